"""Teleoperation of a redundant arm: driving its tool, and reshaping it while the tool stays."""

from __future__ import annotations

from tcs.teleop.arm import Arm, load_arm
from tcs.teleop.session import Step, Teleoperation
from tcs.teleop.settings import Command, Mode, Settings

__all__ = ["Arm", "Command", "Mode", "Settings", "Step", "Teleoperation", "load_arm"]
