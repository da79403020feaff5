"""Table of the goals that a motion was found for, from some of the configurations."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from tcs.placement.tables.columns import ArrayTable, Column, Columns, Form, require


class MotionOutcome(IntEnum):
    """Whether a goal can be done from a configuration, from rest and back; if not, why."""

    UNREACHED = 0
    """No posture reaches it, or none was found again."""
    DONE = 1
    REST_BLOCKED = 2
    """Something touches the arm in its rest posture."""
    APPROACH_LIMITS = 3
    """Joint or velocity limits prevent the straight approach."""
    APPROACH_BLOCKED = 4
    """Something is in the way of the straight approach or retreat."""
    NO_PATH = 5
    """No path was found between the rest posture and the approach."""


@dataclass(frozen=True, kw_only=True, eq=False)
class MotionTable(ArrayTable):
    """Outcomes of the search for motions from n configurations to G goals; read-only."""

    configurations: NDArray[np.int32]
    """Flat indices of the examined configurations, ascending, shape (n,)."""
    outcome: NDArray[np.uint8]
    """A `MotionOutcome` for each examined configuration and goal, shape (n, G)."""
    pair: NDArray[np.int32]
    """The bodies whose contact was most often in the way, as index into `pair_names`; -1 where
    none, shape (n, G)."""
    pair_names: tuple[tuple[str, str], ...]
    """Names of two bodies in contact."""

    WHAT = "motion table"
    COLUMNS: ClassVar[Columns] = {
        "configurations": Column(np.int32, "n", Form.STEPS, key="configuration_step"),
        "outcome": Column(np.uint8, "n G"),
        "pair": Column(np.int32, "n G", Form.PLUS_ONE),
    }

    def __post_init__(self) -> None:
        """Check the arrays against each other and make them read-only.

        Raises:
            TcsError: If an array has the wrong type, shape or range.
        """
        self._check_arrays()
        ascending = bool(np.all(np.diff(self.configurations) > 0))
        require(
            ascending and bool(np.all(self.configurations >= 0)),
            "motion table: configurations must be ascending and >= 0.",
        )
        require(
            bool(np.all(self.outcome <= max(MotionOutcome))),
            f"motion table: outcome outside 0..{max(MotionOutcome):d}.",
        )
        require(
            bool(np.all((self.pair >= -1) & (self.pair < len(self.pair_names)))),
            f"motion table: pair outside -1..{len(self.pair_names) - 1}.",
        )

    @property
    def done(self) -> NDArray[np.bool_]:
        """Whether a goal can be done from each examined configuration, shape (n, G)."""
        return np.asarray(self.outcome == MotionOutcome.DONE)

    def counts(self, reached: NDArray[np.bool_]) -> dict[str, int]:
        """Return the number of reached pairs with each outcome, by its name.

        Args:
            reached: Whether scoring reaches a goal from each examined configuration, shape (n, G).
        """
        counts = np.bincount(self.outcome[reached], minlength=len(MotionOutcome))
        return {outcome.name.lower(): int(counts[outcome]) for outcome in MotionOutcome}
