"""The set of a score file that a report or picture shows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from tcs.model.grid import Grid, InitialConfiguration
from tcs.output.words import base_pose_text, scores_text
from tcs.placement.selection import SelectionTables, UtilityWeights, nearest_table, select
from tcs.placement.store import ScoreFile


@dataclass(frozen=True)
class ShownSet:
    """One set, its members in the order of the tour."""

    here: InitialConfiguration | None
    """The current state for which the set was selected; None for the set with the best scores."""
    members: tuple[InitialConfiguration, ...]
    """Its configurations; empty if no configuration reaches a goal."""
    indices: tuple[int, ...]
    """Their flat configuration indices."""
    table: int
    """Number of the state table that holds the set."""
    subtitle: str
    """How the set was selected, and its scores, as one line of text."""

    @classmethod
    def of(
        cls,
        file: ScoreFile,
        here: InitialConfiguration | None,
        max_members: int | None = None,
        observed: Mapping[str, float] | None = None,
    ) -> ShownSet:
        """Return the set selected for the current state, or the best set if `here` is None.

        Args:
            file: A score file.
            here: The current state.
            max_members: Most members of the set; by default as many as the file holds.
            observed: Observed values of the observed axes [m or rad].
        """
        table = nearest_table(file, here, observed).index
        sets = file.tables[table].sets
        if here is not None:
            choice = select(file, here, max_members=max_members, observed=observed, refined=False)
            members = tuple(choice.members[i] for i in choice.order)
            indices = tuple(choice.indices[i] for i in choice.order)
            what = (
                f"selected for a robot at {base_pose_text(here.to_json())}, "
                f"travel cost {choice.cost:.2f}"
            )
        else:
            indices = _best_of(file, table, max_members)
            grid = Grid.from_dict(file.grid)
            members = tuple(grid.configuration(h) for h in indices)
            what = "best set"
        if not members:
            return cls(None, (), (), table, "no configuration reaches a goal")
        scores = scores_text(*sets.scores_of(tuple(sorted(indices))), file.metadata["measure"])
        return cls(here, members, indices, table, f"{what}: {scores}")


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
