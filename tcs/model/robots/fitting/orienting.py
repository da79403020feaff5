"""The orientation in which a box around points protrudes least from a body."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tcs.kernel.enclosing.orienting import box_cost

FloatArray = NDArray[np.float64]

_FIRST, _LAST = 16.0, 1.0
"""First and last angle by which a box is rotated in one step [deg]; each is half that before."""
_DRAWN = 10_000
"""Most points outside by which orientations are compared."""
_LESS = 1 - 1e-6
"""Factor by which a cost has to fall, so that the result does not depend on rounding."""


def least_protruding(
    points: FloatArray,
    R: FloatArray,
    outside: FloatArray,
    costs: FloatArray,
    per_volume: float,
) -> FloatArray:
    """Return an orientation R_BP of the box around points in which it contains little that costs.

    Starting from R, the box is rotated about its own axes in smaller and smaller steps, as long as
    that helps: the result is a local minimum.

    Args:
        points: Points that the box contains [m], shape (n, 3).
        R: Orientation to start from, shape (3, 3).
        outside: Points that it should not contain [m], shape (m, 3).
        costs: Cost of each of them, shape (m,).
        per_volume: Cost of the volume of the box [1/m^3].
    """
    if len(outside) > _DRAWN:
        # Any, but always the same ones.
        some = np.random.default_rng(0).choice(len(outside), _DRAWN, replace=False)
        outside, costs = outside[some], costs[some] * (len(outside) / _DRAWN)

    def cost(R: FloatArray) -> float:
        return float(box_cost(points, outside, costs, np.ascontiguousarray(R), per_volume))

    return least_costly(R, cost)


def least_costly(R: FloatArray, cost: Callable[[FloatArray], float]) -> FloatArray:
    """Return an orientation of little cost, a local minimum that is found from R.

    Args:
        R: Orientation to start from, shape (3, 3).
        cost: Cost of an orientation.
    """
    best, least, step = R, cost(R), _FIRST
    while step >= _LAST:
        found = _first_better(best, least, step, cost)
        if found is None:
            step /= 2
        else:
            best, least = found
    return best


def _first_better(
    R: FloatArray, least: float, step: float, cost: Callable[[FloatArray], float]
) -> tuple[FloatArray, float] | None:
    """Return the first orientation a step away [deg] that costs less, and its cost."""
    for tried in _rotated(R, step):
        value = cost(tried)
        if value < least * _LESS:
            return tried, value
    return None


def _rotated(R: FloatArray, step: float) -> Iterator[FloatArray]:
    """Yield an orientation rotated about each of its axes, to both sides, by an angle [deg]."""
    for turn in _turns(step):
        yield R @ turn


@cache
def _turns(step: float) -> tuple[FloatArray, ...]:
    """Return rotations about each axis, to both sides, by an angle [deg]."""
    return tuple(
        Rotation.from_euler(axis, angle, degrees=True).as_matrix()
        for axis in "xyz"
        for angle in (step, -step)
    )
