"""Lists of goals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from tcs.output.words.bodies import frame_name
from tcs.placement.tables import Reason

if TYPE_CHECKING:
    from tcs.model.tasks import Goal


def goal_text(goal: int, name: str | None) -> str:
    """Return the number of a goal, with its name if it has one.

    >>> goal_text(2, "left cheek"), goal_text(2, "")
    ('2 (left cheek)', '2')
    """
    return f"{goal} ({name})" if name else str(goal)


def goal_list(goals: Iterable[int], names: Sequence[str] = ()) -> str:
    """Return the numbers of goals.

    Args:
        goals: The goals.
        names: Names of all goals of the task, to add them; "" for a goal without a name.

    >>> goal_list([0, 3]), goal_list([0, 1], ["chin", ""])
    ('0, 3', '0 (chin), 1')
    """
    return ", ".join(goal_text(goal, names[goal] if names else "") for goal in goals)


def goals_text(goals: Sequence[int], names: Sequence[str] = ()) -> str:
    """Return the numbers of goals after the word "goal".

    Args:
        goals: The goals.
        names: As for `goal_list`.

    >>> goals_text([2]), goals_text([0, 3])
    ('goal 2', 'goals 0, 3')
    """
    return f"goal{'' if len(goals) == 1 else 's'} {goal_list(goals, names)}"


def goal_place(goal: Goal) -> str:
    """Return where a goal is: its name, or its body frame in words; and what is free about it."""
    place = goal.name or frame_name(goal.body_frame)
    return place if goal.free is None else f"{place} ({goal.free})"


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
