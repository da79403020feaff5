"""What each mode makes of a command: the joint rates it asks for, or why there are none."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from tcs.teleop.assist import assisted, drake
from tcs.teleop.null_modes import null_space, pose
from tcs.teleop.settings import Command, Mode
from tcs.teleop.situation import Situation, Wish
from tcs.teleop.tool_modes import end_effector

_MODES: Mapping[Mode, Callable[[Command, Situation], Wish]] = {
    Mode.END_EFFECTOR: end_effector,
    Mode.NULL_SPACE: null_space,
    Mode.POSE: pose,
    Mode.ASSISTED: assisted,
    Mode.DRAKE: drake,
}


def wish(mode: Mode, asked: Command, now: Situation) -> Wish:
    """Return the joint rates that a command asks for in a mode."""
    return _MODES[mode](asked, now)
