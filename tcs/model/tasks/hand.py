"""Hands: the arm and the tool that goals name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Hand:
    """The arm and the tool that a goal needs."""

    arm: str = ""
    """Name of the arm in the robot file, "" for the arm that this file scores."""
    tool: str = ""
    """Name of the tool, "" for what the robot holds anyway."""

    def __str__(self) -> str:
        """Return the hand in words.

        >>> str(Hand("left", "razor")), str(Hand(tool="spoon")), str(Hand("right"))
        ('left arm with razor', 'spoon', 'right arm')
        """
        arm = f"{self.arm} arm" if self.arm else ""
        return " with ".join(part for part in (arm, self.tool) if part) or "bare hand"

    def to_json(self) -> dict[str, Any]:
        """Return the hand as plain containers."""
        return {"arm": self.arm, "tool": self.tool}
