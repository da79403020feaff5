"""Picture files, written completely or not at all."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

from tcs.errors import OutputError
from tcs.files.writing import whole_file

FORMATS = ("png", "pdf", "svg")
"""Formats of pictures, given by the suffix of the file name."""


def check_format(path: Path) -> str:
    """Return the format of a picture file.

    Raises:
        OutputError: If the name does not end in one of `FORMATS`.
    """
    ending = path.suffix.lower().removeprefix(".")
    if ending not in FORMATS:
        allowed = ", ".join(f".{name}" for name in FORMATS)
        raise OutputError(f"Picture '{path}': its name must end in one of {allowed}.")
    return ending


def save_figure(path: Path, figure: Figure, *, dpi: float = 130.0) -> None:
    """Write a figure; an older file of that name stays until the new one is complete.

    Raises:
        OutputError: If its name does not end in one of `FORMATS`, or it cannot be written there.
    """
    ending = check_format(path)
    with whole_file(path, "Picture") as stream:
        figure.savefig(stream, format=ending, dpi=dpi)
