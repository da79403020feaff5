"""Candidates for the shapes of a body: those that cover most of its surface are chosen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tcs.model.robots.fitting.bounding import enclose, enclose_axis
from tcs.model.robots.fitting.growth import boxes_in, capsules_in
from tcs.model.robots.fitting.reduction import contain
from tcs.model.robots.fitting.solid import Solid
from tcs.model.robots.primitives import Primitive

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_SEEDS = 300
"""Boxes that are grown along each set of axes."""
_CAPSULES = 600
"""Capsules that are tried."""
_CHOOSING = 4_000
"""Most pieces by which the shapes are chosen; all are enclosed in the end."""
_COVERED = 0.99
"""Fraction of those pieces at which no further shape is added: the nearest one grows."""
_ROUNDS = 4
"""Rounds of shapes that grow from what those before leave bare."""
_INSIDE_WEIGHT = 0.05
"""Weight of a point inside, that of a piece of the surface being 1."""


class Candidates:
    """Shapes within a solid, and which pieces of the surface and points inside each contains."""

    def __init__(
        self,
        body: str,
        solid: Solid,
        protrusion: float,
        orientations: FloatArray,
        pieces: FloatArray,
        inside: FloatArray,
        rng: np.random.Generator,
        capsules: bool = True,
    ) -> None:
        """Grow boxes along each of some axes, and capsules, from pieces and points inside."""
        self._body = body
        self._pieces = len(pieces)
        self._points = np.concatenate([pieces.reshape(-1, 3), inside])
        self._weights = np.repeat([1.0, _INSIDE_WEIGHT], [len(pieces), len(inside)])
        seeds = np.concatenate([pieces.mean(axis=1), inside])
        self._boxes: list[tuple[FloatArray, FloatArray]] = []
        covered, within = [], solid.points(solid.outside <= protrusion)
        for R in orientations:
            drawn = seeds[rng.choice(len(seeds), _SEEDS)]
            ends = boxes_in(solid, protrusion, within, R, drawn, rng)
            self._boxes += [(R, box) for box in ends]
            covered.append(self._in_boxes(R, ends))
        tried = _CAPSULES if capsules else 0
        self._capsules = list(zip(*capsules_in(solid, protrusion, tried, rng), strict=True))
        covered.append(self._in_capsules())
        self._covered = np.concatenate(covered)

    def chosen(self, most: int) -> list[Primitive]:
        """Return the shapes that cover most, each what those before it leave."""
        items, weights = self._covered.shape[1], self._weights.astype(np.float32)
        left = np.ones(items, np.bool_)
        gain = self._covered.astype(np.float32) @ weights
        # Rows of items: what a shape covers is subtracted from the others' gain.
        by_item = self._covered.T.copy()
        shapes: list[Primitive] = []
        while len(shapes) < most and left[: self._pieces].mean() > 1 - _COVERED:
            best = int(np.argmax(gain))
            new = self._covered[best] & left
            if not new.any():
                break
            shapes.append(self._shape(best))
            left &= ~new
            gain -= weights[new] @ by_item[new].astype(np.float32)
        return shapes

    def _shape(self, index: int) -> Primitive:
        if index < len(self._boxes):
            R, ends = self._boxes[index]
            corners = np.stack(np.meshgrid(*ends.T), axis=-1).reshape(-1, 3)
            return enclose(self._body, corners @ R.T, "box", R)
        first, last, radius = self._capsules[index - len(self._boxes)]
        return enclose_axis(self._body, first, last, float(radius))

    def _in_boxes(self, R: FloatArray, ends: FloatArray) -> BoolArray:
        """Return what boxes with given axes and ends contain, shape (boxes, items)."""
        seen, ends = (self._points @ R).astype(np.float32), ends.astype(np.float32)
        corners = 3 * self._pieces
        a, b, c = (seen[k:corners:3] for k in range(3))
        # By coordinate: NumPy is slow along an axis of three.
        low = np.concatenate([np.minimum(np.minimum(a, b), c), seen[corners:]]).T.copy()
        high = np.concatenate([np.maximum(np.maximum(a, b), c), seen[corners:]]).T.copy()
        found = np.ones((len(ends), len(self._weights)), np.bool_)
        for within, (least, greatest) in zip(found, ends, strict=True):
            for k in range(3):
                within &= low[k] >= least[k]
                within &= high[k] <= greatest[k]
        return found

    def _in_capsules(self) -> BoolArray:
        found = []
        for first, last, radius in self._capsules:
            along, out = last - first, self._points - first
            square = float(along @ along)
            t = np.clip(out @ along / square, 0.0, 1.0) if square else np.zeros(len(out))
            away = out - t[:, None] * along
            found.append(self._items(np.einsum("ni,ni->n", away, away) <= radius**2))
        return np.array(found, np.bool_).reshape(-1, len(self._weights))

    def _items(self, contained: BoolArray) -> BoolArray:
        """Return which pieces and points inside are contained, given their corners."""
        corners = 3 * self._pieces
        whole = contained[:corners].reshape(-1, 3).all(axis=1)
        return np.concatenate([whole, contained[corners:]])


def orientations(tight: FloatArray) -> FloatArray:
    """Return axes to try: those of the body, of its smallest box, and rotated ones.

    Args:
        tight: Those of its smallest box, shape (3, 3).
    """
    return np.concatenate([turned(np.eye(3), range(0, 90, 15)), turned(tight, (0, 30, 60))])


def turned(R: FloatArray, angles: Sequence[int], about: str = "xyz") -> FloatArray:
    """Return axes turned about each of them by angles [deg] of which the first is 0."""
    found = [R[None]]
    for axis in about:
        turns = Rotation.from_euler(axis, np.array(angles[1:])[:, None], degrees=True)
        found.append(R @ turns.as_matrix())
    return np.concatenate(found)


def patches(
    body: str,
    solid: Solid,
    protrusion: float,
    most: int,
    orientations: FloatArray,
    bare: FloatArray,
    rng: np.random.Generator,
    capsules: bool = True,
) -> list[Primitive]:
    """Return shapes that grow from pieces of the surface that others leave bare."""
    found: list[Primitive] = []
    for _ in range(_ROUNDS):
        if not len(bare) or len(found) == most:
            break
        some = bare if len(bare) <= _CHOOSING else rng.choice(bare, _CHOOSING, replace=False)
        grown = Candidates(
            body, solid, protrusion, orientations, some, np.empty((0, 3)), rng, capsules
        )
        new = grown.chosen(most - len(found))
        bare, found = bare[~contain(new, bare)], found + new
    return found


def sample(pieces: FloatArray, length: float, rng: np.random.Generator) -> FloatArray:
    """Return at most a given number of pieces, evenly spread over the surface."""
    cells = np.floor(pieces.mean(axis=1) / (0.7 * length)).astype(np.int64)
    chosen = _one_of_each(cells)
    if len(chosen) > _CHOOSING:
        chosen = rng.choice(chosen, _CHOOSING, replace=False)
    return np.asarray(pieces[chosen])


def thinned(points: FloatArray, spacing: float) -> FloatArray:
    """Return one point of each cell of a grid, shape (m, 3)."""
    cells = np.floor(points / spacing).astype(np.int64)
    return np.asarray(points[_one_of_each(cells)])


def _one_of_each(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the first row of each cell, in the order of the cells, which have shape (n, 3)."""
    if not len(cells):
        return np.empty(0, np.int64)
    cells = cells - cells.min(axis=0)
    numbers = np.ravel_multi_index(tuple(cells.T), tuple(cells.max(axis=0) + 1))
    return np.asarray(np.unique(numbers, return_index=True)[1])
