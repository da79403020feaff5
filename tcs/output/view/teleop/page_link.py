"""What the operator's pages and the control loop exchange: input one way, the readout the other.

A page sends a message some twenty times a second, and at once when a key goes down or up. It names
what moves the arm: the keys that are held, the sliders that were moved, the gamepad. So an input
counts while its page is heard, and no longer: where the page whose input moves the arm falls silent
(its tab, browser or machine is gone, or stands still), the arm stops, whichever other pages are
open. A page that was silent for long may have missed a release: its keys count only once they were
released, its sliders are reset, and its gamepad has to be at rest first.

Messages arrive through a server that checks where they come from
(`tcs.output.view.teleop.operator_page`); nothing that moves the arm is read from Meshcat, whose
socket any page in the browser can open.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from tcs.output.view.teleop.controls import RATE_SLIDERS, Reading
from tcs.output.view.teleop.gamepad import GamepadState, gamepad_state
from tcs.output.view.teleop.panel import Readout
from tcs.output.view.teleop.pose_device import PoseState, pose_state

SILENCE = 0.12
"""Time without a message after which what a page moves comes to rest [s]: three messages. At 10
rad/s^2, joints of up to 1.8 rad/s then rest within 0.3 s of the last message."""
ABSENCE = 2.0
"""Silence after which a page counts as gone [s]: a page in the background is heard once a second.
"""
_MOST_PAGES = 8
"""Most pages that are remembered."""
_MOST_VALUES = 64
"""Most axes or buttons of a gamepad, and most sliders in a message."""
_NO_READOUT = Readout((), (), "", "")


class LinkError(ValueError):
    """A message that no operator's page sends."""


@dataclass(frozen=True)
class _Message:
    """A message of a page, checked."""

    page: str
    number: int
    held: frozenset[str]
    clicks: dict[str, int]
    sliders: dict[str, float]
    pad: GamepadState | None
    pose: PoseState | None
    leaves: bool


@dataclass
class _Page:
    """What one page holds."""

    at: float
    """Time of its last message [s]."""
    number: int
    held: frozenset[str] = frozenset()
    ignored: frozenset[str] = frozenset()
    """Held keys that count only after they were released: they outlasted a long silence."""
    clicks: dict[str, int] = field(default_factory=dict)
    sliders: set[str] = field(default_factory=set)
    """Sliders that this page was the last to move."""
    pad: GamepadState | None = None
    pose: PoseState | None = None

    def let_go(self) -> None:
        """Hold nothing any more."""
        self.held, self.pad, self.pose = frozenset(), None, None


class PageLink:
    """Input of the operator's pages, and the readout that they show; safe to use from threads.

    Attributes:
        sliders: Lowest and highest value, step and initial value of each slider, by its name.
    """

    def __init__(
        self,
        buttons: Mapping[str, str],
        sliders: Mapping[str, tuple[float, float, float, float]],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Begin without a page.

        Args:
            buttons: The code of the key of each button, by the button's name.
            sliders: Lowest and highest value, step and initial value of each slider, by its name.
            clock: Returns the time [s].
        """
        self._name = {code: name for name, code in buttons.items()}
        self._clock, self._lock = clock, threading.Lock()
        self._pages: dict[str, _Page] = {}
        self._clicks = dict.fromkeys(buttons, 0)
        self.sliders = dict(sliders)
        self._values = {name: value for name, (*_, value) in sliders.items()}
        self._device: _Page | None = None
        """The page whose gamepad or XR controller is read."""
        self._readout = _NO_READOUT

    def receive(self, message: object) -> dict[str, Any]:
        """Take a message of a page, and return what it shows.

        Args:
            message: `page`, a name that the page chose; `number`, which grows by each message;
                `held`, codes of the keys that are held; `clicks`, the presses so far of keys that
                switch; and, where there are any, `sliders`, values by name of those that were
                moved since the last reply; `gamepad` with `index`, `axes` and `button_values`; and
                `leaves`, whether the page is closed.

        Returns:
            The readout; as `sliders` the values of all of them; and as `ignored` whether keys have
            no effect until they are released.

        Raises:
            LinkError: If it has another form.
        """
        given = _checked(message)
        now = self._clock()
        with self._lock:
            page = self._pages.get(given.page)
            is_late = page is None and given.number > 1
            if page is None:
                # A page that was forgotten has counted its presses before.
                known = given.clicks if is_late else {}
                page = self._pages[given.page] = _Page(now, given.number - 1, clicks=known)
            if given.number > page.number:
                self._take(page, now, given, is_late=is_late or now - page.at > ABSENCE)
            while len(self._pages) > _MOST_PAGES:
                self._forget(min(self._pages, key=lambda one: self._pages[one].at))
            shown, ignored, values = self._readout, bool(page.ignored), dict(self._values)
        return {
            "fractions": [round(fraction, 4) for fraction in shown.fractions],
            "states": list(shown.states),
            "mode": shown.mode,
            "message": shown.message,
            "sliders": values,
            "ignored": ignored,
        }

    def _take(self, page: _Page, now: float, given: _Message, *, is_late: bool) -> None:
        """Take what a page holds.

        Args:
            page: The page.
            now: Time [s].
            given: Its message.
            is_late: Whether the page was not heard for long.
        """
        if is_late:
            self._drop(page)
            page.ignored |= given.held
        page.at, page.number, page.held = now, given.number, given.held
        page.pad, page.pose = given.pad, given.pose
        page.ignored &= given.held
        for code, count in given.clicks.items():
            if code in self._name:
                self._clicks[self._name[code]] += max(count - page.clicks.get(code, 0), 0)
        page.clicks = given.clicks
        for name in () if is_late else given.sliders.keys() & self.sliders.keys():
            self._set(name, given.sliders[name])
            for other in self._pages.values():
                other.sliders.discard(name)
            page.sliders.add(name)
        if given.leaves:
            self._drop(page)
            page.at = -math.inf

    def _set(self, name: str, value: float) -> None:
        """Set a slider to the step of its range that is closest."""
        low, high, step, _ = self.sliders[name]
        value = low + step * round((min(max(value, low), high) - low) / step)
        self._values[name] = min(round(value, 9), high) + 0.0

    def _drop(self, page: _Page) -> None:
        """Let go of all that a page holds: it is gone."""
        page.let_go()
        for name in page.sliders.intersection(RATE_SLIDERS):
            self._values[name] = 0.0
        page.sliders.clear()

    def _forget(self, name: str) -> None:
        self._drop(self._pages.pop(name))

    def read(self) -> Reading:
        """Return the present state of the controls."""
        now = self._clock()
        with self._lock:
            silent, watched, codes = False, False, set[str]()
            for page in self._pages.values():
                if now - page.at > ABSENCE:
                    self._drop(page)
                    continue
                watched = True
                if now - page.at <= SILENCE:
                    codes |= page.held - page.ignored
                else:
                    silent = silent or self._moves(page)
            pad, pose = self._device_state(now)
            held = frozenset(self._name[code] for code in codes if code in self._name)
            return Reading(dict(self._values), dict(self._clicks), pad, watched, pose, held, silent)

    def _moves(self, page: _Page) -> bool:
        """Return whether a page holds anything that moves the arm."""
        turned = (name not in RATE_SLIDERS or self._values[name] for name in page.sliders)
        pushed = page.pad is not None and page.pad.pushing
        followed = page.pose is not None and page.pose.trigger
        return bool(page.held - page.ignored) or pushed or followed or any(turned)

    def _device_state(self, now: float) -> tuple[GamepadState | None, PoseState | None]:
        """Return the state of gamepad and XR controller, of one page until it has none."""
        page = self._device
        if page is None:
            heard = (one for one in self._pages.values() if now - one.at <= SILENCE)
            page = next((one for one in heard if one.pad or one.pose), None)
        elif page.pad is None and page.pose is None:
            # That of another page is another device, and read from the next time on.
            page = None
        self._device = page
        return (None, None) if page is None else (page.pad, page.pose)

    def zero(self) -> None:
        """Reset every slider of a rate to zero."""
        with self._lock:
            self._values.update(dict.fromkeys(RATE_SLIDERS, 0.0))

    def set_slider(self, name: str, value: float) -> float:
        """Set a slider, and return the value that it has then: in its range, at a step of it."""
        with self._lock:
            self._set(name, value)
            for page in self._pages.values():
                page.sliders.discard(name)
            return self._values[name]

    def show(self, now: Readout) -> None:
        """Show a readout with the next messages."""
        with self._lock:
            self._readout = now


def _checked(message: object) -> _Message:
    """Return a message.

    Raises:
        LinkError: If it has another form.
    """
    if not isinstance(message, dict):
        raise LinkError("not a mapping")
    name, number = message.get("page"), message.get("number")
    held, clicks = message.get("held"), message.get("clicks")
    sliders, pad = message.get("sliders", {}), message.get("gamepad") or {}
    if not isinstance(name, str) or type(number) is not int or number < 1:
        raise LinkError("page or number")
    if not isinstance(held, list) or not all(isinstance(code, str) for code in held):
        raise LinkError("held")
    if not isinstance(clicks, dict) or not all(type(n) is int for n in clicks.values()):
        raise LinkError("clicks")
    if not isinstance(sliders, dict) or not isinstance(pad, dict):
        raise LinkError("sliders or gamepad")
    index = pad.get("index")
    axes, pressed = _numbers(pad.get("axes", [])), _numbers(pad.get("button_values", []))
    moved = dict(zip(sliders, _numbers(list(sliders.values())), strict=True))
    if index is not None and type(index) is not int:
        raise LinkError("gamepad")
    return _Message(
        name, number, frozenset(held), clicks, moved, gamepad_state(index, axes, pressed),
        pose_state(index, axes, pressed), message.get("leaves") is True,
    )  # fmt: skip


def _numbers(values: object) -> list[float]:
    """Return finite numbers.

    Raises:
        LinkError: If they are not.
    """
    if not isinstance(values, list) or len(values) > _MOST_VALUES:
        raise LinkError("numbers")
    if not all(type(one) in (int, float) and abs(one) < 1e6 for one in values):
        raise LinkError("numbers")
    return [float(one) for one in values]
