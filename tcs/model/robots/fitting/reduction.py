"""Shapes reduced to what they alone contain of a surface that is cut into pieces."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.enclosing.holding import (
    RoundedBox,
    contains_pieces,
    contains_points,
    farthest_of_pieces,
)
from tcs.model.robots.fitting.bounding import enclose
from tcs.model.robots.primitives import Primitive

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_TOUCH = 1e-6
"""Growth of the box around a shape [m] that tells which pieces are far from it."""


def rounded_box(shape: Primitive) -> RoundedBox:
    """Return a shape as the kernel reads it."""
    half, radius = np.array(shape.size) / 2, 0.0
    if shape.kind != "box":
        radius = shape.size[0]
        half = np.array([0.0, 0.0, shape.size[1] / 2 if shape.kind == "capsule" else 0.0])
    return RoundedBox(half=half, radius=radius, R=shape.rotation, p=np.array(shape.xyz))


def contain(shapes: list[Primitive], pieces: FloatArray) -> BoolArray:
    """Return which pieces, shape (n, 3, 3), lie wholly in one of the shapes, shape (n,)."""
    within = np.zeros(len(pieces), np.bool_)
    for shape in shapes:
        within |= contained(shape, pieces)
    return within


def contained(shape: Primitive, pieces: FloatArray) -> BoolArray:
    """Return which pieces lie wholly in a shape, shape (n,)."""
    return np.asarray(contains_pieces(rounded_box(shape), np.ascontiguousarray(pieces)))


class SortedPieces:
    """Pieces of a surface by their place along it: of most shapes, only a part of them is near."""

    def __init__(self, pieces: FloatArray) -> None:
        """Sort pieces.

        Args:
            pieces: Corners of the pieces [m], shape (n, 3, 3).
        """
        first = pieces[:, 0]
        self._axis = int(np.argmax(np.ptp(first, axis=0))) if len(first) else 0
        order = np.argsort(first[:, self._axis], kind="stable")
        self.corners: FloatArray = pieces[order]
        """Corners of the pieces in their order [m], shape (n, 3, 3)."""
        self._places = first[order, self._axis]

    def within(self, shape: Primitive) -> BoolArray:
        """Return which pieces lie wholly in a shape, shape (n,)."""
        ends = shape.bounds[:, self._axis] + np.array([-_TOUCH, _TOUCH])
        near = slice(*np.searchsorted(self._places, ends).tolist())
        found = np.zeros(len(self.corners), np.bool_)
        found[near] = contained(shape, self.corners[near])
        return found


def reduced(
    body: str,
    shapes: list[Primitive],
    pieces: FloatArray,
    inside: FloatArray,
    *,
    boxed: bool = False,
) -> list[Primitive]:
    """Return shapes that together contain everything, each reduced to what no other one contains.

    A piece that no shape contains goes to the nearest one, which grows.

    Args:
        body: Name of the body.
        shapes: The shapes.
        pieces: Corners of the pieces of its surface [m], shape (n, 3, 3).
        inside: Points inside to be contained [m], shape (m, 3).
        boxed: Whether a box may take the place of a capsule that contains little alone.
    """
    placed = SortedPieces(pieces)
    pieces = placed.corners

    def holds(shape: Primitive) -> BoolArray:
        return np.concatenate([placed.within(shape), contains_points(rounded_box(shape), inside)])

    within = np.stack([holds(shape) for shape in shapes])
    bare = np.flatnonzero(~within[:, : len(pieces)].any(axis=0))
    if len(bare):
        away = np.stack([farthest_of_pieces(rounded_box(s), pieces[bare]) for s in shapes])
        within[away.argmin(axis=0), bare] = True
    current: dict[int, Primitive] = dict(enumerate(shapes))
    count = within.sum(axis=0, dtype=np.int16)
    # The smallest first, so that they are dropped rather than large ones reduced.
    for k in sorted(current, key=lambda k: shapes[k].volume):
        alone = within[k] & (count == 1)
        count -= within[k]
        points = np.concatenate(
            [pieces[alone[: len(pieces)]].reshape(-1, 3), inside[alone[len(pieces) :]]]
        )
        if not len(points):
            del current[k]
            continue
        current[k] = _around(body, shapes[k], points)
        if boxed and shapes[k].kind == "capsule":
            box = enclose(body, points, "box", shapes[k].rotation)
            current[k] = min(current[k], box, key=lambda shape: shape.volume)
        within[k] = holds(current[k])
        count += within[k]
    return list(current.values())


def _around(body: str, shape: Primitive, points: FloatArray) -> Primitive:
    """Return a box reduced to points, or a capsule grown to contain them."""
    if shape.kind == "box":
        return enclose(body, points, "box", shape.rotation)
    beyond = float(shape.distance(points).max())
    return shape.shrunk(-np.ceil(beyond * 1e6 + 1) * 1e-6) if beyond > 0 else shape
