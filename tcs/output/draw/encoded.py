"""Figures as bytes, to be put into a page."""

from __future__ import annotations

import io

import matplotlib as mpl
from matplotlib.figure import Figure
from PIL import Image

_DPI = 96
_SAID_BY_DEFAULT = ("Creator", "Date", "Format", "Type")
"""What matplotlib writes into an SVG if not told otherwise; the page has it already."""


def as_svg(figure: Figure, name: str) -> bytes:
    """Return a figure as an SVG whose text stays text.

    Args:
        figure: The figure.
        name: Any text that no other figure of the page has: it keeps their inner names apart, and
            the same figure gives the same bytes.
    """
    stream = io.BytesIO()
    with mpl.rc_context({"svg.hashsalt": name, "svg.fonttype": "none"}):
        figure.savefig(stream, format="svg", metadata=dict.fromkeys(_SAID_BY_DEFAULT))
    return stream.getvalue()


def as_png(figure: Figure, dpi: float = _DPI, *, colours: int | None = 256) -> bytes:
    """Return a figure as a PNG.

    Args:
        figure: The figure.
        dpi: Pixels in an inch.
        colours: How many colours it may have; 256 take a fifth of the room. None for all of them,
            where colours are a scale to be read.
    """
    full, small = io.BytesIO(), io.BytesIO()
    figure.savefig(full, format="png", dpi=dpi)
    picture = Image.open(full).convert("RGB")
    if colours is not None:
        # An octree keeps small patches of a colour of their own, such as the goals; the median
        # cut lets them go.
        picture = picture.quantize(colours, method=Image.Quantize.FASTOCTREE)
    picture.save(small, "png", optimize=True)
    return small.getvalue()
