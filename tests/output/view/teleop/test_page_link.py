"""Input between the operator's page and the control loop: held until released, or until silence."""

from __future__ import annotations

import pytest

from tcs.output.view.teleop.page_link import ABSENCE, SILENCE, LinkError
from tcs.output.view.teleop.panel import Readout


class Sender:
    """A page that sends messages."""

    def __init__(self, link, name="a"):
        self.link, self.name, self.number = link, name, 0

    def __call__(self, *held, more=None, **clicks):
        self.number += 1
        message = {"page": self.name, "number": self.number, "held": [*held], "clicks": clicks}
        return self.link.receive({**message, **(more or {})})


def test_a_key_counts_while_it_is_held(link):
    send = Sender(link)
    send("KeyW", "KeyR")
    assert link.read().held == {"ahead", "up"}
    send("KeyR")
    assert link.read().held == {"up"}
    send()
    assert link.read().held == set()


def test_silence_releases_every_key(link, clock):
    send = Sender(link)
    send("KeyW")
    clock.now += 0.9 * SILENCE
    assert link.read().held == {"ahead"}
    clock.now += 0.2 * SILENCE
    assert link.read().held == set()
    assert not send("KeyW")["ignored"]
    assert link.read().held == {"ahead"}


def test_after_a_long_silence_keys_must_be_released_first(link, clock):
    send = Sender(link)
    send("KeyW")
    clock.now += 1.01 * ABSENCE
    # The machine of the page may have slept, and missed the release.
    assert send("KeyW", "KeyR")["ignored"]
    assert link.read().held == set()
    send("KeyW")
    send("KeyW", "KeyR")
    assert link.read().held == {"up"}
    send()
    send("KeyW")
    assert link.read().held == {"ahead"}


def test_a_page_that_is_forgotten_moves_nothing_when_it_is_back(link):
    send = Sender(link)
    send("KeyW", KeyM=3)
    for number in range(20):
        Sender(link, f"other {number}")()
    send("KeyW", KeyM=4)
    assert link.read().held == set()
    # Presses that were counted before are not counted twice.
    assert link.read().clicks["next mode"] == 3
    send(KeyM=5)
    assert link.read().clicks["next mode"] == 4


def test_presses_are_counted_once_for_each_page(link):
    first, second = Sender(link), Sender(link, "b")
    first(KeyM=1)
    first(KeyM=1)
    second(KeyM=2, KeyC=1)
    first(KeyM=2)
    assert {name: n for name, n in link.read().clicks.items() if n} == {"next mode": 4, "clutch": 1}


def test_a_late_message_is_ignored(link):
    send = Sender(link)
    send("KeyW")
    send()
    link.receive({"page": "a", "number": 1, "held": ["KeyW"], "clicks": {}})
    assert link.read().held == set()


def test_keys_of_two_pages_add_up_and_unknown_ones_are_ignored(link):
    Sender(link)("KeyW", "F5", "KeyZ")
    Sender(link, "b")("KeyA")
    assert link.read().held == {"ahead", "left"}
    Sender(link)("KeyW", Tab=3)
    assert not any(link.read().clicks.values())


def test_the_readout_returns(link):
    send = Sender(link)
    link.show(Readout((0.25, 1.0), ("free", "limit"), "pose mode", "joint 2 (upper)"))
    reply = send()
    del reply["sliders"]
    assert reply == {
        "fractions": [0.25, 1.0], "states": ["free", "limit"],
        "mode": "pose mode", "message": "joint 2 (upper)", "ignored": False,
    }  # fmt: skip


MOVE, TURN = "move x [m/s]", "turn z [rad/s]"
PUSHED = {"gamepad": {"index": 0, "axes": [0, -1, 0, 0], "button_values": [0] * 17}}


def test_sliders_are_those_of_every_page(link):
    first, second = Sender(link), Sender(link, "b")
    assert first(more={"sliders": {MOVE: 0.1049, TURN: -9, "other": 1}})["sliders"][MOVE] == 0.1
    values = second()["sliders"]
    assert (values[MOVE], values[TURN]) == (0.1, -1.0)
    assert link.read().sliders == values
    link.zero()
    assert not any(second()["sliders"][name] for name in (MOVE, TURN))
    assert link.set_slider(MOVE, 0.5) == 0.25


@pytest.mark.parametrize("more", [PUSHED, {"sliders": {MOVE: 0.1}}], ids=["gamepad", "slider"])
@pytest.mark.parametrize("others", [0, 1])
def test_the_page_that_moves_the_arm_is_missed_whatever_others_say(link, clock, more, others):
    moving, other = Sender(link), Sender(link, "b")
    moving(more=more)
    other()
    assert not link.read().silent
    for _ in range(4):
        clock.now += 0.3 * SILENCE
        if others:
            other()
    assert link.read().silent
    # A page that is heard again goes on, ...
    moving(more=PUSHED if more is PUSHED else {})
    assert not link.read().silent
    assert link.read().sliders[MOVE] == (0.0 if more is PUSHED else 0.1)
    # ... after a long silence it does not, and holds nothing up.
    clock.now += 1.01 * ABSENCE
    other()
    assert not link.read().silent
    assert link.read().sliders[MOVE] == 0.0
    assert link.read().pad is None
    moving(more={"sliders": {MOVE: 0.1}})
    assert link.read().sliders[MOVE] == 0.0


def test_a_page_at_rest_may_be_silent(link, clock):
    Sender(link)(more={"gamepad": {"index": 0, "axes": [0] * 4, "button_values": [0] * 17}})
    clock.now += 2 * SILENCE
    assert not link.read().silent


def test_a_page_that_is_closed_holds_nothing(link):
    send = Sender(link)
    send("KeyW", more={**PUSHED, "sliders": {MOVE: 0.1}})
    assert link.read().pad is not None
    send(more={"leaves": True})
    reading = link.read()
    assert (reading.held, reading.pad, reading.sliders[MOVE]) == (frozenset(), None, 0.0)
    assert not reading.watched


def test_the_gamepad_of_another_page_is_another_gamepad(link):
    first, second = Sender(link), Sender(link, "b")
    first(more=PUSHED)
    second(more=PUSHED)
    assert link.read().pad.pushing
    first()
    # It has to be seen at rest before it moves the arm.
    assert link.read().pad is None
    assert link.read().pad.pushing


def test_an_operator_is_there_while_a_page_is_heard(link, clock):
    assert not link.read().watched
    send = Sender(link)
    send()
    assert link.read().watched
    clock.now += 0.9 * ABSENCE
    assert link.read().watched
    clock.now += 0.2 * ABSENCE
    assert not link.read().watched
    send()
    assert link.read().watched


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
        {"sliders": []},
        {"sliders": {MOVE: "0.1"}},
        {"sliders": {MOVE: float("nan")}},
        {"gamepad": [0]},
        {"gamepad": {"index": 0, "axes": ["a"]}},
        {"gamepad": {"index": 0, "axes": [0] * 1000}},
        {"gamepad": {"index": "0", "axes": [0]}},
    ],
)
def test_other_forms_are_refused(link, changes):
    message = {"page": "a", "number": 1, "held": ["KeyW"], "clicks": {}}
    with pytest.raises(LinkError):
        link.receive({**message, **changes})
    assert link.read().held == set()
