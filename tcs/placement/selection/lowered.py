"""Scores that constraints lower: what the candidates still reach, with bounds on the sets of cells.

At each goal a set gains the greatest alpha reached + beta dexterity of its members, because only a
goal that is reached has a dexterity. The greatest of a cell therefore bounds all its candidates.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcs.placement.selection.admission import Admitted
from tcs.placement.selection.index import SetIndex
from tcs.placement.selection.utility import UtilityWeights

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SLACK = 1e-12
"""Relative margin for rounding in bounds that are not computed by the operations of the utility: a
dozen roundings of 1.1e-16 each, with three digits to spare. A bound without it could end up one
bit below the utility it bounds, and lose a tie."""


@dataclass(frozen=True, eq=False)
class LoweredScores:
    """Scores of the candidates under constraints."""

    dexterity: FloatArray
    """Dexterity of the candidates, one contiguous row for each goal, shape (G, C)."""
    reached: NDArray[np.bool_]
    """Whether a goal is reached, one contiguous row for each goal, shape (G, C)."""
    gain: FloatArray
    """Weight of the goal times (alpha reached + beta dexterity), shape (G, C)."""
    cell_gain: FloatArray
    """The greatest of the admitted candidates of each cell, shape (G, N)."""

    @classmethod
    def of(cls, index: SetIndex, admitted: Admitted, weights: UtilityWeights) -> LoweredScores:
        """Return the scores of admitted candidates.

        Args:
            index: The candidates.
            admitted: What they reach.
            weights: alpha and beta.
        """
        dexterity = np.ascontiguousarray(admitted.dexterity.T, dtype=np.float64)
        reached = np.ascontiguousarray(admitted.reached.T)
        gain = float(weights.reachability) * reached + float(weights.manipulability) * dexterity
        gain *= index.sets.weights[:, None] * (1.0 + SLACK)
        of_admitted = np.where(admitted.candidates, gain, 0.0)[:, index.sets.by_cell]
        return cls(dexterity, reached, gain, np.maximum.reduceat(of_admitted, index.start, axis=1))

    def of_cells(self, cells: tuple[IntArray, ...]) -> FloatArray:
        """Return bounds on alpha P_R + beta P_M of sets with a member in each cell, shape (n,)."""
        total = np.zeros(cells[0].size)
        for of_goal in self.cell_gain:
            total += _greatest([of_goal[of_member] for of_member in cells])
        return total

    def with_partners(self, member: IntArray, cells: tuple[IntArray, ...]) -> FloatArray:
        """Return the same for sets of a candidate and a partner in each cell, shape (n,)."""
        total = np.zeros(member.size)
        for of_candidates, of_goal in zip(self.gain, self.cell_gain, strict=True):
            partners = [of_goal[of_member] for of_member in cells]
            total += _greatest([of_candidates[member], *partners])
        return total


def _greatest(values: list[FloatArray]) -> FloatArray:
    greatest = values[0]
    for other in values[1:]:
        greatest = np.maximum(greatest, other)
    return greatest
