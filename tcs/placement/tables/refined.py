"""Table of the refined sets: configurations between the grid points, and what they reach."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcs.model.grid import Grid, InitialConfiguration
from tcs.placement.tables.columns import ArrayTable, Column, Columns, Form, require
from tcs.placement.tables.equations import tc_manipulability, tc_reachability
from tcs.placement.tables.scores import WEIGHT_SUM_TOLERANCE
from tcs.placement.tables.sets import MOST_MEMBERS
from tcs.placement.tables.success import NO_MEMBER, Estimates


class RefinedSet(NamedTuple):
    """A refined set of a score file."""

    table: int
    """Number of the table."""
    row: int
    """Number of the set."""
    order: tuple[int, ...]
    """Numbers of the members, in the order of the visits."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RefinedTable(ArrayTable):
    """K sets of configurations that need not be on the grid, best first; arrays are read-only.

    Each was refined from a set of the grid. Rows of members that a set does not have hold zeros.
    """

    origin: NDArray[np.int32]
    """Flat grid indices of the members that the refinement started from, NO_MEMBER after the last,
    shape (K, m)."""
    values: NDArray[np.float64]
    """Values of the grid's axes, in their order [m or rad], shape (K, m, axes)."""
    reached: NDArray[np.bool_]
    """Whether a member reaches a goal, shape (K, m, G)."""
    dexterity: NDArray[np.float32]
    """Its dexterity there, 0 where not reached, shape (K, m, G)."""
    arm_joints: NDArray[np.float32]
    """Arm joints of the best solution [rad], 0 where not reached, shape (K, m, G, 7)."""
    objective: NDArray[np.float64]
    """Value of the objective that was maximised, shape (K,)."""
    weights: NDArray[np.float64]
    """Weights of the goals, sum 1, shape (G,)."""
    success: Estimates | None = None
    """Their success under error; None unless that of the table's sets was estimated."""
    hand: NDArray[np.uint8] | None = None
    """Number of the hand of each posture, shape (K, m, G); None if there is only one."""

    WHAT = "refined table"
    COLUMNS: ClassVar[Columns] = {
        "origin": Column(np.int32, "K m", Form.PLUS_ONE),
        "values": Column(np.float64, "K m axes", finite=True),
        "reached": Column(np.bool_, "K m G", Form.FLAGS),
        "dexterity": Column(np.float32, "K m G", least=0.0),
        "arm_joints": Column(np.float32, "K m G 7", finite=True),
        "objective": Column(np.float64, "K", finite=True),
        "weights": Column(np.float64, "G", Form.APART, least=0.0),
        "hand": Column(np.uint8, "K m G", optional=True),
    }

    def __post_init__(self) -> None:
        """Check the arrays against each other and make them read-only.

        Raises:
            TcsError: If an array has the wrong type, shape or range.
        """
        self._check_arrays()
        is_member = self.origin != NO_MEMBER
        require(
            1 <= self.origin.shape[1] <= MOST_MEMBERS
            and bool(np.all(self.origin >= NO_MEMBER) and np.all(is_member[:, :1]))
            and bool(np.all(is_member[:, :-1] | ~is_member[:, 1:])),
            f"refined table: sets must have 1 to {MOST_MEMBERS} members.",
        )
        require(
            not np.any(self.dexterity[~self.reached]) and not np.any(self.reached[~is_member]),
            "refined table: dexterity must be 0 where a goal is not reached.",
        )
        require(
            abs(float(self.weights.sum()) - 1.0) <= WEIGHT_SUM_TOLERANCE,
            "refined table: weights must be >= 0 and sum to 1.",
        )
        require(
            self.success is None or len(self.success.low) == len(self.origin),
            "refined table: there must be one success for each set.",
        )

    def only(self, row: int) -> RefinedTable:
        """Return one of the sets, as wide as it has members."""
        size = int(self.sizes[row])
        arrays = {
            name: getattr(self, name) for name in ("origin", "values", "reached", "dexterity")
        }
        return replace(
            self,
            **{name: array[row : row + 1, :size] for name, array in arrays.items()},
            arm_joints=self.arm_joints[row : row + 1, :size],
            hand=None if self.hand is None else self.hand[row : row + 1, :size],
            objective=self.objective[row : row + 1],
            success=None,
        )

    def members(self, grid: Grid, row: int) -> tuple[InitialConfiguration, ...]:
        """Return the members of a set.

        Args:
            grid: The grid that the sets were refined from.
            row: Number of the set.
        """
        return tuple(
            grid.between(self.values[row, i].tolist()) for i in range(int(self.sizes[row]))
        )

    @property
    def served(self) -> NDArray[np.uint8]:
        """Number of the hand that reaches a goal from a member plus 1, 0 for none, (K, m, G)."""
        hand = np.zeros(self.reached.shape, np.uint8) if self.hand is None else self.hand
        return np.where(self.reached, hand + np.uint8(1), np.uint8(0))

    @property
    def sizes(self) -> NDArray[np.int64]:
        """Number of members of each set, shape (K,)."""
        return np.asarray(np.count_nonzero(self.origin != NO_MEMBER, axis=1), dtype=np.int64)

    @property
    def reachability(self) -> NDArray[np.float64]:
        """P_R of each set, TCS eq. (1), shape (K,)."""
        return tc_reachability(np.logical_or.reduce(self.reached, axis=1), self.weights)

    @property
    def manipulability(self) -> NDArray[np.float64]:
        """P_M of each set, TCS eq. (4), shape (K,)."""
        return tc_manipulability(self.dexterity.max(axis=1), self.weights)
