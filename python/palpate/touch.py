"""Touch: a simulated hand on a simulated device, and a servo for devices written in Python."""

import json
import os
import time
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Protocol, Sequence, Tuple

import numpy as np

from . import _core
from .picture import TransferFunction
from .volume import Progress, Volume, as_volume, number

CONTACTS = ("free", "touching", "yielding", "submerged", "unknown")
"""Names of the numbers in `Touched.contact`."""

_TEXTS = ("algorithm", "source", "mesh", "felt_tool", "tool", "edit")
_CURVES = ("transfer", "transfer_across", "opacity")


class Touched(NamedTuple):
    """What a hand felt: one row a tick of the servo, n in all. World millimetres (LPS) and newtons."""

    time_s: np.ndarray
    """(n,): seconds since the path began."""
    tool: np.ndarray
    """(n, 3): where the hand holds the tool, mm."""
    proxy: np.ndarray
    """(n, 3): where the tool would be if it could not enter, mm."""
    force: np.ndarray
    """(n, 3): force on the hand as sent to the device, N, in world axes."""
    normal: np.ndarray
    """(n, 3): out of the material, unit length; 0 where none is known."""
    depth: np.ndarray
    """(n,): distance from tool to proxy, mm."""
    energy: np.ndarray
    """(n,): work done on the hand since the start, mJ; above 0 the loop added energy."""
    contact: np.ndarray
    """(n,): index into CONTACTS."""
    label: np.ndarray
    """(n,): label that is touched, where the algorithm tells it; 0 is none."""
    buttons: np.ndarray
    """(n,): bit b: button b is pressed."""
    faults: np.ndarray
    """(n,): bits of the safety chain; 0 is none."""
    volume: Volume
    """As it is after the tool has cut."""
    strokes: int
    """How many strokes the tool made."""
    fault_names: str
    """All faults that were seen, in words."""


def touch_algorithms() -> List[str]:
    """Names that `algorithm` takes."""
    return list(_core.touch_algorithms())


def touch_devices() -> List[str]:
    """Names of simulated devices."""
    return list(_core.touch_devices())


def _curve(value: Any) -> str:
    """A text as on the command line; or pairs (value, force or opacity) as VALUE:FORCE,..."""
    if isinstance(value, TransferFunction):
        value = value.opacities
    if isinstance(value, (str, int, float)):
        return value if isinstance(value, str) else number(value)
    return ",".join(f"{number(at)}:{number(then)}" for at, then in value)


def _label_feel(value: Any) -> str:
    """Rows (label, stiffness[, friction[, T0]]), or one, or texts as on the command line."""
    rows = [value] if isinstance(value, str) or not hasattr(next(iter(value)), "__iter__") else list(value)
    return ";".join(row if isinstance(row, str) else ",".join(map(number, row)) for row in rows)


def _split(options: Dict[str, Any]) -> Tuple[Dict[str, float], Dict[str, str]]:
    numbers: Dict[str, float] = {}
    texts: Dict[str, str] = {}
    for name, value in options.items():
        if value is None:
            continue
        if name in _TEXTS:
            texts[name] = json.dumps(value) if isinstance(value, dict) else os.fspath(value)
            continue
        if name in _CURVES or name == "label_feel":
            try:
                texts[name] = _label_feel(value) if name == "label_feel" else _curve(value)
            except (TypeError, ValueError, StopIteration) as error:
                raise _core.Error(f"{name}: expected numbers, pairs or rows of them, found {value!r}") from error
            continue
        try:
            numbers[name] = float(value)
        except (TypeError, ValueError) as error:
            raise _core.Error(f"{name}: expected a number, found {value!r}") from error
    return numbers, texts


def _labels(labels: Any) -> "Optional[_core.Volume]":
    return None if labels is None else as_volume(labels, labels=True)._core


def touch(
    volume: Any,
    path: Any,
    *,
    labels: Any = None,
    device: str = "falcon",
    progress: Progress = None,
    **options: Any,
) -> Touched:
    """Runs the haptic loop on a virtual clock: the same input gives the same bits.

    path: where the hand means to be, an array of rows (time_s, x, y, z), mm in world space (LPS), and
    optionally a column of buttons, and four of a rotation (qw, qx, qy, qz). Force fades in before the path
    begins, so its first pose should be free. device: one of touch_devices().

    Options are those of `palpate touch --help` with _ for -: its settings, such as iso, stiffness (N/m), friction
    and friction_dynamic, yield_force (N) for --yield; rate (Hz), scale, delay (ticks), grip; algorithm, source
    ("grey" or "labels"), mesh (a file), felt_tool (a shape). With button 0 pressed, `drill` (mm) cuts with
    a ball, or `tool` (a shape) does the operation `edit`; shapes and operations are dicts as in stroke files.

    label_feel: rows (label, stiffness[, friction[, T0]]) of labels that feel otherwise. transfer and
    transfer_across (of wish-2008-*): pairs (value, force in N), a number, or a text as on the command line.
    opacity (of koerner-1999, swept-local and swept-mesh): pairs (value, opacity), or a TransferFunction.
    """
    try:
        rows = np.ascontiguousarray(path, dtype=float)
    except (TypeError, ValueError) as error:
        raise _core.Error("path: expected an array of numbers") from error
    numbers, texts = _split(options)
    felt = _core.touch(as_volume(volume)._core, _labels(labels), rows, device, numbers, texts, progress)
    felt["volume"] = Volume(felt["volume"])
    return Touched(**felt)


class Felt(NamedTuple):
    """One tick of a Servo."""

    force: Tuple[float, float, float]
    """On the hand, N, in the device's axes."""
    tool: Tuple[float, float, float]
    """World mm."""
    proxy: Tuple[float, float, float]
    """World mm."""
    depth: float
    """Distance from tool to proxy, mm."""
    contact: str
    """One of CONTACTS."""
    share: float
    """Of the soft start: 0 no force yet, 1 all of it."""
    faults: str
    """In words; "none"."""


class Device(Protocol):
    """What Servo.run() needs of a device: its axes are those of the world, its origin the servo's centre."""

    def read(self) -> Sequence[float]:
        """Where the handle is, mm: (x, y, z), or (x, y, z, buttons)."""

    def write(self, force: Tuple[float, float, float]) -> None:
        """Force on the hand from now on, N."""


class Servo:
    """The servo loop with its safety chain, for a device that is written in Python. Trials alone.

    Not real time: Python pauses for milliseconds when it likes, and a stiff surface needs a tick each
    millisecond. Devices that people hold are driven by `palpate touch --live` and `palpate view`.

    center: the place in the volume, world mm, that the device's origin shows; its middle by default.
    reach: half of the device's workspace on each axis, mm. max_force: N. Options as of touch().
    Force fades in over two seconds once the tool is free.
    """

    def __init__(
        self,
        volume: Any,
        *,
        labels: Any = None,
        center: Optional[Sequence[float]] = None,
        reach: float = 50.0,
        max_force: float = 8.0,
        **options: Any,
    ) -> None:
        felt = as_volume(volume)
        if center is None:
            middle = [(n - 1) / 2 for n in felt.shape]
            center = (felt.affine @ [*middle, 1.0])[:3]
        numbers, texts = _split(options)
        try:
            x, y, z = (float(v) for v in center)
            self._core = _core.Servo(
                felt._core, _labels(labels), (x, y, z), float(reach), float(max_force), numbers, texts
            )
        except (TypeError, ValueError) as error:
            raise _core.Error("center, reach, max_force: expected numbers") from error

    def tick(self, time_s: float, position: Sequence[float], buttons: int = 0) -> Felt:
        """The force for a handle at `position`, mm in the device's axes, at a time that rises."""
        try:
            x, y, z = (float(v) for v in position)
            found = self._core.tick(float(time_s), (x, y, z), int(buttons))
        except (TypeError, ValueError) as error:
            raise _core.Error("time, position, buttons: expected numbers") from error
        contact = CONTACTS[found.pop("contact")]
        force, tool, proxy = (tuple(found.pop(name)) for name in ("force", "tool", "proxy"))
        return Felt(force=force, tool=tool, proxy=proxy, contact=contact, **found)

    def arm(self) -> None:
        """Clears faults; force fades in anew."""
        self._core.arm()

    def run(
        self,
        device: Device,
        seconds: float,
        *,
        rate: float = 500.0,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> List[Felt]:
        """Reads the device, computes and writes its force, `rate` times a second as far as Python keeps up.

        Ends with a force of 0, also where the device raises.
        """
        felt: List[Felt] = []
        start = clock()
        try:
            last = -1.0
            while (now := clock() - start) < seconds:
                if now > last:
                    *position, buttons = [*device.read(), 0][:4]
                    felt.append(self.tick(now, position, int(buttons)))
                    device.write(felt[-1].force)
                    last = now
                sleep(max(0.0, start + now + 1.0 / rate - clock()))
        finally:
            device.write((0.0, 0.0, 0.0))
        return felt
