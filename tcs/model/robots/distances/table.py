"""The least distance of the surfaces of two bodies, over the joints between them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

UNIT = 4e-5
"""Distance that one step of a corner stands for [m]."""
FARTHEST = 255 * UNIT
"""The farthest that a corner can hold [m], 10.2 mm."""
NOTHING = -1.0
"""Bound where none is known [m]: no distance is less."""


@dataclass(frozen=True, kw_only=True, eq=False)
class DistanceTable:
    """Lower bounds of the distance of two surfaces.

    A full turn of either joint is divided into equal cells. A corner of a cell holds the distance
    there, rounded down. In between, the square of the distance is at least what is interpolated,
    less what its curvature can take away: see `bound`.

    Attributes:
        pair: Names of the two bodies, the one nearer to the base first.
        joints: The joint nearer to the base and the one nearer to the tool; the same name twice if
            there is only one between the bodies.
        reach: For each joint, how far from its axis any point of one of the bodies can be, of the
            body for which that is less [m].
        corners: Distances at the corners of the cells in `UNIT`, 0 where nothing is known, shape
            (cells of the first joint, cells of the second): a full turn ends where it begins.
        source: Digest of the meshes and of the joints, from `source_digest`.
    """

    pair: tuple[str, str]
    joints: tuple[str, str]
    reach: tuple[float, float]
    corners: NDArray[np.uint8]
    source: str

    def bound(self, positions: Mapping[str, float], rounding: float = 0.0) -> float:
        """Return a lower bound of the distance of the surfaces [m], `NOTHING` where none is known.

        As one joint turns by an angle x, the square of the distance of two points is
        `c - 2 r s cos(x - x0)`, with r and s their distances from its axis. Its second derivative
        is at most `2 r s`. Points closer than `FARTHEST` have `|r - s| <= FARTHEST`, and one of r
        and s is at most the reach R: `r s <= R (R + FARTHEST)`. The least of such functions, and of
        the square of `FARTHEST`, is nowhere below the chord between two angles h apart by more than
        `R (R + FARTHEST) h^2 t (1 - t)`, t the fraction of the way: less the parabola of that
        curvature each is concave, and so is the least of them. This holds for one joint after the
        other.

        Args:
            positions: Positions of the joints [rad].
            rounding: What rounding may have changed of them [rad]: the bound is the greatest of
                those nearby.
        """
        if rounding:
            first, second = self.joints
            nearby = itertools.product((-rounding, rounding), repeat=2)
            moved = (
                {first: positions[first] + a, second: positions[second] + b} for a, b in nearby
            )
            return max(self.bound(each) for each in moved)
        places, lost = [], 0.0
        for name, reach, count in zip(self.joints, self.reach, self.corners.shape, strict=True):
            step = 2.0 * math.pi / count
            turned = positions[name] % (2.0 * math.pi)
            cell = min(int(turned / step), count - 1)
            way = turned / step - cell
            lost += reach * (reach + FARTHEST) * step**2 * way * (1.0 - way)
            places.append(((cell, 1.0 - way), ((cell + 1) % count, way)))
        square = sum(
            u * v * (float(self.corners[i, j]) * UNIT) ** 2
            for (i, u), (j, v) in itertools.product(*places)
        )
        return math.sqrt(square - lost) if square > lost else NOTHING
