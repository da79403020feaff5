"""The head camera."""

from __future__ import annotations

import math

import numpy as np

from tcs_studies.pick_and_place.master import Coupling
from tcs_studies.pick_and_place.slave import Control
from tcs_studies.pick_and_place.task import CONDITIONS, EXPERT, ITCM_HIGH, ITCM_LOW, START


def camera(tiago, condition):
    return tiago.setting(condition, Control.POSITION_FIRST, Coupling()).camera


def test_the_camera_looks_between_the_markers_and_sees_both(tiago):
    for condition in CONDITIONS:
        view = camera(tiago, condition)
        middle = 0.5 * (condition.cup + condition.place)
        x, y, z = (middle - view.p) @ view.R
        np.testing.assert_allclose([y, z], 0.0, atol=1e-12)
        assert x > 0.0
        assert view.sees(condition.cup)
        assert view.sees(condition.place)
        assert not view.sees(2.0 * view.p - middle)


def test_the_angle_between_master_and_camera(tiago):
    high, expert, low = (camera(tiago, one).pan for one in (ITCM_HIGH, EXPERT, ITCM_LOW))
    assert abs(math.degrees(high - expert)) < 1.0
    # The task is rotated by 90 deg; the camera on the base looks to the right by less.
    assert -60.0 < math.degrees(low) < -40.0
    assert camera(tiago, ITCM_HIGH).sees(np.array(START))
    assert not camera(tiago, ITCM_LOW).sees(np.array(START))
