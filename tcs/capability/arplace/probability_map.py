"""Probability maps over base positions: merging, obstacles, and the best base position."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import distance_transform_edt

from tcs.errors import SelectionError, UnknownNameError
from tcs.files.quantities import ANGLE, POSITION, SIZE
from tcs.kernel.arrays import FloatArray

MAX, PRODUCT = "max", "product"
RULES = (MAX, PRODUCT)
"""Rules of merging: max for several grasps of one object, product for several objects."""
_SAME = 1e-9
"""Base positions closer than this are equal [m]; probabilities closer than this are ties."""


@dataclass(frozen=True, slots=True)
class FloorObstacle:
    """A rectangle on the floor plan, in F."""

    x: float
    """Centre [m]."""
    y: float
    size_x: float
    """Size along its own x [m]."""
    size_y: float
    yaw: float = 0.0
    """Heading [rad]."""

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            SelectionError: If one is out of its physical range.
        """
        POSITION.check((self.x, self.y), "an obstacle: a coordinate", SelectionError)
        SIZE.check((self.size_x, self.size_y), "an obstacle: a size", SelectionError)
        ANGLE.check(self.yaw, "an obstacle: the heading", SelectionError)

    def distance(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Return the distance of points from the rectangle [m], 0 inside, shape (x, y)."""
        dx, dy = x[:, None] - self.x, y[None, :] - self.y
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        along = np.maximum(np.abs(c * dx + s * dy) - 0.5 * self.size_x, 0.0)
        across = np.maximum(np.abs(c * dy - s * dx) - 0.5 * self.size_y, 0.0)
        return np.hypot(along, across)


@dataclass(frozen=True, eq=False)
class ProbabilityMap:
    """Probability that a grasp succeeds, for each base position in F."""

    x: FloatArray
    """Base positions along x [m], ascending, shape (nx,)."""
    y: FloatArray
    """The same along y, shape (ny,)."""
    probability: FloatArray
    """Shape (nx, ny)."""
    base_yaw: float
    """Heading of the base [rad]."""
    torso_height: float
    """Torso height [m]."""

    def __post_init__(self) -> None:
        """Check that the values fit together.

        Raises:
            SelectionError: If they do not.
        """
        numbers = (self.x, self.y, self.probability, [self.base_yaw, self.torso_height])
        fits = self.probability.shape == (len(self.x), len(self.y))
        if not fits or not self.probability.size or not all(np.isfinite(n).all() for n in numbers):
            raise SelectionError("a probability map whose arrays do not fit together")
        if self.probability.min() < 0.0 or self.probability.max() > 1.0:
            raise SelectionError("a probability map with values that are not in 0 to 1")
        for axis in (self.x, self.y):
            if np.any(np.diff(axis) <= 0.0) or np.abs(axis).max() > POSITION.high:
                raise SelectionError("a probability map with invalid base positions")
        for array in (self.x, self.y, self.probability):
            array.flags.writeable = False

    def without(self, obstacles: Sequence[FloorObstacle], clearance: float) -> ProbabilityMap:
        """Return the map with probability 0 at base positions too close to an obstacle.

        Args:
            obstacles: The obstacles.
            clearance: Least distance from the centre of the base [m], e.g. its radius.
        """
        probability = self.probability.copy()
        for obstacle in obstacles:
            probability[obstacle.distance(self.x, self.y) < clearance] = 0.0
        return replace(self, probability=probability)

    def best(self, within: float = _SAME) -> tuple[int, int]:
        """Return the indices of the most probable base position.

        Of several equal ones it is the one farthest from all that are less probable, the first if
        these are several, too.

        Args:
            within: Probabilities this far below the greatest one count as equal to it.

        Raises:
            SelectionError: If all probabilities are 0.
        """
        most = float(self.probability.max())
        if most <= 0.0:
            raise SelectionError(
                "the grasp succeeds from no base position of the map. Reduce the error, move the "
                "object or the obstacles, or learn more base positions."
            )
        ties = (self.probability >= most - within) & (self.probability > 0.0)
        spacing = [float(a[1] - a[0]) if len(a) > 1 else 1.0 for a in (self.x, self.y)]
        depth = distance_transform_edt(np.pad(ties, 1), sampling=spacing)[1:-1, 1:-1]
        i, j = np.unravel_index(int(np.argmax(depth)), depth.shape)
        return int(i), int(j)


def merge_maps(maps: Sequence[ProbabilityMap], rule: str) -> ProbabilityMap:
    """Return several maps merged into one.

    Args:
        maps: Maps of the same base positions, heading and torso height.
        rule: "max": the object can be grasped in several manners, one suffices. "product": several
            objects are grasped from the same base position, with independent errors.

    Raises:
        UnknownNameError: If there is no such rule.
        SelectionError: If there is no map, or their base positions, headings or torso heights
            differ.

    Source:
        ITCM thesis, Appendix D.3.6.
    """
    if rule not in RULES:
        raise UnknownNameError("rule", rule, RULES)
    if not maps:
        raise SelectionError("no map to merge. Give one or more.")
    first = maps[0]
    for other in maps[1:]:
        if not _same_places(first, other):
            raise SelectionError(
                "maps of different base positions, headings or torso heights cannot be merged. "
                "Learn their models with the same --base-x, --base-y, --base-yaw-deg and "
                "--torso-height."
            )
    stacked = np.array([one.probability for one in maps])
    probability = stacked.max(axis=0) if rule == MAX else stacked.prod(axis=0)
    return replace(first, probability=probability)


def _same_places(one: ProbabilityMap, other: ProbabilityMap) -> bool:
    pairs = (
        (one.x, other.x),
        (one.y, other.y),
        (np.array([one.base_yaw]), np.array([other.base_yaw])),
        (np.array([one.torso_height]), np.array([other.torso_height])),
    )
    return all(a.shape == b.shape and np.abs(a - b).max() < _SAME for a, b in pairs)
