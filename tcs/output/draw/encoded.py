"""Figures as bytes for pages."""

from __future__ import annotations

import io

import matplotlib as mpl
from matplotlib.figure import Figure
from PIL import Image

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
