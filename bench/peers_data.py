"""The head CT as the comparison with VTK takes it, its camera, and float pictures from EXR files.

ct256 is matrix.dat of the InVesalius project of Debian's invesalius-examples, 256x256x108; ct174 is
the same resampled to 512x512x174, trilinearly, first and last samples in place. Axes are those of
the samples: world is index times spacing, so that both programs see the same scene."""
import json
import os
import struct
import tarfile
import zlib

import numpy as np

SIZE = (256, 256, 108)
SPACING_MM = (0.9570312, 0.9570312, 1.5)
RESAMPLED = (512, 512, 174)
VIEW_ANGLE_DEG, ELEVATION_DEG, FILL = 30.0, 30.0, 0.8


def head_ct(project):
    """Samples [z][y][x] of an InVesalius project file."""
    with tarfile.open(project) as tar:
        for member in tar:
            if member.name.endswith("matrix.dat"):
                data = np.frombuffer(tar.extractfile(member).read(), "<i2")
                return data.reshape(SIZE[::-1])
    raise SystemExit(f"{project}: expected a matrix.dat inside, found none")


def resampled_axis(samples, axis, count):
    n = samples.shape[axis]
    place = np.arange(count) * ((n - 1) / (count - 1))
    low = np.minimum(place.astype(int), n - 2)
    shape = [1, 1, 1]
    shape[axis] = count
    weight = (place - low).astype(np.float32).reshape(shape)
    return samples.take(low, axis) * (1 - weight) + samples.take(low + 1, axis) * weight


def prepare(project, folder):
    """Writes NAME.raw, NAME.nrrd and volumes.json for ct256 and ct174 where they are missing."""
    index = os.path.join(folder, "volumes.json")
    if os.path.exists(index):
        return
    os.makedirs(folder, exist_ok=True)
    ct = head_ct(project)
    fine = ct.astype(np.float32)
    for axis, count in ((1, RESAMPLED[1]), (2, RESAMPLED[0]), (0, RESAMPLED[2])):
        fine = resampled_axis(fine, axis, count)
    volumes = {}
    for name, samples in (("ct256", ct), ("ct174", np.rint(fine).astype("<i2"))):
        dims = samples.shape[::-1]
        spacing = [s * (n - 1) / (m - 1) for s, n, m in zip(SPACING_MM, SIZE, dims)]
        samples.tofile(os.path.join(folder, name + ".raw"))
        volumes[name] = {"file": name + ".raw", "dtype": "<i2", "dims": dims, "spacing": spacing}
        header = ["NRRD0004", "type: int16", "dimension: 3", "space: left-posterior-superior",
                  "sizes: " + " ".join(map(str, dims)), "encoding: raw", "endian: little",
                  "space directions: " + " ".join(
                      "(" + ",".join(repr(s if i == j else 0.0) for j in range(3)) + ")"
                      for i, s in enumerate(spacing)),
                  "space origin: (0,0,0)", "", ""]
        with open(os.path.join(folder, name + ".nrrd"), "wb") as out:
            out.write("\n".join(header).encode() + samples.tobytes())
    with open(index, "w") as out:
        json.dump(volumes, out, indent=1)


def volume(folder, name):
    """(samples [z][y][x], spacing in mm)"""
    with open(os.path.join(folder, "volumes.json")) as file:
        entry = json.load(file)[name]
    samples = np.fromfile(os.path.join(folder, entry["file"]), entry["dtype"])
    return samples.reshape(entry["dims"][::-1]), entry["spacing"]


def camera(dims, spacing):
    """(eye, target) in mm: from +y, 30 degrees up, at FILL of the distance that shows all."""
    size = (np.array(dims) - 1) * np.array(spacing)
    distance = FILL * np.linalg.norm(size) / 2 / np.sin(np.radians(VIEW_ANGLE_DEG / 2))
    elevation = np.radians(ELEVATION_DEG)
    return size / 2 + distance * np.array([0.0, np.cos(elevation), np.sin(elevation)]), size / 2


def load_exr(path):
    """Channels by name, float32 [row][column], of a scanline EXR of 32-bit floats, ZIP or plain."""
    with open(path, "rb") as file:
        data = file.read()
    if data[:4] != b"\x76\x2f\x31\x01":
        raise SystemExit(f"{path}: expected an EXR file")
    at, attributes = 8, {}

    def text():
        nonlocal at
        end = data.index(b"\0", at)
        value, at = data[at:end].decode(), end + 1
        return value

    while data[at] != 0:
        name = text()
        text()
        size, = struct.unpack_from("<i", data, at)
        attributes[name] = data[at + 4:at + 4 + size]
        at += 4 + size
    at += 1
    channels, rest = [], attributes["channels"]
    while rest[0] != 0:
        end = rest.index(b"\0")
        kind, = struct.unpack_from("<i", rest, end + 1)
        if kind != 2:
            raise SystemExit(f"{path}: expected 32-bit floats")
        channels.append(rest[:end].decode())
        rest = rest[end + 17:]
    x0, y0, x1, y1 = struct.unpack("<4i", attributes["dataWindow"])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    rows_per_block = {0: 1, 2: 1, 3: 16}[attributes["compression"][0]]
    blocks = (height + rows_per_block - 1) // rows_per_block
    image = np.empty((height, len(channels), width), np.float32)
    for offset in struct.unpack_from(f"<{blocks}Q", data, at):
        row, size = struct.unpack_from("<ii", data, offset)
        rows = min(rows_per_block, height - (row - y0))
        raw = data[offset + 8:offset + 8 + size]
        expected = rows * len(channels) * width * 4
        if size != expected:  # compressed: bytes as differences, then low and high halves apart
            coded = np.frombuffer(zlib.decompress(raw), np.uint8).astype(np.int64)
            coded[1:] -= 128
            coded = (np.cumsum(coded) & 255).astype(np.uint8)
            plain = np.empty(expected, np.uint8)
            plain[0::2], plain[1::2] = coded[:(expected + 1) // 2], coded[(expected + 1) // 2:]
            raw = plain.tobytes()
        image[row - y0:row - y0 + rows] = np.frombuffer(raw, "<f4").reshape(rows, len(channels),
                                                                            width)
    return {name: image[:, i] for i, name in enumerate(channels)}
