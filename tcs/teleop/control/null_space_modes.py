"""Modes in which the person reshapes the arm while the tool stays."""

from __future__ import annotations

import math

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.teleop.control.joint_groups import bounded_group_motion, elbow_direction, group_motion
from tcs.teleop.control.resolved_rate import clamped_rates, resolved_rates, smallest_singular_value
from tcs.teleop.control.settings import Command
from tcs.teleop.control.state import (
    PLANNED,
    STILL,
    ControlState,
    RateCommand,
    limit_message,
    slow_down_together,
)

_SLIP = 1e-4
"""A tool that would slip faster than this [m/s] is not held: against feedback at the default gain
it would stand 0.01 mm off."""
_RACING = 3.0
"""Where a joint of a group turns this many times as fast as its lead joint, all have slowed down
by a third; before, hardly, and after, all the more."""
_AT_LIMIT = 1e-5
"""A joint this close to its limit has come to rest there [rad]: nobody sees the difference."""
_EDGE = 0.01
"""At this share of its speed, a group has come as far as its lead joint can lead it: the others
turn 30 times as fast."""


def null_space(asked: Command, now: ControlState) -> RateCommand:
    """Turn a joint group, the tool's position held: eqs. (9) to (14).

    At a limit the group comes to rest, all its joints together. `clamped` goes on from there
    with that joint held, if the rest of the arm can hold the tool.
    """
    settings, jacobian = now.settings, now.jacobian[3:]
    back = _drift_feedback(jacobian, now.error[3:], now)
    if asked.group is None or (asked.sign == 0 and now.speed == 0.0):
        return RateCommand(back)
    group = settings.groups[asked.group]
    lead = group[0]
    way = float(np.sign(now.speed or asked.sign))
    rates, held, slip = _turning(jacobian, group, way, now)
    if slip > _SLIP or abs(rates[lead]) < STILL * settings.group_rate:
        return RateCommand(
            back, f"{limit_message(held)}: its motion ends there." if held else _stuck(lead)
        )
    ease = _ease(rates, lead)
    full = ease * way * rates
    speed = _next_speed(asked.sign, full, now)
    if ease < _EDGE and speed * way > 0.0 and _gets_worse(group, way, rates, now):
        return RateCommand(back, _stuck(lead))
    share, joint = slow_down_together(speed * full + back, now)
    if joint >= 0:
        return RateCommand(back, f"{limit_message([joint])}: its motion ends there.")
    # A group that had to slow down for a limit turns back from the speed it has.
    return RateCommand(share * (speed * full + back), "", share * speed, full)


def pose(asked: Command, now: ControlState) -> RateCommand:
    """Turn the elbow, the tool's pose held: the one degree of freedom that is left."""
    settings = now.settings
    back = _drift_feedback(now.jacobian, now.error, now)
    if asked.sign == 0 and now.speed == 0.0:
        return RateCommand(back)
    if smallest_singular_value(now.jacobian, settings.length) < 1e-3 * settings.singular:
        return RateCommand(back, "the arm is singular: the elbow has no way of its own.")
    direction = now.way * settings.group_rate * elbow_direction(now.jacobian)
    speed = _next_speed(asked.sign, direction, now)
    share, joint = slow_down_together(speed * direction + back, now)
    if joint >= 0:
        return RateCommand(back, f"{limit_message([joint])}: the elbow's motion ends there.")
    return RateCommand(share * (speed * direction + back), "", share * speed, direction)


def elbow_sign(jacobian: FloatArray) -> float:
    """Return the way of the elbow in which joint 1 turns up: 1 or -1."""
    return -1.0 if elbow_direction(jacobian)[0] < 0.0 else 1.0


def _drift_feedback(jacobian: FloatArray, error: FloatArray, now: ControlState) -> FloatArray:
    """Return the joint rates that undo the tool's drift [rad/s], shape (7,).

    All joints take part: a nearly locked group would need unbounded rates for it. In `clamped`
    behaviour joints at their limits stay there if the others can do without them; feedback that
    moved them off would make the group release and hold them in turns.
    """
    settings = now.settings
    velocity = settings.gain * error
    options = {"length": settings.length, "damping": settings.damping}
    rates, _ = resolved_rates(jacobian, velocity, singular=settings.singular, **options)
    if settings.limits == "clamped":
        distance = np.minimum(now.joints - now.arm.lower, now.arm.upper - now.joints)
        at_limit = distance <= _AT_LIMIT
        if rates[at_limit].any():
            lower, upper = (np.where(at_limit, 0.0, bound) for bound in (now.lower, now.upper))
            others, _ = clamped_rates(jacobian, velocity, lower, upper, **options)
            left = velocity - jacobian @ others
            if left @ left < 0.25 * (velocity @ velocity):
                return others
    if ((rates >= now.lower) & (rates <= now.upper)).all():
        return rates
    return clamped_rates(jacobian, velocity, now.lower, now.upper, **options)[0]


def _next_speed(sign: float, full: FloatArray, now: ControlState) -> float:
    """Return the speed after this step, on the way to the one asked for.

    The speed changes, not the joint rates: so a group that starts or stops keeps to the null
    space, which bends while it does. Where it bends so sharply that joints would have to change
    their rates too fast to follow, the group slows down.

    Args:
        sign: The speed asked for, k of eq. (13).
        full: Joint rates at k = 1 [rad/s], shape (7,).
        now: The arm.
    """
    settings = now.settings
    change = PLANNED * settings.acceleration * settings.period
    fastest = max(float(np.abs(full).max()), 1e-9)
    wanted = float(sign)
    if now.turning is not None:
        bend = abs(now.speed) * float(np.abs(full - now.turning).max())
        # Bending takes the square of the speed: once for the way, once for the rates themselves.
        if bend > change:
            most = abs(now.speed) * math.sqrt(change / bend)
            wanted = min(max(wanted, -most), most)
    # Slower may be urgent; faster never is.
    step = change / fastest * (2.0 if abs(wanted) < abs(now.speed) else 1.0)
    return min(max(wanted, now.speed - step), now.speed + step)


def _turning(
    jacobian: FloatArray, group: tuple[int, ...], way: float, now: ControlState
) -> tuple[FloatArray, list[int], float]:
    """Return the joint rates of a group that turns one way at full speed, the tool held.

    Returns:
        Rates [rad/s], shape (7,), the joints that stay at their limits for it, and how fast the
        tool slips for all that [m/s].
    """
    settings, arm = now.settings, now.arm
    motion = group_motion(jacobian, group, way * settings.group_rate)
    if settings.limits == "paper" or motion.slip > _SLIP:
        return motion.rates, [], motion.slip
    lower = np.where(now.joints - arm.lower <= _AT_LIMIT, 0.0, -np.inf)
    upper = np.where(arm.upper - now.joints <= _AT_LIMIT, 0.0, np.inf)
    if ((motion.rates >= lower) & (motion.rates <= upper)).all():
        return motion.rates, [], motion.slip
    rates, held = bounded_group_motion(jacobian, group, way * settings.group_rate, lower, upper)
    return rates, np.flatnonzero(held).tolist(), float(np.linalg.norm(jacobian @ rates))


def _ease(rates: FloatArray, lead: int) -> float:
    """Return by how much a group must slow down so that it stops where its lead joint turns back.

    A tool that is held leaves the lead joint only part of its range. At the end of that part the
    others would turn infinitely faster than it does; their speed is led to zero there instead.
    """
    faster = float(np.abs(rates).max()) / (abs(float(rates[lead])) * _RACING)
    # Smooth, as a kink would be a jerk; 0.99 where all turn as fast as the lead joint.
    return float(1.0 / math.sqrt(1.0 + faster**4))


def _gets_worse(group: tuple[int, ...], way: float, rates: FloatArray, now: ControlState) -> bool:
    """Return whether a group's motion leads on to where its lead joint turns back."""
    # Far enough for rounding, near enough to stay on this side [rad].
    ahead = now.joints + (1e-4 / float(np.abs(rates).max())) * rates
    ease = []
    for joints in (now.joints, ahead):
        jacobian = now.arm.kinematics(joints).jacobian[3:]
        ease.append(_ease(_turning(jacobian, group, way, now)[0], group[0]))
    return ease[1] < ease[0]


def _stuck(lead: int) -> str:
    return f"joint {lead + 1} can turn no further here without moving the tool."
