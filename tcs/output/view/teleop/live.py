"""The live page: an operator teleoperates an arm and sees its motion and why it stops."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Meshcat

from tcs.output.view.teleop.controls import NO_BROWSER, OperatorCommand, OperatorInput
from tcs.output.view.teleop.page_link import PageLink
from tcs.output.view.teleop.panel import mode_line, readout, state_facts
from tcs.output.view.teleop.pose_device import PoseDevice
from tcs.output.view.teleop.robot_display import TARGET, TOOL, RobotDisplay, Trail, pose_of
from tcs.output.view.teleop.set_point import SetPoint
from tcs.output.view.teleop.timing import Durations, StepClock
from tcs.teleop import Arm, Command, Mode, Settings, Step, Teleoperation
from tcs.teleop.control.latency import DelayLine, Latency

FloatArray = NDArray[np.float64]
_REST = Command(clutch=True)
"""Command at the arm until one of the operator arrives."""
SHOW_EVERY = 3
"""Steps per frame: 33 frames a second at 100 steps."""
_MESSAGE_TIME = 0.7
"""Least time that a message stays visible [s]."""
_CHECK_EVERY = 7
"""Frames between two self-contact checks: five checks a second."""


class LivePage:
    """An arm in Meshcat, teleoperated by the controls of the operator's page.

    Meshcat shows the scene only: its socket tells no page of this machine from one of elsewhere.
    """

    def __init__(
        self,
        meshcat: Meshcat,
        display: RobotDisplay,
        arm: Arm,
        start: FloatArray,
        *,
        settings: Settings,
        modes: tuple[Mode, ...],
        link: PageLink,
        latency: Latency | None = None,
        on_stop: Callable[[str], None],
        on_step: Callable[[Command, Step], None] | None = None,
        on_show: Callable[[FloatArray], None] | None = None,
    ) -> None:
        """Set up the page.

        Args:
            meshcat: An empty Meshcat.
            display: The robot.
            arm: Its arm.
            start: Joint positions at the start [rad], shape (7,).
            settings: Settings of the controller.
            modes: Modes that the operator can switch between, the initial one first.
            link: Controls of the operator's page, which shows the readout.
            latency: Latency between the operator and the arm; None for none. A lost operator and
                the return to the start act at once.
            on_stop: Called with the reason whenever the arm stops, or its reason changes.
            on_step: Called after each step with the command that the arm executes and the step,
                once a browser has connected.
            on_show: Called at each frame with the joint positions that it shows [rad], shape (7,).

        Raises:
            TcsError: If the start posture is not seven finite numbers.
        """
        self.session = Teleoperation(arm, start, settings, modes[0])
        self.operator = OperatorInput(
            link, modes, len(settings.groups),
            pose_device=PoseDevice(settings.period),
            set_point=SetPoint(lambda: self.seen.joints) if Mode.JOINT in modes else None,
        )  # fmt: skip
        self.steps, self.pictures, self.worked = Durations(), Durations(), Durations()
        self.dropped = 0
        self._meshcat, self._display, self._arm = meshcat, display, arm
        self._start = np.array(start, dtype=np.float64)
        self._on_stop, self._on_step, self._on_show = on_stop, on_step, on_show
        self._message, self._message_until = "", 0.0
        self._touching = ""
        self._watched = False
        self._shown = 0
        display.set_up(meshcat, arm.kinematics(self._start).p)
        self._link = link
        self._trail = Trail(meshcat)
        self._input = OperatorCommand(Command())
        self.last = self.seen = self.session.step(_REST)
        latency = latency or Latency()
        self._commands = DelayLine(latency.command, settings.period, _REST)
        self._pictures = DelayLine(latency.picture, settings.period, self.last)
        self.show()

    def step(self) -> Step:
        """Read the controls and advance the arm by one period."""
        begun = time.perf_counter()
        operator_input = self._input = self.operator.read(begun)
        if operator_input.back:
            self.session.place(self._start)
            self._trail.clear()
        if operator_input.back or operator_input.lost:
            # The watchdog is at the arm: commands on their way are dropped.
            self._commands.reset(_REST)
        command = self._arriving(operator_input)
        read = time.perf_counter()
        self.last = self.session.step(command)
        now = time.perf_counter()
        self.steps.add(now - read)
        self.worked.add(now - begun)
        if operator_input.lost:
            self.last = dataclasses.replace(self.last, stopped=True, reason=operator_input.lost)
        if operator_input.back:
            self._pictures.reset(self.last)
        self.seen = self._pictures.send(self.last)
        reason = operator_input.lost or self.seen.reason
        if self.seen.reason:
            self.operator.drop_lag()
        if reason:
            # A message that is still visible is not repeated.
            if reason != self._message or now >= self._message_until:
                self._on_stop(reason)
            self._message, self._message_until = reason, now + _MESSAGE_TIME
        self._watched = self._watched or operator_input.watched
        if self._watched and self._on_step is not None:
            self._on_step(command, self.last)
        return self.last

    def restart(self) -> None:
        """Put the arm back to its start, in the first mode, with nothing commanded."""
        self.operator.reset()
        self.session.place(self._start)
        self._trail.clear()
        self._commands.reset(_REST)
        self.last = self.seen = self.session.step(_REST)
        self._pictures.reset(self.last)

    def _arriving(self, operator_input: OperatorCommand) -> Command:
        """Return the command that arrives at the arm now; that of a lost operator at once."""
        if operator_input.lost:
            return operator_input.command
        return self._commands.send(operator_input.command)

    def show(self) -> None:
        """Send the changes to the browser."""
        begun = time.perf_counter()
        seen, meshcat = self.seen, self._meshcat
        for path, pose in self._display.poses(seen.joints).items():
            meshcat.SetTransform(path, pose)
        if self._shown % _CHECK_EVERY == 0:
            touching = self._display.contacts()
            self._touching = "" if touching is None else f"{touching[0]} touches {touching[1]}"
        self._shown += 1
        meshcat.SetTransform(TOOL, pose_of(seen.R, seen.p))
        meshcat.SetTransform(TARGET, pose_of(seen.target_R, seen.target_p))
        self._trail.add(seen.p)
        mode, message = self.mode_line(), self.message(time.perf_counter())
        self._link.show(readout(self._arm, seen.joints, seen.limits, seen.singular, mode, message))
        if self._on_show is not None:
            self._on_show(seen.joints)
        self.pictures.add(time.perf_counter() - begun)

    def run(self, duration: float | None = None) -> None:
        """Run the control loop for a time [s], or until interrupted."""
        pace = StepClock(self.session.settings.period)
        end = None if duration is None else time.monotonic() + duration
        since = 0
        while end is None or time.monotonic() < end:
            due, late = pace.wait()
            self.dropped += late
            for _ in range(due):
                self.step()
                since += 1
            if since >= SHOW_EVERY:
                since = 0
                self.show()

    def timing(self) -> str:
        """Return the times of control steps and frames in one line."""
        late = f"; {self.dropped} steps dropped, as the loop was late" if self.dropped else ""
        return (
            f"{self.steps.count} control steps: {self.steps.summary()}; {self.pictures.count} "
            f"frames: {self.pictures.summary()}{late}."
        )

    def mode_line(self) -> str:
        """Return the control mode in one line."""
        number = self.operator.group
        chosen = self.seen.mode is Mode.NULL_SPACE
        group = self.session.settings.groups[number] if chosen else None
        clutch = self._input.command.clutch and not self._input.lost
        return mode_line(self.seen.mode, group, number, clutch)

    def message(self, now: float) -> str:
        """Return the message for the operator: why the arm stops, joint limits, contacts.

        Args:
            now: Time [s].
        """
        # Who reads that no browser is connected is connected.
        if now < self._message_until and self._message != NO_BROWSER:
            return self._message
        facts = [state_facts(self.seen.limits, self.seen.singular)]
        if self._touching:
            facts.append(f"{self._touching} (contacts are not prevented)")
        return self._input.hint or "; ".join(one for one in facts if one)
