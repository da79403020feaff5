"""Control state with its limits and singularities, and rate command, the output of a mode."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.teleop.arm import Arm
from tcs.teleop.control.bounds import rate_bounds, scale_to_bounds, stops_in_time
from tcs.teleop.control.resolved_rate import smallest_singular_value
from tcs.teleop.control.settings import Command, Mode, Settings

ShortArray = NDArray[np.int8]
POSITION_MODES = (Mode.NULL_SPACE,)
"""Modes whose task is the tool's position alone: three rows of the Jacobian, not six."""


@dataclass(frozen=True, slots=True, eq=False)
class ConfigurationStatus:
    """Joints at their limits, and distance to a singularity.

    Attributes:
        limits: -1 where a joint is at its lower limit, 1 at its upper limit, else 0; shape (7,).
        singular: Whether the task is singular.
        singular_value: Smallest singular value of the task's Jacobian [m/rad].
        worst_joint: The joint closest to a limit as a fraction of its range, counted from 0.
    """

    limits: ShortArray
    singular: bool
    singular_value: float
    worst_joint: int


def range_fraction(arm: Arm, joints: FloatArray) -> FloatArray:
    """Return joint positions as fractions of their ranges: 0 lower, 1 upper, 0.5 without limits.

    Args:
        arm: The arm.
        joints: Joint positions [rad], shape (..., 7).
    """
    bounded = arm.bounded
    span = np.where(bounded, arm.upper - arm.lower, 1.0)
    start = np.where(bounded, arm.lower, joints - 0.5)
    return (joints - start) / span


def configuration_status(
    arm: Arm, joints: FloatArray, jacobian: FloatArray, mode: Mode, settings: Settings
) -> ConfigurationStatus:
    """Return the status of a posture.

    Args:
        arm: The arm.
        joints: Joint positions [rad], shape (7,).
        jacobian: Jacobian of the tool, shape (6, 7).
        mode: The control mode, which determines the task: the tool's position, or its pose.
        settings: Settings of the controller, with the thresholds.
    """
    below, above = joints - arm.lower, arm.upper - joints
    limits = np.zeros(len(joints), np.int8)
    limits[above <= settings.near_limit] = 1
    limits[below <= settings.near_limit] = -1
    rows = jacobian[3:] if mode in POSITION_MODES else jacobian
    value = smallest_singular_value(rows, settings.length)
    # A continuous joint is never the worst.
    margin = np.minimum(below, above)
    fractions = np.where(
        np.isfinite(margin), margin / np.where(arm.bounded, above + below, 1.0), 1.0
    )
    return ConfigurationStatus(limits, value < settings.singular, value, int(fractions.argmin()))


STILL = 1e-3
"""Fraction of the command below which a motion counts as none."""
PLANNED = 0.25
"""Fraction of the acceleration limit for each part of a motion: speeding up, following the curved
null space, braking for a limit. They may coincide, and one joint may compensate for others."""


class ControlState(NamedTuple):
    """State of arm and target in one control period."""

    arm: Arm
    settings: Settings
    joints: FloatArray
    """Joint positions [rad], shape (7,)."""
    rates: FloatArray
    """Joint rates of the previous step [rad/s], shape (7,)."""
    jacobian: FloatArray
    """Jacobian of the tool in the middle of the step, shape (6, 7)."""
    error: FloatArray
    """Displacement from tool to target: rotation vector [rad], translation [m], shape (6,)."""
    lower: FloatArray
    """Lowest rates allowed by joint limits and velocities [rad/s], shape (7,)."""
    upper: FloatArray
    """Highest rates allowed by joint limits and velocities [rad/s], shape (7,)."""
    speed: float
    """Speed of the joint group in the previous step, in [-1, 1]; it approaches k of eq. (13)."""
    group_rates: FloatArray | None
    """Joint rates of the group at speed 1 in the previous step [rad/s], shape (7,), if it moved."""
    elbow_sign: float
    """Direction of the elbow at a positive command: 1 along `elbow_direction`, or -1."""


class RateCommand(NamedTuple):
    """Joint rates that a mode commands.

    Attributes:
        rates: Joint rates within limits of position and velocity [rad/s], shape (7,).
        reason: Reason why the arm does not follow the command, empty if it does.
        speed: New speed k of the joint group.
        group_rates: Joint rates of the group at speed 1 [rad/s], shape (7,); None without a group.
    """

    rates: FloatArray
    reason: str = ""
    speed: float = 0.0
    group_rates: FloatArray | None = None


def mode_rate_bounds(
    arm: Arm, joints: FloatArray, settings: Settings
) -> tuple[FloatArray, FloatArray]:
    """Return the rates that a mode may command: braking at `PLANNED`, within joint velocities."""
    lower, upper = rate_bounds(arm, joints, settings.period, PLANNED * settings.acceleration)
    return np.maximum(lower, -arm.velocity), np.minimum(upper, arm.velocity)


def slow_down_together(rates: FloatArray, state: ControlState) -> tuple[float, int]:
    """Return the factor by which all joints slow down, and the joint that stops them, else -1.

    Each joint brakes for its limit in proportion to its rate, so that all joints come to rest
    together: the tool remains on its path, or at its position, until it stops.
    """
    size = np.abs(rates)
    fastest = float(size.max())
    if fastest == 0.0:
        return 1.0, -1
    settings, velocity = state.settings, state.arm.velocity
    # The lower bound avoids a division by zero; a joint that hardly moves needs no bound.
    braking = PLANNED * settings.acceleration * np.maximum(size / fastest, 1e-6)
    in_time = stops_in_time(state.arm, state.joints, rates, settings.period, braking)
    if in_time and (size <= velocity).all():
        return 1.0, -1
    lower, upper = rate_bounds(state.arm, state.joints, settings.period, braking)
    fraction, joint = scale_to_bounds(
        rates, np.maximum(lower, -velocity), np.minimum(upper, velocity)
    )
    return fraction, joint if fraction < STILL else -1


def commanded_twist(command: Command) -> FloatArray:
    """Return the tool velocity of a command, angular then linear [rad/s; m/s], shape (6,)."""
    twist = np.empty(6)
    twist[:3], twist[3:] = command.angular, command.linear
    return twist


def limit_message(joints: ArrayLike) -> str:
    """Return the message for joints, counted from 0, that are at their limits."""
    names = [str(joint + 1) for joint in np.asarray(joints, dtype=int)]
    if len(names) == 1:
        return f"joint {names[0]} is at its limit"
    return f"joints {', '.join(names)} are at their limits"


def stop_reason(command: Command, rates: FloatArray, held: BoolArray, state: ControlState) -> str:
    """Return why the tool does not follow the command, empty if it follows at least partly."""
    twist = commanded_twist(command)
    # Rotations are weighted as distances, so that both parts of a command count.
    weights = np.repeat((state.settings.length, 1.0), 3) ** 2
    followed = float((state.jacobian @ rates * weights) @ twist)
    if followed > STILL * float((twist * weights) @ twist) or not twist.any():
        return ""
    near = state.settings.near_limit
    at_end = (state.joints - state.arm.lower <= near) | (state.arm.upper - state.joints <= near)
    stuck = np.flatnonzero(held & at_end)
    if not stuck.size:
        return "the arm is fully stretched: the tool cannot move in that direction."
    return f"{limit_message(stuck)}: the tool cannot move in that direction."
