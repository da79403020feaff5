"""Modes in which the person moves the tool."""

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
"""Damping where joints are held at limits [m/rad]: rates stay bounded where the others become
singular; 1 % of the motion at a singular value of 0.05, which the feedback makes up for."""
_NEAR = 3.0
"""At this many times the singular value that ends the motion, joints begin to slow down."""
_NEAR_RATE = 1.0
"""Greatest joint rate there [rad/s]: it takes a tenth of a second to stop from."""
_BEYOND = 0.9
"""Share of that singular value at which the slowing down would end: the motion ends before."""


def end_effector(asked: Command, now: ControlState) -> RateCommand:
    """Move the tool: Delta theta = J^+ Delta x, eqs. (7) and (8)."""
    settings = now.settings
    wanted = commanded_twist(asked) + settings.gain * now.error
    rates, smallest = resolved_rates(
        now.jacobian,
        wanted,
        length=settings.length,
        damping=settings.damping,
        singular=settings.singular,
    )
    if settings.limits == "paper":
        return _until_invalid(rates, smallest, now)
    # Too fast a command is followed slower, in the same direction.
    share, _ = scale_to_bounds(rates, -now.arm.velocity, now.arm.velocity)
    if ((share * rates >= now.lower) & (share * rates <= now.upper)).all():
        return RateCommand(share * rates)
    rates, held = clamped_rates(
        now.jacobian,
        share * wanted,
        now.lower,
        now.upper,
        length=settings.length,
        damping=_EASE,
    )
    return RateCommand(rates, stop_reason(asked, rates, held, now))


def _until_invalid(rates: FloatArray, smallest: float, now: ControlState) -> RateCommand:
    """End the motion where a joint is at its limit, or the arm singular, as the paper does.

    A motion that leads away from there goes on.
    """
    nearness = smallest / now.settings.singular
    if nearness < _NEAR and rates.any() and _gets_more_singular(rates, now):
        if nearness < 1.0:
            return RateCommand(np.zeros(JOINTS), "the arm is singular: motion ends there.")
        # Near a singularity a slow tool takes fast joints: they slow down on the way, or they
        # would race through it before they could stop.
        most = _NEAR_RATE * (nearness - _BEYOND) / (_NEAR - _BEYOND)
        rates = rates * min(1.0, most / float(np.abs(rates).max()))
    share, joint = slow_down_together(rates, now)
    if joint >= 0:
        return RateCommand(np.zeros(JOINTS), f"{limit_message([joint])}: motion ends there.")
    return RateCommand(rates * share)


def _gets_more_singular(rates: FloatArray, now: ControlState) -> bool:
    """Return whether a motion leads on to a singularity."""
    # Far enough for rounding, near enough to stay on this side [rad].
    ahead = now.joints + (1e-4 / float(np.abs(rates).max())) * rates
    here, there = (
        smallest_singular_value(now.arm.kinematics(joints).jacobian, now.settings.length)
        for joints in (now.joints, ahead)
    )
    return there < here
