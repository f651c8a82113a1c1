#!/usr/bin/python3
"""Times VTK's and scikit-image's surfaces for `palpate bench surface`, between its own runs.

usage: peers_surface.py THREADS

THREADS is how many VTK may use. It is told what to do by lines of JSON (bench/suite/surface_peers.cpp)
and answers each with one:
  {"open": {file, dtype, dims, spacing, iso or labels, few}}  reads a volume, raw and little endian:
                           {vtk, skimage, who: [names]}; with `few` flying edges alone
  {"run": name}            one extraction, output in memory, with normals: {ms}
  {"keep": name, "stem": S}  what the last run made: {triangles}; with a stem, S.points (float32)
                           and S.triangles (int32) too
  {"dab": {centre, radius, slope}}  a ball taken out of the open volume, its samples falling to iso
                           at the ball's surface; flying edges extract everything again: {ms,
                           triangles}. Then the volume is whole again.
The filters alone are timed: input in memory and marked modified, then Update()."""
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


class Case:
    """An open volume."""

    def __init__(self, told):
        self.told = told
        self.samples = np.fromfile(told["file"], told["dtype"]).reshape(told["dims"][::-1])
        self.image = vtk.vtkImageData()
        self.image.SetDimensions(told["dims"])
        self.image.SetSpacing(*told["spacing"])
        self.scalars = numpy_to_vtk(self.samples.reshape(-1), deep=False)
        self.image.GetPointData().SetScalars(self.scalars)
        kinds = (["vtkDiscreteFlyingEdges3D"] if "labels" in told
                 else ["vtkFlyingEdges3D"] if told["few"]
                 else ["vtkFlyingEdges3D", "vtkMarchingCubes"])
        self.filters = {kind: self.filter_of(kind) for kind in kinds}
        self.meshes = {}  # of scikit-image
        self.who = kinds + (["skimage_lewiner"]
                            if skimage_version and "iso" in told and not told["few"] else [])

    def filter_of(self, kind):
        extract = getattr(vtk, kind)()
        extract.SetInputData(self.image)
        for i, value in enumerate(self.told.get("labels", [self.told.get("iso")])):
            extract.SetValue(i, value)
        extract.SetComputeNormals("labels" not in self.told)
        extract.SetComputeGradients(False)
        extract.SetComputeScalars("labels" in self.told)
        return extract

    def run(self, who):
        if who in self.filters:
            self.filters[who].Modified()
            start = time.perf_counter()
            self.filters[who].Update()
        else:
            self.meshes[who] = None
            start = time.perf_counter()
            self.meshes[who] = marching_cubes(self.samples, self.told["iso"],
                                              spacing=self.told["spacing"][::-1],
                                              gradient_direction="descent")
        return {"ms": (time.perf_counter() - start) * 1e3}

    def keep(self, who, stem):
        if who in self.filters:
            mesh = self.filters[who].GetOutput()
            points = vtk_to_numpy(mesh.GetPoints().GetData())
            triangles = vtk_to_numpy(mesh.GetPolys().GetConnectivityArray())
        else:
            points, triangles = self.meshes[who][0][:, ::-1], self.meshes[who][1][:, ::-1]
        if stem:
            points.astype("<f4").tofile(stem + ".points")
            triangles.astype("<i4").tofile(stem + ".triangles")
        return {"triangles": int(triangles.size // 3)}

    def dab(self, centre, radius, slope):
        low = [max(0, int(np.floor(c - radius))) for c in centre]
        high = [min(n, int(np.ceil(c + radius)) + 1) for c, n in zip(centre, self.told["dims"])]
        x, y, z = (np.arange(a, b) - c for a, b, c in zip(low, high, centre))
        distance = np.sqrt(x**2 + y[:, None]**2 + z[:, None, None]**2)
        box = tuple(slice(a, b) for a, b in zip(low, high))[::-1]
        whole = self.samples[box].copy()
        cut = np.minimum(whole, self.told["iso"] + slope * (distance - radius))
        self.samples[box] = np.where(distance < radius, cut, whole)
        edges = self.filters["vtkFlyingEdges3D"]
        self.scalars.Modified()
        self.image.Modified()
        start = time.perf_counter()
        edges.Update()
        ms = (time.perf_counter() - start) * 1e3
        self.samples[box] = whole
        return {"ms": ms, "triangles": edges.GetOutput().GetNumberOfPolys()}


def main():
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # whatever else is said here is no answer
    vtk.vtkSMPTools.Initialize(int(sys.argv[1]))
    case = None
    for line in sys.stdin:
        told = json.loads(line)
        if "open" in told:
            case = None  # its memory first
            case = Case(told["open"])
            answer = {"vtk": vtk.vtkVersion.GetVTKVersion(), "skimage": skimage_version,
                      "who": case.who}
        elif "run" in told:
            answer = case.run(told["run"])
        elif "keep" in told:
            answer = case.keep(told["keep"], told["stem"])
        else:
            answer = case.dab(**told["dab"])
        print(json.dumps(answer), file=answers, flush=True)


main()
