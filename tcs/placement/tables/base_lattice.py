"""The lattice of base positions around the furniture, and the moves between neighbours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcs.placement.tables.checks import ArrayTable, require

MOVES = ((1, 0), (0, 1), (1, 1), (1, -1))
"""Steps along x and y of the four types of moves; each also goes backward."""


@dataclass(frozen=True, kw_only=True, eq=False)
class BaseLattice(ArrayTable):
    """X by Y base positions, and the straight moves between neighbours.

    The lattice extends beyond the base positions of the grid. The area beyond the lattice is free.
    """

    start: tuple[float, float]
    """x and y of the first position in W [m]."""
    step: tuple[float, float]
    """Distance of neighbours along x and along y [m]; positive."""
    moves: NDArray[np.bool_]
    """Whether the base can move from position (i, j) by each of `MOVES`, shape (4, X, Y)."""

    def __post_init__(self) -> None:
        """Check the lattice and make its array read-only.

        Raises:
            TcsError: If a number is not finite, a step not positive, there are fewer than two
                positions along an axis, or a move leaves the lattice.
        """
        self._check_arrays("base lattice", {"moves": (np.bool_, (len(MOVES), None, None))})
        numbers = (*self.start, *self.step)
        require(
            len(self.start) == len(self.step) == 2
            and all(isinstance(value, float) and abs(value) < np.inf for value in numbers)
            and min(self.step) > 0.0,
            "base lattice: start and step must be two finite numbers each, the steps positive.",
        )
        require(min(self.shape) >= 2, "base lattice: needs at least two positions along each axis.")
        for along, (dx, dy) in zip(self.moves, MOVES, strict=True):
            leaving = np.ones(self.shape, dtype=np.bool_)
            leaving[: self.shape[0] - dx, max(0, -dy) : self.shape[1] - max(0, dy)] = False
            require(not np.any(along & leaving), "base lattice: a move leaves the lattice.")

    @property
    def shape(self) -> tuple[int, int]:
        """Number of positions along x and y."""
        return self.moves.shape[1], self.moves.shape[2]
