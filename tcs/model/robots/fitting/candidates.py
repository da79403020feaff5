"""Candidates for the shapes of a body: those that cover most of its surface are chosen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tcs.kernel.enclosing.holding import chosen_covers, in_boxes, in_capsules
from tcs.model.robots.fitting.bounding import capsule_volume, enclose, enclose_axis
from tcs.model.robots.fitting.growth import boxes_in, capsules_in, extremes
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
_PART = 0.7
"""Fraction of the candidates from which a further draw chooses."""
_ROUNDS = 4
"""Rounds of shapes that grow from what those before leave bare."""
_PIECE_WEIGHT = 20
"""Weight of a piece of the surface, that of a point inside being 1."""


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
        self._weights = np.repeat([_PIECE_WEIGHT, 1], [len(pieces), len(inside)])
        seeds = np.concatenate([pieces.mean(axis=1), inside])
        self._boxes: list[tuple[FloatArray, FloatArray]] = []
        covered, volumes, corners = [], [], extremes(solid, protrusion)
        for R in orientations:
            drawn = seeds[rng.choice(len(seeds), _SEEDS)]
            ends = boxes_in(solid, protrusion, corners, R, drawn, rng)
            self._boxes += [(R, box) for box in ends]
            volumes.append((ends[:, 1] - ends[:, 0]).prod(axis=1))
            covered.append(self._in_boxes(R, ends))
        tried = _CAPSULES if capsules else 0
        self._capsules = list(zip(*capsules_in(solid, protrusion, tried, rng), strict=True))
        covered.append(self._in_capsules())
        self._covered = np.concatenate(covered)
        volumes += [
            np.array([capsule_volume(radius, float(np.linalg.norm(last - first)))])
            for first, last, radius in self._capsules
        ]
        self._order = np.argsort(np.concatenate(volumes), kind="stable")

    def chosen(self, most: int, draw: int = 0) -> list[Primitive]:
        """Return the shapes that cover most, each what those before it leave, or the smallest.

        Args:
            most: Largest number of shapes.
            draw: 0 for all candidates; others choose from a part of them, each from its own.
        """
        left_out, order = int((1 - _COVERED) * self._pieces), self._order
        if draw:
            order = order[np.random.default_rng(draw).random(len(order)) < _PART]
        best = chosen_covers(self._covered, order, self._weights, self._pieces, most, left_out)
        return [self._shape(index) for index in best.tolist()]

    def _shape(self, index: int) -> Primitive:
        if index < len(self._boxes):
            R, ends = self._boxes[index]
            corners = np.stack(np.meshgrid(*ends.T), axis=-1).reshape(-1, 3)
            return enclose(self._body, corners @ R.T, "box", R)
        first, last, radius = self._capsules[index - len(self._boxes)]
        return enclose_axis(self._body, first, last, float(radius))

    def _in_boxes(self, R: FloatArray, ends: FloatArray) -> BoolArray:
        """Return what boxes with given axes and ends contain, shape (boxes, items)."""
        seen = (self._points @ R).astype(np.float32)
        corners = 3 * self._pieces
        a, b, c = (seen[k:corners:3] for k in range(3))
        # By coordinate: NumPy is slow along an axis of three.
        low = np.concatenate([np.minimum(np.minimum(a, b), c), seen[corners:]])
        high = np.concatenate([np.maximum(np.maximum(a, b), c), seen[corners:]])
        return in_boxes(ends.astype(np.float32), low, high)

    def _in_capsules(self) -> BoolArray:
        """Return what capsules contain, shape (capsules, items)."""
        ends = np.array([capsule[:2] for capsule in self._capsules]).reshape(-1, 2, 3)
        radii = np.array([capsule[2] for capsule in self._capsules], np.float64)
        corners = 3 * self._pieces
        pieces = self._points[:corners].reshape(-1, 3, 3)
        return in_capsules(ends, radii, pieces, self._points[corners:])


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
