"""A trial: the run records the motion of the arm, and invalid courses are refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tcs.errors import TcsError
from tcs.teleop.control.latency import Latency
from tcs.teleop.line import Line
from tcs.teleop.runs.run import NO_GROUP
from tcs_studies.experiment.trial import (
    ASSISTED,
    CONDITIONS,
    END_EFFECTOR,
    NOVEL,
    TrialMeasures,
    mean_measures,
    measure,
    run_trial,
)
from tcs_studies.operators import Experience, OperatorTraits


@pytest.fixture(scope="module")
def runs(iiwa, course):
    """One trial with each controller."""
    return {
        condition.name: run_trial(
            iiwa,
            course,
            condition,
            OperatorTraits(),
            Experience(),
            np.random.default_rng(3),
            time_limit=60.0,
        )
        for condition in CONDITIONS
    }


@pytest.mark.parametrize("condition", CONDITIONS, ids=lambda one: one.name)
def test_a_run_records_the_motion_of_the_arm(iiwa, runs, condition):
    run = runs[condition.name]
    assert run.joint_names == iiwa.joints
    rows = np.linspace(0, len(run) - 1, 50).astype(int)
    for row in rows:
        now = iiwa.kinematics(run.joints[row])
        np.testing.assert_allclose(run.position[row], now.p, atol=1e-9)
        R = Rotation.from_quat(run.quaternion[row], scalar_first=True).as_matrix()
        np.testing.assert_allclose(R, now.R, atol=1e-9)
    moved = np.diff(run.joints, axis=0) / run.step
    np.testing.assert_allclose(moved, run.rates[1:], atol=1e-6)
    assert (run.joints >= iiwa.lower).all()
    assert (run.joints <= iiwa.upper).all()
    assert run.metadata["operator_type"] == "scripted"
    assert run.metadata["condition"] == condition.name


def test_the_tool_is_held_while_the_group_moves(runs):
    run = runs[NOVEL.name]
    turning = run.group == 0
    assert turning.any()
    pieces = np.split(np.flatnonzero(turning), np.flatnonzero(np.diff(np.flatnonzero(turning)) > 1))
    for piece in pieces:
        # In the first steps of a part the tool comes to rest.
        held = run.position[piece[10:]]
        assert np.linalg.norm(held - held[0], axis=1).max() < 1e-4


def test_only_the_novel_controller_moves_groups(runs):
    assert (runs[END_EFFECTOR.name].group == NO_GROUP).all()
    assert (runs[ASSISTED.name].group == NO_GROUP).all()
    assert set(runs[NOVEL.name].mode) == {"end-effector", "null-space"}


def test_without_assistance_the_arm_stops_on_the_way(runs):
    assert runs[END_EFFECTOR.name].stopped.any()
    assert runs[NOVEL.name].stopped.any()


def test_the_same_seed_gives_the_same_trial(iiwa, course):
    first, second = (
        run_trial(
            iiwa,
            course,
            NOVEL,
            OperatorTraits(),
            Experience(),
            np.random.default_rng(9),
            time_limit=15.0,
        )
        for _ in range(2)
    )
    np.testing.assert_array_equal(first.joints, second.joints)


@pytest.mark.parametrize(("path", "ways"), [("command", 1), ("picture", 1), ("both", 2)])
def test_latency_delays_the_hand_by_its_time_on_each_path(iiwa, course, path, ways):
    def moved(latency):
        run = run_trial(
            iiwa, course, NOVEL, OperatorTraits(), Experience(), np.random.default_rng(9),
            time_limit=1.2, latency=latency,
        )  # fmt: skip
        return int(np.argmax(np.linalg.norm(run.linear, axis=1) > 0.03)), run

    begun, prompt = moved(Latency())
    late, run = moved(Latency(0.2, path))
    # Tremor moves the hand past the threshold some steps earlier or later.
    assert late == pytest.approx(begun + 20 * ways, abs=4)
    if path == "command":
        # The same hand 20 steps later, until it reacts to the arm.
        np.testing.assert_array_equal(run.linear[20:45], prompt.linear[:25])
    assert run.metadata["command_latency"] == (0.0 if path == "picture" else 0.2)
    assert "command_latency" not in prompt.metadata


def test_measures_of_a_trial_that_is_broken_off(iiwa, course):
    run = run_trial(
        iiwa,
        course,
        END_EFFECTOR,
        OperatorTraits(),
        Experience(),
        np.random.default_rng(0),
        time_limit=6.0,
    )
    found = measure(run, course, time_limit=6.0)
    assert (found.finished, found.time) == (0.0, 6.0)
    assert 5 < found.planes_met < 25
    assert run.time[-1] == pytest.approx(6.0, abs=0.02)
    assert found.turned == 0.0
    assert found.work == pytest.approx(found.effort * (len(run) - 2))


def test_measures_of_a_whole_trial(runs, course):
    found = measure(runs[NOVEL.name], course)
    assert found.finished == 1.0
    assert found.time == pytest.approx(runs[NOVEL.name].time[-1], abs=0.02)
    assert found.planes_met >= 28
    assert found.turned > 0.1
    assert found.stops >= 1
    # The hand moves at least the length of the line, less the sphere at its end.
    assert found.steering_translation > course.line.length - 0.05


def test_mean_of_trials():
    values = dict.fromkeys(TrialMeasures.__dataclass_fields__, 1.0)
    mean = mean_measures([TrialMeasures(**values), TrialMeasures(**{**values, "time": 4.0})])
    assert (mean.time, mean.accuracy) == (2.5, 1.0)


def refused(iiwa, course):
    run_trial(iiwa, course, NOVEL, OperatorTraits(), Experience(), np.random.default_rng(0))


def test_a_start_posture_beyond_a_limit_is_refused(iiwa, course):
    joints = course.joints.copy()
    joints[3] = 3.0
    with pytest.raises(TcsError, match=r"start posture: joint 4 .* is at 3.0000 rad, outside"):
        refused(iiwa, replace(course, joints=joints))


def test_a_start_posture_off_the_line_is_refused(iiwa, course):
    joints = course.joints.copy()
    joints[0] += 0.3
    with pytest.raises(TcsError, match=r"from the line's start; it must be within 0\.02 m"):
        refused(iiwa, replace(course, joints=joints))


def test_a_line_out_of_reach_is_refused(iiwa, course):
    far = Line(course.line.start, (-2.0, 0.0, 1.0))
    with pytest.raises(TcsError, match=r"line out of reach: its end is 2\.\d+ m from"):
        refused(iiwa, replace(course, line=far))
