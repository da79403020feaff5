"""Hands: the arm and the tool that goals name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from tcs.errors import TaskError, UnknownNameError

if TYPE_CHECKING:
    from tcs.model.tasks.task import Goal


@dataclass(frozen=True, slots=True)
class Hand:
    """The arm and the tool that a goal needs, and those of the arm that works at the same time."""

    arm: str = ""
    """Name of the arm in the robot file, "" for the arm that this file scores."""
    tool: str = ""
    """Name of the tool, "" for the bare gripper, or what the robot holds."""
    other: tuple[str, str] | None = None
    """Arm and tool of the goal that is reached at the same time; None for a goal by itself."""

    @property
    def name(self) -> str:
        """Arm and tool as one name.

        >>> Hand("right", "spoon").name, Hand("left").name, Hand().name
        ('right+spoon', 'left', 'bare')
        """
        return "+".join(part for part in (self.arm, self.tool) if part) or "bare"

    def __str__(self) -> str:
        """Return the hand in words.

        >>> str(Hand("left", "razor")), str(Hand(tool="spoon")), str(Hand("right"))
        ('left arm with razor', 'spoon', 'right arm')
        """
        arm = f"{self.arm} arm" if self.arm else ""
        own = " with ".join(part for part in (arm, self.tool) if part) or "bare hand"
        return own if self.other is None else f"{own} beside the {Hand(*self.other)}"

    def to_json(self) -> dict[str, Any]:
        """Return the hand as plain containers."""
        return {"arm": self.arm, "tool": self.tool, "other": list(self.other or ())}


def partners(goals: Sequence[Goal]) -> tuple[int | None, ...]:
    """Return the number of the goal that is reached together with each goal, None for none.

    Raises:
        TaskError: If a goal belongs to two pairs, or both goals of a pair are of one arm.
        UnknownNameError: If no goal, or more than one, has the name of a partner.
    """
    found: list[int | None] = [None] * len(goals)
    names = [goal.name for goal in goals]
    for i, goal in enumerate(goals):
        if not goal.together_with:
            continue
        where = f"goals[{i}], field 'together_with'"
        named = [j for j, name in enumerate(names) if name == goal.together_with and j != i]
        if not named:
            known = {name for j, name in enumerate(names) if name and j != i}
            raise UnknownNameError("goal", goal.together_with, known, where=where)
        if len(named) > 1:
            raise TaskError(
                f"{where}: {len(named)} goals are called '{goal.together_with}'. Give each a name "
                "of its own."
            )
        j = named[0]
        if {found[i], found[j]} - {None} and (found[i], found[j]) != (j, i):
            raise TaskError(
                f"{where}: '{goal.together_with}' or this goal is in another pair already. A pair "
                "is two goals: write a goal twice, with two names, to have it in two pairs."
            )
        if not goal.arm or not goals[j].arm or goal.arm == goals[j].arm:
            arms = [one.arm or "no arm" for one in (goal, goals[j])]
            raise TaskError(
                f"{where}: the two goals name {' and '.join(arms)}, but two arms reach them at "
                "once. Give each goal its own 'arm'."
            )
        found[i], found[j] = j, i
    return tuple(found)


def hands(goals: Sequence[Goal]) -> tuple[Hand, ...]:
    """Return the hand of each goal.

    Raises:
        TaskError: As `partners`.
        UnknownNameError: As `partners`.
    """
    others = (None if j is None else (goals[j].arm, goals[j].tool) for j in partners(goals))
    return tuple(
        Hand(goal.arm, goal.tool, other) for goal, other in zip(goals, others, strict=True)
    )
