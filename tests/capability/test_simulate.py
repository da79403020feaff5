import math

import numpy as np
import pytest

from tcs.capability import MapGrid, Operator, map_from_recording, simulate
from tcs.capability.simulate import MASTER_BOX, PERIOD
from tcs.errors import DataFileError

MINUTE = Operator(seconds=60.0, height=0.6)


@pytest.fixture(scope="module")
def minute(reach):
    return simulate(reach, MINUTE, seed=1)


def test_it_records_fifty_samples_a_second(minute):
    assert minute.recording.joints.shape == (3000, 7)


def test_the_same_seed_gives_the_same_recording_and_another_one_another(reach, minute):
    np.testing.assert_array_equal(
        simulate(reach, MINUTE, seed=1).recording.joints, minute.recording.joints
    )
    assert not np.array_equal(
        simulate(reach, MINUTE, seed=2).recording.joints, minute.recording.joints
    )


def test_joints_keep_limits_and_speeds(reach, minute):
    joints = minute.recording.joints
    lower, upper = reach.limits
    assert np.all((joints >= lower) & (joints <= upper))
    # The controller's own bound, and rounding.
    assert np.abs(np.diff(joints, axis=0)).max() <= 1.76 * PERIOD + 1e-9


def test_nothing_touches_says_drake(reach, minute):
    scene, before = reach.scene, reach.scene.positions()
    try:
        scene.set_torso(reach.lift)
        for joints in minute.recording.joints[::60]:
            scene.set_arm(joints)
            assert scene.violations() == ()
    finally:
        scene.restore(before)


def test_the_slave_follows_where_nothing_is_in_the_way(minute):
    # It lags by speed over gain, some 4 cm; much more means that it has lost the hand.
    assert np.median(minute.position_error[~minute.held]) < 0.08
    assert not minute.held.all()


def test_the_hand_goes_to_both_sides_of_the_middle_of_its_box(reach, minute):
    _, p_AT = reach.tool_poses(minute.recording.joints)
    p_BT = p_AT @ reach.R_BA.T + reach.p_BA
    off = p_BT[:, :2] - np.array(MINUTE.centre)
    assert np.all(off.min(axis=0) < -0.1)
    assert np.all(off.max(axis=0) > 0.1)


def test_no_turn_is_smaller_than_the_tilt_in_it(reach, minute):
    R_AT, _ = reach.tool_poses(minute.recording.joints)
    # The hand holds the tool level, whatever its heading.
    assert MINUTE.pitch == 0.0
    tilt = np.arccos(np.clip((reach.R_BA @ R_AT)[:, 2, 2], -1.0, 1.0))
    assert tilt.max() > 0.02
    # An arc cosine is good to 1e-8 about zero.
    assert np.all(minute.turn_error >= tilt - 1e-7)


def test_the_tool_stays_upright_near_the_box(reach, minute):
    R_AT, p_AT = reach.tool_poses(minute.recording.joints)
    p_BT = p_AT @ reach.R_BA.T + reach.p_BA
    half = 0.5 * MINUTE.scale * np.array(MASTER_BOX[:2])
    # The tool may overshoot the box by its lag.
    assert np.all(np.abs(p_BT[:, :2] - MINUTE.centre) <= half + 0.15)
    assert np.median(np.abs(p_BT[:, 2] - MINUTE.height)) < 0.025
    up = (reach.R_BA @ R_AT)[:, 2, 2]
    assert np.median(up) > math.cos(math.radians(11.25))


def test_its_map_holds_only_what_inverse_kinematics_reaches(reach, minute):
    grid = MapGrid.of(0.05, 16, "side")
    found = map_from_recording(reach, grid, minute.recording, height=MINUTE.height)
    assert len(found.capability.cells) > 20
    # The recorded pose itself is reachable, though the centre of its cell need not be.
    # At a joint limit rounding decides whether it is.
    joints = found.capability.joints.astype(float)
    lower, upper = reach.limits
    inside = np.all((joints > lower + 1e-3) & (joints < upper - 1e-3), axis=1)
    assert inside.sum() > 20
    R_AT, p_AT = reach.tool_poses(joints[inside])
    solved = reach.solve(reach.R_BA @ R_AT, p_AT @ reach.R_BA.T + reach.p_BA)
    assert solved.reached.mean() > 0.99
    here = found.capability.manipulability[inside][solved.reached]
    # The kernel samples the free joint, so a posture in a narrow window may be better than its own.
    assert (solved.manipulability[solved.reached] >= here - 1e-4).mean() > 0.97


@pytest.mark.parametrize(
    ("operator", "words"),
    [
        (Operator(centre=(9.0, 0.0)), "cannot start: no place in the box"),
        (Operator(seconds=0.0), "from 0.02 to 86,400 s"),
        (Operator(seconds=1e12), "from 0.02 to 86,400 s"),
        (Operator(seconds=math.nan), "finite"),
        (Operator(height=math.nan), "finite"),
    ],
)
def test_recordings_that_cannot_be(reach, operator, words):
    with pytest.raises(DataFileError, match=words):
        simulate(reach, operator)
