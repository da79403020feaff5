"""What a mode knows about the arm in one step, and what it answers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.teleop.arm import Arm
from tcs.teleop.control.bounds import rate_bounds, scale_to_bounds, stops_in_time
from tcs.teleop.control.settings import Command, Settings

STILL = 1e-3
"""A motion of less than this share of what was asked for counts as none."""
PLANNED = 0.25
"""Share of the acceleration limit that each part of a motion is planned with: speeding up, bending,
braking for a limit. They may come together, and one joint may have to make up for others."""


class ControlState(NamedTuple):
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
    """Lowest rates allowed by joint limits and velocities [rad/s], shape (7,)."""
    upper: FloatArray
    """Highest rates allowed by joint limits and velocities [rad/s], shape (7,)."""
    speed: float
    """Speed of the joint group in the step before: k of eq. (13) on its way, in [-1, 1]."""
    turning: FloatArray | None
    """Joint rates of the group at speed 1 in the step before [rad/s], shape (7,), if it moved."""
    way: float
    """Which way the elbow turns at a positive sign: 1 along `elbow_direction`, or -1."""


class RateCommand(NamedTuple):
    """What a mode asks for.

    `rates` are joint rates within limits of position and velocity [rad/s], shape (7,); `reason`
    says why they stop short, and is empty if they do not; `speed` is the group's new speed k, and
    `turning` its joint rates at speed 1 [rad/s].
    """

    rates: FloatArray
    reason: str = ""
    speed: float = 0.0
    turning: FloatArray | None = None


def mode_rate_bounds(
    arm: Arm, joints: FloatArray, settings: Settings
) -> tuple[FloatArray, FloatArray]:
    """Return the rates that a mode may ask for: to brake at `PLANNED`, within joint velocities."""
    lower, upper = rate_bounds(arm, joints, settings.period, PLANNED * settings.acceleration)
    return np.maximum(lower, -arm.velocity), np.minimum(upper, arm.velocity)


def slow_down_together(rates: FloatArray, now: ControlState) -> tuple[float, int]:
    """Return by how much all joints must slow down for one of them, and which one, else -1.

    Each joint brakes for its limit as hard as its share of the motion is, so that all of them
    come to rest together: the tool keeps its way, or stays, until the very end.
    """
    size = np.abs(rates)
    fastest = float(size.max())
    if fastest == 0.0:
        return 1.0, -1
    settings, velocity = now.settings, now.arm.velocity
    # A joint that hardly moves needs no bound of its own; the floor keeps the division sound.
    braking = PLANNED * settings.acceleration * np.maximum(size / fastest, 1e-6)
    in_time = stops_in_time(now.arm, now.joints, rates, settings.period, braking)
    if in_time and (size <= velocity).all():
        return 1.0, -1
    lower, upper = rate_bounds(now.arm, now.joints, settings.period, braking)
    share, joint = scale_to_bounds(rates, np.maximum(lower, -velocity), np.minimum(upper, velocity))
    return share, joint if share < STILL else -1


def commanded_twist(asked: Command) -> FloatArray:
    """Return the tool velocity of a command, angular then linear [rad/s; m/s], shape (6,)."""
    twist = np.empty(6)
    twist[:3], twist[3:] = asked.angular, asked.linear
    return twist


def limit_message(joints: ArrayLike) -> str:
    """Return words for joints, counted from 0, that are at their limits."""
    names = [str(joint + 1) for joint in np.asarray(joints, dtype=int)]
    if len(names) == 1:
        return f"joint {names[0]} is at its limit"
    return f"joints {', '.join(names)} are at their limits"


def stop_reason(asked: Command, rates: FloatArray, held: BoolArray, now: ControlState) -> str:
    """Return why the tool does not go the way it is asked to, empty if it does at least partly."""
    twist = commanded_twist(asked)
    # Turns count as ways here too, so that a command of both is judged as one.
    weights = np.repeat((now.settings.length, 1.0), 3) ** 2
    followed = float((now.jacobian @ rates * weights) @ twist)
    if followed > STILL * float((twist * weights) @ twist) or not twist.any():
        return ""
    near = now.settings.near_limit
    at_end = (now.joints - now.arm.lower <= near) | (now.arm.upper - now.joints <= near)
    stuck = np.flatnonzero(held & at_end)
    if not stuck.size:
        return "the arm is stretched as far as it goes: the tool cannot go that way."
    return f"{limit_message(stuck)}: the tool cannot go that way."
