"""Which member of a set serves which goal."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tcs.placement.tables import ScoreTable


def assign_goals(scores: ScoreTable, members: Sequence[int]) -> tuple[int | None, ...]:
    """Return the number of the member that serves each goal; None where no member reaches it.

    A goal is served by the member that reaches it with the greatest dexterity, which may be 0 for
    a goal that is reached. Of equal members the first in the order of the tour serves the goal.

    Args:
        scores: Scores of the configurations.
        members: Flat indices of the set's configurations, in the order of the tour.
    """
    if not members:
        return (None,) * scores.goals
    rows = list(members)
    reached = scores.reached[rows]
    dexterity = np.where(reached, scores.dexterity[rows], -1.0)
    best = dexterity.argmax(axis=0)
    return tuple(
        int(best[goal]) if reached[:, goal].any() else None for goal in range(scores.goals)
    )


def assigned_goals(assignment: Sequence[int | None], member: int) -> tuple[int, ...]:
    """Return the goals that one member serves, ascending.

    >>> assigned_goals((1, None, 0, 1), 1)
    (0, 3)
    """
    return tuple(goal for goal, number in enumerate(assignment) if number == member)
