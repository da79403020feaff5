"""What each mode makes of a command: the joint rates it asks for, or why there are none."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.teleop.arm import JOINTS, Arm
from tcs.teleop.bounds import scale_within
from tcs.teleop.control import clamped_rates, resolved_rates, smallest_singular_value
from tcs.teleop.groups import GroupMotion, elbow_direction, group_motion
from tcs.teleop.settings import Command, Mode, Settings

_STILL = 1e-3
"""A motion of less than this share of what was asked for counts as none."""
_SLIP = 1e-4
"""A tool that would slip faster than this [m/s] is not held: against feedback at the default gain
it would stand 0.01 mm off."""
_RACING = 3.0
"""Joints of a group may turn this many times as fast as its lead joint before all slow down."""
_EASE = 0.005
"""Damping where joints are held at limits [m/rad]: rates stay bounded where the others become
singular; 1 % of the motion at a singular value of 0.05, which the feedback makes up for."""


class Situation(NamedTuple):
    """What a mode has to know about the arm."""

    arm: Arm
    settings: Settings
    joints: FloatArray
    """Joint positions [rad], shape (7,)."""
    jacobian: FloatArray
    """Of the tool, half way through the step, shape (6, 7)."""
    error: FloatArray
    """From the tool to its target: rotation vector, translation, shape (6,)."""
    lower: FloatArray
    """Lowest rates that the joint limits allow [rad/s], shape (7,)."""
    upper: FloatArray
    """Highest rates that the joint limits allow [rad/s], shape (7,)."""
    way: float
    """Which way the elbow turns at a positive sign: 1 along `elbow_direction`, or -1."""


class Wish(NamedTuple):
    """Joint rates within limits of position and velocity [rad/s], and why they stop short."""

    rates: FloatArray
    reason: str


def wish(mode: Mode, asked: Command, situation: Situation) -> Wish:
    """Return the joint rates that a command asks for in a mode."""
    return _MODES[mode](asked, situation)


def elbow_way(jacobian: FloatArray) -> float:
    """Return the way of the elbow in which joint 1 turns up: 1 or -1."""
    return -1.0 if elbow_direction(jacobian)[0] < 0.0 else 1.0


def _end_effector(asked: Command, now: Situation) -> Wish:
    """Move the tool: Delta theta = J^+ Delta x, eqs. (7) and (8)."""
    settings = now.settings
    twist = twist_of(asked)
    wanted = twist + settings.gain * now.error
    rates, smallest = resolved_rates(
        now.jacobian,
        wanted,
        length=settings.length,
        damping=settings.damping,
        singular=settings.singular,
    )
    share, _ = scale_within(rates, -now.arm.velocity, now.arm.velocity)
    rates *= share
    if settings.limits == "paper":
        return _until_invalid(rates, smallest, now)
    if ((rates >= now.lower) & (rates <= now.upper)).all():
        return Wish(rates, "")
    rates, held = clamped_rates(
        now.jacobian,
        share * wanted,
        np.maximum(now.lower, -now.arm.velocity),
        np.minimum(now.upper, now.arm.velocity),
        length=settings.length,
        damping=_EASE,
    )
    # Turns count as ways here too, so that a command of both is judged as one.
    weights = np.repeat((settings.length, 1.0), 3) ** 2
    followed = float((now.jacobian @ rates * weights) @ twist)
    if followed <= _STILL * float((twist * weights) @ twist) and twist.any():
        return Wish(rates, f"{at_limits(np.flatnonzero(held))}: the tool cannot go that way.")
    return Wish(rates, "")


def _until_invalid(rates: FloatArray, smallest: float, now: Situation) -> Wish:
    """End the motion where a joint is at its limit, or the arm singular, as the paper does.

    A motion that leads away from there goes on.
    """
    share, joint = scale_within(rates, now.lower, now.upper)
    if share < _STILL:
        return Wish(
            np.zeros(JOINTS), f"{at_limits([joint])}: motion ends there. Move back, or reshape."
        )
    rates = rates * share
    if smallest < now.settings.singular and rates.any():
        after = now.arm.kinematics(now.joints + now.settings.period * rates).jacobian
        here = now.arm.kinematics(now.joints).jacobian
        length = now.settings.length
        if smallest_singular_value(after, length) < smallest_singular_value(here, length):
            return Wish(
                np.zeros(JOINTS), "the arm is singular: motion ends there. Move back, or reshape."
            )
    return Wish(rates, "")


def _null_space(asked: Command, now: Situation) -> Wish:
    """Turn a joint group, the tool's position held: eqs. (9) to (14)."""
    settings, jacobian = now.settings, now.jacobian[3:]
    # Drift is undone by all joints: through a group that is nearly locked it would take a race.
    back, _ = resolved_rates(
        jacobian,
        settings.gain * now.error[3:],
        damping=settings.damping,
        singular=settings.singular,
    )
    if asked.group is None or asked.sign == 0:
        return _all_slower(back, now)[0]
    group = settings.groups[asked.group]
    lead = group[0]
    motion = group_motion(jacobian, group, asked.sign * settings.group_rate)
    ease = _ease(motion, settings.group_rate)
    if ease < _STILL or motion.slip > _SLIP:
        reason = f"joint {lead + 1} can turn no further here without moving the tool."
        return Wish(_all_slower(back, now)[0].rates, reason)
    rates = ease * motion.rates + back
    if settings.limits == "clamped":
        rates = _around_limits(rates, back, group, now)
    slower, joint = _all_slower(rates, now)
    if joint < 0:
        return slower
    return Wish(_all_slower(back, now)[0].rates, f"{at_limits([joint])}: its motion ends there.")


def _ease(motion: GroupMotion, rate: float) -> float:
    """Return by how much a group must slow down so that it stops where its lead joint turns back.

    A tool that is held leaves the lead joint only part of its range. At the end of that part the
    others would turn infinitely faster than it does; their speed is led to zero there instead.
    """
    fastest = float(np.abs(motion.rates).max()) / rate
    return 1.0 if fastest <= _RACING else (_RACING / fastest) ** 2


def _around_limits(
    rates: FloatArray, back: FloatArray, group: tuple[int, ...], now: Situation
) -> FloatArray:
    """Return a group's motion in which joints at their limits stay there, if there is one.

    The lead joint is slowed down to what its own limit allows; others that are too fast are held
    at their bounds, the worst first, and the rest of the arm takes over.
    """
    lead = group[0]
    rate = float(np.clip(rates[lead], now.lower[lead], now.upper[lead])) - back[lead]
    held, bound = np.zeros(JOINTS, bool), np.zeros(JOINTS)
    found = rates
    for _ in range(JOINTS):
        over = np.maximum(found - now.upper, now.lower - found)
        over[lead] = 0.0
        over[held] = 0.0
        joint = int(over.argmax())
        # Rates are rounded to far below this [rad/s].
        if over[joint] <= 1e-12:
            return found
        held[joint] = True
        bound[joint] = np.clip(found[joint], now.lower[joint], now.upper[joint]) - back[joint]
        motion = group_motion(now.jacobian[3:], group, rate, None, held, bound)
        if motion.slip > _SLIP or _ease(motion, now.settings.group_rate) < 1.0:
            break
        found = motion.rates + back
    return rates


def _all_slower(rates: FloatArray, now: Situation) -> tuple[Wish, int]:
    """Return rates scaled down to all limits, and the joint that all but stops them, or -1."""
    velocity = now.arm.velocity
    share, joint = scale_within(
        rates, np.maximum(now.lower, -velocity), np.minimum(now.upper, velocity)
    )
    return Wish(share * rates, ""), joint if share < _STILL else -1


def _pose(asked: Command, now: Situation) -> Wish:
    """Turn the elbow, the tool's pose held."""
    settings = now.settings
    rates, smallest = resolved_rates(
        now.jacobian,
        settings.gain * now.error,
        length=settings.length,
        damping=settings.damping,
        singular=settings.singular,
    )
    if asked.sign:
        if smallest < settings.singular:
            return Wish(np.zeros(JOINTS), "the arm is singular: the elbow has no way of its own.")
        way = asked.sign * now.way * settings.group_rate
        rates = rates + way * elbow_direction(now.jacobian)
    slower, joint = _all_slower(rates, now)
    if joint >= 0 and asked.sign:
        return Wish(np.zeros(JOINTS), f"{at_limits([joint])}: the elbow's motion ends there.")
    return slower


_MODES: Mapping[Mode, Callable[[Command, Situation], Wish]] = {
    Mode.END_EFFECTOR: _end_effector,
    Mode.NULL_SPACE: _null_space,
    Mode.POSE: _pose,
}


def twist_of(asked: Command) -> FloatArray:
    """Return the tool velocity of a command, angular then linear, shape (6,)."""
    twist = np.empty(6)
    twist[:3], twist[3:] = asked.angular, asked.linear
    return twist


def at_limits(joints: object) -> str:
    """Return words for joints that are at their limits."""
    names = [str(int(joint) + 1) for joint in np.asarray(joints, dtype=int)]
    if len(names) == 1:
        return f"joint {names[0]} is at its limit"
    return f"joints {', '.join(names)} are at their limits"
