"""Figures as picture files, written completely or not at all, and as bytes for pages."""

from __future__ import annotations

import io
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure
from PIL import Image

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


_DPI = 96
_DEFAULT_METADATA = ("Creator", "Date", "Format", "Type")
"""Metadata that matplotlib writes into an SVG by default; the page has its own."""


def as_svg(figure: Figure, name: str) -> bytes:
    """Return a figure as an SVG with its text as text elements.

    Args:
        figure: The figure.
        name: A name unique within the page. It keeps the ids of the figures apart, and makes the
            bytes of a figure reproducible.
    """
    stream = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": name, "svg.fonttype": "none"}):
        figure.savefig(stream, format="svg", metadata=dict.fromkeys(_DEFAULT_METADATA))
    return stream.getvalue()


def as_png(figure: Figure, dpi: float = _DPI, *, colours: int | None = 256) -> bytes:
    """Return a figure as a PNG.

    Args:
        figure: The figure.
        dpi: Pixels per inch.
        colours: Number of colours; 256 reduce the size to a fifth. None keeps all colours, for
            figures with a colour scale.
    """
    full, small = io.BytesIO(), io.BytesIO()
    figure.savefig(full, format="png", dpi=dpi)
    picture = Image.open(full).convert("RGB")
    if colours is not None:
        # An octree keeps small patches of a distinct colour, such as the goals; the median cut
        # drops them.
        picture = picture.quantize(colours, method=Image.Quantize.FASTOCTREE)
    picture.save(small, "png", optimize=True)
    return small.getvalue()
