"""Operator input: keys, sliders and gamepad become commands; no browser is needed.

The operator's page reports which keys are held, sliders and gamepad
(`tcs.output.view.teleop.page_link`). A press without a release moves the arm for a moment only.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tcs.output.view.teleop.gamepad import DOWN as PAD_DOWN
from tcs.output.view.teleop.gamepad import UP, A, Gamepad, GamepadCommand, GamepadState
from tcs.output.view.teleop.pose_device import PoseCommand, PoseDevice, PoseState
from tcs.output.view.teleop.set_point import SetPoint
from tcs.teleop import Command, Mode
from tcs.teleop.control.settings import NULL_SPACE_MODES

FloatArray = NDArray[np.float64]
TAP = 0.15
"""How long a press of a button without a release moves the arm [s]."""
MOST_LINEAR, MOST_ANGULAR = 0.25, 1.0
"""Greatest commanded velocities [m/s, rad/s]."""
DEAD_LINEAR, DEAD_ANGULAR = 0.02, 0.05
"""Sliders closer to zero than this count as at zero [m/s, rad/s]."""
SPEED, TURN_SPEED = "key speed [m/s]", "key turn [rad/s]"
NEXT_MODE, CLUTCH, STOP, BACK = "next mode", "clutch", "all to zero", "back to the start"
TURN_DOWN, TURN_UP = "turn group -", "turn group +"
AXES = ("x", "y", "z")
MOVES: Mapping[str, tuple[int, float, str]] = {
    "ahead": (0, 1.0, "KeyW"),
    "back": (0, -1.0, "KeyS"),
    "left": (1, 1.0, "KeyA"),
    "right": (1, -1.0, "KeyD"),
    "up": (2, 1.0, "KeyR"),
    "down": (2, -1.0, "KeyF"),
    "roll right": (3, 1.0, "KeyO"),
    "roll left": (3, -1.0, "KeyU"),
    "tip down": (4, 1.0, "KeyI"),
    "tip up": (4, -1.0, "KeyK"),
    "turn left": (5, 1.0, "KeyJ"),
    "turn right": (5, -1.0, "KeyL"),
}
"""Buttons that move the tool: axis of the twist, direction, and key."""
SILENT = "the page that moves the arm is not heard: the arm stops."
NO_BROWSER = "no browser is connected to this page: the arm stops until one is."
OTHERS: Mapping[str, str] = {
    TURN_DOWN: "KeyQ",
    TURN_UP: "KeyE",
    NEXT_MODE: "KeyM",
    CLUTCH: "KeyC",
    STOP: "Space",
    BACK: "KeyX",
}


def key_name(key: str) -> str:
    """Return the label of a key, given by its code in the browser.

    >>> key_name("KeyW"), key_name("Digit1"), key_name("Space")
    ('W', '1', 'space')
    """
    return key.removeprefix("Key").removeprefix("Digit").replace("Space", "space")


def group_button(number: int) -> str:
    """Return the name of the button of a joint group, counted from 0."""
    return f"joint group {number + 1}"


def sliders() -> dict[str, tuple[float, float, float, float]]:
    """Return the lowest and highest value, the step and the initial value of each slider."""
    found = {}
    for unit, most, name in (("m/s", MOST_LINEAR, "move"), ("rad/s", MOST_ANGULAR, "turn")):
        for axis in AXES:
            found[f"{name} {axis} [{unit}]"] = (-most, most, 0.01, 0.0)
    found[SPEED] = (0.01, MOST_LINEAR, 0.01, 0.1)
    found[TURN_SPEED] = (0.05, MOST_ANGULAR, 0.05, 0.5)
    return found


RATE_SLIDERS = tuple(name for name in sliders() if name not in (SPEED, TURN_SPEED))


def buttons(groups: int) -> dict[str, str]:
    """Return every button with its key.

    Args:
        groups: Number of joint groups.
    """
    of_groups = {group_button(i): f"Digit{i + 1}" for i in range(groups)}
    return {name: key for name, (_, _, key) in MOVES.items()} | of_groups | dict(OTHERS)


@dataclass(frozen=True, slots=True)
class Reading:
    """State of the controls."""

    sliders: Mapping[str, float]
    clicks: Mapping[str, int]
    """Presses of each button since it was added."""
    pad: GamepadState | None
    watched: bool
    """Whether a browser is connected to the page."""
    pose: PoseState | None = None
    """State of an XR controller; None if there is none."""
    held: frozenset[str] = frozenset()
    """Buttons whose keys are held down on the operator's page."""
    silent: bool = False
    """Whether a page whose input moves the arm has not been heard for a moment."""


class Source(Protocol):
    """Source of readings."""

    def read(self) -> Reading:
        """Return the present state of the controls."""
        ...

    def zero(self) -> None:
        """Reset every slider of a rate to zero."""
        ...

    def set_slider(self, name: str, value: float) -> float:
        """Set a slider, and return the value that it has then."""
        ...


@dataclass(frozen=True, slots=True)
class OperatorCommand:
    """Input of the operator for one step."""

    command: Command
    lost: str = ""
    """Why the input counts as lost, so that the arm stops; else empty."""
    hint: str = ""
    """Advice after an input that has no effect; may be empty."""
    back: bool = False
    """Whether to put the arm back to its start."""
    watched: bool = True
    """Whether a browser is connected to the page."""


@dataclass
class OperatorInput:
    """Operator input over time."""

    source: Source
    modes: tuple[Mode, ...]
    groups: int
    group: int = 0
    """The selected joint group, counted from 0."""
    clutch: bool = False
    """Whether the clutch is engaged by key or button."""
    pose_device: PoseDevice | None = None
    """The XR controller; None where none can be used."""
    set_point: SetPoint | None = None
    """The set-point of joint mode; None where the mode is not offered."""
    _mode: int = 0
    _gamepad: Gamepad = field(default_factory=Gamepad)
    _counts: dict[str, int] = field(default_factory=dict)
    _until: dict[str, float] = field(default_factory=dict)
    _hint: tuple[str, float] = ("", -1.0)
    _ignored: frozenset[str] = frozenset()
    """Held buttons that have no effect until they are released."""

    @property
    def mode(self) -> Mode:
        """The control mode."""
        return self.modes[self._mode]

    def read(self, now: float) -> OperatorCommand:
        """Return the operator's input.

        Args:
            now: Time [s].
        """
        reading = self.source.read()
        pressed = self._pressed(reading, now)
        pad = self._gamepad.update(reading.pad, now)
        hand = PoseCommand()
        if self.pose_device is not None:
            hand = self.pose_device.update(reading.pose, now)
            if hand.next_mode:
                pressed[NEXT_MODE] = pressed.get(NEXT_MODE, 0) + 1
        self._ignored &= reading.held
        mode = self.mode
        self._apply_switches(pressed, reading.held - self._ignored, pad, now)
        back = BACK in pressed
        lost = pad.lost or hand.lost
        if not reading.watched:
            self._gamepad.reset()
            lost = NO_BROWSER
        if STOP in pressed:
            self._gamepad.dismiss()
            if self.pose_device is not None:
                self.pose_device.dismiss()
        if reading.silent and not (back or lost or STOP in pressed):
            # The page may be heard again at once, and what it holds then counts as before.
            self._until.clear()
            if self.set_point is not None:
                self.set_point.drop()
            return OperatorCommand(Command(mode=self.mode, clutch=True), SILENT)
        if back or lost or STOP in pressed or self.mode is not mode:
            # What is held was pressed for what the arm did before.
            self._ignored = reading.held
        if back or lost or STOP in pressed:
            self._until.clear()
            if any(reading.sliders[name] for name in RATE_SLIDERS):
                self.source.zero()
        clutch = self.clutch or pad.clutch or hand.clutch
        if self.set_point is not None and (
            lost or back or STOP in pressed or clutch or self.mode is not Mode.JOINT
        ):
            self.set_point.drop()
        if lost or back or STOP in pressed:
            command = Command(mode=self.mode, clutch=bool(lost) or self.clutch)
            return OperatorCommand(command, lost, back=back, watched=reading.watched)
        return OperatorCommand(self._command(reading, pad, hand, now), hint=self._hint_at(now))

    def drop_lag(self) -> None:
        """Drop motion of the XR controller that the arm does not follow."""
        if self.pose_device is not None:
            self.pose_device.drop_lag()

    def reset(self) -> None:
        """Return to the first mode and joint group, with nothing commanded."""
        self.group, self.clutch, self._mode = 0, False, 0
        self._until.clear()
        self._ignored = self.source.read().held
        self.source.zero()
        if self.set_point is not None:
            self.set_point.drop()

    def _pressed(self, reading: Reading, now: float) -> dict[str, int]:
        """Return the buttons pressed since the last reading, and how often."""
        found = {}
        for name, count in reading.clicks.items():
            fresh = count - self._counts.get(name, 0)
            self._counts[name] = count
            if fresh > 0:
                found[name] = fresh
                self._until[name] = now + TAP
        return found

    def _apply_switches(
        self, pressed: Mapping[str, int], held: frozenset[str], pad: GamepadCommand, now: float
    ) -> None:
        """Change mode, group and clutch."""
        in_null_space = self.mode in NULL_SPACE_MODES
        for number in range(self.groups):
            if group_button(number) in pressed:
                self.group = number
        step = (UP in pad.clicks) - (PAD_DOWN in pad.clicks)
        self.group = (self.group + step) % self.groups
        changes = pressed.get(NEXT_MODE, 0) + (A in pad.clicks)
        if changes:
            if len(self.modes) == 1:
                self._hint = (f"this condition has {self.mode} control only.", now + 2.0)
            self._mode = (self._mode + changes) % len(self.modes)
            # Input for the previous mode is not meant for this one.
            self._until.clear()
            return
        if pressed.get(CLUTCH, 0) % 2:
            self.clutch = not self.clutch
        moving = held.union(pressed)
        moves = not moving.isdisjoint(MOVES)
        turns = not moving.isdisjoint((TURN_DOWN, TURN_UP))
        if len(self.modes) > 1:
            if self.mode is Mode.JOINT and (moves or turns):
                self._hint = ("joints are set by their sliders: M selects the tool.", now + 2.0)
                return
            if in_null_space and moves:
                self._hint = ("this mode holds the tool: M selects the next mode.", now + 2.0)
            if not in_null_space and turns:
                self._hint = ("groups move in null-space mode: M selects it.", now + 2.0)

    def _command(
        self, reading: Reading, pad: GamepadCommand, hand: PoseCommand, now: float
    ) -> Command:
        clutch = self.clutch or pad.clutch or hand.clutch
        if self.mode is Mode.JOINT and self.set_point is not None:
            sliders, set_slider = reading.sliders, self.source.set_slider
            wanted = None if clutch else self.set_point.read(sliders, set_slider)
            return Command(mode=self.mode, joints=wanted, clutch=clutch)
        if self.mode in NULL_SPACE_MODES:
            down, up = (self._is_on(name, reading, now) for name in (TURN_DOWN, TURN_UP))
            sign = int(np.sign(int(up) - int(down) + pad.turn + hand.turn))
            group = self.group if self.mode is Mode.NULL_SPACE and sign else None
            return Command(group=group, sign=sign, mode=self.mode, clutch=clutch)
        if hand.engaged:
            return Command(linear=hand.linear, angular=hand.angular, mode=self.mode, clutch=clutch)
        wanted = np.array([reading.sliders[name] for name in RATE_SLIDERS])
        dead = np.repeat((DEAD_LINEAR, DEAD_ANGULAR), 3)
        wanted[np.abs(wanted) < dead] = 0.0
        speeds = np.repeat((reading.sliders[SPEED], reading.sliders[TURN_SPEED]), 3)
        keys = np.zeros(6)
        for name, (axis, direction, _) in MOVES.items():
            if self._is_on(name, reading, now):
                keys[axis] += direction
        wanted += speeds * (keys + np.array([*pad.linear, *pad.angular]))
        most = np.repeat((MOST_LINEAR, MOST_ANGULAR), 3)
        wanted = np.clip(wanted, -most, most)
        return Command(linear=wanted[:3], angular=wanted[3:], mode=self.mode, clutch=clutch)

    def _is_on(self, name: str, reading: Reading, now: float) -> bool:
        """Return whether a button that moves the arm is held, or was pressed a moment ago."""
        held = name in reading.held and name not in self._ignored
        return held or now < self._until.get(name, -1.0)

    def _hint_at(self, now: float) -> str:
        text, until = self._hint
        return text if now < until else ""
