"""A gamepad: what its sticks and buttons ask for, and when it counts as lost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
DEAD_ZONE = 0.15
"""Sticks do not come to rest at zero; worn ones are off by up to this share."""
STUCK_AFTER = 5.0
"""A stick that says exactly the same for so long [s] while it is pushed is nobody's hand: a browser
that is not looked at stops sending, and the last thing it has sent would go on for ever."""
_PRESSED = 0.5
A, B, LEFT_SHOULDER = 0, 1, 4
UP, DOWN, LEFT, RIGHT = 12, 13, 14, 15
"""Buttons as the W3C's standard gamepad numbers them."""


@dataclass(frozen=True, slots=True)
class GamepadState:
    """What a gamepad is doing, as the browser has told it last; axes in [-1, 1]."""

    axes: tuple[float, ...]
    buttons: tuple[float, ...]

    def pressed(self, button: int) -> bool:
        """Whether a button is pressed; one that it does not have never is."""
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
class Asked:
    """What a gamepad asks for."""

    linear: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Share of the greatest speed along x (ahead), y (left), z (up) of the base."""
    angular: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """The same of turns about these axes."""
    turn: int = 0
    """Which way the joint group, or the elbow, is to turn."""
    clutch: bool = False
    """Whether the clutch is held."""
    clicks: tuple[int, ...] = ()
    """Buttons that have been pressed since the last look."""
    lost: str = ""
    """Why the arm has to hold still, if it has to."""


class Gamepad:
    """A gamepad over time.

    It moves the arm only once it has been seen at rest: what it was doing while it came, or while
    nobody could tell, is not meant for the arm.
    """

    def __init__(self) -> None:
        """Begin without one."""
        self._last: GamepadState | None = None
        self._changed = 0.0
        self._heeded = False
        self._lost = ""

    def look(self, pad: GamepadState | None, now: float) -> Asked:
        """Return what is asked for now.

        Left stick: ahead and sideways; right stick: up, and turning about the vertical. With the
        left shoulder button held, the left stick rolls and tips instead. The cross turns a joint
        group, left and right, and chooses one, up and down. A changes the mode, B is the clutch.

        A gamepad that was there and is not any more holds the arm, until it is back and has been
        let go of, or `give_up` is called.

        Args:
            pad: What the browser says; None if there is no gamepad.
            now: Time [s].
        """
        before, self._last = self._last, pad
        if pad is None:
            if before is not None and self._heeded:
                self._lost = (
                    "gamepad lost: the arm holds still. Connect it and let go of its sticks, or "
                    "press the space bar to go on without it."
                )
            self._heeded = False
            return Asked(lost=self._lost)
        if pad != before:
            self._changed = now
        if not pad.pushing:
            self._heeded, self._lost = True, ""
        elif self._heeded and now - self._changed > STUCK_AFTER:
            self._heeded = False
            self._lost = (
                f"gamepad silent for {STUCK_AFTER:g} s while it is pushed: the arm holds still. "
                "Let go of it, with this page in front."
            )
        if before is None or not self._heeded:
            return Asked(lost=self._lost)
        clicks = tuple(
            i for i in range(len(pad.buttons)) if pad.pressed(i) and not before.pressed(i)
        )
        ahead, left = -pad.stick(1), -pad.stick(0)
        yaw, up = -pad.stick(2), -pad.stick(3)
        turning = pad.pressed(LEFT_SHOULDER)
        return Asked(
            linear=(0.0, 0.0, up) if turning else (ahead, left, up),
            # Pushing ahead tips the tool ahead: a turn about y; pushing left rolls it to the left.
            angular=(-left, ahead, yaw) if turning else (0.0, 0.0, yaw),
            turn=int(pad.pressed(RIGHT)) - int(pad.pressed(LEFT)),
            clutch=pad.pressed(B),
            clicks=clicks,
        )

    def give_up(self) -> None:
        """Go on without a gamepad that is lost."""
        self._lost = ""

    def forget(self) -> None:
        """Heed it again only once it has been at rest."""
        self._heeded, self._lost = False, ""


def gamepad_state(
    index: int | None, axes: Sequence[float], buttons: Sequence[float]
) -> GamepadState | None:
    """Return what Meshcat tells of a gamepad; None if it has none.

    When a gamepad goes, the browser sends an empty message; Meshcat then keeps the last index and
    tells of neither axes nor buttons.
    """
    if index is None or not (len(axes) or len(buttons)):
        return None
    return GamepadState(tuple(axes), tuple(buttons))
