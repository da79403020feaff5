"""Check-up of a robot file: whether its arm, limits and shapes are fit for scoring.

A room of its own, because it needs both a live scene, for Drake's word on kinematics and contact,
and the kernel, for its solutions; and because no score, set or choice needs it.
"""

from __future__ import annotations

from tcs.model.checkup.arm import ArmClass, RoundTrip
from tcs.model.checkup.report import JointLimits, RobotCheck, check_up

__all__ = ["ArmClass", "JointLimits", "RobotCheck", "RoundTrip", "check_up"]
