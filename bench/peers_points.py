#!/usr/bin/python3
"""Times VTK's volume mappers and takes their pictures, for `palpate bench` to score.

usage: peers_points.py JOB.json

JOB.json, written by bench/suite/peers.cpp:
  mapper        "gpu" or "fixed"
  out           folder for RESULT.json (results_MAPPER.json) and the pictures
  size_px       of frames and pictures
  frames, budget_s  frames timed a case, and seconds after which at least 3 are enough
  volumes       name -> {file (raw, little endian), dtype, dims, spacing}
  cases         [{name, volume, mode (mip, alpha, alpha_shaded, iso), opacity, color, iso,
                  eye, target, up, view_angle_deg, steps_mm, scored}]

Timing is that of the comparison's own scripts: one frame that is not counted, then a turn of one
degree a frame with one pixel read back. A picture NAME_STEP.f32 is float32, row 0 at the top: RGB
for alpha, the maximum for mip (NaN where no window shows it), for iso the depth in mm from the eye
(gpu; NaN where none) or 1 and 0 for hit or not (fixed). Runs under xvfb."""
import json
import os
import statistics
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


def time_frames(stage, job):
    """(wall ms of each frame, processor ms of each)"""
    pixel = vtk.vtkUnsignedCharArray()
    walls, cpus, start = [], [], time.perf_counter()
    middle = stage.size // 2
    for i in range(job["frames"] + 1):
        stage.camera.Azimuth(1.0)
        stage.renderer.ResetCameraClippingRange()
        wall, cpu = time.perf_counter(), time.process_time()
        stage.window.Render()
        stage.window.GetPixelData(middle, middle, middle, middle, 0, pixel, 0)
        if i > 0:
            walls.append((time.perf_counter() - wall) * 1e3)
            cpus.append((time.process_time() - cpu) * 1e3)
        if len(walls) >= 3 and time.perf_counter() - start > job["budget_s"]:
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


def main():
    with open(sys.argv[1]) as file:
        job = json.load(file)
    kind, out, rows = job["mapper"], job["out"], []
    images = {}
    for name, entry in job["volumes"].items():
        samples = np.fromfile(entry["file"], entry["dtype"]).reshape(entry["dims"][::-1])
        images[name] = peers_vtk.vtk_image(samples, entry["spacing"])
    for case in job["cases"]:
        mapper = peers_vtk.make_mapper(kind, images[case["volume"]], case["steps_mm"][0])
        set_blend(mapper, case["mode"], kind)
        look = look_of(case, kind)
        stage = peers_vtk.Stage(case, mapper, job["size_px"])
        if kind == "gpu" and not mapper.IsRenderSupported(stage.window, look):
            sys.exit("VTK's GPU mapper cannot draw here")
        first_ms = first_frame(stage, look, mapper, case["steps_mm"][0])
        for step in case["steps_mm"]:
            stage.resize(job["size_px"])
            stage.volume.SetProperty(look)
            mapper.SetSampleDistance(step)
            walls, cpus = time_frames(stage, job)
            row = {"case": case["name"], "mapper": kind, "step_mm": step, "wall_ms": walls,
                   "cpu_ms": cpus, "first_frame_ms": first_ms}
            if case["scored"]:
                stage.resize(job["size_px"])
                row["picture"] = os.path.join(
                    out, "{}_{}_{:.4g}.f32".format(case["name"].replace("/", "_"), kind, step))
                picture_of(stage, case, kind).astype("<f4").tofile(row["picture"])
                set_blend(mapper, case["mode"], kind)
            rows.append(row)
            print("{} {} step {:.4g} mm: {:.1f} ms".format(
                kind, case["name"], step, statistics.median(walls)), flush=True)
        stage.close()
    with open(os.path.join(out, f"results_{kind}.json"), "w") as file:
        json.dump({"vtk": vtk.vtkVersion.GetVTKVersion(), "rows": rows}, file, indent=1)


main()
