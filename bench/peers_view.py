#!/usr/bin/python3
"""How soon VTK's own views show an edit, and how they turn a volume.

usage: xvfb-run -a vtk_view.py VOLUME.mha

Three slices (vtkImageResliceMapper) and a volume (vtkSmartVolumeMapper, ray cast on the CPU) in windows
as large as those of `palpate view` at 1280 x 800. An edit writes a ball of samples; it is timed from there
to the finished picture. The camera is turned at a desired update rate of 10 pictures a second."""
import sys
import time

import numpy as np
import vtk
from vtk.util.numpy_support import vtk_to_numpy

SIZE = (507, 388)


def percentiles(ms):
    ms = np.array(ms)
    return f"median {np.median(ms):.0f} ms, 95 % within {np.percentile(ms, 95):.0f} ms"


def window(renderer):
    w = vtk.vtkRenderWindow()
    w.SetOffScreenRendering(1)
    w.SetMultiSamples(0)
    w.SetSize(*SIZE)
    w.AddRenderer(renderer)
    return w


def picture(w):
    grab = vtk.vtkWindowToImageFilter()
    grab.SetInput(w)
    grab.ShouldRerenderOff()
    grab.ReadFrontBufferOff()
    grab.Update()
    return vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars()).astype(float) / 255.0


def main():
    reader = vtk.vtkMetaImageReader()
    reader.SetFileName(sys.argv[1])
    reader.Update()
    image = reader.GetOutput()
    nx, ny, nz = image.GetDimensions()
    samples = vtk_to_numpy(image.GetPointData().GetScalars()).reshape(nz, ny, nx)
    center = image.GetCenter()

    slices = []
    for axis in range(3):
        mapper = vtk.vtkImageResliceMapper()
        mapper.SetInputData(image)
        plane = vtk.vtkPlane()
        plane.SetOrigin(*center)
        normal = [0, 0, 0]
        normal[axis] = 1
        plane.SetNormal(*normal)
        mapper.SetSlicePlane(plane)
        actor = vtk.vtkImageSlice()
        actor.SetMapper(mapper)
        actor.GetProperty().SetColorWindow(400)
        actor.GetProperty().SetColorLevel(40)
        renderer = vtk.vtkRenderer()
        renderer.AddViewProp(actor)
        camera = renderer.GetActiveCamera()
        camera.ParallelProjectionOn()
        camera.SetFocalPoint(*center)
        camera.SetPosition(*(np.array(center) + 500.0 * np.array(normal)))
        camera.SetViewUp(*((0, -1, 0) if axis == 2 else (0, 0, 1)))
        renderer.ResetCamera()
        slices.append(window(renderer))

    mapper = vtk.vtkSmartVolumeMapper()
    mapper.SetInputData(image)
    mapper.SetRequestedRenderModeToRayCast()
    opacity = vtk.vtkPiecewiseFunction()
    for value, share in ((-3024, 0), (150, 0), (500, 0.3), (3071, 0.8)):
        opacity.AddPoint(value, share)
    color = vtk.vtkColorTransferFunction()
    color.AddRGBPoint(150, 0.8, 0.5, 0.4)
    color.AddRGBPoint(800, 1.0, 1.0, 0.95)
    look = vtk.vtkVolumeProperty()
    look.SetScalarOpacity(opacity)
    look.SetColor(color)
    look.ShadeOn()
    look.SetInterpolationTypeToLinear()
    volume = vtk.vtkVolume()
    volume.SetMapper(mapper)
    volume.SetProperty(look)
    renderer = vtk.vtkRenderer()
    renderer.AddVolume(volume)
    renderer.GetActiveCamera().SetPosition(center[0], center[1] - 600.0, center[2] + 150.0)
    renderer.GetActiveCamera().SetFocalPoint(*center)
    renderer.GetActiveCamera().SetViewUp(0, 0, 1)
    renderer.ResetCamera()
    solid = window(renderer)

    for w in slices + [solid]:
        w.Render()
    to_slices, to_volume, full = [], [], []
    for i in range(30):
        x, y, z = nx // 2 + i - 15, ny // 2 - 40, nz // 2
        begun = time.perf_counter()
        samples[z - 3:z + 4, y - 3:y + 4, x - 3:x + 4] = -1000
        image.GetPointData().GetScalars().Modified()
        image.Modified()
        for w in slices:
            w.Render()
        to_slices.append(1e3 * (time.perf_counter() - begun))
        solid.SetDesiredUpdateRate(10.0)
        solid.Render()
        to_volume.append(1e3 * (time.perf_counter() - begun))
    print("edit to three slices:", percentiles(to_slices))
    print("edit to slices, then the volume at a desired rate of 10/s:", percentiles(to_volume))

    frames, errors = [], []
    solid.SetDesiredUpdateRate(10.0)
    for i in range(30):
        renderer.GetActiveCamera().Azimuth(2.0)
        solid.SetDesiredUpdateRate(10.0)
        begun = time.perf_counter()
        solid.Render()
        frames.append(1e3 * (time.perf_counter() - begun))
        if i % 5 == 4:
            coarse = picture(solid)
            solid.SetDesiredUpdateRate(0.0001)
            begun = time.perf_counter()
            solid.Render()
            full.append(1e3 * (time.perf_counter() - begun))
            rmse = np.sqrt(np.mean((coarse - picture(solid)) ** 2))
            errors.append(-20.0 * np.log10(max(rmse, 1e-9)))
    print("turning at a desired rate of 10/s:", percentiles(frames),
          f"at {np.median(errors):.0f} dB; full: {percentiles(full)}")


main()
