"""Volumes: arrays, files, and the images of other packages."""

import math
import os
import sys
from typing import Any, Callable, Dict, Optional, Tuple, Union

import numpy as np

from . import _core, _program  # noqa: F401  (_program finds the decoder)

Progress = Optional[Callable[[float], Any]]
PathLike = Union[str, "os.PathLike[str]"]

_FLIP_XY = np.diag([-1.0, -1.0, 1.0, 1.0])
_TYPES = {"u8": np.uint8, "i8": np.int8, "u16": np.uint16, "i16": np.int16, "f32": np.float32}


def number(value: Any) -> str:
    """A number with all its digits; a whole one without a point, for those that must be whole."""
    if hasattr(value, "__index__"):
        return str(value.__index__())
    as_float = float(value)
    return repr(int(as_float)) if math.isfinite(as_float) and as_float == int(as_float) else repr(as_float)


def _lps(affine: Any, space: str) -> np.ndarray:
    try:
        matrix = np.array(affine, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise _core.Error("affine: expected a matrix of 4 x 4 numbers") from error
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
        raise _core.Error(f"affine: expected 4 x 4 finite numbers, found a shape of {matrix.shape}")
    if not np.array_equal(matrix[3], [0, 0, 0, 1]):
        raise _core.Error("affine: expected 0, 0, 0, 1 as its last row")
    if space not in ("LPS", "RAS"):
        raise _core.Error(f"space: expected 'LPS' or 'RAS', found {space!r}")
    return matrix if space == "LPS" else _FLIP_XY @ matrix


class Volume:
    """An immutable volume. Made by load(), Volume.from_numpy() and as_volume(); copying it is free.

    Samples are u8, i8, u16, i16 or f32. NaN is "no data".
    """

    def __init__(self, core: "_core.Volume") -> None:
        if not isinstance(core, _core.Volume):
            raise _core.Error("a Volume is made by palpate.load() or palpate.Volume.from_numpy()")
        self._core = core

    @staticmethod
    def from_numpy(
        array: Any,
        affine: Any = None,
        space: str = "LPS",
        *,
        spacing: Optional[Tuple[float, float, float]] = None,
        modality: str = "",
        labels: bool = False,
    ) -> "Volume":
        """A volume of an array (x, y, z), which is copied.

        affine: 4 x 4, from indices to millimetres of `space`, "LPS" or "RAS"; without it `spacing` (mm)
        along the axes, else 1 mm. modality: "CT" lets presets take values as HU. Types that a volume
        stores are kept; others become the smallest that holds every value, or f32 with a palpate.Warning
        that states the rounding. labels: whole numbers in 0 .. 65535, as u8 or u16.
        """
        try:
            samples = np.asarray(array)
        except (TypeError, ValueError) as error:
            raise _core.Error(f"expected an array, found {type(array).__name__}") from error
        if affine is not None and spacing is not None:
            raise _core.Error("expected affine or spacing, found both")
        if affine is None:
            mm = np.ones(3) if spacing is None else np.asarray(spacing, dtype=np.float64)
            if mm.shape != (3,) or not (np.isfinite(mm).all() and (mm > 0).all()):
                raise _core.Error(f"spacing: expected 3 numbers above 0, found {spacing!r}")
            affine = np.diag([*mm, 1.0])
        matrix = _lps(affine, space)
        if samples.dtype == np.bool_:
            samples = samples.view(np.uint8)
        elif samples.dtype == np.float16:
            samples = samples.astype(np.float32)
        samples = np.asfortranarray(samples, dtype=samples.dtype.newbyteorder("="))
        return Volume(_core.Volume.from_array(samples, matrix, str(modality), bool(labels)))

    def to_numpy(self) -> np.ndarray:
        """The samples as an array (x, y, z) in the volume's own type: a copy, column-major.

        A copy because a volume lies in bricks of 32^3 samples, which versions of it share.
        """
        return self.box((0, 0, 0), self.shape)

    def box(self, first: Tuple[int, int, int], size: Tuple[int, int, int]) -> np.ndarray:
        """A box of samples, first .. first + size - 1, as to_numpy(); reads those bricks alone."""
        try:
            return self._core.array(tuple(map(int, first)), tuple(map(int, size)))
        except (TypeError, ValueError) as error:
            raise _core.Error(f"expected three whole numbers each, found {first!r}, {size!r}") from error

    def __array__(self, dtype: Any = None) -> np.ndarray:
        array = self.to_numpy()
        return array if dtype is None else array.astype(dtype)

    def __dlpack__(self, stream: Any = None) -> Any:
        return self.to_numpy().__dlpack__()

    def __dlpack_device__(self) -> Tuple[int, int]:
        return (1, 0)  # processor memory

    @property
    def shape(self) -> Tuple[int, int, int]:
        """Samples along x, y and z."""
        return self._core.shape

    @property
    def dtype(self) -> np.dtype:
        """The type of the samples."""
        return np.dtype(_TYPES[self._core.type])

    @property
    def affine(self) -> np.ndarray:
        """4 x 4: from indices to millimetres, LPS."""
        return self._core.affine

    @property
    def affine_ras(self) -> np.ndarray:
        """The same in RAS, as nibabel has it."""
        return _FLIP_XY @ self._core.affine

    @property
    def spacing(self) -> Tuple[float, float, float]:
        """Distance between neighbouring samples along each axis, mm."""
        return self._core.spacing

    @property
    def range(self) -> Tuple[float, float]:
        """Lowest and highest value, no data left out."""
        return self._core.range

    @property
    def no_data_count(self) -> int:
        """How many samples have no data (NaN)."""
        return self._core.no_data_count

    @property
    def version(self) -> int:
        """A number of this snapshot; a later one has a higher number."""
        return self._core.version

    @property
    def modality(self) -> str:
        """As DICOM names it: "CT", "MR"; empty where unknown."""
        return self._core.modality

    @property
    def label_names(self) -> Dict[int, str]:
        """Names of labels, where the file states them."""
        return self._core.label_names

    def to_nibabel(self) -> Any:
        """A nibabel.Nifti1Image: a copy of the samples, and the affine in RAS."""
        import nibabel

        return nibabel.Nifti1Image(self.to_numpy(), self.affine_ras)

    def to_sitk(self) -> Any:
        """A SimpleITK image: a copy. Sheared axes are refused, because it has none."""
        import SimpleITK

        image = SimpleITK.GetImageFromArray(np.ascontiguousarray(self.to_numpy().T))
        spacing, direction, origin = self._itk_geometry()
        image.SetSpacing(spacing)
        image.SetDirection(direction.ravel().tolist())
        image.SetOrigin(origin)
        return image

    def to_itk(self) -> Any:
        """An ITK image: a copy. Sheared axes are refused, because it has none."""
        import itk

        image = itk.image_from_array(np.ascontiguousarray(self.to_numpy().T))
        spacing, direction, origin = self._itk_geometry()
        image.SetSpacing(spacing)
        image.SetDirection(itk.matrix_from_array(direction))
        image.SetOrigin(origin)
        return image

    def to_xarray(self) -> Any:
        """An xarray.DataArray with dims x, y, z; its attributes hold affine (LPS), spacing and modality."""
        import xarray

        return xarray.DataArray(
            self.to_numpy(),
            dims=("x", "y", "z"),
            attrs={"affine": self.affine, "spacing": self.spacing, "modality": self.modality},
        )

    def _itk_geometry(self) -> "Tuple[list, np.ndarray, list]":
        spacing = np.array(self.spacing)
        direction = self.affine[:3, :3] / spacing
        if not np.allclose(direction.T @ direction, np.eye(3), atol=1e-6):
            raise _core.Error("expected axes at right angles, found sheared ones, which ITK's images lack")
        return spacing.tolist(), direction, self.affine[:3, 3].tolist()

    def __repr__(self) -> str:
        size = " x ".join(map(str, self.shape))
        mm = " x ".join(f"{v:.4g}" for v in self.spacing)
        kind = f", {self.modality}" if self.modality else ""
        return f"<palpate.Volume {size} {self._core.type}, {mm} mm, {self.range[0]:g} .. {self.range[1]:g}{kind}>"


def _root(value: Any) -> str:
    return type(value).__module__.split(".")[0]


def as_volume(value: Any, *, labels: bool = False) -> Volume:
    """A Volume of a Volume, a path, or an image of nibabel, SimpleITK, ITK or xarray; else of an array.

    nibabel: RAS affines become LPS; values are the scaled ones. xarray: dims in any order, named x, y, z;
    attributes `affine` (LPS) or `spacing`, else spacing from the coordinates. Arrays, also of packages
    that know DLPack: as Volume.from_numpy() with a spacing of 1 mm.
    """
    if isinstance(value, Volume):
        return value
    if isinstance(value, (str, os.PathLike)):
        return load(value, labels=labels)
    if hasattr(value, "dataobj") and hasattr(value, "affine"):  # nibabel
        data = np.asanyarray(value.dataobj)
        if data.ndim == 4 and data.shape[3] == 1:
            data = data[..., 0]
        return Volume.from_numpy(data, value.affine, "RAS", labels=labels)
    if hasattr(value, "GetSpacing") and hasattr(value, "GetDirection"):  # SimpleITK, ITK
        module = sys.modules.get(_root(value))
        view = getattr(module, "GetArrayViewFromImage", None) or getattr(module, "array_view_from_image", None)
        if view is None:
            raise _core.Error(f"expected an image of SimpleITK or ITK, found {type(value).__name__}")
        zyx = np.asarray(view(value))
        if zyx.ndim != 3:
            raise _core.Error(f"expected an image of 3 dimensions, found {zyx.ndim}")
        affine = np.eye(4)
        affine[:3, :3] = np.asarray(value.GetDirection(), dtype=float).reshape(3, 3) @ np.diag(
            np.asarray(value.GetSpacing(), dtype=float)
        )
        affine[:3, 3] = np.asarray(value.GetOrigin(), dtype=float)
        return Volume.from_numpy(zyx.T, affine, labels=labels)
    if hasattr(value, "dims") and hasattr(value, "coords"):  # xarray
        if set(value.dims) != {"x", "y", "z"}:
            raise _core.Error(f"expected the dims x, y and z, found {tuple(value.dims)}")
        return Volume.from_numpy(
            value.transpose("x", "y", "z").values,
            _xarray_affine(value),
            modality=str(value.attrs.get("modality", "")),
            labels=labels,
        )
    if not hasattr(value, "__array__") and hasattr(value, "__dlpack__"):
        value = np.from_dlpack(value)
    return Volume.from_numpy(value, labels=labels)


def _xarray_affine(value: Any) -> np.ndarray:
    if "affine" in value.attrs:
        return value.attrs["affine"]
    affine = np.eye(4)
    if "spacing" in value.attrs:
        affine[:3, :3] = np.diag(np.asarray(value.attrs["spacing"], dtype=float))
        return affine
    for axis, name in enumerate("xyz"):
        if name not in value.coords or len(value.coords[name]) < 2:
            continue
        places = np.asarray(value.coords[name], dtype=float)
        steps = np.diff(places)
        if not np.allclose(steps, steps[0], rtol=1e-6, atol=0):
            raise _core.Error(f"expected even steps along {name}, found {steps.min():g} .. {steps.max():g}")
        affine[axis, axis], affine[axis, 3] = steps[0], places[0]
    return affine


def load(
    path: PathLike,
    *,
    labels: bool = False,
    frame: Optional[int] = None,
    series: str = "",
    resample_slices: bool = False,
    max_memory_mib: float = 0.0,
    progress: Progress = None,
) -> Volume:
    """Reads a file, a DICOM folder, slices by a pattern, a project, or makes "synthetic:NAME".

    Every format but brick files is decoded in a child process, so that a damaged file is an Error and
    nothing worse. labels: whole numbers in 0 .. 65535. frame: of a 4-D file. series: DICOM, by its number,
    UID or a part of its description. progress: called with a share of 0 .. 1.
    """
    if frame is not None and not 0 <= int(frame) <= 0xFFFFFFFF:
        raise _core.Error(f"frame: expected 0 or above, found {frame}")
    if not (max_memory_mib >= 0):
        raise _core.Error(f"max_memory_mib: expected 0 or above, found {max_memory_mib}")
    return Volume(
        _core.load(os.fspath(path), labels, frame, series, resample_slices, float(max_memory_mib), progress)
    )


def load_structures(path: PathLike, reference: PathLike, *, series: str = "", progress: Progress = None) -> Volume:
    """Reads a DICOM structure set (RTSTRUCT) as labels on the grid of the series that `reference` names.

    series: which one of `reference`, as load() takes it.
    """
    return Volume(_core.load_structures(os.fspath(path), os.fspath(reference), series, progress))


def save(path: PathLike, volume: Any, *, progress: Progress = None) -> None:
    """Writes .nii, .nii.gz, .nrrd, .mha, .mhd, .vtk or .pbv; whole or not at all."""
    _core.save(os.fspath(path), as_volume(volume)._core, progress)


def save_dicom(
    path: PathLike,
    labels: Any,
    reference: PathLike,
    *,
    kind: str = "seg",
    names: Optional[Dict[int, str]] = None,
    codes: Optional[PathLike] = None,
    series: str = "",
    progress: Progress = None,
) -> None:
    """Writes labels as a DICOM object of the series that they were made on; whole or not at all.

    reference: the series, a folder or a file; series: which one of several, as load() takes it. kind: "seg",
    "seg-fractional", "seg-labelmap" or "rtstruct". names: of labels; those that the volume has are kept.
    codes: a table as `palpate convert --codes` takes it.
    """
    _core.save_dicom(
        os.fspath(path),
        as_volume(labels, labels=True)._core,
        names or {},
        os.fspath(reference),
        series,
        kind,
        os.fspath(codes) if codes is not None else "",
        progress,
    )
