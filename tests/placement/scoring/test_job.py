"""The offline job."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from tcs.errors import TaskError, TcsError, UnknownNameError
from tcs.model.tasks import load_task
from tcs.placement.scoring import load_job, score, summary, sweep
from tcs.placement.scoring.job import data_references
from tcs.placement.store import load_scores, save_scores
from tcs.placement.tables import Reason


def test_a_small_environment_is_reached_and_summed_up(small_file):
    figures = summary(small_file)
    assert figures["configurations"] == 8 * 2 * 4 * 2
    assert figures["pairs"] == figures["configurations"] * 8
    assert sum(figures["reasons"].values()) == figures["pairs"]
    assert figures["reasons"]["reached"] == figures["reached_pairs"] > 0
    assert 0.0 < figures["best_single"]["reachability"] <= figures["best"]["reachability"] <= 1.0
    assert {"base_x", "base_y", "base_yaw_deg", "torso"} <= set(figures["best"]["members"][0])


def test_scores_do_not_depend_on_the_number_of_threads(small_job):
    lowered = small_job.lowered(small_job.scene())
    one = sweep(lowered, small_job.task.weights, jobs=1).tables[0]
    two = sweep(lowered, small_job.task.weights, jobs=2).tables[0]
    for name in ("reason", "dexterity", "pair", "arm_joints"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
    assert one.pair_names == two.pair_names


def test_conditions_restrict_the_grid():
    job = load_job("shaving", "bed", only=("head_rest >= 35 deg", "base_x = 0..1 m"), robot="pr2")
    assert job.grid.axis("head_rest").count == 2
    assert job.grid.axis("base_x").count == 11
    assert job.grid.axis("base_y") == load_job("shaving", "bed", "pr2").grid.axis("base_y")


@pytest.mark.parametrize("jobs", [0, -1])
def test_no_threads_are_refused(small_job, jobs):
    lowered = small_job.lowered(small_job.scene())
    with pytest.raises(TcsError, match=f"^jobs is {jobs}; must be 1 or more threads"):
        sweep(lowered, small_job.task.weights, jobs=jobs)
    with pytest.raises(TcsError, match=f"^jobs is {jobs}; must be 1 or more threads"):
        score("feeding", jobs=jobs)


def test_blocked_pairs_name_the_bodies_in_contact(small_file):
    scores = small_file.nominal.scores
    blocked = np.isin(scores.reason, (Reason.BODY_BLOCKED, Reason.ARM_BLOCKED))
    gripper = (Reason.GRIPPER_BLOCKED_BY_ENVIRONMENT, Reason.GRIPPER_BLOCKED_BY_ROBOT)
    assert blocked.any()
    assert np.all(scores.pair[blocked] >= 0)
    assert np.all(scores.pair[~blocked & ~np.isin(scores.reason, gripper)] == -1)
    robot, other = scores.pair_names[scores.pair[scores.reason == Reason.BODY_BLOCKED][0]]
    assert not robot.startswith(("wheelchair::", "person::"))
    assert other.startswith(("wheelchair::", "person::"))


def test_progress_ends_at_the_number_of_configurations(small_job):
    calls = []
    lowered = small_job.lowered(small_job.scene())
    sweep(
        lowered, small_job.task.weights, on_progress=lambda done, total: calls.append((done, total))
    )
    assert calls[-1] == (small_job.grid.size, small_job.grid.size)
    assert calls == sorted(calls)


def test_file_survives_the_disk(small_file, tmp_path):
    path = tmp_path / "scores.tcs"
    save_scores(path, small_file)
    again = load_scores(path)
    assert summary(again) == summary(small_file)
    np.testing.assert_array_equal(
        again.nominal.scores.arm_joints, small_file.nominal.scores.arm_joints
    )


def test_an_obstacle_never_makes_a_goal_reachable(small_file, small_environment, tmp_path):
    path = tmp_path / "environment.yaml"
    path.write_text(
        f"based_on: {small_environment}\nname: cluttered\n"
        "obstacles:\n  - {name: table, box: [0.5, 0.4, 0.9], xyz: [0.9, -0.55, 0.45]}\n"
    )
    cluttered = score("shaving", path, paper=True).nominal.scores
    assert cluttered.reached.sum() < small_file.nominal.scores.reached.sum()
    # Several convex parts: an obstacle may steer the search to a narrow free stretch that it had
    # no need to look for before, so a rare gain is possible; it must stay rare.
    gained = cluttered.reached & ~small_file.nominal.scores.reached
    assert gained.sum() <= 0.002 * cluttered.reached.sum()


def test_a_task_that_is_not_for_the_environment_is_refused():
    task = dataclasses.replace(load_task("feeding"), environments=("bed",))
    with pytest.raises(TaskError, match=r"has no goals in environment 'wheelchair'.*bed"):
        load_job(task, "wheelchair", "pr2")


@pytest.mark.parametrize(
    ("names", "named", "near"),
    [
        (("shavin", "wheelchair", "pr2"), "task", "shaving"),
        (("shaving", "wheelchai", "pr2"), "environment", "wheelchair"),
        (("shaving", "wheelchair", "pr3"), "robot", "pr2"),
    ],
)
def test_unknown_names_come_with_the_nearest(names, named, near):
    with pytest.raises(UnknownNameError, match=f"{named}.*Did you mean '{near}'"):
        load_job(*names)


def test_an_unknown_body_frame_names_task_and_goal(tmp_path, small_environment):
    path = tmp_path / "odd.yaml"
    path.write_text(
        "name: odd\ntitle: odd\nsource: made up\nenvironments: [wheelchair]\ntool: any\ngoals:\n"
        "  - {body_frame: haed, position: [0.2, 0, 0], quaternion_wxyz: [1, 0, 0, 0], weight: 1}\n"
    )
    with pytest.raises(UnknownNameError, match=r"goal 1.*haed.*Did you mean 'head'"):
        score(path, small_environment)


def test_metadata_locates_the_files_and_keeps_how_they_were_given(small_job, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path))
    made = data_references(small_job, "shaving", small_job.spec.environment, "~/mine.yaml")
    assert made["robot"] == str(tmp_path / "mine.yaml")
    assert made["given"] == {
        "task": "shaving",
        "environment": small_job.spec.environment.name,
        "robot": "~/mine.yaml",
    }
    assert data_references(small_job, "a", "b", "./mine.yaml")["robot"] == str(
        tmp_path / "mine.yaml"
    )
