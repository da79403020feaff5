"""Null-space control modes: joint-group motion and self-motion of the elbow."""

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
"""Greatest slip velocity of a tool that counts as held [m/s]: with feedback at the default gain,
the position error is then at most 0.005 mm."""
_FAST_RATIO = 3.0
"""Ratio of a joint's rate to the lead joint's at which the group has slowed down by a third."""
_AT_LIMIT = 1e-5
"""Distance from a limit within which a joint is at the limit [rad]."""
_EDGE = 0.01
"""Fraction of its speed at which a group is at the end of its range: the fastest joint rotates 30
times as fast as the lead joint."""


def null_space(command: Command, state: ControlState) -> RateCommand:
    """Move a joint group while the tool's position is held: eqs. (10) to (14).

    At a limit all joints of the group come to rest together. With `clamped` behaviour the motion
    continues with that joint at its limit, if the other joints can hold the tool.
    """
    settings, jacobian = state.settings, state.jacobian[3:]
    back = _drift_feedback(jacobian, state.error[3:], state)
    if command.group is None or (command.sign == 0 and state.speed == 0.0):
        return RateCommand(back)
    group = settings.groups[command.group]
    lead = group[0]
    sense = float(np.sign(state.speed or command.sign))
    rates, held, slip = _turning(jacobian, group, sense, state)
    if slip > _SLIP or abs(rates[lead]) < STILL * settings.group_rate:
        return RateCommand(
            back, f"{limit_message(held)}: its motion ends there." if held else _stuck(lead)
        )
    ease = _ease(rates, lead)
    full = ease * sense * rates
    speed = _next_speed(command.sign, full, state)
    if ease < _EDGE and speed * sense > 0.0 and _gets_worse(group, sense, rates, state):
        return RateCommand(back, _stuck(lead))
    fraction, joint = slow_down_together(speed * full + back, state)
    if joint >= 0:
        return RateCommand(back, f"{limit_message([joint])}: its motion ends there.")
    # The reduced speed is the new one: a group that slowed down for a limit reverses from it.
    return RateCommand(fraction * (speed * full + back), "", fraction * speed, full)


def pose(command: Command, state: ControlState) -> RateCommand:
    """Move the elbow while the tool's pose is held: the self-motion of the arm."""
    settings = state.settings
    back = _drift_feedback(state.jacobian, state.error, state)
    if command.sign == 0 and state.speed == 0.0:
        return RateCommand(back)
    if smallest_singular_value(state.jacobian, settings.length) < 1e-3 * settings.singular:
        return RateCommand(back, "the arm is singular: its self-motion is not unique.")
    direction = state.elbow_sign * settings.group_rate * elbow_direction(state.jacobian)
    speed = _next_speed(command.sign, direction, state)
    fraction, joint = slow_down_together(speed * direction + back, state)
    if joint >= 0:
        return RateCommand(back, f"{limit_message([joint])}: the elbow's motion ends there.")
    return RateCommand(fraction * (speed * direction + back), "", fraction * speed, direction)


def elbow_sign(jacobian: FloatArray) -> float:
    """Return the sign of the elbow direction in which joint 1 increases: 1 or -1."""
    return -1.0 if elbow_direction(jacobian)[0] < 0.0 else 1.0


def _drift_feedback(jacobian: FloatArray, error: FloatArray, state: ControlState) -> FloatArray:
    """Return the joint rates that correct the drift of the tool [rad/s], shape (7,).

    All joints take part, because a group near a singularity would need unbounded rates. With
    `clamped` behaviour, joints at their limits stay there if the others can correct half of the
    error or more; otherwise feedback and group would alternately release and clamp them.
    """
    settings = state.settings
    velocity = settings.gain * error
    options = {"length": settings.length, "damping": settings.inverse_damping}
    rates, _ = resolved_rates(jacobian, velocity, singular=settings.singular, **options)
    if settings.limits == "clamped":
        distance = np.minimum(state.joints - state.arm.lower, state.arm.upper - state.joints)
        at_limit = distance <= _AT_LIMIT
        if rates[at_limit].any():
            lower, upper = (np.where(at_limit, 0.0, bound) for bound in (state.lower, state.upper))
            others, _ = clamped_rates(jacobian, velocity, lower, upper, **options)
            left = velocity - jacobian @ others
            if left @ left < 0.25 * (velocity @ velocity):
                return others
    if ((rates >= state.lower) & (rates <= state.upper)).all():
        return rates
    return clamped_rates(jacobian, velocity, state.lower, state.upper, **options)[0]


def _next_speed(sign: float, full: FloatArray, state: ControlState) -> float:
    """Return the speed after this step, between the current and the commanded speed.

    The change of the speed is limited, not that of single joint rates, so that a group remains in
    the null space while it starts or stops. The null space changes with the posture; where the
    joints could not follow within their acceleration limit, the group slows down.

    Args:
        sign: The commanded speed, k of eq. (13).
        full: Joint rates at k = 1 [rad/s], shape (7,).
        state: The control state.
    """
    settings = state.settings
    change = PLANNED * settings.acceleration * settings.period
    fastest = max(float(np.abs(full).max()), 1e-9)
    wanted = float(sign)
    if state.group_rates is not None:
        change_needed = abs(state.speed) * float(np.abs(full - state.group_rates).max())
        # The change of the rates is proportional to the square of the speed.
        if change_needed > change:
            most = abs(state.speed) * math.sqrt(change / change_needed)
            wanted = min(max(wanted, -most), most)
    # Slowing down may be urgent, speeding up is not.
    step = change / fastest * (2.0 if abs(wanted) < abs(state.speed) else 1.0)
    return min(max(wanted, state.speed - step), state.speed + step)


def _turning(
    jacobian: FloatArray, group: tuple[int, ...], sense: float, state: ControlState
) -> tuple[FloatArray, list[int], float]:
    """Return the joint rates of a group at full speed in one direction, the tool held.

    Returns:
        Rates [rad/s], shape (7,), the joints held at their limits, and the remaining slip
        velocity of the tool [m/s].
    """
    settings, arm = state.settings, state.arm
    motion = group_motion(jacobian, group, sense * settings.group_rate)
    if settings.limits == "paper" or motion.slip > _SLIP:
        return motion.rates, [], motion.slip
    lower = np.where(state.joints - arm.lower <= _AT_LIMIT, 0.0, -np.inf)
    upper = np.where(arm.upper - state.joints <= _AT_LIMIT, 0.0, np.inf)
    if ((motion.rates >= lower) & (motion.rates <= upper)).all():
        return motion.rates, [], motion.slip
    rates, held = bounded_group_motion(jacobian, group, sense * settings.group_rate, lower, upper)
    return rates, np.flatnonzero(held).tolist(), float(np.linalg.norm(jacobian @ rates))


def _ease(rates: FloatArray, lead: int) -> float:
    """Return the factor that stops a group at the end of its lead joint's range.

    While the tool is held, the lead joint has only part of its range. At the end of that part the
    other joints would need unbounded rates; the group's speed is reduced to zero there instead.
    """
    faster = float(np.abs(rates).max()) / (abs(float(rates[lead])) * _FAST_RATIO)
    # Smooth, to avoid jerk; 0.99 where no joint rotates faster than the lead joint.
    return float(1.0 / math.sqrt(1.0 + faster**4))


def _gets_worse(
    group: tuple[int, ...], sense: float, rates: FloatArray, state: ControlState
) -> bool:
    """Return whether a group's motion leads towards the end of its lead joint's range."""
    # Larger than rounding, and small enough not to pass the end of the range [rad].
    ahead = state.joints + (1e-4 / float(np.abs(rates).max())) * rates
    ease = []
    for joints in (state.joints, ahead):
        jacobian = state.arm.kinematics(joints).jacobian[3:]
        ease.append(_ease(_turning(jacobian, group, sense, state)[0], group[0]))
    return ease[1] < ease[0]


def _stuck(lead: int) -> str:
    return f"joint {lead + 1} can turn no further here without moving the tool."
