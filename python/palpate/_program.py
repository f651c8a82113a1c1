"""Where the program palpate lies, which decodes foreign files in a process of its own."""

import os
from pathlib import Path

from . import _core


def _find() -> None:
    """In bin/ beside this package or beside a folder that it lies in: a wheel, a prefix, a build tree."""
    if os.environ.get("PALPATE_DECODER"):
        return
    package = Path(__file__).resolve().parent
    for folder in (package, *package.parents):
        program = folder / "bin" / "palpate"
        if program.is_file() and os.access(program, os.X_OK):
            _core.set_decoder_program(str(program))
            return


_find()


def decoder_program() -> str:
    """The program that decodes foreign files; empty where there is none, and only brick files are read.

    The environment variable PALPATE_DECODER names another.
    """
    return _core.decoder_program()
