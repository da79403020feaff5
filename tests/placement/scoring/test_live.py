"""Scoring a scene as it is observed."""

from __future__ import annotations

import dataclasses
import inspect

import numpy as np
import pytest

from tcs.errors import SelectionError, UnknownNameError
from tcs.model.grid import InitialConfiguration
from tcs.model.scene import Observation
from tcs.placement.scoring import LiveScorer, load_job, score, score_observed, verify
from tcs.placement.selection import select
from tcs.placement.store import load_scores, save_scores

HERE = InitialConfiguration(base_x=1.4, base_y=-1.2, base_yaw=3.0, torso=0.1)
BESIDE_THE_BED = """
based_on: bed
name: beside-the-bed
title: The bed, seen from a few places
grid:
  bed_height: {unit: m, start: 0.2, step: 0.1, count: 1}
  head_rest: {unit: deg, start: 0, step: 35, count: 2}
  base_x: {unit: m, start: 0.1, step: 0.2, count: 3}
  base_y: {unit: m, start: -1.0, step: 0.2, count: 3}
  base_yaw: {unit: deg, start: 90, step: 90, count: 2}
  torso: {unit: m, start: 0.15, step: 0.15, count: 1}
"""
TABLES = ("reason", "dexterity", "arm_joints")


@pytest.fixture(scope="module")
def scorer(small_environment):
    """Shaving in the small environment, ready to be scored."""
    return LiveScorer("shaving", small_environment, paper=True)


@pytest.fixture(scope="module")
def bedside(tmp_path_factory):
    """Path of a bed with a small grid and the paper's five shifts."""
    path = tmp_path_factory.mktemp("environments") / "beside-the-bed.yaml"
    path.write_text(BESIDE_THE_BED)
    return path


@pytest.fixture(scope="module")
def bed_scorer(bedside):
    """Shaving there, ready to be scored."""
    return LiveScorer("shaving", bedside, paper=True)


@pytest.fixture
def head(scorer):
    """The nominal pose of the head: x y z qw qx qy qz."""
    return seven(scorer)


def seven(scorer, joints=(), name="head"):
    """The pose of a body frame with some joints moved, by Drake."""
    scene = scorer.job.scene()
    for joint, value in dict(joints).items():
        scene.set_joint(joint, value)
    X_WH = scene.body_frame_pose(name)
    return [*X_WH.translation(), *X_WH.rotation().ToQuaternion().wxyz()]


def blamed(scores):
    """Names of the bodies in contact; their numbers depend on the other contacts of the file."""
    return np.array([*map(" + ".join, scores.pair_names), ""])[scores.pair]


def assert_same_scores(one, other):
    for name in TABLES:
        np.testing.assert_array_equal(getattr(one.scores, name), getattr(other.scores, name))
    np.testing.assert_array_equal(blamed(one.scores), blamed(other.scores))
    assert one.sets.best == other.sets.best
    np.testing.assert_array_equal(one.sets.pairs.cells, other.sets.pairs.cells)


def test_some_base_positions_have_the_scores_that_they_have_among_all(bed_scorer):
    everything = bed_scorer.score({"person_y": 0.02})
    some = bed_scorer.score({"person_y": 0.02}, every=2, around=(0.31, -1.0))
    every, few = everything.configurations, some.configurations
    assert few.axis("base_x").values == pytest.approx([0.3])
    assert few.axis("base_y").values == pytest.approx([-1.0, -0.6])
    assert few.axis("base_yaw") == every.axis("base_yaw")
    reached = 0
    for index in range(few.size):
        place = few.configuration(index)
        [same] = [h for h in range(every.size) if every.configuration(h) == place]
        one, other = some.tables[0].scores, everything.tables[0].scores
        assert np.array_equal(one.reason[index], other.reason[same])
        assert np.array_equal(one.dexterity[index], other.dexterity[same])
        reached += int(one.reached[index].sum())
    assert reached
    # Scoring them all afterwards scores them all.
    assert_same_scores(bed_scorer.score({"person_y": 0.02}).tables[0], everything.tables[0])
    with pytest.raises(SelectionError, match="'around' requires 'every'"):
        bed_scorer.score({}, around=(0.0, 0.0))


@pytest.mark.parametrize(
    "observation", [None, {}, {"person_x": 0.0, "head_tilt": 0.0, "wheelchair_yaw": 0.0}]
)
def test_without_observed_errors_the_scores_are_the_offline_ones(scorer, small_file, observation):
    assert_same_scores(scorer.score(observation).nominal, small_file.nominal)


def test_a_nominal_frame_gives_the_offline_scores_exactly(scorer, small_file, head):
    file = scorer.score(Observation(frames={"head": head}))
    assert_same_scores(file.nominal, small_file.nominal)
    assert file.metadata["observation"]["frame_position_error"] < 1e-9


@pytest.mark.parametrize("shift", [-0.05, 0.0, 0.1])
def test_a_stored_shift_gives_its_table_exactly(bed_scorer, bedside, shift):
    file = score("shaving", bedside, paper=True)
    stored = [state["person_y"] for state in file.observed_states]
    table = file.tables[int(np.argmin(np.abs(np.array(stored) - shift)))]
    assert_same_scores(bed_scorer.score({"person_y": shift}).nominal, table)


def test_scoring_does_not_affect_the_next_one(scorer, small_file):
    moved = scorer.score({"person_x": 0.05, "head_tilt": 0.1})
    assert not np.array_equal(moved.nominal.scores.dexterity, small_file.nominal.scores.dexterity)
    assert_same_scores(scorer.score().nominal, small_file.nominal)


def test_moving_chair_and_robot_together_changes_nothing_that_is_reached(scorer, small_file):
    # Along x by one step of the grid: the chair with the person on it, and the columns of the
    # grid with it. Chair and robot are on the same floor.
    moved = scorer.score({"wheelchair_x": 0.1}).nominal.scores
    rows = (8, 2, 4, 2, -1)
    here = small_file.nominal.scores.dexterity.reshape(rows)[:-1]
    there = moved.dexterity.reshape(rows)[1:]
    # 0.1 m is no multiple of 2^-52: the last bits of the goals differ, and with them 1e-7 of the
    # float32 dexterity.
    np.testing.assert_allclose(there, here, atol=1e-6)


def test_task_environment_and_robot_come_in_one_order():
    functions = (score, score_observed, LiveScorer, load_job)
    orders = [list(inspect.signature(function).parameters)[:3] for function in functions]
    assert orders == [["task", "environment", "robot"]] * len(functions)


def test_drake_confirms_what_was_scored_live(small_environment, tmp_path):
    observation = {"person_x": 0.03, "person_yaw": 0.08, "wheelchair_y": -0.01, "head_tilt": 0.06}
    path = tmp_path / "live.tcs"
    save_scores(
        path, score_observed("shaving", small_environment, observation=observation, paper=True)
    )
    file = load_scores(path)
    assert file.observed_states[0] == pytest.approx(observation, abs=1e-15)
    found = verify(file, pairs=60, dense=6)
    assert found.checked == 60
    assert found.is_sound


def test_drake_refutes_scores_of_another_observation(scorer, small_file):
    file = scorer.score({"person_x": 0.03})
    # The scores of the nominal scene in a file with another observation.
    swapped = dataclasses.replace(file, tables=small_file.tables)
    assert verify(swapped, pairs=20, dense=0).false_reached == 20


def test_a_set_is_selected_from_a_live_score(scorer):
    file = scorer.score({"person_x": 0.03})
    choice = select(file, HERE)
    assert choice.members
    assert choice.match.state == {"person_x": 0.03}
    assert file.metadata["observation"]["joints"] == {"person_x": 0.03}


def test_frames_with_orientation_determine_the_joints(scorer):
    joints = {"person_x": 0.03, "person_y": -0.02, "person_yaw": 0.07, "head_tilt": -0.05}
    chair = {"wheelchair_x": 0.01, "wheelchair_y": 0.005, "wheelchair_yaw": 0.02}
    frames = {name: seven(scorer, {**joints, **chair}, name) for name in ("head", "chest")}
    file = scorer.score(Observation(joints=chair, frames=frames))
    entry = file.metadata["observation"]
    # Rounded to a nanometre.
    assert entry["joints"] == pytest.approx({**joints, **chair}, abs=2e-9)
    assert entry["frame_position_error"] < 1e-8
    assert entry["frame_rotation_error"] < 1e-8


def test_a_position_alone_is_fitted_by_the_most_likely_joints(scorer, head):
    seen = [head[0] + 0.04, head[1], head[2]]
    entry = scorer.score(Observation(frames={"head": seen})).metadata["observation"]
    assert entry["frame_position_error"] < 1e-8
    joints = entry["joints"]
    # Standard deviations of 5 cm (person) and 1.25 cm (chair): fractions are as their squares.
    assert abs(joints["person_x"]) == pytest.approx(0.04 * 16 / 17, abs=1e-6)
    assert joints["wheelchair_x"] == pytest.approx(0.04 / 17, abs=1e-6)


def test_a_frame_on_the_bed_determines_the_shift(bed_scorer):
    setting = {"bed_height": 0.2, "head_rest": np.radians(35.0)}
    seen = seven(bed_scorer, {**setting, "person_y": 0.025, "person_x": -0.01})[:3]
    file = bed_scorer.score(Observation(frames={"head": seen}, setting=setting))
    assert file.metadata["observation"]["joints"] == pytest.approx(
        {"person_x": -0.01, "person_y": 0.025}, abs=2e-9
    )


@pytest.mark.parametrize(
    ("observation", "error", "message"),
    [
        ({"persn_x": 0.1}, UnknownNameError, "Did you mean 'person_x'"),
        ({"person_x": 5.0}, Exception, "beyond the joint's limits"),
        ({"person_x": float("nan")}, SelectionError, "finite"),
        (Observation(frames={"haed": (0, 0, 1)}), UnknownNameError, "Did you mean 'head'"),
        (Observation(frames={"head": (0.45, 0.0)}), SelectionError, "three finite numbers"),
        (Observation(frames={"head": (0.45, 0.0, 1.3)}), SelectionError, "0.068 m from the"),
        (
            Observation(frames={"wheelchair::base_link": (0, 0, 0.4)}),
            SelectionError,
            "from the scene",
        ),
        (
            Observation(frames={"head": (0.451, 0, 1.232, 2, 0, 0, 0)}),
            SelectionError,
            "has length 2",
        ),
        (
            Observation(frames={"wheelchair::base_link": (0, 0, 0, 0, 1, 0, 0)}),
            SelectionError,
            "rotated by",
        ),
    ],
)
def test_impossible_values_are_refused(scorer, observation, error, message):
    with pytest.raises(error, match=message):
        scorer.score(observation)


@pytest.mark.parametrize(
    ("observation", "message"),
    [
        ({"head_rest": 0.1}, "'head_rest' is an axis of the grid"),
        (Observation(frames={"head": (0.3, 0, 0.9)}), "also depend on bed_height, head_rest"),
        (
            Observation(
                frames={"head": (0.3, 0, 0.9)},
                setting={"bed_height": 0.2, "head_rest": 0.0, "person_y": 0.1},
            ),
            "unknown environment axis 'person_y'",
        ),
        ({"neck_body": 0.1}, "follows 'head_rest'"),
    ],
)
def test_axes_of_the_grid_cannot_be_observed(bed_scorer, observation, message):
    with pytest.raises(Exception, match=message):
        bed_scorer.score(observation)
