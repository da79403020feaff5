"""Lines of text as triangles: Meshcat displays shapes only, and exported pages have no fonts."""

from __future__ import annotations

import functools
import itertools

import numpy as np
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextPath
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]
ADVANCE = 0.602
"""Advance width of a letter of DejaVu Sans Mono, in font heights."""
_FONT = FontProperties(family="DejaVu Sans Mono")
_DETAIL = 24.0
"""Font height at which curves are converted to lines: as fine as the resolution of a screen."""


def text_mesh(text: str) -> tuple[FloatArray, IntArray]:
    """Return corners, shape (3, n), and triangles, shape (3, m), of a line of text.

    The line begins at the origin and extends along x, with font height 1. Blanks have no triangles.

    >>> corners, faces = text_mesh("joint 4")
    >>> bool(corners[0].max() < 7 * ADVANCE)
    True
    """
    slabs = [_glyph(letter) + np.array([ADVANCE * i, 0.0]) for i, letter in enumerate(text)]
    shapes = np.concatenate([np.empty((0, 4, 2)), *slabs])
    corners = np.zeros((3, 4 * len(shapes)))
    corners[:2] = shapes.reshape(-1, 2).T
    halves = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
    faces = 4 * np.arange(len(shapes), dtype=np.int32)[:, None, None] + halves
    return np.asfortranarray(corners), np.asfortranarray(faces.reshape(-1, 3).T)


@functools.cache
def _glyph(letter: str) -> FloatArray:
    """Return the trapezoids that fill a letter, shape (n, 4, 2).

    The letter is divided at the height of every corner of its outlines. Between two neighbouring
    heights the edges are straight and do not cross, so every second gap between them is filled.
    """
    if letter.isspace():
        return np.empty((0, 4, 2))
    path = TextPath((0.0, 0.0), letter, size=_DETAIL, prop=_FONT)
    outlines = [np.asarray(one, dtype=np.float64) for one in path.to_polygons(closed_only=True)]
    edges = [np.stack([one[:-1], one[1:]], axis=1) for one in outlines]
    lines = np.concatenate(edges) / _DETAIL
    lines = lines[lines[:, 0, 1] != lines[:, 1, 1]]
    heights = np.unique(lines[:, :, 1])
    filled = []
    for low, high in itertools.pairwise(heights):
        start, end = lines[:, 0], lines[:, 1]
        across = (np.minimum(start[:, 1], end[:, 1]) <= low) & (
            np.maximum(start[:, 1], end[:, 1]) >= high
        )
        start, end = start[across], end[across]
        slope = (end[:, 0] - start[:, 0]) / (end[:, 1] - start[:, 1])
        below = start[:, 0] + (low - start[:, 1]) * slope
        above = start[:, 0] + (high - start[:, 1]) * slope
        order = np.argsort(below + above)
        for left, right in zip(order[::2], order[1::2], strict=True):
            filled.append(
                [[below[left], low], [below[right], low], [above[right], high], [above[left], high]]
            )
    return np.array(filled)
