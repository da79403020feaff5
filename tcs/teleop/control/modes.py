"""What each mode makes of a command: the joint rates it asks for, or why there are none."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from tcs.teleop.control.assistance import assisted, drake
from tcs.teleop.control.null_space_modes import null_space, pose
from tcs.teleop.control.settings import Command, Mode
from tcs.teleop.control.state import ControlState, RateCommand
from tcs.teleop.control.tool_modes import end_effector

_MODES: Mapping[Mode, Callable[[Command, ControlState], RateCommand]] = {
    Mode.END_EFFECTOR: end_effector,
    Mode.NULL_SPACE: null_space,
    Mode.POSE: pose,
    Mode.ASSISTED: assisted,
    Mode.DRAKE: drake,
}


def rate_command(mode: Mode, asked: Command, now: ControlState) -> RateCommand:
    """Return the joint rates that a command asks for in a mode."""
    return _MODES[mode](asked, now)
