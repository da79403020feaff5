"""Hands: the arm and the tool that goals name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


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
