"""How the reasons of one goal are distributed over all configurations of the grid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tcs.placement.tables import Reason, ScoreTable

CHECKS = (
    Reason.BODY_BLOCKED,
    Reason.GRIPPER_BLOCKED_BY_ENVIRONMENT,
    Reason.TOO_FAR,
    Reason.GRIPPER_BLOCKED_BY_ROBOT,
    Reason.JOINT_LIMITS,
    Reason.ARM_BLOCKED,
)
"""What may keep a configuration from a goal, in the order in which it is looked at."""


@dataclass(frozen=True, slots=True)
class BlockingPair:
    """Two bodies that keep the goal from being reached."""

    pair: tuple[str, str]
    """Names of the bodies."""
    reason: Reason
    """What they block."""
    count: int
    """How many configurations they stop."""

    def to_json(self) -> dict[str, Any]:
        """Return it as plain containers."""
        return {"pair": list(self.pair), "reason": self.reason.name.lower(), "count": self.count}


@dataclass(frozen=True, slots=True)
class Check:
    """One check, and how many of the configurations that came so far it stopped."""

    reason: Reason
    """What the configurations that it stops have as their reason."""
    of: int
    """Configurations that no earlier check stopped."""
    stopped: int
    """Those of them that this one stopped."""

    def to_json(self) -> dict[str, Any]:
        """Return it as plain containers."""
        return {"reason": self.reason.name.lower(), "of": self.of, "stopped": self.stopped}


@dataclass(frozen=True)
class Distribution:
    """Reasons and blocking pairs of one goal, counted over the grid."""

    reasons: dict[Reason, int]
    """How many configurations have each reason, reached ones among them."""
    blocking_pairs: tuple[BlockingPair, ...]
    """The pairs of bodies that block, most frequent first."""

    @classmethod
    def of(cls, scores: ScoreTable, goal: int) -> Distribution:
        """Return the distribution of one goal of a table."""
        reason, pair = scores.reason[:, goal], scores.pair[:, goal]
        counts = np.bincount(reason, minlength=len(Reason))
        blocked = pair >= 0
        # One number for each pair of bodies and what it blocks, so that one pass counts both.
        keys = pair[blocked].astype(np.int64) * len(Reason) + reason[blocked]
        found, times = np.unique(keys, return_counts=True)
        pairs = [
            BlockingPair(scores.pair_names[key // len(Reason)], Reason(key % len(Reason)), count)
            for key, count in zip(found.tolist(), times.tolist(), strict=True)
        ]
        pairs.sort(key=lambda one: (-one.count, one.pair, one.reason))
        return cls({one: int(counts[one]) for one in Reason}, tuple(pairs))

    @property
    def configurations(self) -> int:
        """How many configurations the grid has."""
        return sum(self.reasons.values())

    @property
    def reached(self) -> int:
        """How many of them reach the goal."""
        return self.reasons[Reason.REACHED]

    @property
    def checks(self) -> tuple[Check, ...]:
        """Each of `CHECKS` among those configurations that no earlier one stopped."""
        found, left = [], self.configurations
        for reason in CHECKS:
            found.append(Check(reason, left, self.reasons[reason]))
            left -= self.reasons[reason]
        return tuple(found)

    @property
    def farthest(self) -> Check | None:
        """The last check that stopped any configuration; None where all reach the goal."""
        stopping = [check for check in self.checks if check.stopped]
        return stopping[-1] if stopping else None

    def pairs_of(self, reason: Reason) -> tuple[BlockingPair, ...]:
        """Return the pairs that block in this way, most frequent first."""
        return tuple(one for one in self.blocking_pairs if one.reason == reason)
