"""The explanation of one goal: why it is not reached, and from where it would be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from tcs.errors import SelectionError
from tcs.model.grid import InitialConfiguration
from tcs.placement.reasons.distribution import Distribution
from tcs.placement.reasons.explained import ExplainedConfiguration
from tcs.placement.reasons.fix import Fix, fix_weights, nearest_fix, with_hand
from tcs.placement.selection import (
    Match,
    SelectionTables,
    TravelWeights,
    nearest_table,
    scores_at_limbs,
    select,
)
from tcs.placement.store import ScoreFile, state_to_json
from tcs.placement.tables import SetTable


@dataclass(frozen=True, kw_only=True)
class Explanation:
    """Explanation of one goal, from a score file."""

    file: ScoreFile
    """The score file."""
    goal: int
    """Number of the goal."""
    match: Match
    """The observed state that was read, and how far it is from the observation."""
    explained: ExplainedConfiguration | None
    """The explained configuration; None if none was stated and no configuration reaches a goal."""
    best_set: tuple[int, ...]
    """Flat indices of the members of the recommended set, on the grid."""
    best_reaching: tuple[int, ...]
    """Flat indices of those members that reach the goal."""
    refined: tuple[InitialConfiguration, ...]
    """Members of the recommended set, if it is a refined one, between the grid points; else ()."""
    refined_reaching: tuple[int, ...]
    """Numbers of those that reach the goal, from 0."""
    distribution: Distribution
    """Distribution of the reasons over the whole grid."""
    weights: TravelWeights
    """Cost of each type of change."""
    fix: Fix | None
    """The nearest configuration that reaches the goal, None if there is none."""
    unreachable: int
    """Number of configurations that reach the goal but are unreachable around the furniture."""

    @property
    def body_frame(self) -> str | None:
        """Body frame of the goal, None if the file does not state it."""
        return self._of_goal("body_frame")

    @property
    def goal_name(self) -> str | None:
        """Where the goal is, as people say it, None if the file does not state it."""
        return self._of_goal("name") or None

    @property
    def goal_freedom(self) -> str | None:
        """What is free about the goal, in words; None for nothing."""
        return self._of_goal("free")

    def _of_goal(self, key: str) -> str | None:
        """Return a text that the file holds of the goal, None if there is none."""
        goals = self.file.task.get("goals")
        goal = goals[self.goal] if isinstance(goals, list) and self.goal < len(goals) else None
        text = goal.get(key) if isinstance(goal, dict) else None
        return text if isinstance(text, str) else None

    def to_json(self) -> dict[str, Any]:
        """Return the explanation as plain containers."""
        axes = self.file.observed_axes
        farthest = self.distribution.farthest
        return {
            "task": self.file.metadata["task"],
            "environment": self.file.metadata["environment"],
            "goal": self.goal,
            "goal_name": self.goal_name,
            **({} if self.goal_freedom is None else {"goal_free": self.goal_freedom}),
            "body_frame": self.body_frame,
            "observed": state_to_json(axes, self.match.state),
            "observed_error": state_to_json(axes, self.match.observed_error),
            **({"frames": frames} if (frames := self.match.to_json().get("frames")) else {}),
            "explained": None if self.explained is None else self._explained_to_json(),
            "best_set": {
                "configurations": list(self.best_set),
                "reaching": list(self.best_reaching),
            },
            "refined_set": {
                "members": [member.to_json() for member in self.refined],
                "reaching": list(self.refined_reaching),
            }
            if self.refined
            else None,
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

    def _explained_to_json(self) -> dict[str, Any]:
        """Return the explained configuration, with the name of its hand in a file of several."""
        assert self.explained is not None
        plain = self.explained.to_json()
        if self.file.hands:
            plain["hand"] = self.file.hand_names[self.explained.hand]
        return plain


def explain(
    file: ScoreFile,
    goal: int,
    configuration: int | InitialConfiguration | None = None,
    *,
    weights: TravelWeights | None = None,
    observed: Mapping[str, float] | None = None,
    frames: Mapping[str, Sequence[float]] | None = None,
) -> Explanation:
    """Return why a goal is not reached from a configuration, and the least change that reaches it.

    Only the scores are read: neither simulator nor compiler is needed.

    Args:
        file: A loaded score file.
        goal: Number of the goal, from 0.
        configuration: Flat index of a configuration of the grid, or any configuration, of which the
            nearest one of the grid is explained. None for the member of the recommended set with
            the greatest P_R + P_M by itself.
        weights: Cost of each type of change; by default `fix_weights` of the grid.
        observed: Observed values of the file's observed axes [m or rad].
        frames: Instead of `observed`, positions of body frames in W [m], by name. With several,
            each goal also has to be reached in the table nearest to its own frame, as in
            `tcs.select`; recommended set and base positions are those of the table nearest to all.

    Returns:
        The reason, the distribution of reasons over the grid, and the nearest configuration that
        reaches the goal. Changes start at the stated configuration, not at the one of the grid.

    Raises:
        GridError: If there is no configuration of that index.
        SelectionError: If there is no such goal, the configuration is beyond the grid or lacks an
            axis, or the observed state was not scored.
        UnknownNameError: If an axis has no such name.
    """
    stated = configuration if isinstance(configuration, InitialConfiguration) else None
    match = nearest_table(file, stated, observed, frames)
    table = file.tables[match.index]
    goals = table.sets.weights.size
    if isinstance(goal, bool) or not 0 <= goal < goals:
        raise SelectionError(
            f"There is no goal {goal}: task '{file.metadata['task']}' has {goals}, "
            f"numbered 0 to {goals - 1}."
        )
    grid, scores = file.configurations, scores_at_limbs(file, match)
    weights = fix_weights(grid) if weights is None else weights
    best_set = _recommended(file, match.index)
    requested = _best_member(table.sets, best_set) if configuration is None else configuration
    explained = None
    if requested is not None:
        explained = ExplainedConfiguration.of(grid, scores, goal, requested)
    fix, unreachable = None, 0
    if explained is not None:
        fix, unreachable = nearest_fix(grid, scores, table.sets.lattice, goal, explained, weights)
        fix = with_hand(file, scores, goal, fix, explained)
    refined, refined_reaching = _recommended_refined(file, match.index, goal)
    return Explanation(
        file=file,
        goal=goal,
        match=match,
        explained=explained,
        best_set=best_set,
        best_reaching=tuple(h for h in best_set if scores.reached[h, goal]),
        refined=refined,
        refined_reaching=refined_reaching,
        distribution=Distribution.of(scores, goal),
        weights=weights,
        fix=fix,
        unreachable=unreachable,
    )


def _recommended(file: ScoreFile, table: int) -> tuple[int, ...]:
    """Return the flat indices of the recommended set of the grid; () if no goal is reached."""
    tables = SelectionTables.of(file, table)
    return select(tables, refined=False).indices if len(tables.sets.candidates) else ()


def _recommended_refined(
    file: ScoreFile, table: int, goal: int
) -> tuple[tuple[InitialConfiguration, ...], tuple[int, ...]]:
    """Return the recommended set if it is a refined one, and its members that reach a goal."""
    refined = file.tables[table].refined
    if refined is None:
        return (), ()
    row = select(SelectionTables.of(file, table)).refined
    if row is None:
        return (), ()
    members = refined.members(file.configurations, row)
    return members, tuple(i for i in range(len(members)) if refined.reached[row, i, goal])


def _best_member(sets: SetTable, members: tuple[int, ...]) -> int | None:
    """Return the member of a set with the greatest P_R + P_M by itself; None without members."""
    if not members:
        return None
    rows = np.searchsorted(sets.candidates, members)
    scores = sets.single_reachability[rows] + sets.single_manipulability[rows]
    return members[int(np.argmax(scores))]
