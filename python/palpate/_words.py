"""Keyword arguments as words of the command line, whose table of options is the only one."""

import json
import math
import os
import re
from typing import Any, Iterable, List

from . import _core


def number(value: Any) -> str:
    """A number with all its digits; a whole one without a point, for those that must be whole."""
    if hasattr(value, "__index__"):
        return str(value.__index__())
    as_float = float(value)
    return repr(int(as_float)) if math.isfinite(as_float) and as_float == int(as_float) else repr(as_float)


def _text(value: Any) -> str:
    """One value: a number with all its digits, numbers joined by commas, or a text."""
    if isinstance(value, (str, os.PathLike)):
        return os.fspath(value)
    if isinstance(value, dict):
        return json.dumps(value)
    if hasattr(value, "__iter__"):
        return ",".join(_text(item) for item in value)
    return number(value)


def _is_one(value: Any) -> bool:
    """Whether a value is one word: a text, a number, or a sequence of numbers."""
    if isinstance(value, (str, os.PathLike, dict)) or not hasattr(value, "__iter__"):
        return True
    return all(not isinstance(v, (str, os.PathLike)) and not hasattr(v, "__iter__") for v in value)


def words(options: "dict[str, Any]") -> List[str]:
    """``mode="iso", clip=[(..), (..)], values=True`` as ``--mode=iso --clip=.. --clip=.. --values``."""
    out: List[str] = []
    for name, value in options.items():
        if not re.fullmatch(r"[a-z][a-z0-9_-]*", name):
            raise _core.Error(_unknown(name))
        flag = "--" + name.replace("_", "-")
        if value is None or value is False:
            continue
        if value is True:
            out.append(flag)
            continue
        try:
            values: Iterable[Any] = [value] if _is_one(value) else list(value)
            out.extend(f"{flag}={_text(item)}" for item in values)
        except (TypeError, ValueError) as error:
            raise _core.Error(f"{name}: expected a number, a text or a list, found {value!r}") from error
    return out


def as_typed(text: str, options: "dict[str, Any]") -> str:
    """A sentence about options of the command line, with their names as they were typed here."""
    for name in sorted(options, key=len, reverse=True):
        flag = rf"(?<![\w-])--{re.escape(name.replace('_', '-'))}(?![\w-])"
        if " not expected: " in text and re.search(flag, text):
            return _unknown(name)
        text = re.sub(flag, lambda _: name, text)
    return in_python(text)


def _unknown(name: str) -> str:
    return f"{name}: expected an option of palpate render by name, with _ for -; none has this name"


def in_python(text: str) -> str:
    """The same sentence with options by the names that they have here."""
    return re.sub(r"(?<![\w-])--([a-z][a-z-]*)", lambda m: m.group(1).replace("-", "_"), text)
