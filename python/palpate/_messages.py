"""Messages of the libraries, as Python shows them."""

import logging
import sys
import warnings

_LOGGER = logging.getLogger("palpate")
_LEVELS = {0: logging.DEBUG, 1: logging.INFO, 2: logging.WARNING, 3: logging.ERROR}


class Warning(UserWarning):
    """What a library assumed, lost or could not use; one sentence."""


def tell(level: int, text: str) -> None:
    """Called by _core after its work, in the thread that asked for it."""
    if level != 2:
        _LOGGER.log(_LEVELS[level], "%s", text)
        return
    depth, frame = 1, sys._getframe(0)
    while frame.f_back and frame.f_globals.get("__name__", "").startswith("palpate."):
        depth, frame = depth + 1, frame.f_back
    warnings.warn(text, Warning, stacklevel=depth)
