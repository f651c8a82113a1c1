#!/usr/bin/python3
"""Times what VTK and scikit-image extract, for `palpate bench surface` to stand beside.

usage: peers_meshes.py JOB.json

JOB.json, written by bench/suite/surface.cpp:
  out           folder for results_surface.json and meshes
  threads       that VTK may use
  rounds        timed runs of each case, after one that is not counted
  budget_s      seconds of a case after which two runs are enough
  cases         [{name, file (raw, little endian), dtype, dims, spacing, iso or labels, keep}]

The filter alone is timed: input marked modified, Update(), output in memory, with normals. A mesh that
is kept is NAME.points (float32) and NAME.triangles (int32)."""
import json
import os
import sys
import time

import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

try:
    from skimage import __version__ as skimage_version
    from skimage.measure import marching_cubes
except ImportError:
    skimage_version = None


def timed(job, work):
    """Wall ms of each run."""
    times, start = [], time.perf_counter()
    for i in range(job["rounds"] + 1):
        began = time.perf_counter()
        work()
        if i > 0:
            times.append((time.perf_counter() - began) * 1e3)
        if len(times) >= 2 and time.perf_counter() - start > job["budget_s"]:
            break
    return times


def vtk_filter(case, image, kind):
    names = {"vtkFlyingEdges3D": vtk.vtkFlyingEdges3D, "vtkMarchingCubes": vtk.vtkMarchingCubes,
             "vtkDiscreteFlyingEdges3D": vtk.vtkDiscreteFlyingEdges3D}
    extract = names[kind]()
    extract.SetInputData(image)
    for i, value in enumerate(case.get("labels", [case.get("iso")])):
        extract.SetValue(i, value)
    extract.SetComputeNormals("labels" not in case)
    extract.SetComputeGradients(False)
    extract.SetComputeScalars("labels" in case)
    return extract


def arrays_of(mesh):
    points = vtk_to_numpy(mesh.GetPoints().GetData()).astype("<f4")
    return points, vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).astype("<i4")


def main():
    with open(sys.argv[1]) as file:
        job = json.load(file)
    vtk.vtkSMPTools.Initialize(job["threads"])
    rows = []

    def add(case, who, times, points, triangles):
        row = {"case": case["name"], "who": who, "wall_ms": times,
               "triangles": int(triangles.size // 3)}
        if case["keep"]:
            stem = os.path.join(job["out"], f"{case['name']}_{who}".replace("/", "_"))
            points.tofile(stem + ".points")
            triangles.tofile(stem + ".triangles")
            row["mesh"] = stem
        rows.append(row)
        print(f"{who} {case['name']}: {sorted(times)[len(times) // 2]:.1f} ms", flush=True)

    for case in job["cases"]:
        samples = np.fromfile(case["file"], case["dtype"]).reshape(case["dims"][::-1])
        image = vtk.vtkImageData()
        image.SetDimensions(case["dims"])
        image.SetSpacing(case["spacing"])
        image.GetPointData().SetScalars(numpy_to_vtk(samples.reshape(-1), deep=True))
        kinds = (["vtkDiscreteFlyingEdges3D"] if "labels" in case
                 else ["vtkFlyingEdges3D", "vtkMarchingCubes"])
        for kind in kinds:
            extract = vtk_filter(case, image, kind)

            def update():
                extract.Modified()
                extract.Update()

            times = timed(job, update)
            add(case, kind, times, *arrays_of(extract.GetOutput()))
        if skimage_version and "iso" in case:
            got = {}

            def march():
                got["mesh"] = marching_cubes(samples, case["iso"], spacing=case["spacing"][::-1],
                                             gradient_direction="descent")

            times = timed(job, march)
            points, triangles = got["mesh"][:2]
            add(case, "skimage_lewiner", times, points[:, ::-1].astype("<f4").copy(),
                triangles[:, ::-1].astype("<i4").copy())
    with open(os.path.join(job["out"], "results_surface.json"), "w") as file:
        json.dump({"vtk": vtk.vtkVersion.GetVTKVersion(), "skimage": skimage_version,
                   "rows": rows}, file, indent=1)


main()
