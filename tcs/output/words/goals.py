"""Lists of goals, and which member of a set serves which."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from tcs.errors import SelectionError, UnknownNameError
from tcs.output.words.reasons import frame_name
from tcs.placement.tables import Reason, ScoreTable, members_by_dexterity

if TYPE_CHECKING:
    from tcs.model.tasks import Goal
    from tcs.placement.store import ScoreFile


def goal_names(task: Mapping[str, Any], goals: int) -> tuple[str, ...]:
    """Return where each goal of a task is, as people say it.

    Args:
        task: The task, as a score file holds it.
        goals: Number of goals.

    Returns:
        The name of each goal; for a goal without one, its body frame and its number among the goals
        there, from 1; "" where the task states neither. The arm and the tool that a goal names
        follow.

    >>> on_head = {"body_frame": "head"}
    >>> goal_names({"goals": [on_head, {"name": "chin", **on_head}, on_head]}, 3)
    ('head, place 1', 'chin', 'head, place 3')
    >>> goal_names({"goals": [{"name": "chin", "arm": "left", "tool": "razor"}]}, 1)
    ('chin [left arm with razor]',)
    """
    frames = [text_of_goal(task, goal, "body_frame") for goal in range(goals)]
    names = []
    for goal, frame in enumerate(frames):
        on_frame = f"{frame_name(frame)}, place {frames[: goal + 1].count(frame)}" if frame else ""
        name = text_of_goal(task, goal, "name") or on_frame
        hand = hand_text(text_of_goal(task, goal, "arm"), text_of_goal(task, goal, "tool"))
        names.append(f"{name} [{hand}]".strip() if hand else name)
    return tuple(names)


def hand_text(arm: str | None, tool: str | None) -> str:
    """Return an arm and a tool in words, "" without either.

    >>> hand_text("left", "razor"), hand_text("right", None), hand_text(None, "spoon")
    ('left arm with razor', 'right arm', 'spoon')
    """
    return " with ".join(part for part in (f"{arm} arm" if arm else "", tool) if part)


def text_of_goal(task: Mapping[str, Any], goal: int, key: str) -> str | None:
    """Return a text that a score file holds of a goal, None if it holds none."""
    goals = task.get("goals")
    if not isinstance(goals, Sequence) or goal >= len(goals) or not isinstance(goals[goal], dict):
        return None
    text = goals[goal].get(key)
    return text if isinstance(text, str) and text else None


def goal_text(goal: int, name: str | None) -> str:
    """Return the name of a goal, if it has one, and its number from 1; options take either.

    >>> goal_text(2, "left cheek"), goal_text(2, "")
    ('left cheek (3)', '3')
    """
    return f"{name} ({goal + 1})" if name else str(goal + 1)


def goal_index(file: ScoreFile, given: int | str) -> int:
    """Return the index of a goal of a score file.

    Args:
        file: The file.
        given: The index itself; or the name of the goal, as a task file, `goal_names` or
            `goal_text` has it.

    Raises:
        UnknownNameError: If no goal has that name.
        SelectionError: If several have it.
    """
    if not isinstance(given, str):
        return given
    goals = file.tables[0].scores.goals
    shown = goal_names(file.task, goals)
    plain = [text_of_goal(file.task, goal, "name") for goal in range(goals)]
    found = [
        goal
        for goal in range(goals)
        if given in (shown[goal], plain[goal], goal_text(goal, shown[goal]))
    ]
    if not found:
        known = [name for name in shown if name]
        raise UnknownNameError("goal", given, known, where=f"task '{file.metadata['task']}'")
    if len(found) > 1:
        raise SelectionError(
            f"{len(found)} goals of task '{file.metadata['task']}' are called '{given}': "
            f"{goal_list(found, shown)}. Give the number of one."
        )
    return found[0]


def goal_index_of_number(file: ScoreFile, given: str) -> int:
    """Return the index of a goal that is given as people read it: its number from 1, or its name.

    Raises:
        UnknownNameError: If no goal has that name.
        SelectionError: If several have it, or there is no such number.
    """
    if not given.strip().lstrip("+-").isdecimal():
        return goal_index(file, given)
    number, goals = int(given), file.tables[0].scores.goals
    if not 1 <= number <= goals:
        raise SelectionError(
            f"There is no goal {number}: task '{file.metadata['task']}' has {goals}, "
            f"numbered 1 to {goals}."
        )
    return number - 1


def goal_list(goals: Iterable[int], names: Sequence[str] = ()) -> str:
    """Return the names and numbers of goals.

    Args:
        goals: The goals.
        names: Names of all goals of the task; "" for a goal without a name. None for numbers alone.

    >>> goal_list([0, 3]), goal_list([0, 1], ["chin", ""])
    ('1, 4', 'chin (1), 2')
    """
    return ", ".join(goal_text(goal, names[goal] if names else "") for goal in goals)


def goals_text(goals: Sequence[int], names: Sequence[str] = ()) -> str:
    """Return the names and numbers of goals after the word "goal".

    Args:
        goals: The goals.
        names: As for `goal_list`.

    >>> goals_text([2]), goals_text([0, 3])
    ('goal 3', 'goals 1, 4')
    """
    return f"goal{'' if len(goals) == 1 else 's'} {goal_list(goals, names)}"


def goal_place(goal: Goal) -> str:
    """Return where a goal is: its name, or its body frame in words; and what else serves."""
    place = goal.name or frame_name(goal.body_frame)
    return f"{place} ({goal.region})" if goal.region else place


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


def assign_goals(scores: ScoreTable, members: Sequence[int]) -> tuple[int | None, ...]:
    """Return the number of the member that serves each goal; None where no member reaches it.

    A goal is served by the member that reaches it with the greatest dexterity, which may be 0 for
    a goal that is reached. Of equal members the first in the order of the tour serves the goal.

    Args:
        scores: Scores of the configurations.
        members: Flat indices of the set's configurations, in the order of the tour.
    """
    rows = list(members)
    of_goals = members_by_dexterity(scores.reached[rows], scores.dexterity[rows])
    return tuple(able[0] if able else None for able in of_goals)


def assigned_goals(assignment: Sequence[int | None], member: int) -> tuple[int, ...]:
    """Return the goals that one member serves, ascending.

    >>> assigned_goals((1, None, 0, 1), 1)
    (0, 3)
    """
    return tuple(goal for goal, number in enumerate(assignment) if number == member)
