"""Measures of volumes and labels, and comparisons."""

import json
from typing import Any, Dict, Sequence

import numpy as np

from . import _core
from .mesh import Mesh
from .picture import Picture
from .volume import Progress, as_volume


def measure(
    volume: Any,
    measures: Sequence[Dict[str, Any]] = (),
    *,
    labels: Any = None,
    histogram: int = 0,
    progress: Progress = None,
) -> Dict[str, Any]:
    """Measures things in the patient, and each label of a label map.

    measures: {"kind": "ruler" | "angle" | "polygon" | "sphere", "points_mm": [[x, y, z], ..]}, mm (LPS).
    labels: a label map; each label has its count, volume, area, shape, values, box and centroid.
    Returns {"measures": [..], "labels": [..]} with the keys of `palpate measure --json`.
    """
    if not 0 <= int(histogram) <= 65536:
        raise _core.Error(f"histogram: expected 0 .. 65536 bins, found {histogram}")
    try:
        text = json.dumps([dict(one) for one in measures])
    except (TypeError, ValueError) as error:
        raise _core.Error("measures: expected a list of dicts of numbers and texts") from error
    label_map = None if labels is None else as_volume(labels, labels=True)._core
    return json.loads(_core.measure(as_volume(volume)._core, text, label_map, int(histogram), progress))


def compare(
    first: Any,
    second: Any,
    *,
    labels: bool = False,
    bound: float = 0.0,
    tolerance_mm: float = 1.0,
    progress: Progress = None,
) -> Dict[str, Any]:
    """How far the second is from the first, with the keys of `palpate compare`: two pictures, meshes,
    volumes, or label maps (labels=True; the second is the truth). Nothing is judged.
    """
    if isinstance(first, Mesh) and isinstance(second, Mesh):
        return json.loads(_core.compare_meshes(first._core, second._core))
    if isinstance(first, Picture) and isinstance(second, Picture):
        a, b = (np.ascontiguousarray(p.to_numpy()[..., :3]) for p in (first, second))
        return json.loads(_core.compare_pictures(a, b, float(bound)))
    if isinstance(first, (Mesh, Picture)) or isinstance(second, (Mesh, Picture)):
        raise _core.Error(f"expected two of one kind, found {type(first).__name__} and {type(second).__name__}")
    one, other = as_volume(first, labels=labels)._core, as_volume(second, labels=labels)._core
    if labels:
        return json.loads(_core.compare_labels(one, other, float(tolerance_mm), progress))
    return json.loads(_core.compare_volumes(one, other, float(bound)))
