"""Check-up of a robot file: whether its arm, limits and primitives are fit for scoring.

In: a robot. Out: the class of its arm, its limits, enclosure and self-collision at rest, an IK
round trip between Drake and the kernel, and what follows from them as problems and notes.
"""

from __future__ import annotations

from tcs.model.checkup.arm import ArmClass, RoundTrip
from tcs.model.checkup.report import JointLimits, RobotCheck, check_up

__all__ = ["ArmClass", "JointLimits", "RobotCheck", "RoundTrip", "check_up"]
