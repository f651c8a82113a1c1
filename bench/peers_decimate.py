#!/usr/bin/python3
"""Decimation beside VTK's and meshoptimizer's: the table of docs/reference/surfaces.md.

usage: peers_decimate.py PALPATE DATA [SHARE [NAME..]]

PALPATE is the program, DATA a folder laid out as ../shared/data, SHARE of the triangles to keep
(default 50%). Surfaces whose file is absent are left out, and said so. Every result is measured by
`palpate compare` against the whole surface: the Hausdorff distance, mm. All are given the count that
palpate reached. VTK's DecimatePro keeps topology, as palpate does. Seconds are processor time: of
the filter, and for palpate of the whole command less the same without decimation. The least distance
at equal size (within 1 %) is ahead. Ends with 1 where palpate's result lies beyond its tolerance or
what it told, or has an open or non-manifold edge more than the whole. Needs python3-vtk9, numpy, and
libmeshoptimizer (Debian) for its column."""
import ctypes
import ctypes.util
import json
import os
import resource
import subprocess
import sys
import tempfile
import time

import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy

TOLERANCE_MM = 1.0
MRICRON = "/usr/share/mricron/templates"
SURFACES = [  # name, file, options of the extraction
    ("trunk CT, bone", "{data}/ct_trunk_labels/ct.nii.gz", ["--iso", "200"]),
    ("trunk CT, body", "{data}/ct_trunk_labels/ct.nii.gz", ["--iso", "-300"]),
    ("head CT, bone", "{data}/ct_head/raw_slices_headsq/quarter.nhdr", ["--iso", "1150"]),
    ("head CT average", "{data}/ct_head/ct_brain_atlas_1mm.nii.gz", ["--iso", "60"]),
    ("skull CT (InVesalius)", "/usr/share/doc/invesalius-examples/examples/Cranium.inv3",
     ["--iso", "300"]),
    ("head MR (ch2bet)", MRICRON + "/ch2bet.nii.gz", ["--iso", "60"]),
    ("protein (ironProt)", "{data}/vtk_formats/ironProt.vtk", ["--iso", "100"]),
    ("head MR, small", "{data}/vtk_formats/HeadMRVolume.mhd", ["--iso", "50"]),
    ("trunk MR, slab", "{data}/mr_small/mr_trunk_slab.nii.gz", ["--iso", "100"]),
    ("hippocampus MR", "{data}/mr_hippocampus_labels/hippocampus_001_image.nii.gz",
     ["--iso", "60"]),
    ("binary ball", "{data}/nrrd_variants/BallBinary30x30x30.nrrd", ["--iso", "0.5"]),
    ("vase", "{data}/vtk_formats/vase_1comp.vti", ["--iso", "50"]),
    ("hippocampus labels", "{data}/mr_hippocampus_labels/hippocampus_001_label.nii.gz",
     ["--labels"]),
    ("brodmann labels", MRICRON + "/brodmann.nii.gz", ["--labels"]),
]


def read(path):
    reader = vtk.vtkPLYReader()
    reader.SetFileName(path)
    reader.Update()
    return reader.GetOutput()


def write(mesh, path):
    writer = vtk.vtkPLYWriter()
    writer.SetInputData(mesh)
    writer.SetFileName(path)
    writer.Write()


def decimate_pro(mesh, count):
    filter_ = vtk.vtkDecimatePro()
    filter_.PreserveTopologyOn()
    filter_.SetInputData(mesh)
    filter_.SetTargetReduction(1.0 - count / mesh.GetNumberOfPolys())
    start = time.process_time()
    filter_.Update()
    return filter_.GetOutput(), time.process_time() - start


def meshoptimizer(mesh, count):
    name = ctypes.util.find_library("meshoptimizer")
    if not name:
        return None
    simplify = ctypes.CDLL(name).meshopt_simplify
    simplify.restype = ctypes.c_size_t
    points = np.ascontiguousarray(vtk_to_numpy(mesh.GetPoints().GetData()), "<f4")
    indices = np.ascontiguousarray(vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()), "<u4")
    out, error = np.zeros_like(indices), ctypes.c_float()
    pointer, size = ctypes.c_void_p, ctypes.c_size_t
    start = time.process_time()
    used = simplify(out.ctypes.data_as(pointer), indices.ctypes.data_as(pointer),
                    size(indices.size), points.ctypes.data_as(pointer), size(len(points)), size(12),
                    size(3 * count), ctypes.c_float(1e30), ctypes.c_uint(0), ctypes.byref(error))
    seconds = time.process_time() - start
    cells = vtk.vtkCellArray()
    cells.SetData(3, numpy_to_vtkIdTypeArray(out[:used].astype(np.int64), deep=True))
    result = vtk.vtkPolyData()
    result.SetPoints(mesh.GetPoints())
    result.SetPolys(cells)
    return result, seconds


def distance(palpate, a, b):
    ran = subprocess.run([palpate, "compare", a, b, "--hausdorff", "1e6"], capture_output=True,
                         text=True, check=True)
    return json.loads(ran.stdout)["hausdorff_mm"]


def surface(palpate, arguments, out, report):
    """The report, and the seconds of processor time."""
    def used():
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime
    start = used()
    subprocess.run([palpate, "surface", *arguments, "-o", out, "--report", report], check=True,
                   stderr=subprocess.DEVNULL)
    with open(report) as file:
        return json.load(file), used() - start


def measure(palpate, path, options, share, folder):
    whole, part, report = (os.path.join(folder, f) for f in ("whole.ply", "part.ply", "report.json"))
    before, seconds = surface(palpate, [path, *options], whole, report)
    told, more = surface(palpate, [path, *options, "--decimate-to", share, "--decimate",
                                   str(TOLERANCE_MM)], part, report)
    mesh, count = read(whole), told["triangles"]
    mm = distance(palpate, whole, part)
    faults = [f"{key} {before[key]} to {told[key]}" for key in ("open_edges", "non_manifold_edges")
              if told[key] > before[key]]
    if not mm <= told["decimation"]["hausdorff_mm"] <= TOLERANCE_MM:
        faults.append(f"{mm} mm measured, {told['decimation']['hausdorff_mm']} told")
    results = [("Palpate", count, mm, more - seconds)]
    for name, peer in (("DecimatePro", decimate_pro), ("meshoptimizer", meshoptimizer)):
        made = peer(mesh, count)
        if made:
            write(made[0], part)
            results.append((name, made[0].GetNumberOfPolys(), distance(palpate, whole, part),
                            made[1]))
    return before["triangles"], results, faults


def main():
    palpate, data = sys.argv[1:3]
    share = sys.argv[3] if len(sys.argv) > 3 else "50%"
    failed = False
    print("| surface | triangles | Palpate | DecimatePro | meshoptimizer | ahead |")
    print("|---|---|---|---|---|---|")
    for name, path, options in SURFACES:
        path = path.format(data=data)
        if sys.argv[4:] and name not in sys.argv[4:]:
            continue
        if not os.path.exists(path):
            print(f"{name}: left out, {path} is absent", file=sys.stderr)
            continue
        with tempfile.TemporaryDirectory() as folder:
            before, results, faults = measure(palpate, path, options, share, folder)
        count = results[0][1]
        cells = [f"{mm:.3g} mm, {s:.2g} s" + (f" ({n})" if n > 1.01 * count else "")
                 for _, n, mm, s in results]
        least, ahead = min((mm, peer) for peer, n, mm, _ in results if n <= 1.01 * count)
        for peer, n, mm, _ in results:
            if n > 1.01 * count and mm < least:
                ahead += f"; {peer} nearer with {n}"
        print(f"| {name} | {before} to {count} | " + " | ".join(cells) + f" | {ahead} |", flush=True)
        for fault in faults:
            print(f"{name}: {fault}", file=sys.stderr, flush=True)
            failed = True
    sys.exit(failed)


main()
