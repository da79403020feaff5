"""Keys between the operator's page and the control loop: held until released, or until silence."""

from __future__ import annotations

import pytest

from tcs.output.view.teleop.controls import buttons
from tcs.output.view.teleop.page_link import (
    ABSENCE,
    LONG_SILENCE,
    SILENCE,
    LinkError,
    PageControls,
    PageLink,
)
from tcs.output.view.teleop.panel import Readout


class Clock:
    now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def link(clock):
    return PageLink(buttons(4), clock)


class Sender:
    """A page that sends messages."""

    def __init__(self, link, name="a"):
        self.link, self.name, self.number = link, name, 0

    def __call__(self, *held, **clicks):
        self.number += 1
        message = {"page": self.name, "number": self.number, "held": [*held], "clicks": clicks}
        return self.link.receive(message)


def test_a_key_counts_while_it_is_held(link):
    send = Sender(link)
    send("KeyW", "KeyR")
    assert link.held() == {"ahead", "up"}
    send("KeyR")
    assert link.held() == {"up"}
    send()
    assert link.held() == set()


def test_silence_releases_every_key(link, clock):
    send = Sender(link)
    send("KeyW")
    clock.now += 0.9 * SILENCE
    assert link.held() == {"ahead"}
    clock.now += 0.2 * SILENCE
    assert link.held() == set()
    assert not send("KeyW")["ignored"]
    assert link.held() == {"ahead"}


def test_after_a_long_silence_keys_must_be_released_first(link, clock):
    send = Sender(link)
    send("KeyW")
    clock.now += 1.01 * LONG_SILENCE
    # The machine of the page may have slept, and missed the release.
    assert send("KeyW", "KeyR")["ignored"]
    assert link.held() == set()
    send("KeyW")
    send("KeyW", "KeyR")
    assert link.held() == {"up"}
    send()
    send("KeyW")
    assert link.held() == {"ahead"}


def test_a_page_that_is_forgotten_moves_nothing_when_it_is_back(link):
    send = Sender(link)
    send("KeyW", KeyM=3)
    for number in range(20):
        Sender(link, f"other {number}")()
    send("KeyW", KeyM=4)
    assert link.held() == set()
    # Presses that were counted before are not counted twice.
    assert link.clicks()["next mode"] == 3
    send(KeyM=5)
    assert link.clicks()["next mode"] == 4


def test_presses_are_counted_once_for_each_page(link):
    first, second = Sender(link), Sender(link, "b")
    first(KeyM=1)
    first(KeyM=1)
    second(KeyM=2, KeyC=1)
    first(KeyM=2)
    assert {name: n for name, n in link.clicks().items() if n} == {"next mode": 4, "clutch": 1}


def test_a_late_message_is_ignored(link):
    send = Sender(link)
    send("KeyW")
    send()
    link.receive({"page": "a", "number": 1, "held": ["KeyW"], "clicks": {}})
    assert link.held() == set()


def test_keys_of_two_pages_add_up_and_unknown_ones_are_ignored(link):
    Sender(link)("KeyW", "F5", "KeyZ")
    Sender(link, "b")("KeyA")
    assert link.held() == {"ahead", "left"}
    Sender(link)("KeyW", Tab=3)
    assert not any(link.clicks().values())


def test_the_readout_returns(link):
    send = Sender(link)
    link.show(Readout((0.25, 1.0), ("free", "limit"), "pose mode", "joint 2 (upper)"))
    assert send() == {
        "fractions": [0.25, 1.0], "states": ["free", "limit"],
        "mode": "pose mode", "message": "joint 2 (upper)", "ignored": False,
    }  # fmt: skip


def test_controls_are_those_of_meshcat_and_of_the_page(link, desk):
    controls = PageControls(desk, link)
    desk.press("next mode")
    Sender(link)("KeyW", KeyM=2)
    reading = controls.read()
    assert reading.held == {"ahead"}
    assert reading.clicks["next mode"] == 3
    assert reading.clicks["clutch"] == 0
    controls.set_slider("move x [m/s]", 1.0)
    assert desk.sliders["move x [m/s]"] > 0.0
    controls.zero()
    assert desk.sliders["move x [m/s]"] == 0.0


def test_an_operator_is_there_while_a_page_is_heard(link, desk, clock):
    controls = PageControls(desk, link)
    assert not controls.read().watched
    send = Sender(link)
    send()
    assert controls.read().watched
    clock.now += 0.9 * ABSENCE
    assert controls.read().watched
    # A browser may keep the connection to Meshcat of a page that was left.
    clock.now += 0.2 * ABSENCE
    assert not controls.read().watched
    send()
    assert controls.read().watched
    desk.watched = False
    assert not controls.read().watched


@pytest.mark.parametrize(
    "changes",
    [
        {"page": 1},
        {"number": 0},
        {"number": True},
        {"number": 1.5},
        {"held": "KeyW"},
        {"held": [1]},
        {"clicks": {"KeyM": "1"}},
        {"clicks": []},
    ],
)
def test_other_forms_are_refused(link, changes):
    message = {"page": "a", "number": 1, "held": ["KeyW"], "clicks": {}}
    with pytest.raises(LinkError):
        link.receive({**message, **changes})
    assert link.held() == set()
