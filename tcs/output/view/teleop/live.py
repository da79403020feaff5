"""The live page: a person drives an arm, and sees what it does and why it stops."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import Meshcat

from tcs.output.view.teleop.controls import (
    RATE_SLIDERS,
    OperatorCommand,
    OperatorInput,
    Reading,
    buttons,
    sliders,
)
from tcs.output.view.teleop.gamepad import gamepad_state
from tcs.output.view.teleop.panel import Panel, mode_line, readout, state_facts
from tcs.output.view.teleop.robot_display import TARGET, TOOL, RobotDisplay, Trail, pose_of
from tcs.output.view.teleop.timing import Durations, StepClock
from tcs.teleop import Arm, Command, Mode, Settings, Step, Teleoperation

FloatArray = NDArray[np.float64]
SHOW_EVERY = 3
"""Steps from picture to picture: 33 in a second, at 100 steps."""
_SAID_FOR = 0.7
"""How long what is said stays to be read, at least [s]."""
_LOOK_EVERY = 7
"""Pictures between two looks at whether the robot touches itself: five in a second."""


class MeshcatControls:
    """Sliders, buttons and gamepad of a Meshcat."""

    def __init__(self, meshcat: Meshcat, groups: int) -> None:
        """Lay them out.

        Args:
            meshcat: Where to.
            groups: How many joint groups there are.
        """
        self._meshcat = meshcat
        self._sliders = sliders()
        self._buttons = buttons(groups)
        for name, key in self._buttons.items():
            meshcat.AddButton(f"{name} ({key_name(key)})", key)
        for name, (low, high, step, value) in self._sliders.items():
            meshcat.AddSlider(name, low, high, step, value)

    def read(self) -> Reading:
        """Return how the controls stand now."""
        meshcat = self._meshcat
        pad = meshcat.GetGamepad()
        return Reading(
            {name: meshcat.GetSliderValue(name) for name in self._sliders},
            {
                name: meshcat.GetButtonClicks(f"{name} ({key_name(key)})")
                for name, key in self._buttons.items()
            },
            gamepad_state(pad.index, pad.axes, pad.button_values),
            meshcat.GetNumActiveConnections() > 0,
        )

    def zero(self) -> None:
        """Put every slider of a rate back to zero."""
        for name in RATE_SLIDERS:
            self._meshcat.SetSliderValue(name, 0.0)


def key_name(key: str) -> str:
    """Return what stands on a key that the browser knows by its place.

    >>> key_name("KeyW"), key_name("Digit1"), key_name("Space")
    ('W', '1', 'space')
    """
    return key.removeprefix("Key").removeprefix("Digit").replace("Space", "space")


class LivePage:
    """An arm on show, driven by the controls of its page."""

    def __init__(
        self,
        meshcat: Meshcat,
        stage: RobotDisplay,
        arm: Arm,
        start: FloatArray,
        *,
        settings: Settings,
        modes: tuple[Mode, ...],
        tell: Callable[[str], None],
        on_step: Callable[[Command, Step], None] | None = None,
    ) -> None:
        """Lay out the page.

        Args:
            meshcat: An empty one.
            stage: The robot.
            arm: Its arm.
            start: Where its joints stand at first [rad], shape (7,).
            settings: How commands become motion.
            modes: What a person can change between; the first one comes first.
            tell: Called with a line of text whenever the arm stops anew, or for another reason.
            on_step: Called after each step with the command and what came of it, once a browser
                has looked at the page.

        Raises:
            TcsError: If the start posture is not seven finite numbers.
        """
        self.session = Teleoperation(arm, start, settings, modes[0])
        self.hand = OperatorInput(
            MeshcatControls(meshcat, len(settings.groups)), modes, len(settings.groups)
        )
        self.steps, self.pictures, self.worked = Durations(), Durations(), Durations()
        self.dropped = 0
        self._meshcat, self._stage, self._arm = meshcat, stage, arm
        self._start = np.array(start, dtype=np.float64)
        self._tell, self._on_step = tell, on_step
        self._said, self._said_until = "", 0.0
        self._touching = ""
        self._seen = False
        self._shown = 0
        stage.set_up(meshcat, arm.kinematics(self._start).p)
        self._panel = Panel(meshcat, arm)
        self._trail = Trail(meshcat)
        self._heard = OperatorCommand(Command())
        self.last = self.session.step(Command(clutch=True))
        self.show()

    def step(self) -> Step:
        """Listen to the controls and move the arm on by one period."""
        begun = time.perf_counter()
        heard = self._heard = self.hand.listen(begun)
        if heard.back:
            self.session.place(self._start)
            self._trail.clear()
        listened = time.perf_counter()
        self.last = self.session.step(heard.command)
        now = time.perf_counter()
        self.steps.add(now - listened)
        self.worked.add(now - begun)
        if heard.lost:
            self.last = dataclasses.replace(self.last, stopped=True, reason=heard.lost)
        reason = self.last.reason
        if reason:
            # What can still be read on the page is not told again.
            if reason != self._said or now >= self._said_until:
                self._tell(reason)
            self._said, self._said_until = reason, now + _SAID_FOR
        self._seen = self._seen or heard.watched
        if self._seen and self._on_step is not None:
            self._on_step(heard.command, self.last)
        return self.last

    def show(self) -> None:
        """Send what has changed to the browser."""
        begun = time.perf_counter()
        last, meshcat = self.last, self._meshcat
        for path, pose in self._stage.poses(last.joints).items():
            meshcat.SetTransform(path, pose)
        if self._shown % _LOOK_EVERY == 0:
            touching = self._stage.contacts()
            self._touching = "" if touching is None else f"{touching[0]} touches {touching[1]}"
        self._shown += 1
        meshcat.SetTransform(TOOL, pose_of(last.R, last.p))
        meshcat.SetTransform(TARGET, pose_of(last.target_R, last.target_p))
        self._trail.add(last.p)
        mode, said = self.mode_line(), self.said(time.perf_counter())
        self._panel.show(readout(self._arm, last.joints, last.limits, last.singular, mode, said))
        self.pictures.add(time.perf_counter() - begun)

    def run(self, duration: float | None = None) -> None:
        """Drive the arm for so long [s], or until interrupted."""
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
        """Return what commands move, in one line."""
        number = self.hand.group
        chosen = self.last.mode is Mode.NULL_SPACE
        group = self.session.settings.groups[number] if chosen else None
        clutch = self._heard.command.clutch and not self._heard.lost
        return mode_line(self.last.mode, group, number, clutch)

    def said(self, now: float) -> str:
        """Return what the person is told: why the arm stops, or what else there is to know.

        Args:
            now: Time [s].
        """
        if now < self._said_until:
            return self._said
        facts = [state_facts(self.last.limits, self.last.singular)]
        if self._touching:
            facts.append(f"{self._touching} (nothing prevents that)")
        return self._heard.hint or "; ".join(one for one in facts if one)
