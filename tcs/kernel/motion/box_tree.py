"""Boxes around groups of shapes that never move relative to each other: a binary tree of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import BOX, CAPSULE, FloatArray, IntArray
from tcs.kernel.cache import inner, jit
from tcs.kernel.collide import BOUND, CENTRE, COLUMNS, ROTATION, SIZE, TYPE

LEAST = 3
"""Number of shapes of a link up to which they get no boxes: checking each pair takes no longer."""
ENCLOSING = 1e-9
"""Excess of the half sizes of boxes around shapes [m], above rounding errors."""
NONE = -1


class Groups(NamedTuple):
    """Shapes and the boxes around groups of them."""

    rows: FloatArray
    """Shapes, then boxes, packed, in the frames of what carries them, shape (n, 17)."""
    frame: IntArray
    """What carries each, shape (n,): shapes that it carries never move relative to each other."""
    parts: IntArray
    """The two shapes or boxes in each box, which come before it, NONE for shapes, shape (n, 2)."""
    roots: IntArray
    """Shapes and boxes that are in no other box."""


def boxes_around(links: FloatArray, link_frame: IntArray, body: IntArray) -> Groups:
    """Return the boxes around groups of the shapes of each link, or other carrier, that has many.

    Args:
        links: Shapes, packed, in link frames, shape (n, 17).
        link_frame: Link of each, shape (n,); NONE for shapes that are not grouped.
        body: Body of each, shape (n,): bodies that are fixed to each other are on one link.
    """
    count = len(links)
    centres = np.ascontiguousarray(links[:, CENTRE : CENTRE + 3])
    half = extents(links)
    roots, parts, frames = [], [np.full((count, 2), NONE)], [link_frame]
    top = count
    for frame in np.unique(link_frame):
        members = np.flatnonzero(link_frame == frame)
        if frame == NONE or len(members) <= LEAST:
            roots += members.tolist()
            continue
        below = np.empty((len(members) - 1, 2), np.int64)
        _divide(members, centres, body, top, below)
        top += len(below)
        roots.append(top - 1)
        parts.append(below)
        frames.append(np.full(len(below), frame, link_frame.dtype))
    parts_of_all = np.concatenate(parts)
    corners = np.empty((top, 6))
    corners[:count, :3], corners[:count, 3:] = centres - half, centres + half
    _enclose(parts_of_all, corners)
    return Groups(
        rows=np.concatenate([links, boxes_between(corners[count:])]),
        frame=np.concatenate(frames),
        parts=parts_of_all,
        roots=np.array(roots, np.int64),
    )


@jit
def _divide(
    members: IntArray, centres: FloatArray, body: IntArray, first: int, parts: IntArray
) -> None:
    """Fill the parts of the boxes around some shapes, each box after its parts.

    Args:
        members: The shapes, two or more; their order changes.
        centres: Centre of every shape [m], shape (n, 3).
        body: Body of every shape, shape (n,).
        first: Number of the first box.
        parts: Filled, shape (len(members) - 1, 2).
    """
    # From the largest box on: its number is the greatest.
    span = np.empty((len(parts), 2), np.int64)
    span[0, 0], span[0, 1] = 0, len(members)
    last, made = first + len(parts) - 1, 1
    for n in range(len(parts)):
        begin, end = span[n, 0], span[n, 1]
        middle = _halve(members, centres, body, begin, end)
        for m in range(2):
            low, high = (begin, middle) if m == 0 else (middle, end)
            if high - low == 1:
                parts[len(parts) - 1 - n, m] = members[low]
                continue
            span[made, 0], span[made, 1] = low, high
            parts[len(parts) - 1 - n, m] = last - made
            made += 1


@inner
def _halve(members: IntArray, centres: FloatArray, body: IntArray, begin: int, end: int) -> int:
    """Order some members so that one group comes first; return where the other one begins.

    These are the shapes of one body and the others, or those on either side of the middle.
    """
    of_first = begin
    for n in range(begin, end):
        i = members[n]
        if body[i] == body[members[begin]]:
            for m in range(n, of_first, -1):
                members[m] = members[m - 1]
            members[of_first] = i
            of_first += 1
    if of_first < end:
        return of_first
    axis, widest = 0, -1.0
    for r in range(3):
        low = high = centres[members[begin], r]
        for n in range(begin, end):
            low, high = min(low, centres[members[n], r]), max(high, centres[members[n], r])
        if high - low > widest:
            axis, widest = r, high - low
    for n in range(begin + 1, end):
        i, m = members[n], n
        while m > begin and centres[members[m - 1], axis] > centres[i, axis]:
            members[m] = members[m - 1]
            m -= 1
        members[m] = i
    return begin + (end - begin) // 2


@jit
def _enclose(parts: IntArray, corners: FloatArray) -> None:
    """Fill least and greatest coordinates of boxes, those of shapes being filled, shape (n, 6)."""
    for n in range(len(parts)):
        if parts[n, 0] != NONE:
            for r in range(3):
                corners[n, r] = min(corners[parts[n, 0], r], corners[parts[n, 1], r])
                corners[n, 3 + r] = max(corners[parts[n, 0], 3 + r], corners[parts[n, 1], 3 + r])


def extents(rows: FloatArray) -> FloatArray:
    """Return how far each shape extends from its centre along the axes of its frame, (n, 3)."""
    size, R = rows[:, SIZE : SIZE + 3], np.abs(rows[:, ROTATION:].reshape(-1, 3, 3))
    of_boxes = np.einsum("nij,nj->ni", R, size)
    of_capsules = size[:, :1] + R[:, :, 2] * size[:, 1:2]
    kind = rows[:, TYPE, None]
    return np.where(kind == BOX, of_boxes, np.where(kind == CAPSULE, of_capsules, size[:, :1]))


def boxes_between(corners: FloatArray) -> FloatArray:
    """Return boxes between two corners [m], shape (n, 6), as packed shapes."""
    rows = np.zeros((len(corners), COLUMNS))
    half = (corners[:, 3:] - corners[:, :3]) / 2.0 + ENCLOSING
    rows[:, TYPE] = BOX
    rows[:, BOUND] = np.linalg.norm(half, axis=1)
    rows[:, SIZE : SIZE + 3] = half
    rows[:, CENTRE : CENTRE + 3] = (corners[:, :3] + corners[:, 3:]) / 2.0
    rows[:, ROTATION:] = np.eye(3).ravel()
    return rows
