"""Control modes: functions from a command and the control state to a rate command."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from tcs.teleop.control.assistance import assisted, drake
from tcs.teleop.control.joint_mode import joint
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
    Mode.JOINT: joint,
}


def rate_command(mode: Mode, command: Command, state: ControlState) -> RateCommand:
    """Return the joint rates of a command in a mode."""
    return _MODES[mode](command, state)
