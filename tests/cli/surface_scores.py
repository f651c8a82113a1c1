"""The distances of surfaces that `palpate compare` prints, computed anew from their definition
(engine/measure/surface_scores.h) with numpy: cells of 2 x 2 x 2 samples, loops through the middles
of their crossed edges, all pairs of cells.

surface_scores.py PROGRAM LABELS.nii.gz
"""

import gzip
import itertools
import json
import os
import struct
import subprocess
import sys
import tempfile

import numpy as np

SKIP = 77
CORNERS = list(itertools.product((0, 1), repeat=3))


def read_nifti(path):
    data = gzip.open(path).read()
    sizes = struct.unpack_from("<8h", data, 40)[1:4]
    kind = {2: "u1", 4: "<i2", 8: "<i4", 16: "<f4", 64: "<f8", 256: "i1", 512: "<u2"}[
        struct.unpack_from("<h", data, 70)[0]]
    spacing = np.array(struct.unpack_from("<8f", data, 76)[1:4], dtype=float)
    start = int(struct.unpack_from("<f", data, 108)[0])
    samples = np.frombuffer(data, kind, int(np.prod(sizes)), start)
    return samples.reshape(sizes, order="F"), spacing


def face_segments(inside, axis, side):
    """Pairs of edges' middles that the surface joins on one face of a cell."""
    u, v = [k for k in range(3) if k != axis]

    def corner(a, b):
        at = [0, 0, 0]
        at[axis], at[u], at[v] = side, a, b
        return tuple(at)

    ring = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)]
    middles = [tuple((np.array(ring[i]) + ring[(i + 1) % 4]) / 2) for i in range(4)]
    crossed = [i for i in range(4) if inside[ring[i]] != inside[ring[(i + 1) % 4]]]
    if len(crossed) == 2:
        return [(middles[crossed[0]], middles[crossed[1]])]
    # Inside corners lie apart: each has its own segment.
    return [(middles[i - 1], middles[i]) for i in range(4) if crossed and inside[ring[i]]]


def cell_area(inside, spacing):
    """The sum of the lengths of the loops' vector areas, mm^2."""
    joined = {}
    for axis in range(3):
        for side in (0, 1):
            for a, b in face_segments(inside, axis, side):
                joined.setdefault(a, []).append(b)
                joined.setdefault(b, []).append(a)
    area = 0.0
    while joined:
        first = at = next(iter(joined))
        loop = []
        while at in joined:
            loop.append(at)
            ways = joined.pop(at)
            at = next((w for w in ways if w in joined), first)
        points = np.array(loop) * spacing
        area += np.linalg.norm(np.cross(points, np.roll(points, -1, axis=0)).sum(axis=0)) / 2
    return area


def pieces(mask, spacing):
    """Places (mm) and areas of the cells that the surface of a mask passes through."""
    padded = np.pad(mask, 1)
    shape = [n - 1 for n in padded.shape]
    code = np.zeros(shape, int)
    for bit, (x, y, z) in enumerate(CORNERS):
        code |= padded[x:x + shape[0], y:y + shape[1], z:z + shape[2]].astype(int) << bit
    at = np.argwhere((code != 0) & (code != 255))
    areas = {}
    for c in np.unique(code[tuple(at.T)]):
        areas[c] = cell_area({k: bool(c >> i & 1) for i, k in enumerate(CORNERS)}, spacing)
    return at * spacing, np.array([areas[c] for c in code[tuple(at.T)]])


def nearest(places, others):
    return np.array([np.sqrt(((others - p) ** 2).sum(axis=1).min()) for p in places])


def within(distances, areas, share):
    order = np.argsort(distances)
    return distances[order][np.searchsorted(np.cumsum(areas[order]), share * areas.sum())]


def scores(first, second, spacing):
    a, area_a = pieces(first, spacing)
    b, area_b = pieces(second, spacing)
    d_a, d_b = nearest(a, b), nearest(b, a)
    d, area = np.concatenate([d_a, d_b]), np.concatenate([area_a, area_b])
    return {"area_mm2": [area_a.sum(), area_b.sum()],
            "mean_mm": (d * area).sum() / area.sum(),
            "rms_mm": np.sqrt((d * d * area).sum() / area.sum()),
            "p95_mm": max(within(d_a, area_a, 0.95), within(d_b, area_b, 0.95)),
            "largest_mm": d.max()}


def main(program, labels):
    if not os.path.exists(labels):
        print(f"{labels} is absent")
        return SKIP
    wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        other = os.path.join(folder, "other.nii.gz")
        for change in (["--smooth-joint", "1.5"], ["--erode", "6"], ["--dilate", "ball,2.5"]):
            subprocess.run([program, "filter", labels, *change, "-o", other], check=True)
            ran = subprocess.run([program, "compare", labels, other, "--labels"],
                                 capture_output=True, text=True, check=False)
            (a, spacing), (b, _) = read_nifti(labels), read_nifti(other)
            found = {one["label"]: one["surface"] for one in json.loads(ran.stdout)["labels"]}
            for label in sorted(found):
                if not (a == label).any() or not (b == label).any():
                    continue
                for key, value in scores(a == label, b == label, spacing).items():
                    # Distances and areas of pieces are floats there: 2^-24 of each.
                    if not np.allclose(found[label][key], value, rtol=1e-6, atol=1e-6):
                        print(f"{change} label {label} {key}: {found[label][key]}, here {value}")
                        wrong += 1
                print(f"{' '.join(change)}, label {label}: mean {found[label]['mean_mm']:.4f}, RMS "
                      f"{found[label]['rms_mm']:.4f}, 95 % {found[label]['p95_mm']:.4f}, "
                      f"largest {found[label]['largest_mm']:.4f} mm")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2]))
