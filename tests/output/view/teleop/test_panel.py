from __future__ import annotations

import math

import numpy as np
import pytest

from tcs.output.view.teleop.panel import (
    COLOURS,
    FREE,
    LIMIT,
    PANEL,
    SINGULAR,
    Panel,
    bar,
    bar_properties,
    mode_line,
    readout,
    state_facts,
)
from tcs.teleop import load_arm

NO_LIMITS = np.zeros(7, np.int8)


class Spy:
    """Records the objects and properties that it receives."""

    def __init__(self):
        self.properties, self.drawn, self.deleted, self.sent = {}, [], [], 0

    def SetProperty(self, path, name, value):
        self.properties[path, name] = value
        self.sent += 1

    def SetTriangleMesh(self, path, corners, faces, _colour):
        assert faces.max() < corners.shape[1]
        self.drawn.append(path)

    def SetTransform(self, path, _pose):
        pass

    def Delete(self, path):
        self.deleted.append(path)

    def visible(self, *paths):
        return [path for path in paths if self.properties[path, "visible"]]


@pytest.fixture
def spy():
    return Spy()


def shown(arm, joints, limits=NO_LIMITS, singular=False, message=""):
    return readout(arm, np.asarray(joints), limits, singular, "end-effector mode", message)


def test_bars_show_the_position_between_the_limits(iiwa):
    places = np.linspace(0.0, 1.0, 7)
    joints = iiwa.lower + places * (iiwa.upper - iiwa.lower)
    np.testing.assert_allclose(shown(iiwa, joints).fractions, places, atol=1e-12)


def test_continuous_joints_are_shown_from_minus_pi_to_pi():
    arm = load_arm("pr2")
    free = int(np.flatnonzero(~arm.bounded)[0])
    joints = np.where(arm.bounded, arm.lower, 0.0)
    for turns in (0.0, 2.0 * math.pi, -4.0 * math.pi):
        joints[free] = turns + 0.25 * math.pi
        assert shown(arm, joints).fractions[free] == pytest.approx(0.625)


def test_a_limit_is_red_and_a_singularity_magenta():
    assert COLOURS[LIMIT].startswith("#ff2")
    assert COLOURS[SINGULAR] == "#ff00ff"


def test_red_has_priority_over_magenta_and_magenta_over_green(iiwa, ready):
    limits = NO_LIMITS.copy()
    limits[3] = -1
    assert shown(iiwa, ready).states == (FREE,) * 7
    assert shown(iiwa, ready, limits).states == (*[FREE] * 3, LIMIT, *[FREE] * 3)
    both = shown(iiwa, ready, limits, singular=True).states
    assert both == (*[SINGULAR] * 3, LIMIT, *[SINGULAR] * 3)


def test_one_colour_of_each_bar_is_seen(spy, iiwa, ready):
    panel = Panel(spy, iiwa)
    limits = NO_LIMITS.copy()
    limits[5] = 1
    for now in (shown(iiwa, ready), shown(iiwa, ready, limits), shown(iiwa, ready, singular=True)):
        panel.show(now)
        for i, state in enumerate(now.states):
            seen = spy.visible(*(f"{bar(i)}/{one}" for one in COLOURS))
            assert seen == [f"{bar(i)}/{state}"]


def test_bars_are_told_apart_by_words_too(spy, iiwa):
    Panel(spy, iiwa)
    for i in range(7):
        words = [path for path in spy.drawn if path.startswith(bar(i)) and path.endswith("/word")]
        assert words == [f"{bar(i)}/{state}/word" for state in (LIMIT, SINGULAR)]


def test_only_what_changes_is_sent(spy, iiwa, ready):
    panel = Panel(spy, iiwa)
    panel.show(shown(iiwa, ready, message="one"))
    spy.sent = 0
    panel.show(shown(iiwa, ready, message="one"))
    assert spy.sent == 0
    moved = ready.copy()
    moved[2] += 0.1
    panel.show(shown(iiwa, moved, message="one"))
    expected = bar_properties(2, shown(iiwa, moved).fractions[2], True)
    assert spy.sent == len(expected)
    for path, name, value in expected:
        assert spy.properties[path, name] == value


def test_one_line_is_visible_at_a_time_and_old_ones_are_deleted(spy, iiwa, ready):
    panel = Panel(spy, iiwa)
    texts = [f"reason {i}" for i in range(60)]
    for text in ("", *texts, "", texts[0], texts[-1]):
        panel.show(shown(iiwa, ready, message=text))
        lines = {
            path
            for path, name in spy.properties
            if name == "visible" and path.startswith(f"{PANEL}/message/")
        }
        assert len(spy.visible(*lines - set(spy.deleted))) == (1 if text else 0)
    assert len(spy.deleted) >= 20
    drawn = [path for path in spy.drawn if path.startswith(f"{PANEL}/message/")]
    # The first one had been deleted and was written again; the last one was still there.
    assert len(drawn) == 61


def test_long_texts_stay_on_the_panel(iiwa, meshcat):
    class Wide(Spy):
        farthest = 0.0

        def SetTriangleMesh(self, path, corners, faces, colour):
            super().SetTriangleMesh(path, corners, faces, colour)
            self.farthest = max(self.farthest, float(np.abs(corners[0]).max(initial=0.0)))

    spy = Wide()
    panel = Panel(spy, iiwa)
    edge = spy.farthest
    panel.text("message", "the arm stops for a reason that takes many words; " * 8)
    assert spy.farthest <= edge


def test_every_part_is_a_child_of_the_camera(iiwa, meshcat):
    Panel(meshcat, iiwa)
    for path in ("back", *(f"bar/{i}/{state}/fill" for i in range(7) for state in COLOURS)):
        assert meshcat.HasPath(f"/Cameras/default/rotated/<object>/panel/{path}")


def test_words():
    assert state_facts(NO_LIMITS, False) == ""
    assert mode_line("pose", None, 0, True) == "pose mode; clutch engaged"


def test_limits_are_written_below_the_bars(spy, monkeypatch):
    written = []

    def text_mesh(text):
        written.append(text)
        return np.zeros((3, 3)), np.array([[0], [1], [2]], dtype=np.int32)

    monkeypatch.setattr("tcs.output.view.teleop.panel.text_mesh", text_mesh)
    arm = load_arm("pr2")
    Panel(spy, arm)
    assert [text for text in written if text.startswith("joint")] == [
        f"joint {i}" for i in range(1, 8)
    ]
    assert written.count("continuous") == np.count_nonzero(~arm.bounded) == 2
    for i in np.flatnonzero(arm.bounded):
        assert f"{np.degrees(arm.lower[i]):+.0f}" in written
        assert f"{np.degrees(arm.upper[i]):+.0f}" in written
    assert not [text for text in written if "inf" in text]
