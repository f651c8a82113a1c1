#!/usr/bin/python3
"""Decimation beside VTK's and meshoptimizer's: the table of docs/reference/surfaces.md.

usage: peers_decimate.py PALPATE DATA [SHARE [NAME..]]

PALPATE is the program, DATA a folder laid out as ../shared/data, SHARE of the triangles to keep
(default 50%). Surfaces whose file is absent are left out, and said so. Every result is measured by
`palpate compare` against the whole surface: the Hausdorff distance, mm. All are given the count that
palpate reached. VTK's DecimatePro keeps topology, as palpate does. Seconds are of the filter, and
for palpate of its stage "decimate", which measures too. Needs python3-vtk9, numpy, and
libmeshoptimizer (Debian) for its column."""
import ctypes
import ctypes.util
import json
import os
import subprocess
import sys
import tempfile
import time

import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy

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


def by_vtk(filter_, mesh, count):
    filter_.SetInputData(mesh)
    filter_.SetTargetReduction(1.0 - count / mesh.GetNumberOfPolys())
    start = time.perf_counter()
    filter_.Update()
    return filter_.GetOutput(), time.perf_counter() - start


def decimate_pro(mesh, count):
    filter_ = vtk.vtkDecimatePro()
    filter_.PreserveTopologyOn()
    return by_vtk(filter_, mesh, count)


def quadric(mesh, count):
    return by_vtk(vtk.vtkQuadricDecimation(), mesh, count)


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
    start = time.perf_counter()
    used = simplify(out.ctypes.data_as(pointer), indices.ctypes.data_as(pointer),
                    size(indices.size), points.ctypes.data_as(pointer), size(len(points)), size(12),
                    size(3 * count), ctypes.c_float(1e30), ctypes.c_uint(0), ctypes.byref(error))
    seconds = time.perf_counter() - start
    cells = vtk.vtkCellArray()
    cells.SetData(3, numpy_to_vtkIdTypeArray(out[:used].astype(np.int64), deep=True))
    result = vtk.vtkPolyData()
    result.SetPoints(mesh.GetPoints())
    result.SetPolys(cells)
    return result, seconds


def distance(palpate, a, b):
    ran = subprocess.run([palpate, "compare", a, b, "--hausdorff", "1e6"], capture_output=True, text=True, check=True)
    return json.loads(ran.stdout)["hausdorff_mm"]


def measure(palpate, path, options, share, folder):
    whole, part, report = (os.path.join(folder, f) for f in ("whole.ply", "part.ply", "report.json"))
    surface = [palpate, "surface", path, *options]
    subprocess.run([*surface, "-o", whole], check=True, stderr=subprocess.DEVNULL)
    subprocess.run([*surface, "-o", part, "--decimate-to", share, "--report", report], check=True,
                   stderr=subprocess.DEVNULL)
    with open(report) as file:
        told = json.load(file)
    mesh, count = read(whole), told["triangles"]
    results = [(count, distance(palpate, whole, part), told["ms"]["decimate"] / 1e3)]
    for peer in (decimate_pro, quadric, meshoptimizer):
        made = peer(mesh, count)
        if made:
            write(made[0], part)
            results.append((made[0].GetNumberOfPolys(), distance(palpate, whole, part), made[1]))
    return mesh.GetNumberOfPolys(), results


def main():
    palpate, data = sys.argv[1:3]
    share = sys.argv[3] if len(sys.argv) > 3 else "50%"
    print("| surface | triangles | Palpate | DecimatePro | vtkQuadricDecimation | meshoptimizer |")
    print("|---|---|---|---|---|---|")
    for name, path, options in SURFACES:
        path = path.format(data=data)
        if sys.argv[4:] and name not in sys.argv[4:]:
            continue
        if not os.path.exists(path):
            print(f"{name}: left out, {path} is absent", file=sys.stderr)
            continue
        with tempfile.TemporaryDirectory() as folder:
            before, results = measure(palpate, path, options, share, folder)
        count = results[0][0]
        cells = [f"{mm:.3g} mm, {s:.2g} s" + (f" ({n})" if n > 1.01 * count else "")
                 for n, mm, s in results]
        print(f"| {name} | {before} to {count} | " + " | ".join(cells) + " |", flush=True)


main()
