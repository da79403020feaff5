"""Explain one goal: why it is not reached from here, from where it is, and what to change."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from tcs.errors import SelectionError
from tcs.model.grid import Grid, InitialConfiguration
from tcs.placement.reasons.distribution import Distribution
from tcs.placement.reasons.explained import Standing
from tcs.placement.reasons.fix import Fix, fix_weights, nearest_fix
from tcs.placement.selection import Match, TravelWeights, nearest_table
from tcs.placement.store import ScoreFile, state_to_json
from tcs.placement.tables import SetTable


@dataclass(frozen=True, kw_only=True)
class Explanation:
    """What a score file tells about one goal."""

    file: ScoreFile
    """The file."""
    goal: int
    """Number of the goal."""
    match: Match
    """Which table of the file was read, and how far it is from what was observed."""
    standing: Standing | None
    """The configuration that is explained; None where no goal is reached from anywhere and none
    was named."""
    best_set: tuple[int, ...]
    """Flat indices of the best set of the table."""
    best_reaching: tuple[int, ...]
    """Those of them that reach the goal."""
    distribution: Distribution
    """Reasons over the whole grid."""
    weights: TravelWeights
    """What each kind of change costs."""
    fix: Fix | None
    """The nearest configuration that reaches the goal, None where there is none."""
    unreachable: int
    """How many configurations reach the goal but cannot be driven to around the furniture."""

    @property
    def body_frame(self) -> str | None:
        """The part of the person the goal is on, where the file tells."""
        goals = self.file.task.get("goals")
        goal = goals[self.goal] if isinstance(goals, list) and self.goal < len(goals) else None
        frame = goal.get("body_frame") if isinstance(goal, dict) else None
        return frame if isinstance(frame, str) else None

    def to_json(self) -> dict[str, Any]:
        """Return the explanation as plain containers."""
        axes = self.file.observed_axes
        farthest = self.distribution.farthest
        return {
            "task": self.file.metadata["task"],
            "environment": self.file.metadata["environment"],
            "goal": self.goal,
            "body_frame": self.body_frame,
            "observed": state_to_json(axes, self.match.state),
            "observed_error": state_to_json(axes, self.match.observed_error),
            "explained": None if self.standing is None else self.standing.to_json(),
            "best_set": {
                "configurations": list(self.best_set),
                "reaching": list(self.best_reaching),
            },
            "configurations": self.distribution.configurations,
            "reasons": {
                reason.name.lower(): count for reason, count in self.distribution.reasons.items()
            },
            "checks": [check.to_json() for check in self.distribution.checks],
            "farthest": None if farthest is None else farthest.to_json(),
            "blocking_pairs": [pair.to_json() for pair in self.distribution.blocking_pairs],
            "weights": {**asdict(self.weights), "environment": dict(self.weights.environment)},
            "unreachable": self.unreachable,
            "nearest_reaching": None if self.fix is None else self.fix.to_json(),
        }


def explain(
    file: ScoreFile,
    goal: int,
    configuration: int | InitialConfiguration | None = None,
    *,
    weights: TravelWeights | None = None,
    observed: Mapping[str, float] | None = None,
    frames: Mapping[str, Sequence[float]] | None = None,
) -> Explanation:
    """Return why a goal is not reached from a configuration, and what would reach it.

    Reads the scores alone: neither simulator nor compiler is needed.

    Args:
        file: A loaded score file.
        goal: Number of the goal, from 0.
        configuration: Flat index of a configuration of the grid; or a place of robot and
            environment, of which the nearest configuration is explained. None for the member of
            the best set with the greatest P_R + P_M by itself.
        weights: What each kind of change costs; by default `fix_weights` of the grid.
        observed: How the person is found: values of the file's observed axes [m or rad].
        frames: The same told by places of body frames in W [m], by name.

    Returns:
        The reason, the distribution of reasons over the grid, and the nearest configuration that
        reaches the goal. Changes start at a stated place itself, not at what it is nearest to.

    Raises:
        GridError: If there is no configuration of that index.
        SelectionError: If there is no such goal, the place is beyond the grid or lacks an axis,
            or what is observed was not scored.
        UnknownNameError: If an axis has no such name.
    """
    place = configuration if isinstance(configuration, InitialConfiguration) else None
    match = nearest_table(file, place, observed, frames)
    table = file.tables[match.index]
    goals = table.sets.weights.size
    if isinstance(goal, bool) or not 0 <= goal < goals:
        raise SelectionError(
            f"There is no goal {goal}: task '{file.metadata['task']}' has {goals}, "
            f"numbered 0 to {goals - 1}."
        )
    grid, scores = Grid.from_dict(file.grid), table.scores
    weights = fix_weights(grid) if weights is None else weights
    asked = _best_member(table.sets) if configuration is None else configuration
    standing = None if asked is None else Standing.of(grid, scores, goal, asked)
    fix, unreachable = None, 0
    if standing is not None:
        fix, unreachable = nearest_fix(grid, scores, table.sets.lattice, goal, standing, weights)
    return Explanation(
        file=file,
        goal=goal,
        match=match,
        standing=standing,
        best_set=table.sets.best,
        best_reaching=tuple(h for h in table.sets.best if scores.reached[h, goal]),
        distribution=Distribution.of(scores, goal),
        weights=weights,
        fix=fix,
        unreachable=unreachable,
    )


def _best_member(sets: SetTable) -> int | None:
    """Return the member of the best set that has the greatest P_R + P_M by itself."""
    if not sets.best:
        return None
    rows = np.searchsorted(sets.candidates, sets.best)
    scores = sets.single_reachability[rows] + sets.single_manipulability[rows]
    return sets.best[int(np.argmax(scores))]
