"""Joint mode of the live page: sliders are set-points."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.output.view.teleop import LivePage
from tcs.output.view.teleop.controls import BACK, CLUTCH, NEXT_MODE, STOP
from tcs.output.view.teleop.set_point import joint_slider, joint_sliders
from tcs.teleop import Mode, Settings


@pytest.fixture
def page(meshcat, iiwa_display, iiwa, ready, desk, link):
    """A live page that begins in joint mode."""
    found = LivePage(
        meshcat, iiwa_display, iiwa, ready, settings=Settings(),
        modes=(Mode.JOINT, Mode.END_EFFECTOR), link=link, on_stop=lambda _: None,
    )  # fmt: skip
    sliders = joint_sliders(iiwa.lower, iiwa.upper)
    desk.sliders |= {name: value for name, (*_, value) in sliders.items()}
    found.operator.source = desk
    return found


def drive(page, steps):
    for _ in range(steps):
        page.step()


def test_nothing_moves_until_a_slider_does(page, desk, ready):
    drive(page, 20)
    np.testing.assert_array_equal(page.last.joints, ready)
    # The sliders show the posture, at their steps of half a degree.
    assert desk.sliders[joint_slider(3)] == pytest.approx(np.degrees(ready[3]), abs=0.25)


def test_a_slider_moves_its_joint_alone(page, desk, ready):
    drive(page, 1)
    desk.sliders[joint_slider(1)] = 20.0
    drive(page, 200)
    wanted = ready.copy()
    wanted[1] = np.radians(20.0)
    np.testing.assert_allclose(page.last.joints, wanted, atol=1e-9)


@pytest.mark.parametrize("how", [STOP, CLUTCH, "lost"])
def test_a_set_point_is_dropped_when_the_operator_stops(page, desk, how):
    drive(page, 1)
    desk.sliders[joint_slider(1)] = -90.0
    drive(page, 30)
    if how == "lost":
        desk.watched = False
    else:
        desk.press(how)
    drive(page, 20)
    assert not page.last.rates.any()
    desk.watched = True
    if how == CLUTCH:
        desk.press(CLUTCH)
    drive(page, 30)
    assert not page.last.rates.any()
    assert desk.sliders[joint_slider(1)] > -60.0


def test_sliders_follow_the_posture_of_the_other_mode(page, desk, ready):
    drive(page, 1)
    desk.press(NEXT_MODE)
    desk.sliders["move x [m/s]"] = 0.1
    drive(page, 60)
    desk.press(NEXT_MODE)
    desk.sliders["move x [m/s]"] = 0.0
    drive(page, 30)
    assert page.last.mode is Mode.JOINT
    assert abs(desk.sliders[joint_slider(3)] - np.degrees(ready[3])) > 2.0
    desk.press(BACK)
    drive(page, 10)
    np.testing.assert_array_equal(page.last.joints, ready)
