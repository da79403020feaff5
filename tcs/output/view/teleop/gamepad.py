"""Gamepad input: sticks and buttons become a command, or count as lost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
GAMEPADS = range(16)
"""Numbers of gamepads in a browser; greater ones mark other devices."""
DEAD_ZONE = 0.15
"""Fraction of the range within which a stick counts as at rest."""
STUCK_AFTER = 5.0
"""Time for which a pushed stick may report a constant value [s]: a browser in the background stops
sending, and its last state would persist."""
_PRESSED = 0.5
A, B, LEFT_SHOULDER = 0, 1, 4
UP, DOWN, LEFT, RIGHT = 12, 13, 14, 15
"""Numbers of the buttons in the standard gamepad mapping of the W3C."""


@dataclass(frozen=True, slots=True)
class GamepadState:
    """State of a gamepad as last reported by the browser; axes in [-1, 1]."""

    axes: tuple[float, ...]
    buttons: tuple[float, ...]

    def pressed(self, button: int) -> bool:
        """Return whether a button is pressed; False for a missing button."""
        return button < len(self.buttons) and self.buttons[button] > _PRESSED

    def stick(self, axis: int) -> float:
        """Return an axis in [-1, 1], zero within the dead zone and without a jump at its edge."""
        value = self.axes[axis] if axis < len(self.axes) else 0.0
        if not abs(value) > DEAD_ZONE:
            return 0.0
        return float(np.sign(value)) * (min(abs(value), 1.0) - DEAD_ZONE) / (1.0 - DEAD_ZONE)

    @property
    def pushing(self) -> bool:
        """Whether anything that moves the arm is pushed."""
        return any(self.stick(i) for i in range(4)) or self.pressed(LEFT) or self.pressed(RIGHT)


@dataclass(frozen=True, slots=True)
class GamepadCommand:
    """Command of a gamepad."""

    linear: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Fraction of the greatest speed along x (forward), y (left), z (up) of the base."""
    angular: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """The same for rotations about these axes."""
    turn: int = 0
    """Direction of the joint group or the elbow."""
    clutch: bool = False
    """Whether the clutch is held."""
    clicks: tuple[int, ...] = ()
    """Buttons pressed since the last reading."""
    lost: str = ""
    """Why the arm has to stop; empty if it need not."""


class Gamepad:
    """A gamepad over time.

    It moves the arm only after it was at rest: earlier input, or input from an unobserved time, is
    not meant for the arm.
    """

    def __init__(self) -> None:
        """Begin without a gamepad."""
        self._last: GamepadState | None = None
        self._changed = 0.0
        self._active = False
        self._lost = ""

    def update(self, pad: GamepadState | None, now: float) -> GamepadCommand:
        """Return the present command.

        Left stick: forward and sideways; right stick: up, and yaw. With the left shoulder button
        held, the left stick rolls and pitches instead. The cross moves a joint group, left and
        right, and selects one, up and down. A changes the mode, B is the clutch.

        A lost gamepad stops the arm until it is back and was released, or `dismiss` is called.

        Args:
            pad: State of the gamepad; None if there is none.
            now: Time [s].
        """
        before, self._last = self._last, pad
        if pad is None:
            if before is not None and self._active:
                self._lost = (
                    "gamepad lost: the arm stops. Connect it and release its sticks, or press the "
                    "space bar to continue without it."
                )
            self._active = False
            return GamepadCommand(lost=self._lost)
        if pad != before:
            self._changed = now
        if not pad.pushing:
            self._active, self._lost = True, ""
        elif self._active and now - self._changed > STUCK_AFTER:
            self._active = False
            self._lost = (
                f"no change from the gamepad for {STUCK_AFTER:g} s while a stick is pushed: the "
                "arm stops. Release it, with this page in the foreground."
            )
        if before is None or not self._active:
            return GamepadCommand(lost=self._lost)
        clicks = tuple(
            i for i in range(len(pad.buttons)) if pad.pressed(i) and not before.pressed(i)
        )
        ahead, left = -pad.stick(1), -pad.stick(0)
        yaw, up = -pad.stick(2), -pad.stick(3)
        turning = pad.pressed(LEFT_SHOULDER)
        return GamepadCommand(
            linear=(0.0, 0.0, up) if turning else (ahead, left, up),
            # Pushing forward pitches the tool about y; pushing left rolls it to the left.
            angular=(-left, ahead, yaw) if turning else (0.0, 0.0, yaw),
            turn=int(pad.pressed(RIGHT)) - int(pad.pressed(LEFT)),
            clutch=pad.pressed(B),
            clicks=clicks,
        )

    def dismiss(self) -> None:
        """Continue without a lost gamepad."""
        self._lost = ""

    def reset(self) -> None:
        """Ignore the gamepad until it was at rest."""
        self._active, self._lost = False, ""


def gamepad_state(
    index: int | None, axes: Sequence[float], buttons: Sequence[float]
) -> GamepadState | None:
    """Return the gamepad's state from Meshcat; None if there is none.

    When a gamepad is removed, the browser sends an empty message; Meshcat then keeps the last index
    and reports neither axes nor buttons.
    """
    if index is None or index not in GAMEPADS or not (len(axes) or len(buttons)):
        return None
    return GamepadState(tuple(axes), tuple(buttons))
