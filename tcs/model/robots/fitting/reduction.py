"""Shapes reduced to what they alone contain of a surface that is cut into pieces."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tcs.model.robots.fitting.bounding import enclose
from tcs.model.robots.primitives import Primitive

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_TOUCH = 1e-6
"""Growth of the box around a shape [m] that tells which pieces are far from it."""


def contain(shapes: list[Primitive], pieces: FloatArray) -> BoolArray:
    """Return which pieces, shape (n, 3, 3), lie wholly in one of the shapes, shape (n,)."""
    within = np.zeros(len(pieces), np.bool_)
    for shape in shapes:
        within |= contained(shape, pieces)
    return within


def contained(shape: Primitive, pieces: FloatArray) -> BoolArray:
    """Return which pieces lie wholly in a shape, shape (n,)."""
    low, high = shape.bounds + np.array([[-_TOUCH], [_TOUCH]])
    is_near = np.ones(len(pieces), np.bool_)
    # By coordinate: NumPy is slow along an axis of three.
    for k in range(3):
        first = pieces[:, 0, k]
        is_near &= (first >= low[k]) & (first <= high[k])
    near = np.flatnonzero(is_near)
    within = np.zeros(len(pieces), np.bool_)
    within[near] = shape.contains(pieces[near].reshape(-1, 3)).reshape(-1, 3).all(axis=1)
    return within


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

    def holds(shape: Primitive) -> BoolArray:
        return np.concatenate([contained(shape, pieces), shape.contains(inside)])

    within = np.stack([holds(shape) for shape in shapes])
    bare = np.flatnonzero(~within[:, : len(pieces)].any(axis=0))
    if len(bare):
        away = np.stack([shape.distance(pieces[bare]).max(axis=1) for shape in shapes])
        within[away.argmin(axis=0), bare] = True
    current: dict[int, Primitive] = dict(enumerate(shapes))
    count = within.sum(axis=0)
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
