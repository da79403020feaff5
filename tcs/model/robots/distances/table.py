"""The least distance of the surfaces of two bodies, over the joints between them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

UNIT = 2e-4
"""Distance that one step of a cell stands for [m]; the farthest that a cell can hold is 51 mm."""


@dataclass(frozen=True, kw_only=True, eq=False)
class DistanceTable:
    """Lower bounds of the distance of two surfaces.

    A full turn of either joint is divided into equal cells. A cell holds the distance at its
    centre, rounded down; from there, no distance decreases faster than the joints turn times the
    reach of what they move. So the bound holds everywhere, not only at the centres.

    Attributes:
        pair: Names of the two bodies, the one nearer to the base first.
        joints: The joint nearer to the base and the one nearer to the tool; the same name twice if
            there is only one between the bodies.
        reach: For each joint, how far from its axis any point of one of the bodies can be, of the
            body for which that is less [m].
        cells: Distances at the centres of the cells in `UNIT`, 0 where nothing is known, shape
            (cells of the first joint, cells of the second).
        source: Digest of the meshes and of the joints, from `source_digest`.
    """

    pair: tuple[str, str]
    joints: tuple[str, str]
    reach: tuple[float, float]
    cells: NDArray[np.uint8]
    source: str

    def bound(self, positions: Mapping[str, float], rounding: float = 0.0) -> float:
        """Return a lower bound of the distance of the surfaces [m]; negative where none is known.

        Args:
            positions: Positions of the joints [rad].
            rounding: What rounding may have changed of them [rad]: the bound is the greatest of the
                cells that they may be in.
        """
        if rounding:
            first, second = self.joints
            nearby = itertools.product((-rounding, rounding), repeat=2)
            moved = (
                {first: positions[first] + a, second: positions[second] + b} for a, b in nearby
            )
            return max(self.bound(each) for each in moved)
        place, off = [], 0.0
        for name, reach, count in zip(self.joints, self.reach, self.cells.shape, strict=True):
            step = 2.0 * math.pi / count
            turned = positions[name] % (2.0 * math.pi)
            cell = min(int(turned / step), count - 1)
            off += reach * abs(turned - (cell + 0.5) * step)
            place.append(cell)
        return float(self.cells[place[0], place[1]]) * UNIT - off
