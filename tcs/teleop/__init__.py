"""Teleoperation of a redundant seven-joint arm: tool motion and null-space motion.

In: an arm from a robot file (`load_arm`) and one `Command` per control period. Out: one `Step` per
period (joints, tool pose, limits, singularity, reason for a stop), recorded as runs. Subpackages:
`control` (the control law) and `runs` (recorded steps and their files). Scripted operators and the
experiments of the papers are in `tcs_studies`.
"""

from __future__ import annotations

from tcs.teleop.arm import Arm, load_arm
from tcs.teleop.control.session import Step, Teleoperation
from tcs.teleop.control.settings import Command, Mode, Settings

__all__ = ["Arm", "Command", "Mode", "Settings", "Step", "Teleoperation", "load_arm"]
