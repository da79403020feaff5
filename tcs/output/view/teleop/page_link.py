"""What the operator's page and the control loop exchange: keys one way, the readout the other.

The page sends a message some twenty times a second, and at once when a key goes down or up. It
names the keys that are held, so that a key counts until it is released, and no longer: silence of
the page counts as the release of all its keys. A page whose machine slept may have missed a
release: after a long silence its keys count only once they were released.

A browser may keep a page that was left, its connection to Meshcat open and its sliders where they
were: an operator is there only while a page is heard.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from tcs.output.view.teleop.controls import Reading, Source
from tcs.output.view.teleop.panel import Readout

SILENCE = 0.3
"""Time without a message after which all keys of a page count as released [s]: six messages. At the
greatest speed of keys the tool moves 7 cm in it."""
ABSENCE = 1.0
"""Silence of all pages after which no operator is there [s]: when a page itself says that it has no
connection. Shorter, and a browser that is slow to draw would stop the arm."""
LONG_SILENCE = 2.0
"""Silence after which a key that is still held has no effect until it is released [s]."""
_MOST_PAGES = 8
"""Most pages that are remembered."""
_NO_READOUT = Readout((), (), "", "")


class LinkError(ValueError):
    """A message that no operator's page sends."""


@dataclass
class _Page:
    """Last message of one page."""

    at: float
    number: int
    held: frozenset[str] = frozenset()
    ignored: frozenset[str] = frozenset()
    """Held keys that count only after they were released: they outlasted a long silence."""
    clicks: dict[str, int] = field(default_factory=dict)


class PageLink:
    """Keys of the operator's pages and the readout that they show; safe to use from threads."""

    def __init__(
        self, buttons: Mapping[str, str], clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Begin without a page.

        Args:
            buttons: The code of the key of each button, by the button's name.
            clock: Returns the time [s].
        """
        self._name = {code: name for name, code in buttons.items()}
        self._clock, self._lock = clock, threading.Lock()
        self._pages: dict[str, _Page] = {}
        self._clicks = dict.fromkeys(buttons, 0)
        self._readout = _NO_READOUT

    def receive(self, message: object) -> dict[str, Any]:
        """Take a message of a page, and return what it shows.

        Args:
            message: Its keys: `page`, a name that the page chose; `number`, which grows by each
                message; `held`, codes of the keys that are held; `clicks`, the presses so far of
                keys that switch.

        Returns:
            The readout, and as `ignored` whether keys have no effect until they are released.

        Raises:
            LinkError: If it has another form.
        """
        name, number, held, clicks = _checked(message)
        now = self._clock()
        with self._lock:
            page = self._pages.get(name)
            if page is None:
                # A page that was forgotten has counted its presses before.
                known = clicks if number > 1 else {}
                page = self._pages[name] = _Page(now, number - 1, clicks=known)
                if number > 1:
                    page.ignored = held
            if number > page.number:
                if now - page.at > LONG_SILENCE:
                    page.ignored |= held
                self._take(page, now, number, held, clicks)
            while len(self._pages) > _MOST_PAGES:
                del self._pages[min(self._pages, key=lambda one: self._pages[one].at)]
            shown, ignored = self._readout, bool(page.ignored)
        return {
            "fractions": [round(fraction, 4) for fraction in shown.fractions],
            "states": list(shown.states),
            "mode": shown.mode,
            "message": shown.message,
            "ignored": ignored,
        }

    def _take(
        self, page: _Page, now: float, number: int, held: frozenset[str], clicks: dict[str, int]
    ) -> None:
        page.at, page.number, page.held = now, number, held
        page.ignored &= held
        for code, count in clicks.items():
            if code in self._name:
                self._clicks[self._name[code]] += max(count - page.clicks.get(code, 0), 0)
        page.clicks = clicks

    def is_heard(self) -> bool:
        """Return whether any page has sent a message lately."""
        now = self._clock()
        with self._lock:
            return any(now - page.at <= ABSENCE for page in self._pages.values())

    def held(self) -> frozenset[str]:
        """Return the names of the buttons whose keys are held now."""
        now = self._clock()
        with self._lock:
            codes = frozenset(
                code
                for page in self._pages.values()
                if now - page.at <= SILENCE
                for code in page.held - page.ignored
            )
        return frozenset(self._name[code] for code in codes if code in self._name)

    def clicks(self) -> dict[str, int]:
        """Return the presses of each button so far, of keys that switch."""
        with self._lock:
            return dict(self._clicks)

    def show(self, now: Readout) -> None:
        """Show a readout with the next messages."""
        with self._lock:
            self._readout = now


class PageControls:
    """Controls of the operator's page: sliders, buttons and gamepad of Meshcat, and its keys."""

    def __init__(self, meshcat: Source, link: PageLink) -> None:
        """Read Meshcat and a link."""
        self._meshcat, self._link = meshcat, link

    def read(self) -> Reading:
        """Return the present state of the controls."""
        reading, more = self._meshcat.read(), self._link.clicks()
        clicks = {name: count + more.get(name, 0) for name, count in reading.clicks.items()}
        watched = reading.watched and self._link.is_heard()
        return replace(reading, clicks=clicks, held=self._link.held(), watched=watched)

    def zero(self) -> None:
        """Reset every slider of a rate to zero."""
        self._meshcat.zero()

    def set_slider(self, name: str, value: float) -> float:
        """Set a slider, and return the value that it has then."""
        return self._meshcat.set_slider(name, value)


def _checked(message: object) -> tuple[str, int, frozenset[str], dict[str, int]]:
    """Return name, number, held keys and presses of a message.

    Raises:
        LinkError: If it has another form.
    """
    if not isinstance(message, dict):
        raise LinkError("not a mapping")
    name, number = message.get("page"), message.get("number")
    held, clicks = message.get("held"), message.get("clicks")
    if not isinstance(name, str) or type(number) is not int or number < 1:
        raise LinkError("page or number")
    if not isinstance(held, list) or not all(isinstance(code, str) for code in held):
        raise LinkError("held")
    if not isinstance(clicks, dict) or not all(type(n) is int for n in clicks.values()):
        raise LinkError("clicks")
    return name, number, frozenset(held), clicks
