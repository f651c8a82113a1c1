"""Meshes: surfaces of volumes and of labels, as arrays."""

import json
import os
from typing import Any, Dict, Optional, Sequence

import numpy as np

from . import _core
from .volume import PathLike, Progress, as_volume


class Mesh:
    """Triangles that share vertices, in world millimetres (LPS)."""

    def __init__(self, vertices: Any, triangles: Any = None) -> None:
        """vertices: (n, 3) millimetres; triangles: (m, 3) vertex numbers, counter-clockwise from outside."""
        if isinstance(vertices, _core.Mesh):
            self._core = vertices
            return
        try:
            self._core = _core.Mesh.from_arrays(np.asarray(vertices, dtype=float), np.asarray(triangles, dtype=np.int64))
        except (TypeError, ValueError) as error:
            raise _core.Error("expected vertices and triangles as arrays of n x 3 numbers") from error

    @property
    def vertices(self) -> np.ndarray:
        """(n, 3), float64, mm."""
        return self._core.vertices

    @property
    def triangles(self) -> np.ndarray:
        """(m, 3), uint32: numbers of vertices."""
        return self._core.triangles

    @property
    def normals(self) -> np.ndarray:
        """(n, 3), of unit length, outward; (0, 3) where the mesh has none."""
        return self._core.normals

    @property
    def labels(self) -> np.ndarray:
        """(m,): the label that a triangle encloses; empty where the mesh has none."""
        return self._core.labels

    @property
    def outer_labels(self) -> np.ndarray:
        """(m,): the label on a triangle's other side; empty where the mesh has none."""
        return self._core.outer_labels

    def of_label(self, label: int) -> "Mesh":
        """The closed surface of one label of a mesh with labels."""
        if not 0 <= int(label) <= 65535:
            raise _core.Error(f"label: expected 0 .. 65535, found {label}")
        return Mesh(self._core.of_label(int(label)))

    def topology(self) -> Dict[str, Any]:
        """Counts, Euler number, open edges, area and volume."""
        return json.loads(self._core.topology())

    def smooth(self, kind: str = "taubin", passes: int = 10) -> "Mesh":
        """A smoothed mesh; kind: mean (shrinks), taubin or sinc."""
        return Mesh(self._core.smoothed(kind, _count(passes, "passes")))

    def decimate(
        self, error_mm: Optional[float] = None, triangles: int = 0, *, progress: Progress = None
    ) -> "Mesh":
        """Fewer triangles: none farther from this mesh than error_mm, or down to a number."""
        if error_mm is None and triangles == 0:
            raise _core.Error("expected error_mm or triangles, found neither")
        error = float("inf") if error_mm is None else float(error_mm)
        return Mesh(self._core.decimated(error, _count(triangles, "triangles"), progress))

    def save(self, path: PathLike, *, ascii: bool = False) -> None:
        """Writes .ply, .stl, .obj or .vtp."""
        _core.save_mesh(os.fspath(path), self._core, ascii)

    def to_trimesh(self) -> Any:
        """A trimesh.Trimesh."""
        import trimesh

        return trimesh.Trimesh(self.vertices, self.triangles, process=False)

    def to_meshio(self) -> Any:
        """A meshio.Mesh."""
        import meshio

        return meshio.Mesh(self.vertices, [("triangle", self.triangles)])

    def to_pyvista(self) -> Any:
        """A pyvista.PolyData."""
        import pyvista

        threes = np.full((len(self.triangles), 1), 3)
        return pyvista.PolyData(self.vertices, np.hstack([threes, self.triangles]).ravel())

    def __repr__(self) -> str:
        return f"<palpate.Mesh {len(self.triangles)} triangles, {len(self.vertices)} vertices>"


def _count(value: Any, name: str) -> int:
    if not 0 <= int(value) <= 0xFFFFFFFF:
        raise _core.Error(f"{name}: expected 0 or above, found {value}")
    return int(value)


def surface(
    volume: Any, iso: float, *, topology: str = "classic", closed: bool = False, progress: Progress = None
) -> Mesh:
    """The iso-surface by marching cubes. topology: classic, or correct. closed: also at the border."""
    if topology not in ("classic", "correct"):
        raise _core.Error(f"topology: expected classic or correct, found {topology!r}")
    return Mesh(_core.surface(as_volume(volume)._core, float(iso), topology == "correct", bool(closed), progress))


def labels_to_meshes(
    labels: Any, only: Optional[Sequence[int]] = None, *, passes: int = 10, progress: Progress = None
) -> Dict[int, Mesh]:
    """The closed surface of each label but 0, by surface nets: neighbours share their walls.

    passes: of smoothing, which moves no vertex by more than 0.375 of a sample. only: labels that are
    wanted; one without a sample is an Error.
    """
    volume = as_volume(labels, labels=True)
    walls = Mesh(_core.label_walls(volume._core, _count(passes, "passes"), progress))
    there = sorted((set(walls.labels.tolist()) | set(walls.outer_labels.tolist())) - {0})
    wanted = there if only is None else [int(label) for label in only]
    for label in wanted:
        if label not in there:
            raise _core.Error(f"only: no sample has label {label}")
    return {label: walls.of_label(label) for label in wanted}


def load_mesh(path: PathLike) -> Mesh:
    """Reads .ply, .stl, .obj or .vtp."""
    return Mesh(_core.load_mesh(os.fspath(path)))
