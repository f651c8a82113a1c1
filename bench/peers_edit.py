#!/usr/bin/python3
"""What an edit costs in VTK: the whole iso-surface and the whole texture again.

usage: peers_edit.py VOLUME.raw SIDE ISO REPEATS RESULT.json

VOLUME.raw holds SIDE^3 samples of u16. Each repeat writes 20^3 samples in place and tells VTK; then
the flying edges filter runs (with normals, as drawn), and one frame of 64 x 64 pixels is drawn by
the GPU mapper, which uploads its texture. A frame without an edit is timed too, to be subtracted.
Run under xvfb; times are wall clock in ms."""
import json
import sys
import time

import numpy as np
import vtk
from vtk.util import numpy_support


def timed(work):
    start = time.perf_counter()
    work()
    return (time.perf_counter() - start) * 1000.0


def main():
    path, side, iso, repeats, out = sys.argv[1:]
    side, repeats = int(side), int(repeats)
    samples = np.fromfile(path, dtype="<u2").reshape(side, side, side)
    image = vtk.vtkImageData()
    image.SetDimensions(side, side, side)
    scalars = numpy_support.numpy_to_vtk(samples.ravel(), deep=False)
    image.GetPointData().SetScalars(scalars)

    edges = vtk.vtkFlyingEdges3D()
    edges.SetInputData(image)
    edges.SetValue(0, float(iso))
    edges.ComputeNormalsOn()

    mapper = vtk.vtkGPUVolumeRayCastMapper()
    mapper.SetInputData(image)
    look = vtk.vtkVolumeProperty()
    opacity, color = vtk.vtkPiecewiseFunction(), vtk.vtkColorTransferFunction()
    opacity.AddPoint(float(iso) - 1, 0.0), opacity.AddPoint(float(iso), 1.0)
    color.AddRGBPoint(0.0, 1, 1, 1)
    look.SetScalarOpacity(opacity), look.SetColor(color)
    volume = vtk.vtkVolume()
    volume.SetMapper(mapper), volume.SetProperty(look)
    renderer, window = vtk.vtkRenderer(), vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1), window.SetSize(64, 64)
    window.AddRenderer(renderer), renderer.AddVolume(volume), renderer.ResetCamera()

    def draw():
        window.Render()
        window.WaitForCompletion()

    edges.Update()
    draw()
    result = {"vtk": vtk.vtkVersion.GetVTKVersion(), "flying_edges_ms": [], "frame_ms": [],
              "frame_after_edit_ms": []}
    for i in range(repeats):
        result["frame_ms"].append(timed(draw))
        at = side // 4 + i
        samples[at:at + 20, at:at + 20, at:at + 20] = i
        scalars.Modified(), image.Modified()
        result["flying_edges_ms"].append(timed(edges.Update))
        result["frame_after_edit_ms"].append(timed(draw))
    result["triangles"] = edges.GetOutput().GetNumberOfPolys()
    with open(out, "w") as file:
        json.dump(result, file, indent=1)


main()
