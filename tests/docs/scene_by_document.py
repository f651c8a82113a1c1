#!/usr/bin/python3
"""Draws scenes from docs/reference/scene.md alone, and compares them with the program's pictures.

    scene_by_document.py PALPATE FOLDER

Nothing here is taken from the program: where this and the program differ, one of them or the
document is wrong. A pixel may differ by one level of 255 where rounding falls either way.
"""

import json
import math
import os
import struct
import subprocess
import sys
import zlib

import numpy as np


def read_png(path):
    """Height x width x 3 bytes of an 8-bit RGB or RGBA picture."""
    data = open(path, "rb").read()
    at, packed, head = 8, b"", None
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + 8 + size]
        if kind == b"IHDR":
            head = struct.unpack(">IIBBBBB", body)
        if kind == b"IDAT":
            packed += body
        at += size + 12
    width, height, bits, color = head[:4]
    assert bits == 8 and color in (2, 6) and head[6] == 0, head
    n = 3 if color == 2 else 4
    raw = zlib.decompress(packed)
    rows, above = [], [0] * (width * n)
    for y in range(height):
        line = raw[y * (width * n + 1) : (y + 1) * (width * n + 1)]
        row = list(line[1:])
        for i in range(width * n):
            left = row[i - n] if i >= n else 0
            corner = above[i - n] if i >= n else 0
            if line[0] == 1:
                add = left
            elif line[0] == 2:
                add = above[i]
            elif line[0] == 3:
                add = (left + above[i]) // 2
            elif line[0] == 4:
                guess = left + above[i] - corner
                near = [abs(guess - v) for v in (left, above[i], corner)]
                add = (left, above[i], corner)[near.index(min(near))]
            else:
                add = 0
            row[i] = (row[i] + add) & 255
        rows.append(row)
        above = row
    return np.array(rows, np.uint8).reshape(height, width, n)[:, :, :3]


def write_nrrd(path, samples, directions, origin):
    """samples[x, y, z], i16; directions: a row for each index axis, in mm."""
    with open(path, "wb") as out:
        text = " ".join("(%r,%r,%r)" % tuple(float(v) for v in row) for row in directions)
        out.write(
            (
                "NRRD0004\ntype: int16\ndimension: 3\nspace: left-posterior-superior\n"
                "sizes: %d %d %d\nspace directions: %s\nspace origin: (%r,%r,%r)\n"
                "encoding: raw\nendian: little\n\n"
                % (*samples.shape, text, *[float(v) for v in origin])
            ).encode()
        )
        out.write(samples.astype("<i2").tobytes(order="F"))


class Volume:
    def __init__(self, samples, directions, origin):
        self.samples = samples.astype(float)
        self.axes = np.array(directions, float).T  # world = axes @ index + origin
        self.origin = np.array(origin, float)
        self.inverse = np.linalg.inv(self.axes)
        self.last = np.array(samples.shape) - 1.0
        self.spacing = np.linalg.norm(self.axes, axis=0)

    def index(self, world):
        return (world - self.origin) @ self.inverse.T

    def stored(self, i):
        i = np.clip(i, 0, self.last.astype(int))
        return self.samples[i[..., 0], i[..., 1], i[..., 2]]

    def linear(self, p):
        p = np.clip(p, 0, self.last)
        low = np.floor(p).astype(int)
        f = p - low
        total = 0
        for corner in np.ndindex(2, 2, 2):
            c = np.array(corner)
            weight = np.prod(np.where(c, f, 1 - f), axis=-1)
            total = total + weight * self.stored(low + c)
        return total

    def cubic(self, p):
        low = np.floor(p).astype(int)
        f = p - low
        w = [
            0.5 * (-(f**3) + 2 * f**2 - f),
            0.5 * (3 * f**3 - 5 * f**2 + 2),
            0.5 * (-3 * f**3 + 4 * f**2 + f),
            0.5 * (f**3 - f**2),
        ]
        total = 0
        for o in np.ndindex(4, 4, 4):
            weight = w[o[0]][..., 0] * w[o[1]][..., 1] * w[o[2]][..., 2]
            total = total + weight * self.stored(low + np.array(o) - 1)
        return total

    def gradient(self, p):
        """In the world, per mm."""
        g = np.empty(p.shape)
        for axis in range(3):
            step = np.eye(3)[axis]
            g[..., axis] = 0.5 * (
                self.linear(np.clip(p + step, 0, self.last))
                - self.linear(np.clip(p - step, 0, self.last))
            )
        return g @ self.inverse


class Transfer:
    """4096 entries from the first to the last point; a value takes the nearest."""

    def __init__(self, function, unit_mm):
        colors, opacities = function["colors"], function["opacities"]
        ends = [p[0] for p in colors] + [p[0] for p in opacities]
        self.low, self.high = min(ends), max(ends)
        at = np.linspace(self.low, self.high, 4096)
        cv = [p[0] for p in colors]
        self.color = np.stack([np.interp(at, cv, [p[i] for p in colors]) for i in (1, 2, 3)], -1)
        opacity = np.interp(at, [p[0] for p in opacities], [p[1] for p in opacities])
        self.tau = -np.log1p(-np.minimum(opacity, 1 - 2.0**-24)) / unit_mm

    def entry(self, value):
        x = (value - self.low) / (self.high - self.low) * 4095
        i = np.clip(np.floor(x + 0.5), 0, 4095).astype(int)
        return self.color[i], self.tau[i]


def rays(camera, size):
    """Origin and unit direction for each pixel, world mm."""
    eye, target = np.array(camera["eye_mm"], float), np.array(camera["target_mm"], float)
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, camera["up"])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    width, height = size
    parallel = camera["projection"] == "orthographic"
    half = (
        0.5 * camera["view_height_mm"]
        if parallel
        else math.tan(math.radians(0.5 * camera["view_angle_deg"]))
    )
    u = (2 * (np.arange(width) + 0.5) / width - 1) * half * width / height
    v = (1 - 2 * (np.arange(height) + 0.5) / height) * half
    across = u[None, :, None] * right + v[:, None, None] * up
    if parallel:
        return eye + across, np.broadcast_to(forward, across.shape)
    d = forward + across
    return np.broadcast_to(eye, d.shape), d / np.linalg.norm(d, axis=-1, keepdims=True)


def inside(volume, origin, direction):
    """Distances where a ray enters and leaves the box of sample centres."""
    o = volume.index(origin)
    d = direction @ volume.inverse.T
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = -o / d, (volume.last - o) / d
    near = np.maximum(np.minimum(a, b).max(-1), 0)
    return near, np.maximum(a, b).min(-1)


def draw_alpha(volume, scene, unit_mm):
    layer = scene["ray_cast"]
    transfer = Transfer(layer["transfer"], unit_mm)
    light = layer["shading"]
    origin, direction = rays(scene["camera"], scene["size_px"])
    near, far = inside(volume, origin, direction)
    h = layer["step_mm"]
    color = np.zeros(origin.shape)
    through = np.ones(origin.shape[:2])
    first = np.floor(near / h)
    for n in range(int(np.ceil(np.max(np.where(far > near, far - near, 0)) / h)) + 2):
        start = np.maximum((first + n) * h, near)
        end = np.minimum((first + n + 1) * h, far)
        going = (start < end) & (through >= layer["min_transmittance"])
        t = 0.5 * (start + end)[..., None]
        p = volume.index(origin + t * direction)
        base, tau = transfer.entry(volume.linear(p))
        g = volume.gradient(np.clip(p, 0, volume.last))
        size = np.linalg.norm(g, axis=-1)
        along = np.abs(np.sum(g * direction, -1))
        facing = np.where(size > 0, np.minimum(along / np.where(size > 0, size, 1), 1), 1)
        lit = np.clip(
            base * (light["ambient"] + light["diffuse"] * facing)[..., None]
            + (light["specular"] * facing ** light["shininess"])[..., None],
            0,
            1,
        )
        hidden = np.where(going, 1 - np.exp(-tau * np.maximum(end - start, 0)), 0)
        color += (through * hidden)[..., None] * lit
        through = through * (1 - hidden)
    return color + through[..., None] * np.array(scene["background"])


def draw_slab(volume, scene):
    plane = scene["slices"][0]
    transfer = Transfer(scene["slice_transfer"], 1.0)
    origin, direction = rays(scene["camera"], scene["size_px"])
    normal = np.array(plane["normal"], float)
    normal /= np.linalg.norm(normal)
    point = np.array(plane["point_mm"], float)
    t = ((point - origin) @ normal) / (direction @ normal)
    hit = volume.index(origin + t[..., None] * direction)
    met = (t >= 0) & np.all((hit >= -1e-4) & (hit <= volume.last + 1e-4), axis=-1)
    hit = np.clip(hit, 0, volume.last)
    count = max(1, math.ceil(plane["slab_mm"] / volume.spacing.min()))
    step = volume.inverse @ normal * (plane["slab_mm"] / count)
    total, counted, largest = 0.0, 0.0, np.full(t.shape, -np.inf)
    for i in range(count):
        p = hit + (i + 0.5 - 0.5 * count) * step
        within = np.all((p >= 0) & (p <= volume.last), axis=-1) | (count == 1)
        value = volume.cubic(p) if plane["interpolation"] == "cubic" else volume.linear(p)
        total = total + np.where(within, value, 0)
        counted = counted + within
        largest = np.maximum(largest, np.where(within, value, -np.inf))
    value = total / np.maximum(counted, 1)
    if plane["slab_mode"] == "maximum":
        value = largest
    color, _ = transfer.entry(np.where(np.isfinite(value), value, transfer.low))
    return np.where((met & (counted > 0))[..., None], color, np.array(scene["background"]))


# The table of docs/reference/scene.md.
CT_BONE = {
    "colors": [
        [110, 0.80, 0.60, 0.44],
        [200, 0.93, 0.82, 0.66],
        [450, 0.99, 0.95, 0.86],
        [1200, 1.0, 0.99, 0.96],
    ],
    "opacities": [[110, 0.0], [190, 0.3], [300, 0.7], [1000, 0.92]],
}


def main():
    palpate, folder = sys.argv[1], sys.argv[2]
    os.makedirs(folder, exist_ok=True)
    x, y, z = np.meshgrid(np.arange(26), np.arange(22), np.arange(15), indexing="ij")
    samples = np.round(
        500 * np.sin(0.45 * x) * np.cos(0.5 * y + 0.1 * x) + 40 * z + 13 * ((x * 7 + y * 3) % 5)
    )
    # Oblique, of unequal spacing, and small: the diagonal of its box of voxels is below 200 mm.
    c, s = 0.8, 0.6
    directions = [[0.9 * c, 0.9 * s, 0], [-1.1 * s, 1.1 * c, 0], [0, 0, -2.0]]
    origin = [-30.0, 12.0, 7.0]
    volume = Volume(samples, directions, origin)
    write_nrrd(os.path.join(folder, "volume.nrrd"), samples, directions, origin)
    middle = (volume.axes @ (volume.last / 2) + volume.origin).tolist()
    box = volume.axes @ np.array([26.0, 22.0, 15.0])
    diagonals = [
        np.linalg.norm(volume.axes @ (np.array(samples.shape) * np.array(sign)))
        for sign in ((1, 1, 1), (-1, 1, 1), (1, -1, 1), (1, 1, -1))
    ]
    assert np.linalg.norm(box) < 200
    unit_mm = max(diagonals) / 200.0

    eye = [middle[0] - 40, middle[1] - 75, middle[2] + 33]
    common = {"volume": "volume.nrrd", "background": [0.1, 0.2, 0.05]}
    shading = {"ambient": 0.2, "diffuse": 0.65, "specular": 0.15, "shininess": 10}
    alpha = {
        **common,
        "size_px": [72, 56],
        "camera": {
            "projection": "perspective",
            "eye_mm": eye,
            "target_mm": middle,
            "up": [0.1, 0, 1],
            "view_angle_deg": 28,
        },
        "ray_cast": {
            "mode": "alpha",
            "integrator": "fast",
            "step_mm": 0.7,
            "transfer": "ct-bone",
            "shading": True,
        },
    }
    slab = {
        **common,
        "size_px": [60, 64],
        "camera": {
            "projection": "orthographic",
            "eye_mm": eye,
            "target_mm": middle,
            "up": [0, 0, 1],
            "view_height_mm": 34,
        },
        "slices": [
            {
                "point_mm": middle,
                "normal": [0.5, 1, -0.4],
                "interpolation": "cubic",
                "slab_mm": 3.1,
                "slab_mode": "mean",
            }
        ],
        "slice_transfer": {"window": [-450, 900]},
    }
    maximum = {**slab, "slices": [{**slab["slices"][0], "interpolation": "linear",
                                   "slab_mode": "maximum"}]}
    window = {
        "colors": [[-450, 0, 0, 0], [900, 1, 1, 1]],
        "opacities": [[-450, 0], [900, 1]],
    }

    def resolved(scene):
        out = json.loads(json.dumps(scene))
        if "ray_cast" in out:
            out["ray_cast"].update(
                transfer=CT_BONE, shading=shading, min_transmittance=1 / 1024
            )
        else:
            out["slice_transfer"] = window
        return out

    failed = False
    for name, scene, mine in (
        ("alpha", alpha, draw_alpha(volume, resolved(alpha), unit_mm)),
        ("slab", slab, draw_slab(volume, resolved(slab))),
        ("slab_maximum", maximum, draw_slab(volume, resolved(maximum))),
    ):
        path = os.path.join(folder, name + ".json")
        with open(path, "w") as out:
            json.dump(scene, out)
        picture = os.path.join(folder, name + ".png")
        subprocess.run([palpate, "--quiet", "render", path, "-o", picture], check=True)
        theirs = read_png(picture).astype(int)
        expected = np.floor(255 * np.clip(mine, 0, 1) + 0.5).astype(int)
        difference = np.abs(theirs - expected).max(-1)
        # A level apart where 255 v lies within rounding of a half: 32-bit floats against 64, and
        # entries of the table where a value lies between two: colours and opacities of neighbours
        # differ by less than 1/1000 here.
        apart, far = np.mean(difference > 0), np.mean(difference > 1)
        seen = np.mean(np.abs(expected - expected[0, 0]).max(-1) > 8)
        print(
            f"{name}: {100 * apart:.2f} % of the pixels one level apart, {100 * far:.2f} % more, "
            f"largest {difference.max()}; {100 * seen:.0f} % are not background"
        )
        failed |= apart > 0.05 or far > 0 or seen < 0.1
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
