"""Filters and segmentation methods, by name."""

import json
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

from . import _core
from .volume import Progress, Volume, as_volume, number


def filters() -> List[Dict[str, str]]:
    """The filters: name, purpose, arguments and their ranges, type of the result."""
    return _core.filters()


def filter(
    volume: Any,
    name: str,
    *values: Any,
    labels: bool = False,
    others: Optional[Mapping[str, Any]] = None,
    locked: Sequence[int] = (),
    progress: Progress = None,
    **named: Any,
) -> Volume:
    """Runs one filter: filter(v, "gaussian", 1.5), filter(v, "bilateral", 2, range=50).

    values: in the order of filters()' arguments, or by name; lengths are mm. others: volumes that an
    expression names. labels: `volume` is a label map. locked: labels of it, 1 .. 65535, that keep their
    samples and get no other, where the filter's result is the map: filter(v, "margin", 2, labels=True, locked=[3]).
    """
    text = ",".join([_word(v) for v in values] + [f"{key}={_word(v)}" for key, v in named.items()])
    known = {key: as_volume(v)._core for key, v in (others or {}).items()}
    fixed = [int(label) for label in locked]
    if not all(1 <= label <= 65535 for label in fixed):
        raise _core.Error(f"locked: expected labels 1 .. 65535, found {fixed}")
    return Volume(_core.filter(as_volume(volume, labels=labels)._core, name, text, known, fixed, progress))


def scissors(
    labels: Any,
    outline_mm: Sequence[Sequence[float]],
    towards: Sequence[float],
    *,
    action: str = "erase-inside",
    label: int = 1,
    all_labels: bool = False,
    eye_mm: Optional[Sequence[float]] = None,
    depths_mm: Optional[Sequence[float]] = None,
    seen_first: bool = False,
    locked: Sequence[int] = (),
    progress: Progress = None,
) -> Volume:
    """Cuts a label map by a closed outline: scissors(v, [[0, 0, 0], [9, 0, 0], [9, 9, 0]], [0, 0, 1]).

    A sample lies within where its centre is seen within the outline, looking along towards, with parallel
    rays or from eye_mm. action: "erase-inside", "erase-outside" or "fill-inside", of the label; all_labels:
    every label is erased, or a fill takes samples of others. depths_mm: (least, most) along towards from the
    outline's first corner. seen_first: only what no sample hides. Places are LPS mm.
    """
    cut: Dict[str, Any] = {
        "scissors": 1,
        "units": "mm",
        "action": action,
        "label": label,
        "all_labels": all_labels,
        "outline_mm": [[float(x) for x in corner] for corner in outline_mm],
        "towards": [float(x) for x in towards],
        "seen_first": seen_first,
    }
    if eye_mm is not None:
        cut["eye_mm"] = [float(x) for x in eye_mm]
    if depths_mm is not None:
        cut["depths_mm"] = [float(x) for x in depths_mm]
    return filter(labels, "scissors", json.dumps(cut), labels=True, locked=locked, progress=progress)


def _word(value: Any) -> str:
    return value if isinstance(value, str) else number(value)


def methods() -> List[Dict[str, Any]]:
    """The segmentation methods: name, purpose, takes_seeds, and parameters with unit, range and default."""
    return _core.methods()


class Segmented(NamedTuple):
    """What segment() found."""

    labels: Volume
    """u8 or u16; 0 outside of all objects."""
    cost: Optional[Volume]
    """f32, of fast marching."""
    strength: Optional[Volume]
    """f32: arrival times, connectedness or probability; NaN where the background has won."""
    notes: List[str]
    """What was found from the data."""


def segment(
    volume: Any,
    method: str,
    seeds: Any = None,
    *,
    background: int = 0,
    progress: Progress = None,
    **parameters: Any,
) -> Segmented:
    """Finds objects.

    seeds: a list of (label, (x, y, z)) or (label, (x, y, z), radius_mm) in mm (LPS), a dict as in a seed
    file, or a label map on the volume's grid. background: the label of seeds that stands for outside.
    parameters: those of methods(), with _ for -.
    """
    text, label_map = _seeds_of(seeds, background)
    try:
        values = {name.replace("_", "-"): float(value) for name, value in parameters.items()}
    except (TypeError, ValueError) as error:
        raise _core.Error(f"expected numbers as parameters, found {parameters!r}") from error
    labels, cost, strength, notes = _core.segment(
        as_volume(volume)._core, method, text, label_map, int(background), values, progress
    )
    return Segmented(Volume(labels), cost and Volume(cost), strength and Volume(strength), notes)


def segment_by_net(
    volume: Any,
    send_to: str,
    seeds: Any = None,
    *,
    consent: bool = False,
    background: int = 0,
    model: str = "",
    key: str = "",
    timeout_s: float = 60.0,
    progress: Progress = None,
) -> Segmented:
    """Asks a net on a server for objects: segment_by_net(v, "gpu:1527", [(1, (0, 0, 0))], consent=True).

    send_to: a server of nnInteractive or MONAI Label, HOST:PORT or a URL. consent: agrees that the volume and
    the seeds leave this machine for it; without, nothing is sent, and the error says what would be. seeds and
    background: as of segment(); places are points, label maps scribbles. model: of MONAI Label. key: if the
    server wants one. timeout_s: silence after which it is given up. The licence of the net is in the notes.
    """
    text, label_map = _seeds_of(seeds, background)
    labels, notes = _core.segment_by_net(
        as_volume(volume)._core, send_to, key, model, consent, timeout_s, text, label_map, int(background), progress
    )
    return Segmented(Volume(labels), None, None, notes)


def _seeds_of(seeds: Any, background: int) -> Tuple[str, Any]:
    """The text of a seed file, or a label map, as _core takes them."""
    text, label_map = "", None
    if isinstance(seeds, dict):
        text = json.dumps(seeds)
    elif isinstance(seeds, (list, tuple)):
        text = _seed_text(seeds)
    elif seeds is not None:
        label_map = as_volume(seeds, labels=True)._core
    if not 0 <= int(background) <= 65535:
        raise _core.Error(f"background: expected 0 .. 65535, found {background}")
    return text, label_map


def _seed_text(seeds: Any) -> str:
    balls, points = [], []
    try:
        for seed in seeds:
            place = [float(v) for v in seed[1]]
            if len(seed) > 2:
                balls.append({"label": int(seed[0]), "center_mm": place, "radius_mm": float(seed[2])})
            else:
                points.append({"label": int(seed[0]), "at_mm": place})
    except (TypeError, ValueError, IndexError) as error:
        raise _core.Error("seeds: expected a list of (label, (x, y, z)) or (label, (x, y, z), radius)") from error
    return json.dumps({"seeds": 1, "units": "mm", "balls": balls, "points": points})
