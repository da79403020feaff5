"""Joint mode: the operator sets the joints, and the tool is not held."""

from __future__ import annotations

import numpy as np

from tcs.teleop.arm import JOINTS
from tcs.teleop.control.bounds import stopping_rates
from tcs.teleop.control.settings import Command
from tcs.teleop.control.state import PLANNED, ControlState, RateCommand, limit_message


def joint(command: Command, state: ControlState) -> RateCommand:
    """Move every joint to its set-point: theta_post = theta_pre + Delta theta_sp, eq. (9).

    The paper adds the whole displacement at once. Here each joint takes it on its own, at
    `Settings.joint_rate` at most, and comes to rest at its set-point, or at the limit before it.
    Nothing is held, so neither singularities nor other joints matter.
    """
    settings, arm = state.settings, state.arm
    change = settings.acceleration * settings.period
    wanted, reason = np.zeros(JOINTS), ""
    if command.joints is not None:
        set_point = np.asarray(command.joints, dtype=np.float64)
        displacement = np.clip(set_point, arm.lower, arm.upper) - state.joints
        fastest = stopping_rates(
            np.abs(displacement), settings.period, PLANNED * settings.acceleration
        )
        fastest = np.minimum(fastest, np.minimum(arm.velocity, settings.joint_rate))
        wanted = np.copysign(fastest, displacement)
        beyond = (set_point < arm.lower) | (set_point > arm.upper)
        # The other joints arrive first.
        if beyond.any() and np.abs(displacement).max() <= settings.near_limit:
            reason = f"{limit_message(np.flatnonzero(beyond))}: the set-point is beyond."
    return RateCommand(np.clip(wanted, state.rates - change, state.rates + change), reason)
