#!/usr/bin/python3
"""Runs one program of examples/ and checks what it made.

    check.py NAME EXAMPLE

NAME picks the check; EXAMPLE is the program.
"""

import math
import os
import re
import subprocess
import sys
import tempfile

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "docs"))
from scene_by_document import read_png


def output_of(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def numbers(text):
    return [float(n) for n in re.findall(r"-?\d+(?:\.\d+)?", text)]


def near(what, found, expected, tolerance):
    assert abs(found - expected) <= tolerance, f"{what}: expected {expected}, found {found}"


def picture(example, folder):
    out = os.path.join(folder, "picture.png")
    output_of(example, out)
    pixels = read_png(out).astype(int)
    assert pixels.shape == (256, 256, 3), pixels.shape
    # frame_volume(): 0.8 of the distance from which the sphere round the box of samples fills 30
    # degrees. The ball of 40 mm is then a disk; its hole is too oblique to be seen through.
    away = 0.8 * 0.5 * math.sqrt(95**2 + 95**2 + 94**2) / math.sin(math.radians(15))
    disk_px = 128 * math.tan(math.asin(40 / away)) / math.tan(math.radians(15))
    # Trilinear interpolation between samples 2 mm apart lies within 2^2 / (8 * 40) mm of the ball
    # on each axis, 0.07 pixels; a quarter of a pixel holds that and counting by pixel centres.
    near("pixels of the disk", np.count_nonzero(pixels.sum(-1)), math.pi * disk_px**2,
         2 * math.pi * disk_px * 0.25)
    # In the middle the ball faces the eye: colour (ambient 0.2 + diffuse 0.65) + specular 0.15.
    for channel, color in enumerate((1.0, 0.94, 0.85)):
        near("middle pixel", pixels[128, 128, channel], 255 * (0.85 * color + 0.15), 2)


def slice(example, folder):
    """A ramp along x of 20 x 10 x 4 samples, 2 x 2 x 5 mm; its middle slice is z = 1.5 samples."""
    volume, out = os.path.join(folder, "ramp.nrrd"), os.path.join(folder, "slice.png")
    values = " ".join(str(100 * x) for _ in range(4 * 10) for x in range(20))
    with open(volume, "w", encoding="ascii") as file:
        file.write("NRRD0004\ntype: int16\ndimension: 3\nsizes: 20 10 4\n"
                   "space: left-posterior-superior\nspace directions: (2,0,0) (0,2,0) (0,0,5)\n"
                   "space origin: (0,0,0)\nencoding: ascii\n\n" + values + "\n")
    assert "20 x 10 x 4 samples, 2 x 2 x 5 mm, values 0 .. 1900" in output_of(example, volume, out)
    pixels = read_png(out).astype(int)
    # The picture is as high as the diagonal of 40 x 20 x 20 mm, and x = 19 mm is in its middle. Seen
    # from the feet, +x (left) is on the right. The ramp is a straight one from 0 to 1 over 38 mm.
    px_per_mm = 256 / math.sqrt(40**2 + 20**2 + 20**2)
    for column in range(256):
        mm = 19 + (column + 0.5 - 128) / px_per_mm
        if 0.5 < mm < 37.5:
            near(f"column {column}", pixels[128, column, 0], 255 * mm / 38, 1)
        elif mm < -1.5 or mm > 39.5:
            near(f"column {column}", pixels[128, column, 0], 0, 0)
    missing = subprocess.run([example, os.path.join(folder, "none.nii"), out],
                             capture_output=True, text=True)
    assert missing.returncode == 1 and "none.nii" in missing.stderr, missing


def mesh(example, folder):
    out = os.path.join(folder, "torus.ply")
    text = output_of(example, out)
    triangles, euler, volume = numbers(text)[:3]
    assert "closed yes" in text, text
    near("Euler number", euler, 0, 0)
    # 2 pi^2 R r^2; triangles with sides of up to h = 0.5 sqrt(3) lie up to h^2 / (8 r) within.
    exact, inside = 2 * math.pi**2 * 20 * 8**2, 0.5**2 * 3 / (8 * 8)
    near("volume", volume, exact, exact * 2 * inside / 8)
    head = open(out, "rb").read(2000).decode("latin-1")
    assert f"element face {int(triangles)}" in head, head


def stroke(example, folder):
    text = output_of(example).splitlines()
    assert re.search(r"-?\d+ before, -1000 after", text[0]), text
    assert "-1000 before" not in text[0], text
    assert numbers(text[1])[0] > 0, text
    assert text[2] == "bricks changed after undo: 0", text


def touch(example, folder):
    radius, depth, force = numbers(output_of(example))
    # 0.05 voxels of 0.5 mm (docs/reference/touch.md), printed to 0.001 mm; the coupling has 600 N/m
    # and the device's motors follow within a tick's slew.
    near("radius of the proxy", radius, 20.0, 0.026)
    assert depth > 0.5, depth
    near("force", force, 0.6 * depth, 0.02)


def session(example, folder):
    begin, carved, undone = [numbers(line) for line in output_of(example).splitlines()]
    ball = 4 / 3 * math.pi * 20**3
    # Triangles with sides of up to h = 0.5 sqrt(3) lie up to h^2 / (8 r) within the ball.
    near("volume at first", begin[2], ball, ball * 3 * 0.5**2 * 3 / (8 * 20**2))
    assert begin[:2] == [0, 0] and undone[:2] == [0, 0], (begin, undone)
    assert carved[0] == 1 and carved[1] > 0, carved
    # A ball of 3 mm centred on the surface takes about half of itself, more where it sinks in.
    cut = begin[2] - carved[2]
    assert 0.4 * 113 < cut < 4 * 113, cut
    assert undone[2] == begin[2], (begin, undone)


with tempfile.TemporaryDirectory() as folder:
    globals()[sys.argv[1]](sys.argv[2], folder)
