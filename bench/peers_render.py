#!/usr/bin/python3
"""Speed and error of palpate beside VTK's two volume mappers, on a head CT.

usage: peers_render.py --build BUILD --peers PEERS --out OUT [--project FILE] [--volumes ct256 ...]

BUILD is a build folder (with bin/palpate and bin/palpate_grid_truth), PEERS the folder that holds
vtk_volume.py, which times VTK. Both programs get the same camera, step (one in-plane voxel) and
transfer function. Times are medians of a turn of 1 degree a frame. Errors are taken at 512x512, on
the 128x128 rays of every fourth pixel, against grid truth, which OUT keeps. Writes OUT/table.md.
Needs xvfb and python3-vtk9; a quiet machine, and some 30 minutes for both volumes."""
import argparse
import json
import os
import subprocess
import sys

import numpy as np

import peers_data

HERE = os.path.dirname(os.path.abspath(__file__))
PYTHON = "/usr/bin/python3"
SIZE, STRIDE, OFFSET = 512, 4, 1
MODES = {  # name in the table: (name in vtk_volume.py, ray_cast of the scene)
    "MIP": ("mip", {"mode": "mip", "transfer": {"window": [-200, 2000]}}),
    "alpha": ("alpha", {"mode": "alpha", "transfer": "ct-peer"}),
    "alpha, shaded": ("alpha_shaded", {"mode": "alpha", "transfer": "ct-peer", "shading": True}),
    "iso": ("iso_shaded", {"mode": "iso", "isos": [{"value": 300}]}),
}


def run(*command, **options):
    print("+", " ".join(map(str, command)), file=sys.stderr, flush=True)
    return subprocess.run(list(map(str, command)), check=True, **options)


def under_display(*command):
    environment = dict(os.environ, MESA_SHADER_CACHE_DISABLE="true")
    run("xvfb-run", "-a", "-s", "-screen 0 1280x1280x24 -noreset", *command, env=environment,
        stdout=subprocess.DEVNULL)


def write_scene(path, data, name, ray_cast, size):
    samples, spacing = peers_data.volume(data, name)
    eye, target = peers_data.camera(samples.shape[::-1], spacing)
    scene = {"volume": os.path.abspath(os.path.join(data, name + ".nrrd")),
             "size_px": [size, size],
             "camera": {"eye_mm": list(eye), "target_mm": list(target), "up": [0, 0, 1],
                        "view_angle_deg": peers_data.VIEW_ANGLE_DEG},
             "ray_cast": dict(ray_cast, step_mm=spacing[0]),
             "value_and_depth": True}
    with open(path, "w") as out:
        json.dump(scene, out, indent=1)


def time_palpate(args, data, name):
    """{(mode, size): stats}; also leaves OUT/NAME_MODE.exr of the first view."""
    stats = {}
    for mode, (key, ray_cast) in MODES.items():
        for size in (512, 1024):
            scene = os.path.join(args.out, f"{name}_{key}_{size}.json")
            result = os.path.join(args.out, f"{name}_{key}_{size}_stats.json")
            write_scene(scene, data, name, ray_cast, size)
            palpate = os.path.join(args.build, "bin", "palpate")
            picture = os.path.join(args.out, f"{name}_{key}_{size}.exr")
            run(palpate, "render", scene, "-o", os.path.join(args.out, "turned.exr"), "--frames",
                args.frames, "--orbit-deg", "1", "--stats", result)
            if size == SIZE:
                run(palpate, "render", scene, "-o", picture)
            with open(result) as file:
                stats[mode, size] = json.load(file)
    return stats


def time_vtk(args, data, name, kind):
    """{(mode, size): median ms} at a step of one voxel."""
    under_display(PYTHON, os.path.join(args.peers, "vtk_volume.py"), os.path.abspath(data),
                  os.path.abspath(args.out), name, kind)
    with open(os.path.join(args.out, f"vtk_volume_{kind}_{name}.json")) as file:
        rows = {row["case"]: row["median_ms"] for row in json.load(file)["results"]}
    return {(mode, size): rows[f"{kind}/{name}/{key}/{size}px/step1.0"]
            for mode, (key, _) in MODES.items() for size in (512, 1024)}


def grid_truth(args, name, key):
    path = os.path.join(args.out, f"{name}_{key}_truth.exr")
    if not os.path.exists(path):
        run(os.path.join(args.build, "bin", "palpate_grid_truth"),
            os.path.join(args.out, f"{name}_{key}_{SIZE}.json"), "--stride", STRIDE, "--offset",
            OFFSET, OFFSET, "-o", path)
    return peers_data.load_exr(path)


def some(picture):
    return picture[OFFSET::STRIDE, OFFSET::STRIDE]


def rmse(difference):
    return float(np.sqrt(np.mean(np.square(difference, dtype=float))))


def errors_of(pictures, truth):
    """RMSE of MIP in HU and of alpha in colour; the share of pixels whose iso-surface only one of
    the two has; of those that both have, the median and RMSE of depth in mm (or None)."""
    both = ~np.isnan(pictures["mip"]) & ~np.isnan(truth["mip"]["value"])
    color = np.stack([truth["alpha"][c] for c in "RGB"], axis=-1)
    true_hit = ~np.isnan(truth["iso_shaded"]["depth"])
    met = pictures["hit"] & true_hit
    result = {"MIP": rmse((pictures["mip"] - truth["mip"]["value"])[both]),
              "alpha": rmse(pictures["alpha"] - color),
              "silhouette": float(np.mean(pictures["hit"] != true_hit)), "depth": None}
    if "depth" in pictures:
        met &= ~np.isnan(pictures["depth"])
        off = (pictures["depth"] - truth["iso_shaded"]["depth"])[met]
        result["depth"] = (float(np.median(np.abs(off))), rmse(off))
    return result


def palpate_pictures(args, name):
    exr = {key: peers_data.load_exr(os.path.join(args.out, f"{name}_{key}_{SIZE}.exr"))
           for key in ("mip", "alpha", "iso_shaded")}
    return {"mip": some(exr["mip"]["value"]),
            "alpha": np.stack([some(exr["alpha"][c]) for c in "RGB"], axis=-1),
            "hit": ~np.isnan(some(exr["iso_shaded"]["depth"])),
            "depth": some(exr["iso_shaded"]["depth"])}


def vtk_pictures(args, data, name, kind):
    path = os.path.join(args.out, f"vtk_{kind}_{name}.npz")
    if not os.path.exists(path):
        under_display(PYTHON, os.path.join(HERE, "peers_vtk.py"), data, path, name, kind)
    with np.load(path) as pictures:
        return {key: some(pictures[key]) for key in pictures}


def table(name, times, errors):
    lines = [f"### {name}", "",
             "| ms, median | " + " | ".join(f"{m} {s}" for m in MODES for s in (512, 1024)) + " |",
             "|---" * (1 + 2 * len(MODES)) + "|"]
    for who, row in times.items():
        cells = [f"{row[m, s]:.0f}" for m in MODES for s in (512, 1024)]
        lines.append(f"| {who} | " + " | ".join(cells) + " |")
    lines += ["", "| error | MIP, HU RMSE | alpha, colour RMSE | iso, silhouette | "
              "iso depth, mm median / RMSE |", "|---|---|---|---|---|"]
    for who, e in errors.items():
        depth = "none given" if e["depth"] is None else "{:.2g} / {:.2g}".format(*e["depth"])
        lines.append(f"| {who} | {e['MIP']:.2g} | {e['alpha']:.2g} | {100 * e['silhouette']:.2g} % "
                     f"| {depth} |")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", required=True, help="build folder")
    parser.add_argument("--peers", help="folder of vtk_volume.py; without it VTK is not timed")
    parser.add_argument("--out", required=True, help="folder for data, pictures and the table")
    parser.add_argument("--project", help="InVesalius project (default: Debian's Cranium.inv3)",
                        default="/usr/share/doc/invesalius-examples/examples/Cranium.inv3")
    parser.add_argument("--volumes", nargs="+", default=["ct256", "ct174"])
    parser.add_argument("--frames", type=int, default=9, help="frames timed (default: 9)")
    args = parser.parse_args()
    data = os.path.abspath(os.path.join(args.out, "data"))
    args.out = os.path.abspath(args.out)
    peers_data.prepare(args.project, data)
    text = []
    for name in args.volumes:
        stats = time_palpate(args, data, name)
        times = {"palpate": {case: s["frame_ms"]["median"] for case, s in stats.items()}}
        truth = {key: grid_truth(args, name, key) for key in ("mip", "alpha", "iso_shaded")}
        errors = {"palpate": errors_of(palpate_pictures(args, name), truth)}
        for kind, who in (("gpu", "VTK GPU mapper"), ("fixed", "VTK fixed-point mapper")):
            if args.peers:
                times[who] = time_vtk(args, data, name, kind)
            errors[who] = errors_of(vtk_pictures(args, data, name, kind), truth)
        first = next(iter(stats.values()))
        text.append(f"Device: {first['device']}, {first['driver']}\n" if not text else "")
        text.append(table(name, times, errors))
    with open(os.path.join(args.out, "table.md"), "w") as out:
        out.write("\n".join(text))
    print("\n".join(text))


main()
