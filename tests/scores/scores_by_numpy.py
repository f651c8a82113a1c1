#!/usr/bin/python3
"""Checks the scores of `palpate compare A B --labels` against numpy and scipy.

    scores_by_numpy.py PALPATE FOLDER

Random label maps on anisotropic grids; every score is computed here from docs/reference/scores.md alone.
"""

import itertools
import json
import os
import subprocess
import sys

import numpy as np
from scipy import ndimage


def write_nrrd(path, labels, spacing):
    """labels[z, y, x]"""
    z, y, x = labels.shape
    with open(path, "wb") as out:
        out.write((
            "NRRD0004\ntype: unsigned char\ndimension: 3\nspace: left-posterior-superior\n"
            f"sizes: {x} {y} {z}\nspace directions: ({spacing[0]},0,0) (0,{spacing[1]},0) (0,0,{spacing[2]})\n"
            "space origin: (0,0,0)\nencoding: raw\n\n").encode())
        out.write(labels.astype(np.uint8).tobytes())


CORNERS = [np.array([c & 1, c >> 1 & 1, c >> 2 & 1]) for c in range(8)]


def face_segments(inside, face):
    """Segments on a face (its four corners in turn), as pairs of crossed edges; inside corners apart."""
    edges = [frozenset((face[i], face[(i + 1) % 4])) for i in range(4)]
    crossed = [i for i in range(4) if inside[face[i]] != inside[face[(i + 1) % 4]]]
    if len(crossed) == 2:
        return [(edges[crossed[0]], edges[crossed[1]])]
    if len(crossed) == 4:  # each inside corner is cut off by the two edges beside it
        return [(edges[i - 1], edges[i]) for i in range(4) if inside[face[i]]]
    return []


def cell_area(code, spacing):
    inside = [code >> c & 1 for c in range(8)]
    neighbours = {}
    for axis, side in itertools.product(range(3), range(2)):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        face = []
        for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
            corner = [0, 0, 0]
            corner[axis], corner[u], corner[v] = side, a, b
            face.append(corner[0] + 2 * corner[1] + 4 * corner[2])
        for a, b in face_segments(inside, face):
            neighbours.setdefault(a, []).append(b)
            neighbours.setdefault(b, []).append(a)
    middle = lambda edge: sum(CORNERS[c] * np.array(spacing) for c in edge) / 2
    area, left = 0.0, set(neighbours)
    while left:
        start = at = next(iter(left))
        loop, before = [], None
        while True:
            loop.append(middle(at))
            left.discard(at)
            onward = neighbours[at][0] if neighbours[at][0] != before or len(loop) == 1 else neighbours[at][1]
            before, at = at, onward
            if at == start:
                break
        vector = sum(np.cross(loop[i], loop[(i + 1) % len(loop)]) for i in range(len(loop)))
        area += np.linalg.norm(vector) / 2
    return area


def cells(mask):
    padded = np.pad(mask.astype(np.uint8), 1)
    code = np.zeros([n - 1 for n in padded.shape], int)
    for c, (x, y, z) in enumerate(CORNERS):
        code |= padded[z:padded.shape[0] - 1 + z, y:padded.shape[1] - 1 + y, x:padded.shape[2] - 1 + x].astype(int) << c
    return code


def surface(a, b, spacing, tolerance):
    areas = np.array([cell_area(code, spacing) for code in range(256)])
    codes = [cells(a), cells(b)]
    crossed = [(c != 0) & (c != 255) for c in codes]
    pieces = []
    for own, other in ((0, 1), (1, 0)):
        area = areas[codes[own][crossed[own]]]
        if not crossed[other].any():
            pieces.append((np.full(len(area), np.inf), area))
            continue
        away = ndimage.distance_transform_edt(~crossed[other], sampling=spacing[::-1])
        pieces.append((away[crossed[own]], area))
    return pieces


def surface_scores(first, second, tolerance):
    total = first[1].sum() + second[1].sum()
    out = {"area_mm2": [first[1].sum(), second[1].sum()], "mean_mm": None, "rms_mm": None, "p95_mm": None,
           "largest_mm": None, "dice": 1.0}
    if total:
        out["dice"] = sum(a[d <= tolerance].sum() for d, a in (first, second)) / total
    kept = [(d[np.isfinite(d)], a[np.isfinite(d)]) for d, a in (first, second)]
    reached = sum(a.sum() for _, a in kept)
    if not total:
        return dict(out, mean_mm=0.0, rms_mm=0.0, p95_mm=0.0, largest_mm=0.0)
    if not reached:
        return out
    out["mean_mm"] = sum((d * a).sum() for d, a in kept) / reached
    out["rms_mm"] = np.sqrt(sum((d * d * a).sum() for d, a in kept) / reached)
    out["largest_mm"] = max(d.max(initial=0) for d, _ in kept)
    p95 = []
    for d, a in kept:
        order = np.argsort(d)
        passed = np.cumsum(a[order])
        p95.append(d[order][np.searchsorted(passed, 0.95 * passed[-1] - 1e-6)] if len(d) else 0.0)
    out["p95_mm"] = max(p95)
    return out


def overlap(a, b, margin, spacing):
    share = lambda p, q: p / q if q else None
    tp, p, q = int((a & b).sum()), int(a.sum()), int(b.sum())
    out = {"voxels": [p, q], "both": tp, "dice": share(2 * tp, p + q), "jaccard": share(tp, p + q - tp),
           "sensitivity": share(tp, q), "ppv": share(tp, p), "rvd": share(p - q, q),
           "specificity": share(int((~a & ~b).sum()), int((~b).sum())), "box_specificity": None}
    out["voe"] = 1 - out["jaccard"]
    if q:
        where = np.argwhere(b)
        grow = np.ceil(margin / np.array(spacing[::-1]) - 1e-12).astype(int)
        low, high = np.maximum(where.min(0) - grow, 0), where.max(0) + grow + 1
        box = tuple(slice(l, h) for l, h in zip(low, high))
        out["box_specificity"] = share(int((~a[box] & ~b[box]).sum()), int((~b[box]).sum()))
    return out


def blobs(random, shape, kinds):
    smooth = [ndimage.gaussian_filter(random.standard_normal(shape), 2) for _ in range(kinds)]
    return np.argmax(np.stack(smooth), 0).astype(np.uint8)


def main():
    program, folder = sys.argv[1:3]
    os.makedirs(folder, exist_ok=True)
    faults = compared = 0
    for case, (shape, spacing) in enumerate((((20, 24, 28), (1.0, 1.0, 1.0)), ((12, 31, 40), (0.5, 0.7, 3.0)),
                                             ((1, 30, 33), (0.6, 0.6, 2.0)))):
        random = np.random.default_rng(case)
        a = blobs(random, shape, 4)
        b = np.where(ndimage.gaussian_filter(random.standard_normal(shape), 1) > 0.05, blobs(random, shape, 3), a)
        a[a == 2], b[b == 3] = 9, 0  # labels that one map alone has
        paths = [os.path.join(folder, f"{case}{name}.nrrd") for name in "ab"]
        write_nrrd(paths[0], a, spacing)
        write_nrrd(paths[1], b, spacing)
        tolerance, margin = 0.9, 2.0
        run = subprocess.run([program, "compare", *paths, "--labels", "--dice", "0", "--tolerance-mm", str(tolerance),
                              "--box-margin-mm", str(margin)], capture_output=True, text=True)
        if run.returncode != 0:
            sys.exit(f"palpate compare failed: {run.stderr}")
        found = json.loads(run.stdout)
        labels = sorted(set(np.unique(a)) | set(np.unique(b)) - {0})
        labels = [int(label) for label in labels if label]
        if [one["label"] for one in found["labels"]] != labels:
            sys.exit(f"labels {labels}, found {[one['label'] for one in found['labels']]}")
        every = []
        for label, one in zip(labels, found["labels"]):
            expected = overlap(a == label, b == label, margin, spacing)
            pieces = surface(a == label, b == label, spacing, tolerance)
            every.append(pieces)
            expected["surface"] = surface_scores(*pieces, tolerance)
            pairs = [(k, expected[k], one[k]) for k in expected if k != "surface"]
            pairs += [(k, expected["surface"][k], one["surface"][k]) for k in expected["surface"]]
            for key, want, have in pairs:
                compared += 1
                wants, haves = (want, have) if isinstance(want, list) else ([want], [have])
                for w, h in zip(wants, haves):
                    # Distances and areas are floats there: 2^-23 of each.
                    if (w is None) != (h is None) or (w is not None and abs(w - h) > 1e-6 * max(1, abs(w))):
                        faults += 1
                        print(f"case {case}, label {label}, {key}: numpy has {w}, palpate {h}")
        whole = [tuple(np.concatenate([p[side][k] for p in every]) for k in range(2)) for side in range(2)]
        for key, want in surface_scores(*whole, tolerance).items():
            have = found["overall"]["surface"][key]
            compared += 1
            if not np.allclose(np.array(want, float), np.array(have, float), rtol=1e-6, atol=1e-6):
                faults += 1
                print(f"case {case}, overall, {key}: numpy has {want}, palpate {have}")
    print(f"{compared} scores compared, {faults} differ")
    sys.exit(faults > 0 or compared < 100)


if __name__ == "__main__":
    main()
