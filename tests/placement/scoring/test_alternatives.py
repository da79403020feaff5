"""A task with several grasps of one cup, through every command that takes a file."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import yaml

import tcs
from tcs.model.people import Bodies, papers_man
from tcs.model.tasks import load_task
from tcs.output.words import goal_place
from tcs.placement.reasons import explain
from tcs.placement.scoring import load_job, score, verify
from tcs.placement.scoring.drake_check import DrakeChecker
from tcs.placement.tables import Reason
from tests.environments import write_environment

CUP = Path(__file__).parents[2] / "data" / "cup.yaml"
GRID = {
    "base_x": (0.8, 0.2, 4),
    "base_y": (-0.8, 0.4, 5),
    "base_yaw": (0, 90, 4),
    "torso": (0.0, 0.15, 2),
}


@pytest.fixture(scope="module")
def environment(tmp_path_factory):
    return write_environment(tmp_path_factory.mktemp("cup"), "cup-corner", GRID)


@pytest.fixture(scope="module")
def single(tmp_path_factory):
    """Paths of the task with one of its poses."""
    folder, paths = tmp_path_factory.mktemp("single"), []
    for number in range(2):
        task = yaml.safe_load(CUP.read_text())
        (goal,) = task["goals"]
        goal["alternatives"] = goal["alternatives"][number : number + 1]
        paths.append(folder / f"cup_{number}.yaml")
        paths[-1].write_text(yaml.safe_dump(task))
    return paths


@pytest.fixture(scope="module")
def file(environment):
    return score(CUP, environment, approach=False)


@pytest.fixture(scope="module")
def single_files(environment, single):
    return [score(path, environment, approach=False) for path in single]


def test_a_cup_counts_once_however_it_is_grasped(file, single_files):
    """Two goals, one for each grasp, would each have half of the weight."""
    reached = [f.nominal.scores.reason[:, 0] == Reason.REACHED for f in single_files]
    assert np.any(reached[0] & ~reached[1])
    assert np.any(reached[1] & ~reached[0])
    scores = file.nominal.scores
    assert scores.weights.tolist() == [1.0]
    np.testing.assert_array_equal(scores.reason[:, 0] == Reason.REACHED, reached[0] | reached[1])
    best = np.max([f.nominal.scores.dexterity[:, 0] for f in single_files], axis=0)
    np.testing.assert_array_equal(scores.dexterity[:, 0], best)


def test_drake_finds_the_pose_that_the_joints_reach(file, environment, single):
    found = verify(file, pairs=8, dense=1)
    assert found.is_sound
    assert (found.checked, found.missed) == (8, 0)
    job = load_job(CUP, environment, "pr2")
    both = DrakeChecker(job, job.scene(), "isotropy")
    one = dataclasses.replace(job, task=load_task(single[0]))
    first = DrakeChecker(one, one.scene(), "isotropy")
    scores, true_at_first = file.nominal.scores, set()
    reached = np.flatnonzero(scores.reason[:, 0] == Reason.REACHED)
    for h in reached[:: max(1, len(reached) // 5)]:
        q = np.asarray(scores.joints_of(h, 0), dtype=np.float64)
        assert both.check_at(both.values(h), 0, q, scores.dexterity[h, 0]).is_true
        true_at_first.add(first.check_at(first.values(h), 0, q, scores.dexterity[h, 0]).is_true)
        bent = q + np.eye(7)[5] * 1e-3
        assert not both.check_at(both.values(h), 0, bent, scores.dexterity[h, 0]).is_true
    assert true_at_first == {True, False}


def test_files_and_words_say_that_there_are_several_poses(file):
    (goal,) = file.task["goals"]
    assert goal["free"] == "any of 2 poses"
    assert [pose["body_frame"] for pose in goal["alternatives"]] == ["head"]
    assert goal_place(load_task(CUP).goals[0]) == "cup (any of 2 poses)"
    assert explain(file, 0).to_json()["goal_free"] == "any of 2 poses"


def test_alternatives_are_part_of_what_scores_follow_from(environment, single, single_files):
    job = load_job(CUP, environment, "pr2")
    lowered = job.lowered(job.scene())
    assert lowered.arrays.first_pose.tolist() == [0, 2]
    apart = dataclasses.replace(
        lowered, arrays=lowered.arrays._replace(first_pose=np.empty(0, np.int64))
    )
    assert lowered.digest() != apart.digest()
    alone = load_job(single[0], environment, "pr2")
    assert not len(alone.lowered(alone.scene()).arrays.first_pose)
    assert "alternatives" not in single_files[0].task["goals"][0]


def test_under_errors_any_pose_counts(file, single_files):
    """Of the same samples, a goal of two poses is reached where one of them is."""
    reasons = [one.nominal.scores.reason[:, 0] for one in single_files]
    h = int(np.flatnonzero(np.all(np.equal(reasons, Reason.REACHED), axis=0))[0])
    either, *each = [
        tcs.evaluate(one, samples=20, select=[h], seed=1).reached[:, 0]
        for one in (file, *single_files)
    ]
    np.testing.assert_array_equal(either, each[0] | each[1])
    assert not np.array_equal(each[0], each[1])


@pytest.mark.slow
def test_refinement_and_populations_take_the_file(file):
    refined = tcs.refine(file, starts=1, rounds=2, keep_success=False)
    assert verify(refined, pairs=4).is_sound
    man = papers_man()
    alone = Bodies(tuple(man.measures), np.array([True]), np.array([list(man.measures.values())]))
    result = tcs.population(file, alone, top=tcs.Top(count=1))
    assert result.best.served.tolist() == [True]
