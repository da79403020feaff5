"""The robot at rest at a stop, by Drake."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from tcs.model.grid import thinned
from tcs.model.scene import lowering
from tcs.placement.scoring import load_job, score, verify
from tcs.placement.scoring.sweep import sweep
from tcs.placement.tables import Reason
from tests.chosen import some_of
from tests.environments import BESIDE, write_environment

CHECKED = 12
"""Configurations of either outcome that Drake checks."""


def is_free_at_rest(job, scene, h):
    """Return whether Drake finds the robot at rest free of the environment at a configuration."""
    at = {name: float(value) for name, value in job.scored_grid.values(h).items()}
    scene.place_base(at["base_x"], at["base_y"], at["base_yaw"])
    scene.set_torso(at["torso"])
    for q in job.spec.robot.rest_postures().values():
        scene.set_arm(q)
        if not scene.of_environment(scene.violations()):
            return True
    return False


@pytest.mark.parametrize("robot", some_of(["stretch", "pr2", "jaco"], "stretch"))
def test_what_counts_is_free_at_rest_and_what_is_refused_is_not(robot, rng):
    job = load_job("feeding", "wheelchair", robot, paper=True)
    job = dataclasses.replace(job, grid=thinned(job.grid, 4, (0.5, 0.0)))
    scene = job.scene()
    lowered = job.lowered(scene)
    scores = sweep(lowered, job.task.weights, jobs=1).tables[0]
    blocked = np.all(scores.reason == Reason.BODY_BLOCKED, axis=1)
    counted = np.any(scores.reason == Reason.REACHED, axis=1)
    # What only the arm at rest blocks.
    arrays = lowered.arrays._replace(rest=np.empty((0, 7)))
    unchecked = dataclasses.replace(lowered, arrays=arrays)
    before = sweep(unchecked, job.task.weights, jobs=1).tables[0]
    refused = blocked & np.any(before.reason != Reason.BODY_BLOCKED, axis=1)
    for rows, expected in ((counted, True), (refused, False)):
        found = np.flatnonzero(rows)
        for h in rng.choice(found, min(CHECKED, found.size), replace=False):
            assert is_free_at_rest(job, scene, int(h)) == expected, h
    assert counted.any()
    values = job.grid.values(np.arange(job.grid.size))
    amid = (np.abs(values["base_x"] - 0.5) < 1e-9) & (np.abs(values["base_y"]) < 1e-9)
    assert amid.any()
    assert blocked[amid].all()


def test_verify_refutes_a_stop_where_the_arm_at_rest_is_in_contact(tmp_path, monkeypatch):
    environment = write_environment(tmp_path, "beside", BESIDE)
    monkeypatch.setattr(lowering, "_rest", lambda scene: np.empty((0, 7)))
    robot = tmp_path / "reaching.yaml"
    # Straight ahead, into person and chair.
    rests = "rest: {l_elbow_flex_joint: -0.15}\nother_rests: {}\n"
    robot.write_text("based_on: pr2\nname: reaching\ntitle: reaching\n" + rests)
    file = score("shaving", environment, robot, paper=True)
    assert verify(file, pairs=8, dense=0).false_reached > 0
