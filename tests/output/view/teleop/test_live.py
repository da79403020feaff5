from __future__ import annotations

import socket
import time

import numpy as np
import pytest

from tcs.errors import OutputError
from tcs.output.view import open_meshcat
from tcs.output.view.teleop import LivePage, RobotDisplay, start_posture
from tcs.output.view.teleop.controls import BACK, NEXT_MODE, SILENT, TAP, TURN_UP
from tcs.output.view.teleop.panel import LIMIT, SINGULAR, readout
from tcs.teleop import Mode, Settings, load_arm
from tcs.teleop.control.latency import Latency
from tcs.teleop.runs.recorder import Recorder
from tests.output.view.teleop.conftest import MODES, Instead

FORWARD, DOWN = "move x [m/s]", "move z [m/s]"
AT_REST = {"index": 0, "axes": [0.0] * 4, "button_values": [0.0] * 17}
PUSHED = {**AT_REST, "axes": [0.0, -1.0, 0.0, 0.0]}


def drive(page, steps):
    for _ in range(steps):
        page.step()


def test_a_slider_moves_the_tool(page, desk):
    before = page.last.p.copy()
    desk.sliders[FORWARD] = 0.1
    drive(page, 50)
    moved = page.last.p - before
    # Half a second at 0.1 m/s, less the acceleration.
    assert 0.03 < moved[0] <= 0.05
    assert np.abs(moved[1:]).max() < 1e-3


def receive(link, number, more, page="a"):
    link.receive({"page": page, "number": number, "held": [], "clicks": {}, **more})


@pytest.fixture
def linked(meshcat, iiwa_display, iiwa, ready, reasons, link):
    """A live page with the controls of its link, whose clock is that of the steps."""
    return LivePage(
        meshcat, iiwa_display, iiwa, ready, settings=Settings(), modes=MODES, link=link,
        on_stop=reasons.append,
    )  # fmt: skip


HANDS = {
    "key": {"held": ["KeyW"]},
    "gamepad": {"gamepad": PUSHED},
    "slider": {"sliders": {FORWARD: 0.25}},
}


@pytest.mark.parametrize("other", [False, True], ids=["alone", "other tab"])
@pytest.mark.parametrize("hand", HANDS)
def test_the_arm_rests_soon_after_the_last_message_of_the_hand(
    linked, link, clock, reasons, hand, other
):
    # The greatest speed of keys and sticks.
    pad = {"gamepad": AT_REST} if hand == "gamepad" else {}
    receive(link, 1, {**pad, "sliders": {"key speed [m/s]": 0.25}})
    drive(linked, 2)
    for number in range(2, 12):
        receive(link, number, HANDS[hand])
        for _ in range(5):
            clock.now += 0.01
            drive(linked, 1)
    assert linked.last.rates.any()
    # The last message was five steps ago.
    for left in range(6, 31):
        clock.now += 0.01
        if other and left % 5 == 0:
            # Another page is open, and has a gamepad at rest.
            receive(link, left, {"gamepad": AT_REST}, page="b")
        drive(linked, 1)
    assert not linked.last.rates.any()
    assert reasons == [SILENT]
    for _ in range(300):
        clock.now += 0.01
        drive(linked, 1)
        assert not linked.last.rates.any()


@pytest.mark.parametrize("hand", HANDS)
def test_the_arm_rests_at_once_when_the_page_of_the_hand_is_closed(linked, link, clock, hand):
    receive(link, 1, {"gamepad": AT_REST} if hand == "gamepad" else {})
    drive(linked, 2)
    receive(link, 2, HANDS[hand])
    drive(linked, 10)
    assert linked.last.rates.any()
    receive(link, 3, {"leaves": True})
    # Joint rates change by 0.1 rad/s in a step.
    drive(linked, 1 + int(np.abs(linked.last.rates).max() / 0.1) + 1)
    assert not linked.last.rates.any()


def test_what_a_page_that_is_heard_reads_is_not_that_none_is_connected(linked, link, clock):
    drive(linked, 5)
    linked.show()
    number = {"page": "a", "number": 1, "held": [], "clicks": {}}
    assert link.receive(number)["message"] == ""
    drive(linked, 1)
    linked.show()
    assert link.receive({**number, "number": 2})["message"] == ""


@pytest.fixture
def late(meshcat, iiwa_display, iiwa, ready, reasons, desk, link):
    """A live page with a latency of five periods each way."""
    found = LivePage(
        meshcat, iiwa_display, iiwa, ready, settings=Settings(), modes=MODES,
        latency=Latency(0.05), link=link, on_stop=reasons.append,
    )  # fmt: skip
    found.operator.source = desk
    return found


def test_latency_delays_commands_and_picture(late, desk):
    start = late.last.p
    desk.sliders[FORWARD] = 0.2
    drive(late, 5)
    assert not late.last.rates.any()
    drive(late, 5)
    assert late.last.p[0] > start[0]
    np.testing.assert_array_equal(late.seen.p, start)
    moved = late.last
    drive(late, 5)
    assert late.seen is moved


def test_a_lost_operator_stops_the_arm_without_latency(late, desk, reasons):
    desk.sliders[FORWARD] = 0.05
    drive(late, 40)
    assert late.last.rates.any()
    desk.watched = False
    drive(late, 1)
    assert reasons[-1].startswith("no browser")
    # 0.05 m/s needs joint rates that vanish within some steps of 0.1 rad/s each.
    drive(late, 4)
    assert not late.last.rates.any()
    # Commands that were on their way are gone.
    desk.watched = True
    drive(late, 5)
    assert not late.last.rates.any()


def test_a_group_turns_while_the_tool_stays(page, desk):
    desk.press(NEXT_MODE)
    drive(page, 1)
    before, elbow = page.last.p.copy(), page.session.arm.link_poses(page.last.joints)[3, :3, 3]
    assert page.last.mode is Mode.NULL_SPACE
    for _ in range(20):
        desk.press(TURN_UP)
        drive(page, 5)
    after = page.session.arm.link_poses(page.last.joints)[3, :3, 3]
    # Bound on the displacement of the tool: 0.1 mm.
    assert np.linalg.norm(page.last.p - before) < 1e-4
    assert np.linalg.norm(after - elbow) > 0.02


def test_back_to_the_start(page, desk, ready, meshcat):
    desk.sliders[FORWARD] = 0.1
    drive(page, 50)
    for _ in range(5):
        drive(page, 10)
        page.show()
    assert meshcat.HasPath("path")
    desk.press(BACK)
    drive(page, 2)
    assert not meshcat.HasPath("path")
    np.testing.assert_array_equal(page.last.joints, ready)
    assert not page.last.rates.any()


def test_a_lost_browser_is_reported_once_and_recorded_as_a_stop(page, desk, reasons):
    desk.sliders[FORWARD] = 0.1
    drive(page, 20)
    desk.watched = False
    drive(page, 200)
    assert page.last.stopped
    assert not page.last.rates.any()
    assert reasons == ["no browser is connected to this page: the arm stops until one is."]


def test_a_message_stays_visible_for_a_while(page, desk):
    desk.silent = True
    drive(page, 1)
    reason = page.last.reason
    desk.silent = False
    drive(page, 1)
    assert page.last.reason == ""
    begun = page._message_until
    assert page.message(begun - 0.01) == reason
    assert page.message(begun + 0.01) == ""


def test_a_limit_turns_its_bar_red_and_names_the_joint(page, desk, iiwa):
    desk.sliders[DOWN] = -0.25
    drive(page, 400)
    page.show()
    at = np.flatnonzero(page.last.limits)
    assert len(at)
    now = readout(iiwa, page.last.joints, page.last.limits, page.last.singular, "", "")
    assert all(now.states[i] == LIMIT for i in at)
    assert f"joint {at[0] + 1}" in page.message(page._message_until + 1.0)


def test_a_stretched_arm_turns_the_bars_magenta(page, desk, iiwa):
    desk.sliders[FORWARD] = 0.25
    drive(page, 400)
    assert page.last.singular
    now = readout(iiwa, page.last.joints, page.last.limits, True, "", "")
    assert SINGULAR in now.states
    assert "singular" in page.message(page._message_until + 1.0)


def test_recording_begins_when_a_browser_connects(meshcat, iiwa_display, iiwa, ready, desk, link):
    recorder = Recorder(iiwa)
    page = LivePage(
        meshcat, iiwa_display, iiwa, ready, settings=Settings(), modes=MODES,
        link=link, on_stop=lambda _: None, on_step=recorder.add,
    )  # fmt: skip
    page.operator.source = desk
    desk.watched = False
    drive(page, 5)
    assert recorder.run({}) is None
    desk.watched = True
    drive(page, 5)
    assert len(recorder.run({})) == 5


def test_recorder_gives_what_it_was_given(iiwa, ready, driven, monkeypatch):
    from tcs.teleop import Command, Teleoperation
    from tcs.teleop.runs import recorder as module
    from tcs.teleop.runs.recorder import run_from_steps

    monkeypatch.setattr(module, "_BLOCK", 10)
    session = Teleoperation(iiwa, ready)
    commands = [Command(linear=(0.1, 0.0, 0.0)), Command(mode=Mode.NULL_SPACE, group=0, sign=1)]
    rows = [(commands[i > 20], session.step(commands[i > 20])) for i in range(33)]
    found = Recorder(iiwa)
    for row in rows:
        found.add(*row)
    assert len(found) == 33
    run, whole = found.run({"robot": "iiwa7"}), run_from_steps(iiwa, rows, {})
    assert run.metadata == {"robot": "iiwa7"}
    for name in ("time", "joints", "position", "quaternion", "linear", "group", "mode", "limits"):
        np.testing.assert_array_equal(getattr(run, name), getattr(whole, name), err_msg=name)


def frame(content):
    """Return a message of a browser to a socket, of up to 65,535 bytes."""
    mask = bytes(4)
    return b"\x82\xfe" + len(content).to_bytes(2, "big") + mask + content


def test_nothing_that_is_sent_to_meshcat_moves_the_arm(linked, meshcat, link, ready):
    msgpack = pytest.importorskip("msgpack")
    live = linked
    assert meshcat.GetSliderNames() == meshcat.GetButtonNames() == []
    # What any page in the browser can send to Meshcat's socket.
    with socket.create_connection(("localhost", meshcat.port()), timeout=10) as foreign:
        foreign.sendall(
            f"GET / HTTP/1.1\r\nHost: localhost:{meshcat.port()}\r\n"
            "Origin: http://evil.example\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
            "Sec-WebSocket-Version: 13\r\n\r\n".encode()
        )
        foreign.recv(65536)
        for pad in (AT_REST, PUSHED):
            for message in (
                {"type": "button", "name": "ahead (W)"},
                {"type": "slider", "name": FORWARD, "value": 0.25},
                {"type": "gamepad", "name": "", "gamepad": pad},
            ):
                foreign.sendall(frame(msgpack.packb(message)))
            end = time.monotonic() + 10.0
            while list(meshcat.GetGamepad().axes) != pad["axes"]:
                assert time.monotonic() < end
                time.sleep(0.01)
            receive(link, 1, {})
            drive(live, 30)
    np.testing.assert_array_equal(live.last.joints, ready)


@pytest.mark.parametrize("name", ["iiwa7", "pr2", "pr2_right", "tiago", "panda"])
def test_start_postures_are_collision_free_and_allow_motion(name, meshcat, link):
    arm = load_arm(name, torso_height=0.1)
    display = RobotDisplay(arm, meshes=False)
    start = start_posture(arm, display)
    assert arm.limit_violation(start) == ""
    display.poses(start)
    assert display.contacts() is None
    np.testing.assert_array_equal(start, start_posture(arm, display))
    page = LivePage(
        meshcat, display, arm, start, settings=Settings(), modes=MODES, link=link,
        on_stop=lambda _: None,
    )  # fmt: skip
    before = page.last.p.copy()
    assert before[0] > arm.frames[0, 0, 3]
    assert not page.last.singular
    page.operator.source = None
    for direction in np.vstack([np.eye(3), -np.eye(3)]):
        page.session.place(start)
        for _ in range(60):
            last = page.session.step(_towards(0.1 * direction))
        assert (last.p - before) @ direction > 0.03, f"{name} is blocked along {direction}"


def _towards(linear):
    from tcs.teleop import Command

    return Command(linear=linear)


def test_only_bodies_carried_by_the_arm_move(iiwa_display, iiwa, ready):
    poses = iiwa_display.poses(ready)
    # Seven links; column and base stand still.
    assert len(poses) == 7
    tool = iiwa.kinematics(ready).p
    farthest = max(poses.values(), key=lambda one: one.translation()[0]).translation()
    # The last link's frame lies within its flange's length of the tool.
    assert np.linalg.norm(farthest - tool) < 0.1


def test_self_contact_is_shown(page, iiwa_display, iiwa, ready):
    posture = ready.copy()
    posture[[1, 3]] = 2.0, -2.0
    page.session.place(posture)
    drive(page, 1)
    for _ in range(8):
        page.show()
    assert "touches" in page.message(page._message_until + 1.0)


def test_an_occupied_port_is_refused(shared_meshcat):
    with pytest.raises(OutputError, match=f"port {shared_meshcat.port()}"):
        open_meshcat(shared_meshcat.port())


def test_a_run_at_the_pace_of_the_clock(page):
    page.run(duration=0.3)
    # 30 steps in 0.3 s; a busy machine may drop some, and a step may fall on either end.
    assert page.steps.count + page.dropped in range(28, 34)
    # A late loop takes up to 7 steps from frame to frame.
    assert page.pictures.count - 1 >= page.steps.count // 7


def test_without_a_forward_posture_the_start_is_in_the_middle_of_the_ranges(
    iiwa, iiwa_display, monkeypatch
):
    monkeypatch.setattr("tcs.output.view.teleop.start._AHEAD", 1.1)
    np.testing.assert_allclose(start_posture(iiwa, iiwa_display), np.zeros(7), atol=1e-12)


def test_a_recurring_reason_is_reported_once(page, desk, reasons):
    for i in range(6):
        desk.watched = bool(i % 2)
        drive(page, 1)
    assert len(reasons) == 1
    page._message_until = 0.0
    desk.watched = False
    drive(page, 1)
    assert len(reasons) == 2


def test_the_clutch_is_shown_only_if_the_operator_engaged_it(page, desk):
    assert page.mode_line() == "end-effector mode"
    desk.press("clutch")
    drive(page, 1)
    assert page.mode_line() == "end-effector mode; clutch engaged"
    desk.press("clutch")
    desk.watched = False
    drive(page, 1)
    assert page.mode_line() == "end-effector mode"


def test_the_target_is_shown_at_its_pose(page, desk, meshcat, monkeypatch):
    moved = {}

    monkeypatch.setattr(page, "_meshcat", Instead(meshcat, SetTransform=moved.__setitem__))
    desk.sliders[FORWARD] = 0.2
    drive(page, 4)
    page.show()
    np.testing.assert_allclose(moved["target"].translation(), page.last.target_p, atol=1e-12)
    np.testing.assert_allclose(moved["tool"].translation(), page.last.p, atol=1e-12)
    # The target leads the tool while the tool accelerates.
    assert (page.last.target_p - page.last.p)[0] > 1e-4


def test_a_key_moves_the_arm_for_a_moment_of_the_clock(page, desk):
    desk.press("ahead")
    drive(page, 5)
    assert np.any(page._input.command.linear)
    time.sleep(TAP)
    drive(page, 1)
    assert not np.any(page._input.command.linear)


def test_hints_are_shown(page, desk):
    desk.press(TURN_UP)
    drive(page, 1)
    assert "null-space mode" in page.message(time.perf_counter())


def test_postures_in_contact_are_skipped(iiwa, iiwa_display):
    class InContact:
        checked = 0

        def poses(self, joints):
            return iiwa_display.poses(joints)

        def contacts(self):
            self.checked += 1
            return ("arm", "column") if self.checked < 3 else None

    display = InContact()
    other = start_posture(iiwa, display)
    assert display.checked == 3
    assert not np.array_equal(other, start_posture(iiwa, iiwa_display))
