"""A set of a score file in the viewer, and the result of any configuration at every goal."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tcs.model.grid import Grid, InitialConfiguration
from tcs.output.report.score.shown_set import ShownSet
from tcs.output.words import (
    REASON_NAMES,
    REASON_TEXTS,
    assign_goals,
    assigned_goals,
    goal_list,
    goal_names,
    goals_by_reason,
    goals_text,
    pair_text,
    place_in_line,
    place_of_state,
)
from tcs.placement.refinement import RefinedMembers
from tcs.placement.store import ScoreFile
from tcs.placement.tables import Reason, ScoreTable, SuccessTable
from tcs.placement.tables.equations import tc_manipulability, tc_reachability


@dataclass(frozen=True, eq=False)
class ConfigurationResult:
    """The results of one configuration."""

    index: int
    """Flat index of the configuration."""
    configuration: InitialConfiguration
    """The configuration."""
    reasons: tuple[Reason, ...]
    """The reason at each goal."""
    pairs: tuple[tuple[str, str] | None, ...]
    """The bodies in contact at each goal, if a contact is the reason."""
    reachability: float
    """P_R of the configuration by itself, TCS eq. (1)."""
    manipulability: float
    """P_M of the configuration by itself, TCS eq. (4)."""
    names: tuple[str, ...] = ()
    """Names of all goals, "" for one without; () if they are not known."""
    place: str = ""
    """Where the base is relative to the person, as a sentence; "" without a person."""

    @property
    def reached(self) -> tuple[int, ...]:
        """Numbers of the goals that are reached."""
        return tuple(g for g, one in enumerate(self.reasons) if one == Reason.REACHED)

    def line(self, goal: int) -> str:
        """Return the result as a line of text.

        Args:
            goal: The goal that is shown, which comes first.
        """
        place = [place_in_line(self.place)] if self.place else []
        of_goal = f"{goals_text((goal,), self.names)} {self._goal_text(goal)}"
        return "; ".join([*place, of_goal, self.summary])

    @property
    def summary(self) -> str:
        """The goals reached, the scores, and the reasons at the other goals."""
        scores = (
            f"{len(self.reached)} of {len(self.reasons)} goals, "
            f"P_R {self.reachability:.0%}, P_M {self.manipulability:.3f}"
        )
        missed = goals_by_reason(self.reasons).items()
        rest = [
            f"{REASON_NAMES[reason]}: {goal_list(goals, self.names)}" for reason, goals in missed
        ]
        return "; ".join([scores, *rest])

    def _goal_text(self, goal: int) -> str:
        reason, pair = self.reasons[goal], self.pairs[goal]
        if reason == Reason.REACHED:
            return "reached"
        contact = f" ({pair_text(pair)})" if pair is not None else ""
        return f"not reached: {REASON_TEXTS[reason]}{contact}"


@dataclass(frozen=True, eq=False)
class ViewedSet:
    """A state table of a score file, and one of its sets."""

    grid: Grid
    """The grid of configurations."""
    scores: ScoreTable
    """Scores of the grid."""
    members: tuple[int, ...]
    """Flat indices of the set in the order of the tour; empty if no goal is reached."""
    success: SuccessTable | None
    """Estimated success under error, if the file holds estimates."""
    refined: RefinedMembers | None = None
    """The members of a refined set: after the configurations of the grid, they have the flat
    indices from `grid.size`."""
    origin: tuple[int, ...] = ()
    """Flat indices of the configurations of the grid that they were refined from."""
    file: ScoreFile | None = None
    """The score file, which knows the names of the goals and where the person is; None if only the
    table is known."""
    table: int = 0
    """Number of the state table in it."""

    @classmethod
    def of(cls, file: ScoreFile, table: int, members: tuple[int, ...]) -> ViewedSet:
        """Return a set of a state table of a file."""
        found = file.tables[table]
        grid = Grid.from_dict(file.grid)
        return cls(grid, found.scores, members, found.success, file=file, table=table)

    @classmethod
    def of_shown(cls, shown: ShownSet) -> ViewedSet:
        """Return the set of a score file that is shown, which may be refined."""
        if shown.refined is None:
            return cls.of(shown.file, shown.table, shown.indices)
        found, grid = shown.file.tables[shown.table], Grid.from_dict(shown.file.grid)
        members = tuple(grid.size + i for i in range(len(shown.members)))
        refined = RefinedMembers(shown.members, shown.scores)
        return cls(
            grid, found.scores, members, found.success, refined, shown.indices,
            file=shown.file, table=shown.table,
        )  # fmt: skip

    def configuration(self, index: int) -> InitialConfiguration:
        """Return a configuration of the grid, or a member of a refined set."""
        if self.refined is not None and index >= self.grid.size:
            return self.refined.members[index - self.grid.size]
        return self.grid.configuration(index)

    def on_grid(self, index: int) -> int:
        """Return the configuration of the grid that a member was refined from, or itself."""
        return self.origin[index - self.grid.size] if index >= self.grid.size else index

    def _row(self, index: int) -> tuple[ScoreTable, int]:
        """Return the scores that hold a configuration, and its row in them."""
        if self.refined is not None and index >= self.grid.size:
            return self.refined.scores, index - self.grid.size
        return self.scores, index

    @property
    def goals(self) -> int:
        """Number of goals."""
        return self.scores.goals

    def result(self, index: int) -> ConfigurationResult:
        """Return the results of a configuration.

        Args:
            index: Its flat index.

        Raises:
            GridError: If there is no configuration of that index.
        """
        (scores, row), configuration = self._row(index), self.configuration(index)
        names = scores.pair_names
        return ConfigurationResult(
            index=index,
            configuration=configuration,
            reasons=tuple(Reason(code) for code in scores.reason[row]),
            pairs=tuple(names[i] if i >= 0 else None for i in scores.pair[row].tolist()),
            reachability=float(tc_reachability(scores.reached[row], scores.weights)),
            manipulability=float(tc_manipulability(scores.dexterity[row], scores.weights)),
            names=() if self.file is None else goal_names(self.file.task, self.goals),
            place="" if self.file is None else place_of_state(self.file, self.table, configuration),
        )

    def joints(self, index: int, goal: int) -> NDArray[np.float32] | None:
        """Return the stored arm joints [rad] at a goal, shape (7,); None where not reached."""
        scores, row = self._row(index)
        return scores.joints_of(row, goal)

    def hand(self, index: int, goal: int) -> int:
        """Return the number of the hand that reaches a goal."""
        scores, row = self._row(index)
        return 0 if scores.hand is None else int(scores.hand[row, goal])

    def environment_state(self, index: int) -> int:
        """Return the number of a configuration's environment state, in C order over its axes."""
        return self.on_grid(index) // (self.grid.size // math.prod(self.grid.environment_shape))

    def served(self, number: int) -> tuple[int, ...]:
        """Return the goals that a member of the set serves, ascending.

        Args:
            number: Number of the member in the set.
        """
        return assigned_goals(self.assignment, number)

    @cached_property
    def assignment(self) -> tuple[int | None, ...]:
        """Number of the member that serves each goal, from 0; None where no member reaches it."""
        if self.refined is not None:
            return assign_goals(self.refined.scores, range(len(self.members)))
        return assign_goals(self.scores, self.members)
