"""What the members of a refined set reach, with the reasons where they do not."""

from __future__ import annotations

from typing import NamedTuple

from tcs.errors import SelectionError
from tcs.model.grid import InitialConfiguration
from tcs.placement.refinement.points import PointScorer
from tcs.placement.store import ScoreFile
from tcs.placement.tables import RefinedSet, RefinedTable, ScoreTable


class RefinedMembers(NamedTuple):
    """The members of a refined set, in the order of the visits."""

    members: tuple[InitialConfiguration, ...]
    """The configurations."""
    scores: ScoreTable
    """Their scores, a row for each."""


def refined_table(file: ScoreFile, table: int) -> RefinedTable:
    """Return the refined sets of a table.

    Raises:
        SelectionError: If there are none.
    """
    refined = file.tables[table].refined
    if refined is None:
        raise SelectionError("No sets of this table were refined. Refine them: tcs refine FILE.")
    return refined


def score_members(file: ScoreFile, chosen: RefinedSet, jobs: int = 2) -> RefinedMembers:
    """Return the members of a refined set with their scores, computed by the kernel.

    The file holds what the members reach; this has the reasons, and the bodies in contact, too.

    Args:
        file: A score file with refined sets.
        chosen: The set.
        jobs: Number of threads.

    Raises:
        StoreMismatchError: If the file was made from other models.
        SelectionError: If the table was not refined.
    """
    refined = refined_table(file, chosen.table)
    at = chosen.row, list(chosen.order)
    scorer = PointScorer.of(file, chosen.table, jobs)
    scores = scorer.score_table(refined.values[at], refined.weights)
    members = refined.members(file.configurations, chosen.row)
    return RefinedMembers(tuple(members[i] for i in chosen.order), scores)
