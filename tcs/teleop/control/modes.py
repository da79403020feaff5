"""Control modes: functions from a command and the control state to a rate command."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.teleop.arm import JOINTS
from tcs.teleop.control.assistance import assisted, drake
from tcs.teleop.control.bounds import scale_to_bounds, stopping_rates
from tcs.teleop.control.joint_groups import bounded_group_motion, elbow_direction, group_motion
from tcs.teleop.control.resolved_rate import clamped_rates, resolved_rates, smallest_singular_value
from tcs.teleop.control.settings import Command, Mode
from tcs.teleop.control.state import (
    PLANNED,
    STILL,
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


_MODES: Mapping[Mode, Callable[[Command, ControlState], RateCommand]] = {
    Mode.END_EFFECTOR: end_effector,
    Mode.NULL_SPACE: null_space,
    Mode.POSE: pose,
    Mode.ASSISTED: assisted,
    Mode.DRAKE: drake,
    Mode.JOINT: joint,
}


def rate_command(mode: Mode, command: Command, state: ControlState) -> RateCommand:
    """Return the joint rates of a command in a mode."""
    return _MODES[mode](command, state)
