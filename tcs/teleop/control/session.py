"""Teleoperation session: commands in, steps of the arm out, one per control period."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tcs.kernel.arrays import FloatArray
from tcs.teleop.arm import JOINTS, Arm
from tcs.teleop.control.bounds import limit_rate_change, rate_bounds, stops_in_time
from tcs.teleop.control.joint_groups import holding_rates
from tcs.teleop.control.modes import elbow_sign, rate_command
from tcs.teleop.control.resolved_rate import pose_error, rotated
from tcs.teleop.control.settings import NULL_SPACE_MODES, Command, Mode, Settings
from tcs.teleop.control.state import (
    ControlState,
    RateCommand,
    ShortArray,
    commanded_twist,
    configuration_status,
    mode_rate_bounds,
)


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """State of the arm after one control period.

    Attributes:
        time: Time since the start of the session [s].
        joints: Joint positions [rad], shape (7,), always within the limits.
        rates: Joint rates during the step [rad/s], shape (7,).
        R: Orientation of the tool in the robot's base, R_BT, shape (3, 3).
        p: Position of the tool in the robot's base [m], shape (3,).
        target_R: Target orientation in the robot's base, shape (3, 3).
        target_p: Target position in the robot's base [m], shape (3,).
        mode: The control mode.
        limits: -1 where a joint is at its lower limit, 1 at its upper limit, else 0; shape (7,).
        singular: Whether the task of this mode is singular.
        singular_value: Smallest singular value of the task's Jacobian [m/rad].
        worst_joint: The joint closest to a limit, as a fraction of its range, counted from 0.
        stopped: Whether the arm does not follow the command.
        reason: Reason of the stop, one line; empty while the arm follows.
    """

    time: float
    joints: FloatArray
    rates: FloatArray
    R: FloatArray
    p: FloatArray
    target_R: FloatArray
    target_p: FloatArray
    mode: Mode
    limits: ShortArray
    singular: bool
    singular_value: float
    worst_joint: int
    stopped: bool
    reason: str


class Teleoperation:
    """An arm that follows an operator's commands, one every `settings.period`."""

    def __init__(
        self,
        arm: Arm,
        joints: ArrayLike,
        settings: Settings | None = None,
        mode: Mode = Mode.END_EFFECTOR,
    ) -> None:
        """Start with the arm at rest.

        A posture beyond the limits is not an error: the arm holds still there, and every step
        reports the reason, until `place` sets another posture.

        Args:
            arm: The arm.
            joints: Joint positions [rad], shape (7,).
            settings: Settings of the controller; None for the defaults.
            mode: The initial mode.

        Raises:
            TcsError: If the joints are not seven finite numbers.
        """
        self.arm = arm
        self.settings = settings or Settings()
        self._mode = mode
        self._time = 0.0
        self._last_command_time = 0.0
        self._command = Command()
        self.place(joints)

    def place(self, joints: ArrayLike) -> None:
        """Set the arm to another posture, at rest; time continues.

        Args:
            joints: Joint positions [rad], shape (7,).

        Raises:
            TcsError: If the joints are not seven finite numbers.
        """
        self._joints = self.arm.checked(joints, "start posture")
        self._rates = np.zeros(JOINTS)
        self._now = self.arm.kinematics(self._joints)
        self._target_R, self._target_p = self._now.R, self._now.p
        self._switching = False
        self._group: int | None = None
        self._speed = 0.0
        self._group_rates: FloatArray | None = None
        self._elbow_sign: float | None = None
        self._held_rows: FloatArray | None = None
        self._beyond = self.arm.limit_violation(self._joints)

    @property
    def joints(self) -> FloatArray:
        """Joint positions [rad], shape (7,)."""
        return self._joints.copy()

    @property
    def mode(self) -> Mode:
        """The control mode."""
        return self._mode

    def step(self, command: Command | None = None) -> Step:
        """Move the arm for one period.

        Args:
            command: The operator's command; None if no command arrived, in which case the last one
                continues until `settings.timeout` has passed.
        """
        self._time += self.settings.period
        why = self._refused(command)
        held = bool(why) or self._command.clutch
        executed = self._admitted(self._command, held)
        rates, reason = np.zeros(JOINTS), why
        self._held_rows = None
        if not held or self._speed:
            rates, reason, self._speed, self._group_rates = self._rate_command(executed)
            reason = why or reason
        if self._move(rates):
            self._switching = False
        self._advance_target(executed, stays=held or self._switching or bool(reason))
        return self._report(reason)

    def _admitted(self, command: Command, held: bool) -> Command:
        """Return the part of a command that is executed now.

        A moving group comes to rest before another motion begins, and so does the tool before a
        group moves: each mode ends by its own rules, without jumps or slip.
        """
        if not self._speed:
            self._group = command.group
            if not held and command.mode is not None and command.mode != self._mode:
                self._mode = Mode(command.mode)
                self._switching = True
                self._target_R, self._target_p = self._now.R, self._now.p
        other = command.mode not in (None, self._mode)
        if not (held or other or self._switching):
            if self._mode is Mode.POSE or command.group == self._group:
                return command
        if self._mode in NULL_SPACE_MODES:
            return Command(group=self._group)
        return Command() if held else command

    def _refused(self, command: Command | None) -> str:
        """Accept a command, or return the reason why the arm holds still instead."""
        settings = self.settings
        why = ""
        if command is not None:
            self._last_command_time = self._time
            fault = command.fault(len(settings.groups))
            if fault:
                why = f"command rejected: {fault}. The arm holds still until a valid one arrives."
            else:
                self._command = command
        # Half a period is added so that rounding of the time does not decide.
        elif self._time - self._last_command_time > settings.timeout + 0.5 * settings.period:
            why = (
                f"input lost: no command for more than {settings.timeout:g} s. The arm holds still "
                "until one arrives."
            )
        if why:
            # An earlier command must not resume once the reason no longer applies.
            self._command = Command()
        if self._beyond:
            why = f"start posture: {self._beyond}. The arm holds still; place it within them."
        return why

    def _rate_command(self, command: Command) -> RateCommand:
        """Return the rate command of the mode."""
        settings = self.settings
        # The Jacobian at the middle of the step is accurate to second order.
        middle = self.arm.kinematics(self._joints + 0.5 * settings.period * self._rates)
        if self._elbow_sign is None or not (self._speed or command.sign):
            # The direction of the elbow in which joint 1 increases at the start.
            self._elbow_sign = elbow_sign(middle.jacobian) if self._mode is Mode.POSE else None
        if self._mode in NULL_SPACE_MODES:
            # Rows of the Jacobian that the mode holds: position, or position and orientation.
            rows = 3 if self._mode is Mode.NULL_SPACE else 0
            self._held_rows = middle.jacobian[rows:]
        lower, upper = mode_rate_bounds(self.arm, self._joints, settings)
        state = ControlState(
            arm=self.arm,
            settings=settings,
            joints=self._joints,
            rates=self._rates,
            jacobian=middle.jacobian,
            error=pose_error(self._target_R, self._target_p, self._now.R, self._now.p),
            lower=lower,
            upper=upper,
            speed=self._speed,
            group_rates=self._group_rates,
            elbow_sign=self._elbow_sign or 1.0,
        )
        return rate_command(self._mode, command, state)

    def _move(self, wanted: FloatArray) -> bool:
        """Move the arm for one period; return whether it reaches the required rates."""
        settings, arm = self.settings, self.arm
        if self._beyond:
            return True
        period, acceleration = settings.period, settings.acceleration
        change = acceleration * period
        before = self._rates
        rates, arrived = limit_rate_change(before, wanted, change)
        in_time = stops_in_time(arm, self._joints, rates, period, acceleration)
        if not (in_time and arrived):
            # A joint that must brake for its limit does so even if the others take longer.
            lower, upper = rate_bounds(arm, self._joints, period, acceleration)
            held = self._held_rows
            if held is None or self._switching:
                rates = np.clip(rates, lower, upper)
            else:
                # The null space changes with the posture: rates that kept their direction would
                # let the tool slip.
                rates = holding_rates(
                    held,
                    rates,
                    held @ wanted,
                    np.maximum(lower, before - change),
                    np.minimum(upper, before + change),
                )
        self._rates = rates
        # The bounds end at the limits, which rounding may exceed slightly.
        joints = self._joints + settings.period * self._rates
        self._joints = np.minimum(np.maximum(joints, arm.lower), arm.upper)
        self._now = arm.kinematics(self._joints)
        return arrived

    def _advance_target(self, command: Command, *, stays: bool) -> None:
        """Move the target with the command, within the target lead limit.

        Args:
            command: The executed part of the command.
            stays: Whether the target is set to the tool pose instead: while the tool comes to rest,
                so that no error moves it back, and where its motion ends. In joint mode it always
                is, because no pose is commanded.
        """
        settings, now = self.settings, self._now
        if self._mode in NULL_SPACE_MODES and not self._switching:
            if self._mode is Mode.NULL_SPACE:
                self._target_R = now.R
            return
        if stays or self._mode is Mode.JOINT:
            self._target_R, self._target_p = now.R, now.p
            return
        twist = commanded_twist(command)
        self._target_p = self._target_p + twist[3:] * settings.period
        self._target_R = rotated(self._target_R, twist[:3], settings.period)
        error = pose_error(self._target_R, self._target_p, now.R, now.p)
        angle, distance = (math.sqrt(part @ part) for part in (error[:3], error[3:]))
        if distance > settings.target_lead:
            self._target_p = now.p + error[3:] * (settings.target_lead / distance)
        assisted = self._mode is Mode.ASSISTED
        target_lead = settings.assist_lead_angle if assisted else settings.target_lead_angle
        if angle > target_lead:
            self._target_R = rotated(now.R, error[:3], target_lead / angle)

    def _report(self, reason: str) -> Step:
        flags = configuration_status(
            self.arm, self._joints, self._now.jacobian, self._mode, self.settings
        )
        return Step(
            time=self._time,
            joints=self._joints,
            rates=self._rates,
            R=self._now.R,
            p=self._now.p,
            target_R=self._target_R,
            target_p=self._target_p,
            mode=self._mode,
            limits=flags.limits,
            singular=flags.singular,
            singular_value=flags.singular_value,
            worst_joint=flags.worst_joint,
            stopped=bool(reason),
            reason=reason,
        )
