"""Pictures: scenes, renderers, and `palpate render` as a function."""

import json
import os
import threading
from typing import Any, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np

from . import _core
from .mesh import Mesh
from .volume import PathLike, Progress, Volume, as_volume

# Options of the device; the others belong to a scene.
_DEVICE = ("device", "residency", "gpu_memory", "sampling", "gradients", "volume_format", "no_skipping", "validate")
_ROLES = ("labels", "fused", "overlay")


class Camera:
    """Position and projection of the viewer, in world millimetres (LPS)."""

    def __init__(
        self,
        eye: Sequence[float],
        target: Sequence[float],
        up: Sequence[float] = (0.0, 0.0, 1.0),
        *,
        view_angle: float = 30.0,
        view_height: float = 200.0,
        orthographic: bool = False,
    ) -> None:
        """view_angle: degrees from bottom to top (perspective); view_height: mm (orthographic)."""
        self.eye, self.target, self.up = _vector(eye, "eye"), _vector(target, "target"), _vector(up, "up")
        self.view_angle, self.view_height = float(view_angle), float(view_height)
        self.orthographic = bool(orthographic)

    def __repr__(self) -> str:
        return f"palpate.Camera(eye={self.eye}, target={self.target}, up={self.up})"


class TransferFunction:
    """Colour and opacity by value: piecewise linear, constant beyond the ends.

    colors: (value, r, g, b) with display values 0 .. 1. opacities: (value, opacity) of a slab of
    opacity_unit_mm; 0 lets the size of the volume decide.
    """

    def __init__(
        self,
        colors: Sequence[Sequence[float]],
        opacities: Sequence[Sequence[float]],
        opacity_unit_mm: float = 1.0,
    ) -> None:
        try:
            self.colors = [[float(v) for v in point] for point in colors]
            self.opacities = [[float(v) for v in point] for point in opacities]
        except (TypeError, ValueError) as error:
            raise _core.Error("a transfer function: expected lists of numbers") from error
        self.opacity_unit_mm = float(opacity_unit_mm)

    def json(self) -> Dict[str, Any]:
        """As in a scene file."""
        return {"colors": self.colors, "opacities": self.opacities, "opacity_unit_mm": self.opacity_unit_mm}


def presets() -> List[str]:
    """Names of transfer functions that `tf` takes."""
    return list(_core.preset_names())


def _vector(value: Any, name: str) -> Tuple[float, float, float]:
    try:
        x, y, z = (float(v) for v in value)
    except (TypeError, ValueError) as error:
        raise _core.Error(f"{name}: expected three numbers, found {value!r}") from error
    return x, y, z


class Scene:
    """A scene with its voxels on the processor: what Renderer.render() draws.

    source: a Volume, what as_volume() takes, or the path of a scene file, a project or a volume.
    Options are those of `palpate render --help` that say what is drawn, with _ for -: mode, iso, tf,
    window, slice, clip, camera, view, size, stereo, background, annotate, values, error, frame_ms, and so
    on. Flags take True. Several values are a list: slice=["axial", "coronal"]; numbers are a tuple:
    size=(800, 600). labels, fused and overlay take volumes, surface takes meshes, tf a TransferFunction or
    a dict, camera a Camera.
    """

    def __init__(self, source: Any, *, progress: Progress = None, **options: Any) -> None:
        for name in _DEVICE:
            if options.get(name) is not None:
                raise _core.Error(f"{name}: expected as an option of a Renderer, not of a Scene")
        volumes: Dict[str, Any] = {}
        meshes: Dict[str, Any] = {}
        from_path = isinstance(source, (str, os.PathLike))
        name = os.fspath(source) if from_path else "volume"
        if not from_path:
            volumes[name] = as_volume(source)._core
        for role in _ROLES:
            value = options.get(role)
            if value is None or (from_path and isinstance(value, (str, os.PathLike))):
                continue
            volumes[f"{role} in memory"] = as_volume(value, labels=role != "fused")._core
            options[role] = f"{role} in memory"
        surfaces = options.get("surface")
        if surfaces is not None and not isinstance(surfaces, (str, os.PathLike)):
            listed = list(surfaces) if isinstance(surfaces, (list, tuple)) else [surfaces]
            for i, one in enumerate(listed):
                if isinstance(one, Mesh):
                    listed[i] = f"/mesh {i} in memory"  # absolute, so that it stays
                    meshes[listed[i]] = one._core
            options["surface"] = listed
        tf = options.get("tf")
        if isinstance(tf, TransferFunction):
            options["tf"] = tf.json()
        camera = options.pop("camera", None)
        if camera is not None and not isinstance(camera, Camera):
            options["camera"] = camera
        self._core = _core.open_scene(options, name, volumes, meshes, progress)
        if isinstance(camera, Camera):
            self.camera = camera

    @property
    def camera(self) -> Camera:
        """The camera; setting it moves the view."""
        return Camera(**self._core.camera())

    @camera.setter
    def camera(self, camera: Camera) -> None:
        if not isinstance(camera, Camera):
            raise _core.Error(f"camera: expected a palpate.Camera, found {type(camera).__name__}")
        self._core.set_camera(
            camera.eye, camera.target, camera.up, camera.view_angle, camera.view_height, camera.orthographic
        )

    def orbit(self, degrees: float) -> None:
        """Turns the camera about its up axis through the target."""
        self._core.orbit(float(degrees))

    def set_volume(self, volume: Volume) -> None:
        """Another snapshot of the volume; a renderer uploads only the bricks that differ."""
        self._core.set_volume(as_volume(volume)._core)

    def json(self) -> Dict[str, Any]:
        """As a scene file, with all options applied."""
        return json.loads(self._core.json())


class Picture:
    """A drawn frame. In a notebook it shows itself."""

    def __init__(self, core: "_core.Picture") -> None:
        self._core = core

    def to_numpy(self, dtype: Any = np.float32) -> np.ndarray:
        """(height, width, 3), or 4 with a transparent background, as saved: marks on, eyes laid out.

        float32: display values, 0 black, 1 white. uint8: the bytes of a PNG.
        """
        if np.dtype(dtype) == np.uint8:
            return self._core.bytes()
        return self._core.floats().astype(dtype, copy=False)

    def __array__(self, dtype: Any = None) -> np.ndarray:
        return self.to_numpy(np.float32 if dtype is None else dtype)

    @property
    def eyes(self) -> List[np.ndarray]:
        """Each eye's picture without marks: (height, width, 4), colours and alpha, float32."""
        return [self._core.eye(i) for i in range(self._core.eye_count)]

    @property
    def value(self) -> np.ndarray:
        """The volume's value behind each pixel, NaN where there is none; of values=True."""
        return self._core.channel("value", 0)

    @property
    def depth(self) -> np.ndarray:
        """Millimetres from the ray's start, NaN where there is none; of values=True."""
        return self._core.channel("depth", 0)

    @property
    def passes(self) -> Dict[str, float]:
        """Milliseconds of the device, by pass."""
        return dict(self._core.passes)

    @property
    def ms(self) -> float:
        """Milliseconds from the start of drawing until the pixels were on the processor."""
        return self._core.ms

    @property
    def error_estimate(self) -> float:
        """Of a frame drawn with frame_ms: RMSE of colour against full quality; 0 without."""
        return self._core.error_estimate

    @property
    def metadata(self) -> Dict[str, str]:
        """What an EXR keeps beside the picture: version, device, driver, hash of the scene."""
        return self._core.metadata

    def save(self, path: PathLike) -> None:
        """Writes .png or .exr: the bytes that `palpate render` writes."""
        _core.Picture.save(self._core, os.fspath(path))

    def _repr_png_(self) -> bytes:
        return self._core.png()


class Renderer:
    """A device that draws many frames. Volumes stay on it, and only bricks that changed are uploaded.

    Options are device, residency, gpu_memory, sampling, gradients, volume_format, no_skipping and validate
    of `palpate render --help`. Any thread may use it; one frame is drawn at a time.
    """

    def __init__(self, **options: Any) -> None:
        for name in options:
            if name not in _DEVICE:
                raise _core.Error(f"{name}: expected an option of a Renderer, one of {', '.join(_DEVICE)}")
        self._core = _core.Renderer(options)

    def render(self, scene: Union[Scene, Any], *, progress: Progress = None, **options: Any) -> Picture:
        """Draws a Scene, or what Scene() takes with its options."""
        if not isinstance(scene, Scene):
            scene = Scene(scene, **options)
        elif options:
            raise _core.Error(f"{next(iter(options))}: expected as an option of the Scene that is drawn")
        return Picture(self._core.render(scene._core, progress))

    @property
    def device(self) -> str:
        """The Vulkan device's name."""
        return self._core.device

    def close(self) -> None:
        """Frees the device. Drawing is an Error afterwards."""
        self._core.close()

    def __enter__(self) -> "Renderer":
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()


_lock = threading.Lock()
_kept: "Optional[Tuple[Tuple[Tuple[str, str], ...], Renderer]]" = None


def _renderer(options: Dict[str, Any]) -> Renderer:
    global _kept
    key = tuple(sorted((name, str(value)) for name, value in options.items()))
    with _lock:
        if _kept is None or _kept[0] != key:
            _kept = (key, Renderer(**options))
        return _kept[1]


def release() -> None:
    """Frees the renderer, and the volume on its device, that render() keeps from one call to the next."""
    global _kept
    with _lock:
        _kept = None


def render(source: Any, *, progress: Progress = None, **options: Any) -> Picture:
    """Draws a picture: `palpate render` with its options as keywords.

    source and options: those of Scene() and of Renderer(). The bytes of a saved picture are those of the
    command line. The device is kept for the next call with the same options of it (release() frees it).
    """
    of_device = {name: options.pop(name) for name in _DEVICE if options.get(name) is not None}
    scene = source if isinstance(source, Scene) and not options else Scene(source, **options)
    return _renderer(of_device).render(scene, progress=progress)
