"""Distribution of the reasons of one goal over all configurations of the grid."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tcs.files.mapped import chunks
from tcs.placement.tables import Reason, ScoreTable

CHECKS = (
    Reason.EXCLUDED,
    Reason.BODY_BLOCKED,
    Reason.GRIPPER_BLOCKED_BY_ENVIRONMENT,
    Reason.TOO_FAR,
    Reason.GRIPPER_BLOCKED_BY_ROBOT,
    Reason.JOINT_LIMITS,
    Reason.ARM_BLOCKED,
    Reason.APPROACH_LIMITS,
    Reason.APPROACH_BLOCKED,
    Reason.OTHER_GOAL_UNREACHED,
    Reason.ARMS_BLOCKED,
)
"""Reasons why a goal is not reached, in the order in which they are checked."""
ON_REQUEST = (
    (Reason.EXCLUDED,),
    (Reason.APPROACH_LIMITS, Reason.APPROACH_BLOCKED),
    (Reason.OTHER_GOAL_UNREACHED, Reason.ARMS_BLOCKED),
)
"""Checks that are made of some files only: under constraints, with approach, of two arms."""


def checks_of(reasons: Mapping[Reason, int]) -> tuple[Reason, ...]:
    """Return the `CHECKS` that were made.

    Those of `ON_REQUEST` count only if they stopped a configuration.

    Args:
        reasons: Number of configurations with each reason.
    """
    absent = {one for some in ON_REQUEST if not any(reasons[one] for one in some) for one in some}
    return tuple(one for one in CHECKS if one not in absent)


@dataclass(frozen=True, slots=True)
class BlockingPair:
    """Two bodies in contact, and how many configurations this stops."""

    pair: tuple[str, str]
    """Names of the bodies."""
    reason: Reason
    """The check they fail."""
    count: int
    """Number of configurations they stop."""

    def to_json(self) -> dict[str, Any]:
        """Return the counts as plain containers."""
        return {"pair": list(self.pair), "reason": self.reason.name.lower(), "count": self.count}


@dataclass(frozen=True, slots=True)
class CheckCount:
    """One check, with the number of configurations that came to it and that it stopped."""

    reason: Reason
    """Reason of the configurations that the check stops."""
    of: int
    """Number of configurations that no earlier check stopped."""
    stopped: int
    """Number of these that this check stopped."""

    def to_json(self) -> dict[str, Any]:
        """Return the counts as plain containers."""
        return {"reason": self.reason.name.lower(), "of": self.of, "stopped": self.stopped}


@dataclass(frozen=True)
class Distribution:
    """Reasons and blocking pairs of one goal, counted over the grid."""

    reasons: dict[Reason, int]
    """Number of configurations with each reason, `REACHED` included."""
    blocking_pairs: tuple[BlockingPair, ...]
    """The pairs of bodies in contact, most frequent first."""

    @classmethod
    def of(cls, scores: ScoreTable, goal: int) -> Distribution:
        """Return the distribution for one goal of a score table."""
        counts = np.zeros(len(Reason), dtype=np.int64)
        # One number for pair and reason, so that one pass counts both.
        times = np.zeros(len(scores.pair_names) * len(Reason), dtype=np.int64)
        for rows in chunks(scores.reason, scores.pair):
            reason, pair = scores.reason[rows, goal], scores.pair[rows, goal]
            counts += np.bincount(reason, minlength=len(Reason))
            blocked = pair >= 0
            keys = pair[blocked].astype(np.int64) * len(Reason) + reason[blocked]
            times += np.bincount(keys, minlength=times.size)
        pairs = [
            BlockingPair(
                scores.pair_names[key // len(Reason)], Reason(key % len(Reason)), int(times[key])
            )
            for key in np.flatnonzero(times).tolist()
        ]
        pairs.sort(key=lambda one: (-one.count, one.pair, one.reason))
        return cls({one: int(counts[one]) for one in Reason}, tuple(pairs))

    @property
    def configurations(self) -> int:
        """Number of configurations of the grid."""
        return sum(self.reasons.values())

    @property
    def reached(self) -> int:
        """Number of configurations that reach the goal."""
        return self.reasons[Reason.REACHED]

    @property
    def checks(self) -> tuple[CheckCount, ...]:
        """Counts of each of `CHECKS` that were made, in order."""
        found, left = [], self.configurations
        for reason in checks_of(self.reasons):
            found.append(CheckCount(reason, left, self.reasons[reason]))
            left -= self.reasons[reason]
        return tuple(found)

    @property
    def farthest(self) -> CheckCount | None:
        """The last check that stopped any configuration; None if all reach the goal."""
        stopping = [check for check in self.checks if check.stopped]
        return stopping[-1] if stopping else None

    def pairs_of(self, reason: Reason) -> tuple[BlockingPair, ...]:
        """Return the pairs of bodies that fail a check, most frequent first."""
        return tuple(one for one in self.blocking_pairs if one.reason == reason)
