#!/usr/bin/python3
"""Compares the edge-aware brush with the plain one along the edges of organs (docs/log/editing.md).

usage: bench/edge_brush.py build/dev/bin/palpate ../shared/data/ct_trunk_labels [--alike 3] [--radius 12]

For each of ten organs, in the axial slice that holds most of it: the samples at 0.4 to 0.75 of the radius from its
edge, in order along the edge, from a start drawn by chance (three seeds each). A stroke goes down at the first and
visits all of them, with a disc in the slice and with a ball. The error is the area of wrong samples over the length
of the edge within the tool's sweep, in mm: how far the edge is off on average. Wrong are painted samples beside
the organ, and samples of the organ that the tool passed over and left.
"""
import argparse
import json
import pathlib
import subprocess
import tempfile

import nibabel
import numpy as np
from scipy import ndimage

ORGANS = {1: "spleen", 2: "right kidney", 3: "left kidney", 5: "liver", 6: "stomach", 18: "small bowel", 20: "colon",
          21: "bladder", 25: "sacrum", 75: "left hip"}
LPS_FROM_RAS = np.diag([-1.0, -1.0, 1.0, 1.0])


def stroke_text(shape, operation, points):
    head = {"stroke": 1, "units": "mm", "shape": shape, "operation": operation}
    lines = [json.dumps(head)]
    lines += [json.dumps({"t_s": 0.01 * i, "p_mm": list(map(float, p))}) for i, p in enumerate(points)]
    return "\n".join(lines) + "\n"


def ring_path(organ_slice, spacing, radius, seed):
    """Samples of the ring, each the nearest one left to the one before, within three samples."""
    depth = ndimage.distance_transform_edt(organ_slice) * spacing
    left = [tuple(p) for p in np.argwhere((depth >= 0.4 * radius) & (depth <= 0.75 * radius))]
    if len(left) < 5:
        return []
    path = [left.pop(np.random.default_rng(seed).integers(len(left)))]
    while left:
        away = [np.hypot(p[0] - path[-1][0], p[1] - path[-1][1]) for p in left]
        nearest = int(np.argmin(away))
        if away[nearest] > 3:
            break
        path.append(left.pop(nearest))
    return path


def edge_faces(organ, swept):
    count = 0
    for axis in range(3):
        low, high = [slice(None)] * 3, [slice(None)] * 3
        low[axis], high[axis] = slice(None, -1), slice(1, None)
        low, high = tuple(low), tuple(high)
        count += int(((organ[low] != organ[high]) & swept[low] & swept[high]).sum())
    return count


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("palpate")
    options.add_argument("data", type=pathlib.Path)
    options.add_argument("--alike", type=float, default=3.0)
    options.add_argument("--radius", type=float, default=12.0, help="mm")
    o = options.parse_args()
    image = nibabel.load(o.data / "labels_totalseg_v2.nii.gz")
    labels = np.asarray(image.dataobj).astype(int)
    spacing = float(image.header.get_zooms()[0])
    world = LPS_FROM_RAS @ image.affine
    folder = pathlib.Path(tempfile.mkdtemp())
    empty = folder / "empty.nii.gz"
    nibabel.save(nibabel.Nifti1Image(np.zeros(labels.shape, np.uint8), image.affine), empty)

    def painted(shape, operation, points):
        strokes, out = folder / "strokes.jsonl", folder / "out.nii.gz"
        strokes.write_text(stroke_text(shape, operation, points))
        done = subprocess.run([o.palpate, "edit", empty, strokes, "--guide", o.data / "ct.nii.gz", "-o", out],
                              capture_output=True, text=True)
        if done.returncode != 0:
            raise SystemExit(done.stderr)
        return np.asarray(nibabel.load(out).dataobj) > 0

    shapes = {
        "disc": {"kind": "cylinder", "radius_mm": o.radius, "length_mm": 0.5 * spacing, "at_mm": [0, 0, -0.25 * spacing]},
        "ball": {"kind": "ball", "radius_mm": o.radius},
    }
    print("| brush | organ | plain, mm | edge-aware, mm | of it beside the organ | left out |\n|---|---|---|---|---|---|")
    for name, shape in shapes.items():
        every = []
        for label, organ_name in ORGANS.items():
            organ, rows = labels == label, []
            z = int(organ.sum((0, 1)).argmax())
            for seed in range(3):
                path = ring_path(organ[:, :, z], spacing, o.radius, seed)
                if not path:
                    continue
                points = [(world @ [x, y, z, 1])[:3] for x, y in path]
                swept = painted(shape, {"kind": "draw"}, points)
                held = painted(shape, {"kind": "draw", "alike": o.alike}, points)
                faces = edge_faces(organ, swept)
                if faces:
                    rows.append([(swept & ~organ).sum(), (held & ~organ).sum() + (swept & organ & ~held).sum(),
                                 (held & ~organ).sum(), (swept & organ & ~held).sum()])
                    rows[-1] = np.array(rows[-1]) * spacing / faces
            if rows:
                every += rows
                print(f"| {name} | {organ_name} | " + " | ".join(f"{v:.2f}" for v in np.mean(rows, axis=0)) + " |")
        print(f"| {name} | all, mean of {len(every)} | " + " | ".join(f"{v:.2f}" for v in np.mean(every, axis=0)) + " |")


if __name__ == "__main__":
    main()
