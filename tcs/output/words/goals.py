"""Lists of goals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from tcs.placement.tables import Reason


def goal_list(goals: Iterable[int]) -> str:
    """Return the numbers of goals.

    >>> goal_list([0, 3])
    '0, 3'
    """
    return ", ".join(str(goal) for goal in goals)


def goals_text(goals: Sequence[int]) -> str:
    """Return the numbers of goals after the word "goal".

    >>> goals_text([2]), goals_text([0, 3])
    ('goal 2', 'goals 0, 3')
    """
    return f"goal{'' if len(goals) == 1 else 's'} {goal_list(goals)}"


def goals_by_reason(reasons: Iterable[Reason]) -> Mapping[Reason, tuple[int, ...]]:
    """Return the unreached goals by reason.

    Args:
        reasons: The reason at each goal.

    >>> goals_by_reason([Reason.TOO_FAR, Reason.REACHED, Reason.TOO_FAR])
    {<Reason.TOO_FAR: 1>: (0, 2)}
    """
    found: dict[Reason, list[int]] = {}
    for goal, reason in enumerate(reasons):
        if reason != Reason.REACHED:
            found.setdefault(reason, []).append(goal)
    return {reason: tuple(found[reason]) for reason in sorted(found)}
