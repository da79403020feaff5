"""Modes in which the person moves the tool."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.teleop.arm import JOINTS
from tcs.teleop.bounds import scale_within
from tcs.teleop.control import clamped_rates, resolved_rates, smallest_singular_value
from tcs.teleop.settings import Command
from tcs.teleop.situation import Situation, Wish, all_slower, at_limits, twist_of, unmoved

_EASE = 0.005
"""Damping where joints are held at limits [m/rad]: rates stay bounded where the others become
singular; 1 % of the motion at a singular value of 0.05, which the feedback makes up for."""


def end_effector(asked: Command, now: Situation) -> Wish:
    """Move the tool: Delta theta = J^+ Delta x, eqs. (7) and (8)."""
    settings = now.settings
    wanted = twist_of(asked) + settings.gain * now.error
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
    share, _ = scale_within(rates, -now.arm.velocity, now.arm.velocity)
    if ((share * rates >= now.lower) & (share * rates <= now.upper)).all():
        return Wish(share * rates)
    rates, held = clamped_rates(
        now.jacobian,
        share * wanted,
        now.lower,
        now.upper,
        length=settings.length,
        damping=_EASE,
    )
    return Wish(rates, unmoved(asked, rates, held, now))


def _until_invalid(rates: FloatArray, smallest: float, now: Situation) -> Wish:
    """End the motion where a joint is at its limit, or the arm singular, as the paper does.

    A motion that leads away from there goes on.
    """
    share, joint = all_slower(rates, now)
    if joint >= 0:
        return Wish(np.zeros(JOINTS), f"{at_limits([joint])}: motion ends there.")
    rates = rates * share
    if smallest < now.settings.singular and rates.any():
        after = now.arm.kinematics(now.joints + now.settings.period * rates).jacobian
        here = now.arm.kinematics(now.joints).jacobian
        length = now.settings.length
        if smallest_singular_value(after, length) < smallest_singular_value(here, length):
            return Wish(np.zeros(JOINTS), "the arm is singular: motion ends there.")
    return Wish(rates)
