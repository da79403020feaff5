"""What a score file answers about one configuration: which goals are reached, why not the rest."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tcs.model.grid import Grid, InitialConfiguration
from tcs.output.words import (
    REASON_NAMES,
    REASON_TEXTS,
    assign_goals,
    assigned_goals,
    goal_list,
    goals_by_reason,
    pair_text,
)
from tcs.placement.store import ScoreFile
from tcs.placement.tables import Reason, ScoreTable, SuccessTable
from tcs.placement.tables.equations import tc_manipulability, tc_reachability


@dataclass(frozen=True, eq=False)
class ConfigurationResult:
    """What came of one configuration at every goal."""

    index: int
    """Its flat index."""
    configuration: InitialConfiguration
    """It itself."""
    reasons: tuple[Reason, ...]
    """Whether each goal is reached, or why not."""
    pairs: tuple[tuple[str, str] | None, ...]
    """The two bodies that block at each goal, if any do."""
    reachability: float
    """P_R of the configuration by itself, TCS eq. (1)."""
    manipulability: float
    """P_M of the configuration by itself, TCS eq. (4)."""

    @property
    def reached(self) -> tuple[int, ...]:
        """Numbers of the goals that are reached."""
        return tuple(g for g, one in enumerate(self.reasons) if one == Reason.REACHED)

    def line(self, goal: int) -> str:
        """Return the result as a line of text.

        Args:
            goal: The goal that is shown: it is told first.
        """
        return f"goal {goal} {self._goal_text(goal)}; {self.summary}"

    @property
    def summary(self) -> str:
        """What is reached, the scores, and why the rest is not reached."""
        scores = (
            f"{len(self.reached)} of {len(self.reasons)} goals, "
            f"P_R {self.reachability:.0%}, P_M {self.manipulability:.3f}"
        )
        missed = goals_by_reason(self.reasons).items()
        rest = [f"{REASON_NAMES[reason]}: {goal_list(goals)}" for reason, goals in missed]
        return "; ".join([scores, *rest])

    def _goal_text(self, goal: int) -> str:
        reason, pair = self.reasons[goal], self.pairs[goal]
        if reason == Reason.REACHED:
            return "reached"
        contact = f" ({pair_text(pair)})" if pair is not None else ""
        return f"not reached: {REASON_TEXTS[reason]}{contact}"


@dataclass(frozen=True, eq=False)
class ViewedSet:
    """One table of a score file, and the set of it that is looked at."""

    grid: Grid
    """What can be chosen."""
    scores: ScoreTable
    """Its scores."""
    members: tuple[int, ...]
    """Flat indices of the set in the order of the tour; none where no goal is reached."""
    success: SuccessTable | None
    """Estimated success under error, where the file holds any."""

    @classmethod
    def of(cls, file: ScoreFile, table: int, members: tuple[int, ...]) -> ViewedSet:
        """Return the answers of one table of a file."""
        found = file.tables[table]
        return cls(Grid.from_dict(file.grid), found.scores, members, found.success)

    @property
    def goals(self) -> int:
        """How many goals there are."""
        return self.scores.goals

    def result(self, index: int) -> ConfigurationResult:
        """Return what came of a configuration.

        Args:
            index: Its flat index.

        Raises:
            GridError: If there is none of that index.
        """
        scores, configuration = self.scores, self.grid.configuration(index)
        names = scores.pair_names
        return ConfigurationResult(
            index=index,
            configuration=configuration,
            reasons=tuple(Reason(code) for code in scores.reason[index]),
            pairs=tuple(names[i] if i >= 0 else None for i in scores.pair[index].tolist()),
            reachability=float(tc_reachability(scores.reached[index], scores.weights)),
            manipulability=float(tc_manipulability(scores.dexterity[index], scores.weights)),
        )

    def joints(self, index: int, goal: int) -> NDArray[np.float32] | None:
        """Return the stored arm joints [rad] at a goal, shape (7,); None where not reached."""
        return self.scores.joints_of(index, goal)

    def environment_state(self, index: int) -> int:
        """Return the number of a configuration's environment state, in C order over its axes."""
        return index // (self.grid.size // math.prod(self.grid.environment_shape))

    def served(self, number: int) -> tuple[int, ...]:
        """Return the goals that a member of the set serves better than the others do.

        Args:
            number: Number of the member in the set.

        Returns:
            The goals it reaches with the greatest measure of all members, ascending; a goal that
            several serve alike counts for the first of them.
        """
        return assigned_goals(self.assignment, number)

    @cached_property
    def assignment(self) -> tuple[int | None, ...]:
        """Number of the member that serves each goal, from 0; None where no member reaches it."""
        return assign_goals(self.scores, self.members)
