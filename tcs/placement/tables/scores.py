"""The score table: what the arm can do at each goal from each initial configuration."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from tcs.files.mapped import chunks, large_zeros
from tcs.placement.tables.columns import ArrayTable, Column, Columns, Form, require
from tcs.placement.tables.equations import tc_manipulability, tc_reachability

WEIGHT_SUM_TOLERANCE = 1e-9
"""Weights must sum to 1; dividing by the sum leaves 1e-16 per goal; this tolerates
millions of goals and still refuses weights that were never normalised."""

EVERY = slice(None)
"""All configurations."""


class Reason(IntEnum):
    """Why a goal is or is not reached from an initial configuration."""

    REACHED = 0
    TOO_FAR = 1
    JOINT_LIMITS = 2
    BODY_BLOCKED = 3
    GRIPPER_BLOCKED_BY_ENVIRONMENT = 4
    """The gripper at the goal touches the environment, whatever the base pose."""
    GRIPPER_BLOCKED_BY_ROBOT = 5
    """The gripper at the goal touches the robot itself."""
    ARM_BLOCKED = 6
    EXCLUDED = 7
    """A constraint excludes the configuration, which was not scored."""
    APPROACH_LIMITS = 8
    """Scored with approach: joint limits or velocity limits end the approach of every posture."""
    APPROACH_BLOCKED = 9
    """Scored with approach: no posture can be approached without contact."""
    OTHER_GOAL_UNREACHED = 10
    """A goal of a pair for two arms: the other arm does not reach the other goal."""
    ARMS_BLOCKED = 11
    """A goal of a pair for two arms: each arm reaches its goal, but they touch each other."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ScoreTable(ArrayTable):
    """Scores of H initial configurations at G goals; arrays are read-only.

    Rows follow the flat order of the grid: C order over (environment state, base x,
    base y, base yaw, torso level). Arrays over all pairs may be mapped to a scratch file
    (`tcs.files.mapped`): work on some of their rows at a time.
    """

    dexterity: NDArray[np.float32]
    """Greatest dexterity over all collision-free solutions, 0 where not reached, shape (H, G)."""
    reason: NDArray[np.uint8]
    """A `Reason` for each pair of configuration and goal, shape (H, G)."""
    pair: NDArray[np.int16] | NDArray[np.int32]
    """The bodies in contact, as index into `pair_names`; -1 where none, shape (H, G)."""
    pair_names: tuple[tuple[str, str], ...]
    """Names of two bodies in contact."""
    arm_joints: NDArray[np.float32]
    """Arm joints [rad] of the best solution of each of the R reached pairs, row-major in (h, g),
    shape (R, 7). Those of an arm of six joints follow a 0."""
    weights: NDArray[np.float64]
    """Weights of the goals, sum 1, shape (G,)."""
    hand: NDArray[np.uint8] | None = None
    """Number of the hand that reaches the goal, or comes nearest to it, shape (H, G); None if there
    is only one."""

    WHAT = "score table"
    COLUMNS: ClassVar[Columns] = {
        "weights": Column(np.float64, "G", Form.APART),
        "dexterity": Column(np.float32, "H G", Form.APART),
        "reason": Column(np.uint8, "H G"),
        "pair": Column((np.int16, np.int32), "H G", Form.APART),
        "arm_joints": Column(np.float32, "R 7", finite=True),
        "hand": Column(np.uint8, "H G", optional=True),
    }

    def __post_init__(self) -> None:
        """Check the arrays against each other and make them read-only.

        Raises:
            TcsError: If an array has the wrong type, shape or range.
        """
        self._check_arrays()
        self._check_ranges()

    def _check_ranges(self) -> None:
        """Check the ranges of the values."""
        weights, reached = self.weights, self.reached
        require(
            weights.size > 0
            and bool(np.all(weights >= 0.0))
            and abs(float(weights.sum()) - 1.0) <= WEIGHT_SUM_TOLERANCE,
            "score table: weights must be >= 0 and sum to 1.",
        )
        for rows in chunks(self.dexterity, self.reason, self.pair, reached):
            self._check_rows(rows)
        require(
            len(self.arm_joints) == np.count_nonzero(reached),
            f"score table: {len(self.arm_joints)} rows of arm joints for "
            f"{np.count_nonzero(reached)} reached pairs; the numbers must be equal.",
        )

    def _check_rows(self, rows: slice) -> None:
        """Check the ranges of the values of some configurations."""
        dexterity, pair = self.dexterity[rows], self.pair[rows]
        require(
            bool(np.all(self.reason[rows] <= max(Reason))),
            f"score table: reason outside 0..{max(Reason):d}.",
        )
        require(
            bool(np.all((dexterity >= 0.0) & (dexterity < np.inf))),
            "score table: dexterity must be finite and >= 0.",
        )
        require(
            not np.any(dexterity[~self.reached[rows]]),
            "score table: dexterity must be 0 where the goal is not reached.",
        )
        require(
            bool(np.all((pair >= -1) & (pair < len(self.pair_names)))),
            f"score table: pair outside -1..{len(self.pair_names) - 1}.",
        )

    @property
    def configurations(self) -> int:
        """H, the number of initial configurations."""
        return len(self.dexterity)

    @property
    def goals(self) -> int:
        """G, the number of goals."""
        return self.weights.size

    @cached_property
    def reached(self) -> NDArray[np.bool_]:
        """Whether the goal is reached, shape (H, G)."""
        reached: NDArray[np.bool_] = large_zeros(self.reason.shape, np.bool_)
        for rows in chunks(self.reason, reached):
            np.equal(self.reason[rows], Reason.REACHED, out=reached[rows])
        reached.flags.writeable = False
        return reached

    @property
    def has_no_free_body(self) -> NDArray[np.bool_]:
        """Whether a configuration's body is in contact or was not checked, shape (H,)."""
        stuck = np.empty(self.configurations, dtype=np.bool_)
        for rows in chunks(self.reason):
            reason = self.reason[rows]
            either = (reason == Reason.BODY_BLOCKED) | (reason == Reason.EXCLUDED)
            np.any(either, axis=1, out=stuck[rows])
        return stuck

    @cached_property
    def _reached_pairs(self) -> NDArray[np.intp]:
        """Flat (h, g) numbers of the reached pairs, ascending, shape (R,)."""
        return np.flatnonzero(self.reached)

    def reachability(self, rows: slice | NDArray[np.int64] = EVERY) -> NDArray[np.float64]:
        """Return P_R of each configuration, or of some, by itself, TCS eq. (1), shape (H,)."""
        return self._of_rows(tc_reachability, self.reached[rows])

    def manipulability(self, rows: slice | NDArray[np.int64] = EVERY) -> NDArray[np.float64]:
        """Return P_M of each configuration, or of some, by itself, TCS eq. (4), shape (H,)."""
        return self._of_rows(tc_manipulability, self.dexterity[rows])

    def _of_rows(
        self, equation: Callable[..., NDArray[np.float64]], values: NDArray[Any]
    ) -> NDArray[np.float64]:
        """Return an equation of the values of each configuration, worked out some at a time."""
        found = np.empty(len(values))
        for part in chunks(values):
            found[part] = equation(values[part], self.weights)
        return found

    def reason_counts(self) -> dict[str, int]:
        """Return the number of pairs of configuration and goal with each reason, by its name."""
        counts = np.zeros(len(Reason), dtype=np.int64)
        for rows in chunks(self.reason):
            counts += np.bincount(self.reason[rows].ravel(), minlength=len(Reason))
        return {reason.name.lower(): int(counts[reason]) for reason in Reason}

    def joints_of(self, h: int, g: int) -> NDArray[np.float32] | None:
        """Return the arm joints of the best solution [rad], shape (7,), or None if not reached.

        Those of an arm of six joints follow a 0.

        Args:
            h: Flat index of the initial configuration.
            g: Number of the goal.

        Raises:
            TcsError: If there is no such configuration or goal.
        """
        require(
            0 <= h < self.configurations and 0 <= g < self.goals,
            f"No pair of configuration {h} and goal {g}: the table has "
            f"{self.configurations} configurations and {self.goals} goals, counted from 0.",
        )
        if not self.reached[h, g]:
            return None
        row = int(np.searchsorted(self._reached_pairs, h * self.goals + g))
        return np.asarray(self.arm_joints[row])
