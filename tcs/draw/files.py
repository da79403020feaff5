"""Write pictures, wholly or not at all."""

from __future__ import annotations

import contextlib
import os
import secrets
from pathlib import Path

from matplotlib.figure import Figure

from tcs.errors import OutputError

FORMATS = ("png", "pdf", "svg")
"""What a picture may be written as; the end of its name says which."""


def check_format(path: Path) -> str:
    """Return the format that a file name asks for.

    Raises:
        OutputError: If the name ends in none of `FORMATS`.
    """
    ending = path.suffix.lower().removeprefix(".")
    if ending not in FORMATS:
        allowed = ", ".join(f".{name}" for name in FORMATS)
        raise OutputError(f"Picture '{path}': its name must end in one of {allowed}.")
    return ending


def save_figure(path: Path, figure: Figure, *, dpi: float = 130.0) -> None:
    """Write a figure; an older file of that name stays until the new one is complete.

    Raises:
        OutputError: If its name ends in none of `FORMATS`, or it cannot be written there.
    """
    ending = check_format(path)
    beside = path.with_name(f".{path.name}.{os.getpid()}-{secrets.token_hex(4)}.part")
    try:
        figure.savefig(beside, format=ending, dpi=dpi)
        beside.replace(path)
    except BaseException as error:
        # Where no file could be made, there is none to remove; the first error is the one to tell.
        with contextlib.suppress(OSError):
            beside.unlink()
        if isinstance(error, OSError):
            raise OutputError(
                f"Picture '{path}' cannot be written: {error.strerror or error}. Name a file in an "
                "existing, writable folder."
            ) from error
        raise
