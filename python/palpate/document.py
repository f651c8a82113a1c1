"""Documents: volumes that are edited together by strokes of tools, with undo and a journal."""

import json
import os
from typing import Any, Dict, List, Mapping, Optional, Union

import numpy as np

from . import _core
from .volume import PathLike, Progress, Volume, as_volume


def _within_mask(operation: Dict[str, Any], mask: Dict[str, Any]) -> Dict[str, Any]:
    twice = sorted(set(operation) & set(mask) - {"kind"})
    if twice:
        raise _core.Error(f"mask: the operation has {twice[0]} of its own")
    overwrites = operation.get("kind") in ("draw", "dilate", "smooth", "fill")
    return {**operation, **{k: v for k, v in mask.items() if k != "over" or overwrites}}


class Document:
    """Named volumes with one history. Any thread may use it; one call works at a time.

    volumes: a volume, which is then named "volume", or a mapping of names to volumes. labels: names of
    those that are label maps. journal: a file that keeps each stroke before the next begins; recover=True
    goes on with one that is there. Where the result is saved, end_journal() removes it.
    """

    def __init__(
        self,
        volumes: Union[Any, Mapping[str, Any]],
        *,
        labels: Union[bool, List[str]] = False,
        journal: Optional[PathLike] = None,
        recover: bool = False,
    ) -> None:
        named = dict(volumes) if isinstance(volumes, Mapping) else {"volume": volumes}
        kinds = {n: labels if isinstance(labels, bool) else n in labels for n in named}
        parts = [(n, as_volume(v, labels=kinds[n])._core, kinds[n]) for n, v in named.items()]
        self._core = _core.Document(parts, "" if journal is None else os.fspath(journal), recover)

    def __getitem__(self, name: str) -> Volume:
        """The volume of this name as it is now."""
        return Volume(self._core.volume(name))

    @property
    def volume(self) -> Volume:
        """The first volume as it is now."""
        return self[self.names[0]]

    @property
    def names(self) -> List[str]:
        """Names of the volumes."""
        return self._core.names()

    def stroke(
        self,
        shape: Dict[str, Any],
        operation: Dict[str, Any],
        positions: Any,
        *,
        times: Any = None,
        rotations: Any = None,
        on: Optional[str] = None,
        guide: str = "",
        mask: Optional[Dict[str, Any]] = None,
        progress: Progress = None,
    ) -> str:
        """Moves a tool along positions (n, 3), in mm (LPS), and applies its operation.

        shape and operation: as in a stroke file, {"kind": "ball", "radius_mm": 3} and {"kind": "cut"}.
        mask: keys of operations that confine any edit, such as {"inside": [3]}, {"outside": "any"},
        {"only_values": [0, 90]} and {"over": [0]}; the operation itself then has none of them.
        times: seconds, rising (needed by mill; 1 ms apart else); rotations: quaternions w, x, y, z.
        Returns a sentence where no sample changed, else "".
        """
        try:
            places = np.asarray(positions, dtype=float).reshape(-1, 3)
            seconds = np.arange(len(places)) * 1e-3 if times is None else np.asarray(times, dtype=float)
            turns = None if rotations is None else np.asarray(rotations, dtype=float).reshape(-1, 4)
        except (TypeError, ValueError) as error:
            raise _core.Error("positions: expected n x 3 numbers, with n times and n x 4 rotations") from error
        if seconds.shape != (len(places),) or (turns is not None and len(turns) != len(places)):
            raise _core.Error(f"expected one time and one rotation for each of {len(places)} positions")
        if not (np.isfinite(places).all() and np.isfinite(seconds).all()):
            raise _core.Error("positions and times: expected finite numbers")
        operation = _within_mask(operation, mask or {})
        lines = [json.dumps({"stroke": 1, "units": "mm", "shape": shape, "operation": operation})]
        for i, place in enumerate(places):
            pose: Dict[str, Any] = {"t_s": seconds[i], "p_mm": place.tolist()}
            if turns is not None:
                pose["q"] = turns[i].tolist()
            lines.append(json.dumps(pose))
        idle = self.apply("\n".join(lines) + "\n", on=on, guide=guide, progress=progress)
        return idle[0] if idle else ""

    def apply(
        self, strokes: str, *, on: Optional[str] = None, guide: str = "", progress: Progress = None
    ) -> List[str]:
        """Applies the text of a stroke file, all of it or nothing. A sentence for each stroke that changed nothing."""
        return self._core.apply(strokes, on or self.names[0], guide, progress)[1]

    def put(self, name: str, volume: Any, *, labels: bool = False, title: str = "put") -> None:
        """A step that puts a volume in the place of the one of this name, or beside the others."""
        self._core.put(name, as_volume(volume, labels=labels)._core, labels, title)

    def undo(self) -> None:
        """Takes the newest step back."""
        self._core.undo()

    def redo(self) -> None:
        """Does again what was undone last."""
        self._core.redo()

    @property
    def undo_steps(self) -> int:
        """How many steps can be taken back."""
        return self._core.steps()[0]

    @property
    def redo_steps(self) -> int:
        """How many steps can be done again."""
        return self._core.steps()[1]

    @property
    def history(self) -> List[str]:
        """Titles of all steps, the oldest first; those that can be redone come last."""
        return self._core.titles()

    def end_journal(self) -> None:
        """Removes the journal: its strokes are saved elsewhere, or not wanted."""
        self._core.end_journal()
