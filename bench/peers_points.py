#!/usr/bin/python3
"""Times VTK's volume mappers and takes their pictures, for `palpate bench` to score.

usage: peers_points.py JOB.json

JOB.json, written by bench/suite/peers.cpp:
  mapper        "gpu" or "fixed"
  out           folder for the pictures
  size_px       of frames and pictures
  volumes       name -> {file (raw, little endian), dtype, dims, spacing}
  cases         [{name, volume, mode (mip, alpha, alpha_shaded, iso), opacity, color, iso,
                  eye, target, up, view_angle_deg, steps_mm, scored}]

Then it is told what to do by lines of JSON, and answers each with one:
  {"open": i}   case i, drawn for the first time and scored: {vtk, first_frame_ms, pictures: [a
                file a step]}
  {"frames": n, "budget_s": s}  times n frames of each step of the open case, at least one and no
                more than take s seconds a step: [{wall_ms: [..], cpu_ms: [..]}]

Timing is that of the comparison's own scripts: a turn of one degree a frame with one pixel read
back; a frame that is not counted comes first, but where a frame takes a second or more. A picture
NAME_STEP.f32 is float32, row 0 at the top: RGB for alpha, the maximum for mip (NaN where no window
shows it), for iso the depth in mm from the eye (gpu; NaN where none) or 1 and 0 for hit or not
(fixed). Runs under xvfb."""
import json
import os
import sys
import time

import numpy as np
import vtk

import peers_vtk


def transfer_of(case):
    """Points as make_property of the timing scripts takes them, by mode."""
    if case["mode"] == "iso":
        return [(case["iso"] - 1, 0), (case["iso"], 1)], [(case["iso"], 1, .94, .85)]
    return case["opacity"], case["color"]


def look_of(case, kind):
    look = peers_vtk.volume_property(*transfer_of(case))
    look.SetScalarOpacityUnitDistance(case.get("opacity_unit_mm", 1.0))
    if case["mode"] in ("alpha_shaded", "iso"):
        look.ShadeOn()
        look.SetAmbient(0.2), look.SetDiffuse(0.8)
        look.SetSpecular(0.2), look.SetSpecularPower(10)
    if case["mode"] == "iso" and kind == "gpu":
        look.GetIsoSurfaceValues().SetValue(0, case["iso"])
    return look


def set_blend(mapper, mode, kind):
    if mode == "mip":
        mapper.SetBlendModeToMaximumIntensity()
    elif mode == "iso" and kind == "gpu":
        mapper.SetBlendModeToIsoSurface()
    else:
        mapper.SetBlendModeToComposite()


def time_frames(stage, count, budget_s):
    """(wall ms of each frame, processor ms of each)"""
    pixel = vtk.vtkUnsignedCharArray()
    walls, cpus, start = [], [], time.perf_counter()
    middle = stage.size // 2
    for i in range(count + 1):
        stage.camera.Azimuth(1.0)
        stage.renderer.ResetCameraClippingRange()
        wall, cpu = time.perf_counter(), time.process_time()
        stage.window.Render()
        stage.window.GetPixelData(middle, middle, middle, middle, 0, pixel, 0)
        wall = time.perf_counter() - wall
        if i > 0 or wall > 1.0:
            walls.append(wall * 1e3)
            cpus.append((time.process_time() - cpu) * 1e3)
        if len(walls) == count or (walls and time.perf_counter() - start > budget_s):
            break
    return walls, cpus


def picture_of(stage, case, kind):
    mode = case["mode"]
    if mode == "mip":
        return peers_vtk.maximum(stage, *case["range"], window_hu=512)
    look = peers_vtk.volume_property(*transfer_of(case))
    look.SetScalarOpacityUnitDistance(case.get("opacity_unit_mm", 1.0))
    if mode == "alpha":
        return stage.draw(look)
    # Without light, so that every hit is bright.
    if kind == "fixed":
        return (stage.draw(look)[..., 0] > 0.5).astype(float)
    look.GetIsoSurfaceValues().SetValue(0, case["iso"])
    return peers_vtk.surface_depth(stage, look)


def first_frame(stage, look, mapper, step):
    """Context exists; upload, shaders or tables, and the frame."""
    mapper.SetSampleDistance(step)
    stage.volume.SetProperty(look)
    pixel = vtk.vtkUnsignedCharArray()
    start = time.perf_counter()
    stage.renderer.AddVolume(stage.volume)
    stage.renderer.ResetCameraClippingRange()
    stage.window.Render()
    middle = stage.size // 2
    stage.window.GetPixelData(middle, middle, middle, middle, 0, pixel, 0)
    return (time.perf_counter() - start) * 1e3


class Case:
    """One case, open in a window."""

    def __init__(self, job, case, images):
        self.job, self.case, self.kind = job, case, job["mapper"]
        image, first = images[case["volume"]], case["steps_mm"][0]
        self.mapper = peers_vtk.make_mapper(self.kind, image, first)
        set_blend(self.mapper, case["mode"], self.kind)
        self.look = look_of(case, self.kind)
        self.stage = peers_vtk.Stage(case, self.mapper, job["size_px"])
        if self.kind == "gpu" and not self.mapper.IsRenderSupported(self.stage.window, self.look):
            sys.exit("VTK's GPU mapper cannot draw here")
        self.first_frame_ms = first_frame(self.stage, self.look, self.mapper, first)

    def show(self, step):
        set_blend(self.mapper, self.case["mode"], self.kind)
        self.stage.volume.SetProperty(self.look)
        self.mapper.SetSampleDistance(step)

    def pictures(self):
        files = []
        for step in self.case["steps_mm"] if self.case["scored"] else []:
            self.stage.resize(self.job["size_px"])
            self.show(step)
            files.append(os.path.join(self.job["out"], "{}_{}_{:.4g}.f32".format(
                self.case["name"].replace("/", "_"), self.kind, step)))
            picture_of(self.stage, self.case, self.kind).astype("<f4").tofile(files[-1])
        self.stage.resize(self.job["size_px"])
        return files

    def times(self, count, budget_s):
        rows = []
        for step in self.case["steps_mm"]:
            self.show(step)
            walls, cpus = time_frames(self.stage, count, budget_s)
            rows.append({"wall_ms": walls, "cpu_ms": cpus})
        return rows


def main():
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # whatever else is said here is no answer
    with open(sys.argv[1]) as file:
        job = json.load(file)
    images = {}
    for name, entry in job["volumes"].items():
        samples = np.fromfile(entry["file"], entry["dtype"]).reshape(entry["dims"][::-1])
        images[name] = peers_vtk.vtk_image(samples, entry["spacing"])
    shown = None
    for line in sys.stdin:
        told = json.loads(line)
        if "open" in told:
            if shown:
                shown.stage.close()
            shown = Case(job, job["cases"][told["open"]], images)
            answer = {"vtk": vtk.vtkVersion.GetVTKVersion(), "pictures": shown.pictures(),
                      "first_frame_ms": shown.first_frame_ms}
        else:
            answer = shown.times(told["frames"], told["budget_s"])
        print(json.dumps(answer), file=answers, flush=True)


main()
