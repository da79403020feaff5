"""The set of a score file that a report or picture shows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from tcs.model.grid import Grid, InitialConfiguration
from tcs.output.words import (
    base_pose_text,
    goal_names,
    member_places,
    place_in_line,
    place_of_state,
    scores_text,
)
from tcs.placement.refinement import refined_table, score_members
from tcs.placement.selection import SelectionTables, UtilityWeights, nearest_table, select
from tcs.placement.store import ScoreFile
from tcs.placement.tables import RefinedSet, ScoreTable, SuccessTable


class SuccessEstimate(NamedTuple):
    """Estimated success of a set under error."""

    mean: float
    """Mean of P_R over the samples."""
    low: float
    """Lower end of its 95 % interval."""
    high: float
    """Upper end."""
    samples: int
    """Number of samples."""


@dataclass(frozen=True)
class ShownSet:
    """One set, its members in the order of the tour."""

    here: InitialConfiguration | None
    """The current state for which the set was selected; None for the set with the best scores."""
    members: tuple[InitialConfiguration, ...]
    """Its configurations; empty if no configuration reaches a goal."""
    indices: tuple[int, ...]
    """Their flat configuration indices; of a refined set those from which it was refined."""
    table: int
    """Number of the state table that holds the set."""
    subtitle: str
    """How the set was selected, and its scores, as one line of text."""
    file: ScoreFile = field(repr=False, compare=False)
    """The score file."""
    refined: RefinedSet | None = None
    """The refined set that is shown; None for a set of the grid."""

    @classmethod
    def of(
        cls,
        file: ScoreFile,
        here: InitialConfiguration | None,
        max_members: int | None = None,
        observed: Mapping[str, float] | None = None,
        *,
        refined: bool = True,
    ) -> ShownSet:
        """Return the set selected for the current state, or the best set if `here` is None.

        In a file with refined sets, the best set is the best of these.

        Args:
            file: A score file.
            here: The current state.
            max_members: Most members of the set; by default as many as the file holds.
            observed: Observed values of the observed axes [m or rad].
            refined: Whether a refined set may be shown.
        """
        table = nearest_table(file, here, observed).index
        sets = file.tables[table].sets
        if here is not None:
            choice = select(file, here, max_members=max_members, observed=observed, refined=refined)
            members = tuple(choice.members[i] for i in choice.order)
            indices = tuple(choice.indices[i] for i in choice.order)
            place = place_of_state(file, table, here)
            now = f"{place_in_line(place)}, at " if place else "at "
            what = (
                f"selected for a robot {now}{base_pose_text(here.to_json())}, "
                f"travel cost {choice.cost:.2f}"
            )
            if choice.refined is not None:
                chosen = RefinedSet(table, choice.refined, tuple(choice.order))
                return cls._of_refined(file, chosen, here, what)
        elif refined and (row := _best_refined(file, table, max_members)) is not None:
            table_of_refined = refined_table(file, table)
            order = tuple(range(int(table_of_refined.sizes[row])))
            return cls._of_refined(file, RefinedSet(table, row, order), None, "best refined set")
        else:
            indices = _best_of(file, table, max_members)
            grid = Grid.from_dict(file.grid)
            members = tuple(grid.configuration(h) for h in indices)
            what = "best set"
        if not members:
            return cls(None, (), (), table, "no configuration reaches a goal", file)
        scores = scores_text(*sets.scores_of(tuple(sorted(indices))), file.metadata["measure"])
        return cls(here, members, indices, table, f"{what}: {scores}", file)

    @classmethod
    def _of_refined(
        cls, file: ScoreFile, chosen: RefinedSet, here: InitialConfiguration | None, what: str
    ) -> ShownSet:
        """Return a refined set."""
        refined = refined_table(file, chosen.table)
        members = refined.members(file.configurations, chosen.row)
        pair = float(refined.reachability[chosen.row]), float(refined.manipulability[chosen.row])
        return cls(
            here,
            tuple(members[i] for i in chosen.order),
            tuple(int(refined.origin[chosen.row, i]) for i in chosen.order),
            chosen.table,
            f"{what}: {scores_text(*pair, file.metadata['measure'])}",
            file,
            chosen,
        )

    @property
    def stored(self) -> tuple[int, ...]:
        """Flat indices of the members, ascending; () for a refined set, which is off the grid."""
        return tuple(sorted(self.indices)) if self.refined is None else ()

    @property
    def success(self) -> SuccessEstimate | None:
        """Its estimated success under error; None without an estimate."""
        table = self.file.tables[self.table]
        if self.refined is None:
            return estimate_of(table.success, self.stored)
        found = refined_table(self.file, self.table).success
        if found is None:
            return None
        row = self.refined.row
        mean, low, high = (float(array[row]) for array in (found.mean, found.low, found.high))
        return SuccessEstimate(mean, low, high, found.samples)

    @property
    def places(self) -> list[str]:
        """Where each member is relative to the person, as a sentence; "" without a person."""
        return member_places(self.file, self.table, self.indices, self.members)

    @property
    def goal_names(self) -> tuple[str, ...]:
        """Where each goal is, as people say it; "" where the file does not state it."""
        return goal_names(self.file.task, self.scores.goals)

    @property
    def reachability(self) -> float:
        """P_R of the set, 0 if it has no member."""
        return self._pair[0]

    @property
    def manipulability(self) -> float:
        """P_M of the set, 0 if it has no member."""
        return self._pair[1]

    @cached_property
    def scores(self) -> ScoreTable:
        """Scores in which the members have the rows `rows`.

        Those of a refined set are computed by the kernel.
        """
        if self.refined is None:
            return self.file.tables[self.table].scores
        return score_members(self.file, self.refined).scores

    @property
    def rows(self) -> tuple[int, ...]:
        """Rows of the members in `scores`, in the order of the tour."""
        return self.indices if self.refined is None else tuple(range(len(self.members)))

    @property
    def _pair(self) -> tuple[float, float]:
        if not self.members:
            return (0.0, 0.0)
        if self.refined is None:
            return self.file.tables[self.table].sets.scores_of(self.stored)
        refined = refined_table(self.file, self.refined.table)
        row = self.refined.row
        return float(refined.reachability[row]), float(refined.manipulability[row])


def _best_refined(file: ScoreFile, table: int, max_members: int | None) -> int | None:
    """Return the number of the best refined set of a table with few enough members."""
    refined = file.tables[table].refined
    if refined is None:
        return None
    rows = np.flatnonzero(refined.sizes <= (max_members or refined.origin.shape[1]))
    return int(rows[0]) if rows.size else None


def _best_of(file: ScoreFile, table: int, max_members: int | None) -> tuple[int, ...]:
    """Return the best set of a table with at most `max_members` members, without travel costs.

    Raises:
        SelectionError: If the file holds no sets of that many members.
    """
    sets = file.tables[table].sets
    if max_members is None or len(sets.best) <= max_members <= sets.max_members:
        return sets.best
    if max_members == 1:
        return sets.best_single
    # Without a weight of travel the current state does not matter.
    anywhere = InitialConfiguration(base_x=0.0, base_y=0.0, base_yaw=0.0, torso=0.0)
    free = UtilityWeights(travel=0.0, places=0.0, environment=0.0)
    tables = SelectionTables.of(file, table)
    choice = select(tables, anywhere, weights=free, max_members=max_members, refined=False)
    return choice.indices


def estimate_of(success: SuccessTable | None, members: tuple[int, ...]) -> SuccessEstimate | None:
    """Return the estimate of a set of the grid; None without one.

    Args:
        success: The table's estimates.
        members: Flat configuration indices, ascending.
    """
    row = success.row_of(members) if success is not None and members else None
    if success is None or row is None:
        return None
    mean, low, high = (float(of[row]) for of in (success.success, success.low, success.high))
    return SuccessEstimate(mean, low, high, int(success.samples[row]))
