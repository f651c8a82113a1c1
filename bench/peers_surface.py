#!/usr/bin/python3
"""Surfaces beside VTK's flying edges in one run: a head CT at two sizes, a gyroid, and edits.

usage: peers_surface.py --build build/dev --work FOLDER [--project Cranium.inv3] [--repeat 7] [--gpu]

FOLDER keeps the raw volumes (0.7 GB with the gyroid). VTK's filter alone is timed: its input is in
memory and marked modified, then Update(). Both programs use the same number of threads, and take
turns volume by volume. The figures are medians in ms; those of palpate include finding what changed
for edits, and nothing of the edit itself for either. Edits stand beside the extractor of Vidholm &
Agmund (2004) too, which makes all triangles again as printed, and with --gpu beside the graphics
device (PALPATE_DEVICE), the upload of what changed included."""
import argparse
import json
import math
import os
import statistics
import subprocess
import sys
import time

import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

import peers_data

try:
    from skimage import __version__ as skimage_version
    from skimage.measure import marching_cubes
except ImportError:
    skimage_version = None

EDIT_SIDE, EDIT_SIGMA = 128, 24.0


def gyroid(folder, side):
    """A raw f32 file of side^3 samples, eight periods of 1 sample a mm across, as bench_surface's."""
    path = os.path.join(folder, f"gyroid{side}.raw")
    if os.path.exists(path) and os.path.getsize(path) == 4 * side**3:
        return path
    w = 2 * math.pi / (side / 8.0)
    i = np.arange(side) * w
    s, c = np.sin(i), np.cos(i)
    with open(path, "wb") as f:
        for z in range(side):
            f.write((s[None, :] * c[:, None] + s[:, None] * c[z] + s[z] * c[None, :])
                    .astype("<f4").tobytes())
    return path


def vtk_image(samples, spacing):
    image = vtk.vtkImageData()
    image.SetDimensions(samples.shape[::-1])
    image.SetSpacing(*spacing)
    scalars = numpy_to_vtk(samples.reshape(-1), deep=False)
    image.GetPointData().SetScalars(scalars)
    return image, scalars


def flying_edges(image, iso, normals=True):
    filter_ = vtk.vtkFlyingEdges3D()
    filter_.SetInputData(image)
    filter_.SetValue(0, iso)
    filter_.SetComputeNormals(normals)
    filter_.SetComputeGradients(False)
    filter_.SetComputeScalars(False)
    return filter_


def times_of(repeat, run, budget_s=math.inf):
    """Wall ms of each run after one that is not counted; two are enough once the budget is spent."""
    times, start = [], time.perf_counter()
    for i in range(repeat + 1):
        began = time.perf_counter()
        run()
        if i > 0:
            times.append((time.perf_counter() - began) * 1e3)
        if len(times) >= 2 and time.perf_counter() - start > budget_s:
            break
    return times


def timed(repeat, run):
    return statistics.median(times_of(repeat, run))


def vtk_of_case(case, image, kind):
    """One of VTK's filters by name, on a case of job()."""
    extract = getattr(vtk, kind)()
    extract.SetInputData(image)
    for i, value in enumerate(case.get("labels", [case.get("iso")])):
        extract.SetValue(i, value)
    extract.SetComputeNormals("labels" not in case)
    extract.SetComputeGradients(False)
    extract.SetComputeScalars("labels" in case)
    return extract


def job(path):
    """What VTK and scikit-image extract, for `palpate bench surface` to stand beside.

    The file, written by bench/suite/surface.cpp, is JSON:
      out           folder for results_surface.json and meshes
      threads       that VTK may use
      rounds        timed runs of each case, after one that is not counted
      budget_s      seconds of a case after which two runs are enough
      cases         [{name, file (raw, little endian), dtype, dims, spacing, iso or labels, keep}]
    The output is in memory, with normals. A mesh that is kept is NAME.points (float32) and
    NAME.triangles (int32)."""
    with open(path) as file:
        told = json.load(file)
    vtk.vtkSMPTools.Initialize(told["threads"])
    rows = []

    def add(case, who, times, points, triangles):
        row = {"case": case["name"], "who": who, "wall_ms": times,
               "triangles": int(triangles.size // 3)}
        if case["keep"]:
            stem = os.path.join(told["out"], f"{case['name']}_{who}".replace("/", "_"))
            points.astype("<f4").tofile(stem + ".points")
            triangles.astype("<i4").tofile(stem + ".triangles")
            row["mesh"] = stem
        rows.append(row)
        print(f"{who} {case['name']}: {statistics.median(times):.1f} ms", flush=True)

    for case in told["cases"]:
        samples = np.fromfile(case["file"], case["dtype"]).reshape(case["dims"][::-1])
        image, _ = vtk_image(samples, case["spacing"])
        for kind in (["vtkDiscreteFlyingEdges3D"] if "labels" in case
                     else ["vtkFlyingEdges3D", "vtkMarchingCubes"]):
            extract = vtk_of_case(case, image, kind)

            def update():
                extract.Modified()
                extract.Update()

            times = times_of(told["rounds"], update, told["budget_s"])
            mesh = extract.GetOutput()
            add(case, kind, times, vtk_to_numpy(mesh.GetPoints().GetData()),
                vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()))
        if skimage_version and "iso" in case:
            got = {}

            def march():
                got["mesh"] = marching_cubes(samples, case["iso"], spacing=case["spacing"][::-1],
                                             gradient_direction="descent")

            times = times_of(told["rounds"], march, told["budget_s"])
            points, triangles = got["mesh"][:2]
            add(case, "skimage_lewiner", times, points[:, ::-1], triangles[:, ::-1])
    with open(os.path.join(told["out"], "results_surface.json"), "w") as file:
        json.dump({"vtk": vtk.vtkVersion.GetVTKVersion(), "skimage": skimage_version,
                   "rows": rows}, file, indent=1)


def vtk_full(path, dtype, dims, spacing, iso, repeat):
    samples = np.fromfile(path, dtype).reshape(dims[::-1])
    image, _ = vtk_image(samples, spacing)
    found = {}
    for name, normals in (("normals", True), ("plain", False)):
        f = flying_edges(image, iso, normals)

        def run():
            f.Modified()
            f.Update()

        found[name] = timed(repeat, run)
    return found, f.GetOutput().GetNumberOfPolys()


def vtk_edits(triangles, radius, repeat):
    """A ball taken out at the surface and put back; each time everything is extracted again."""
    middle, r = (EDIT_SIDE - 1) / 2, math.sqrt(triangles / (12 * math.pi))
    i = np.arange(EDIT_SIDE, dtype=np.float64) - middle
    square = i[:, None, None] ** 2 + i[None, :, None] ** 2 + i[None, None, :] ** 2
    base = np.exp(-square / (2 * EDIT_SIGMA**2)).astype(np.float32)
    iso = math.exp(-r * r / (2 * EDIT_SIGMA**2))
    centre = r / math.sqrt(3)
    distance = np.sqrt((i[:, None, None] - centre) ** 2 + (i[None, :, None] - centre) ** 2 +
                       (i[None, None, :] - centre) ** 2)
    cut = np.minimum(base, iso + 0.02 * iso * (distance - radius)).astype(np.float32)
    eroded = np.where(distance < radius, cut, base)
    samples = base.copy()
    image, scalars = vtk_image(samples, (1, 1, 1))
    f = flying_edges(image, iso)
    times = []
    for n in range(2 * repeat + 1):
        samples[...] = eroded if n % 2 == 0 else base
        scalars.Modified()
        image.Modified()
        start = time.perf_counter()
        f.Update()
        times.append((time.perf_counter() - start) * 1e3)
    return statistics.median(times[1:])


def table(head):
    print("\n| " + " | ".join(head) + " |\n|" + "---|" * len(head), flush=True)


def row(cells):
    print("| " + " | ".join(cells) + " |", flush=True)


def full(args, palpate):
    peers_data.prepare(args.project, args.work)
    with open(os.path.join(args.work, "volumes.json")) as f:
        volumes = [(name, os.path.join(args.work, v["file"]), v["dtype"], v["dims"], v["spacing"],
                    300.0) for name, v in json.load(f).items()]
    if args.gyroid:
        volumes.append((f"gyroid{args.gyroid}", gyroid(args.work, args.gyroid), "<f4",
                        [args.gyroid] * 3, [1.0] * 3, 0.0))
    gpu = ["graphics device", "count", "emit", "first, with upload", "read back"] if args.gpu else []
    table(["volume", "triangles", "flying edges, with normals", "palpate", "times", "plain",
           "palpate", "times", "correct", "Mtri/s"] + gpu)
    for name, path, dtype, dims, spacing, iso in volumes:
        peer, polys = vtk_full(path, dtype, dims, spacing, iso, args.repeat)
        ours = palpate(f"{name}={path}:{'f32' if dtype == '<f4' else 'i16'}:"
                       f"{','.join(map(str, dims))}:{','.join(map(str, spacing))}:{iso}")
        n, p = ours["normals"]["median_ms"], ours["plain"]["median_ms"]
        triangles = ours["normals"]["triangles"]
        assert triangles == polys or name.startswith("gyroid")
        cells = [name, f"{triangles}", f"{peer['normals']:.1f}", f"{n:.1f}",
                 f"{peer['normals'] / n:.2f}", f"{peer['plain']:.1f}", f"{p:.1f}",
                 f"{peer['plain'] / p:.2f}", f"{ours['correct']['median_ms']:.1f}",
                 f"{triangles / n / 1e3:.1f}"]
        if args.gpu:
            g = ours["gpu"]
            assert g["triangles"] == triangles and g["vertices"] == ours["normals"]["vertices"]
            cells += [f"{g[key]:.1f}" for key in ("median_ms", "count_ms", "emit_ms", "first_ms",
                                                  "read_back_ms")]
        row(cells)


def edits(args, palpate):
    def by(triangles, radius, kind):
        return next(iter(palpate(f"edits:{triangles}:{radius}:{kind}").values()))

    gpu = ["graphics device", "edits/s", "times flying edges"] if args.gpu else []
    table(["erosion, Gaussian 128^3", "tracker", "edits/s", "flying edges", "palpate f32",
           "edits/s", "times flying edges", "i16", "blocks"] + gpu)
    for triangles in (20000, 40000, 60000, 80000, 100000):
        for radius in (5, 10):
            peer = vtk_edits(triangles, radius, args.repeat)
            tracker, f32 = by(triangles, radius, "f32:tracker"), by(triangles, radius, "f32")
            i16, ms = by(triangles, radius, "i16"), f32["median_ms"]
            cells = [f"{triangles}, r = {radius}", f"{tracker['median_ms']:.2f}",
                     f"{1e3 / tracker['median_ms']:.0f}", f"{peer:.2f}", f"{ms:.3f}",
                     f"{1e3 / ms:.0f}", f"{peer / ms:.0f}", f"{i16['median_ms']:.3f}",
                     f"{f32['blocks']:.0f}"]
            if args.gpu:
                on_gpu = by(triangles, radius, "f32:gpu")["median_ms"]
                cells += [f"{on_gpu:.2f}", f"{1e3 / on_gpu:.0f}", f"{peer / on_gpu:.1f}"]
            row(cells)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", required=True)
    parser.add_argument("--work", required=True)
    parser.add_argument("--project",
                        default="/usr/share/doc/invesalius-examples/examples/Cranium.inv3")
    parser.add_argument("--repeat", type=int, default=7)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--gyroid", type=int, default=512, help="samples a side; 0: none")
    parser.add_argument("--gpu", action="store_true", help="the graphics device too")
    parser.add_argument("--only", choices=["full", "edits", "local"], help="a part of it")
    args = parser.parse_args()
    vtk.vtkSMPTools.Initialize(args.threads)

    def palpate(case):
        command = [os.path.join(args.build, "bin", "bench_surface"), "--repeat", str(args.repeat),
                   "--threads", str(args.threads), case] + (["--gpu"] if args.gpu else [])
        out = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        return {line["case"].split("/")[-1]: line for line in map(json.loads, out.splitlines())}

    print(f"VTK {vtk.vtkVersion.GetVTKVersion()}, {args.threads} threads, medians of {args.repeat}")
    parts = [args.only] if args.only else ["full", "edits", "local"]
    if "full" in parts:
        full(args, palpate)
    if "edits" in parts:
        edits(args, palpate)
    if "local" in parts:
        local = next(iter(palpate("local:7").values()))
        print(f"\nwindow of 7^3: {local['p50_us']:.1f} us, p99 {local['p99_us']:.1f} us, worst "
              f"{local['worst_us']:.0f} us of {local['runs']}")


if len(sys.argv) == 2 and sys.argv[1].endswith(".json"):
    job(sys.argv[1])
else:
    main()
