"""Simulated recordings: reproducible, within limits, free of contact, and fit for maps."""

import inspect
import math
from dataclasses import replace

import numpy as np
import pytest

from tcs.capability import MapGrid, Reach, map_from_recording
from tcs.cli.capability.making import record
from tcs.errors import DataFileError
from tcs.model.robots import load_robot
from tcs.teleop import load_arm
from tcs_studies.simulated_recording import PERIOD, HandMotion, simulate_recording

MINUTE = HandMotion(seconds=60.0, height=0.6)


@pytest.fixture(scope="module")
def reach():
    """TIAGo on an empty floor."""
    return Reach(load_robot("tiago"), torso_height=0.15)


@pytest.fixture(scope="module")
def minute(reach):
    return simulate_recording(reach, MINUTE, seed=1)


@pytest.fixture(scope="module")
def hindered(reach):
    """A minute in which the hand is so low that the arm meets the robot's base."""
    return simulate_recording(reach, replace(MINUTE, height=0.3), seed=2)


def tool_poses(reach, joints):
    """Return tool poses in the base B."""
    R_AT, p_AT = reach.tool_poses(joints)
    return reach.R_BA @ R_AT, p_AT @ reach.R_BA.T + reach.p_BA


def test_it_records_fifty_samples_a_second(minute):
    assert minute.recording.joints.shape == (3000, 7)


def test_the_same_seed_gives_the_same_recording_and_another_one_another(reach):
    short = HandMotion(seconds=5.0, height=0.6)
    one, same, other = (simulate_recording(reach, short, seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.recording.joints, same.recording.joints)
    assert not np.array_equal(one.recording.joints, other.recording.joints)


def test_joints_keep_limits_and_speeds(reach, minute):
    joints = minute.recording.joints
    lower, upper = reach.limits
    assert np.all((joints >= lower) & (joints <= upper))
    fastest = load_arm(reach.robot).velocity
    assert np.all(np.abs(np.diff(joints, axis=0)) <= fastest * PERIOD + 1e-9)


def test_drake_finds_no_contact(reach, minute):
    scene, before = reach.scene, reach.scene.positions()
    try:
        scene.set_torso(reach.torso_height)
        for joints in minute.recording.joints[::60]:
            scene.set_arm(joints)
            assert scene.violations() == ()
    finally:
        scene.restore(before)


def test_a_stopped_arm_goes_back_along_its_path(hindered):
    stopped, joints = hindered.stopped, hindered.recording.joints
    assert stopped.any()
    # The rest of the time it follows the hand: it never gets stuck.
    assert stopped.mean() < 0.6
    assert not stopped[-500:].all()
    for i in np.flatnonzero(stopped)[::10]:
        # At the start of the path there is no sample of the start posture.
        earlier = np.any(np.all(joints[:i] == joints[i], axis=1))
        assert earlier or np.abs(joints[i] - joints[0]).max() < 0.1


def test_the_arm_follows_the_hand_where_nothing_is_in_the_way(minute):
    # It lags by speed over gain, 4 cm; much more means that it no longer follows the hand.
    assert np.median(minute.position_error[~minute.stopped]) < 0.08


def test_the_hand_goes_to_both_sides_of_the_middle_of_its_box(reach, minute):
    _, p_BT = tool_poses(reach, minute.recording.joints)
    off = p_BT[:, :2] - np.array(MINUTE.centre)
    assert np.all(off.min(axis=0) < -0.1)
    assert np.all(off.max(axis=0) > 0.1)


def test_the_orientation_error_is_at_least_the_tilt(reach, minute):
    R_BT, _ = tool_poses(reach, minute.recording.joints)
    # The hand holds the tool level, whatever its yaw.
    assert MINUTE.pitch == 0.0
    tilt = np.arccos(np.clip(R_BT[:, 2, 2], -1.0, 1.0))
    assert tilt.max() > 0.02
    # An arc cosine is good to 1e-8 about zero.
    assert np.all(minute.orientation_error >= tilt - 1e-7)


def test_the_tool_stays_upright_near_the_box(reach, minute):
    R_BT, p_BT = tool_poses(reach, minute.recording.joints)
    half = 0.5 * MINUTE.extent[:2]
    # The tool may overshoot the box by its lag.
    assert np.all(np.abs(p_BT[:, :2] - MINUTE.centre) <= half + 0.15)
    assert np.median(np.abs(p_BT[:, 2] - MINUTE.height)) < 0.025
    assert np.median(R_BT[:, 2, 2]) > math.cos(math.radians(11.25))


def test_top_grasps_point_down(reach):
    down = HandMotion(seconds=2.0, height=0.6, pitch=math.pi / 2)
    R_BT, _ = tool_poses(reach, simulate_recording(reach, down).recording.joints)
    assert np.median(R_BT[:, 2, 0]) < -0.98


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
    solved = reach.solve(*tool_poses(reach, joints[inside]))
    assert solved.reached.mean() > 0.99
    here = found.capability.manipulability[inside][solved.reached]
    # The kernel samples the free joint, so a posture in a narrow window may be better than its own.
    assert (solved.manipulability[solved.reached] >= here - 1e-4).mean() > 0.97


def test_by_default_it_is_as_long_as_that_of_the_thesis():
    # Appendix C.1: 53 min and 17 s.
    assert HandMotion().seconds == 53 * 60 + 17
    assert inspect.signature(record).parameters["seconds"].default == HandMotion().seconds


def test_progress_ends_with_all_samples(reach):
    calls = []
    simulate_recording(reach, HandMotion(seconds=1.3), on_progress=lambda *done: calls.append(done))
    assert calls[-1] == (65, 65)
    assert [done for done, _ in calls] == sorted({done for done, _ in calls})


@pytest.mark.parametrize(
    ("motion", "words"),
    [
        (HandMotion(centre=(9.0, 0.0)), "cannot start, as it reaches no pose in the box"),
        (HandMotion(seconds=0.0), "length is 0 s, .* 0.02 to 86,400 s"),
        (HandMotion(seconds=1e12), "0.02 to 86,400 s"),
        (HandMotion(seconds=math.nan), "nan"),
        (HandMotion(height=math.nan), "height or centre is nan m"),
        (HandMotion(scale=math.inf), "scale is inf"),
        (HandMotion(scale=0.0), "scale is 0, but a scale must be 0.01 to 100"),
        (HandMotion(scale=-7.5), "scale is -7.5"),
    ],
)
def test_invalid_recordings_are_refused(reach, motion, words):
    with pytest.raises(DataFileError, match=words):
        simulate_recording(reach, motion)
