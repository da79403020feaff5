"""End-effector control: the operator moves the tool."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.teleop.arm import JOINTS
from tcs.teleop.control.bounds import scale_to_bounds
from tcs.teleop.control.resolved_rate import clamped_rates, resolved_rates, smallest_singular_value
from tcs.teleop.control.settings import Command
from tcs.teleop.control.state import (
    ControlState,
    RateCommand,
    commanded_twist,
    limit_message,
    slow_down_together,
    stop_reason,
)

_EASE = 0.005
"""Damping where joints are held at limits [m/rad]: rates remain bounded where the other joints
become singular. It costs 1 % of the motion at a singular value of 0.05, which the feedback
compensates."""
_NEAR = 3.0
"""Multiple of `Settings.singular` at which joints begin to slow down."""
_NEAR_RATE = 1.0
"""Greatest joint rate at that singular value [rad/s], from which a joint stops in a tenth of a
second."""
_BEYOND = 0.9
"""Fraction of `Settings.singular` at which the rates would be zero; the motion ends before."""


def end_effector(command: Command, state: ControlState) -> RateCommand:
    """Move the tool: Delta theta = J^+ Delta x, eqs. (7) and (8)."""
    settings = state.settings
    wanted = commanded_twist(command) + settings.gain * state.error
    rates, smallest = resolved_rates(
        state.jacobian,
        wanted,
        length=settings.length,
        damping=settings.inverse_damping,
        singular=settings.singular,
    )
    if settings.limits == "paper":
        return _until_invalid(rates, smallest, state)
    # A command that exceeds the joint velocities is followed in the same direction, but slower.
    fraction, _ = scale_to_bounds(rates, -state.arm.velocity, state.arm.velocity)
    if ((fraction * rates >= state.lower) & (fraction * rates <= state.upper)).all():
        return RateCommand(fraction * rates)
    rates, held = clamped_rates(
        state.jacobian,
        fraction * wanted,
        state.lower,
        state.upper,
        length=settings.length,
        damping=_EASE,
    )
    return RateCommand(rates, stop_reason(command, rates, held, state))


def _until_invalid(rates: FloatArray, smallest: float, state: ControlState) -> RateCommand:
    """End the motion where a joint is at its limit or the arm is singular, as in the paper.

    A motion away from the limit or the singularity continues.
    """
    nearness = smallest / state.settings.singular
    if nearness < _NEAR and rates.any() and _gets_more_singular(rates, state):
        if nearness < 1.0:
            return RateCommand(np.zeros(JOINTS), "the arm is singular: motion ends there.")
        # Near a singularity even a slow tool needs fast joints. They slow down in advance, because
        # they would otherwise pass through it before they could stop.
        most = _NEAR_RATE * (nearness - _BEYOND) / (_NEAR - _BEYOND)
        rates = rates * min(1.0, most / float(np.abs(rates).max()))
    elif nearness < 1.0:
        # The undamped pseudo-inverse may demand a thousand times what the joints can do.
        rates = rates * scale_to_bounds(rates, -state.arm.velocity, state.arm.velocity)[0]
    fraction, joint = slow_down_together(rates, state)
    if joint >= 0:
        return RateCommand(np.zeros(JOINTS), f"{limit_message([joint])}: motion ends there.")
    return RateCommand(rates * fraction)


def _gets_more_singular(rates: FloatArray, state: ControlState) -> bool:
    """Return whether a motion leads towards a singularity."""
    # Larger than rounding, and small enough not to pass the singularity [rad].
    ahead = state.joints + (1e-4 / float(np.abs(rates).max())) * rates
    here, there = (
        smallest_singular_value(state.arm.kinematics(joints).jacobian, state.settings.length)
        for joints in (state.joints, ahead)
    )
    return there < here
