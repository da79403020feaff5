"""Goals whose approach Newton's method finds: beside the grid of the free joint, and without it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from tcs.motion.approach_check import ApproachScene
from tcs.motion.stops import single_grid
from tcs.placement.scoring import load_job, sweep
from tcs.placement.scoring.approaches import approach_lines


@pytest.mark.parametrize(
    ("robot", "at", "goal"),
    [
        # Lines that lead on in other windows, which no motion reaches, use up the attempts.
        ("fr3", 24276, 4),
        # The wrist is straight at the begin: joints 5 and 7 turn fast against each other.
        ("tiago", 81538, 4),
        # Only next to a limit, closer than the grid's angles, does nothing touch.
        ("pr2", 80857, 0),
        # Another posture than the best one.
        ("ur5", 12369, 6),
        # The base drives, the lift and the telescope move.
        ("stretch", 14778, 6),
    ],
)
def test_approaches_that_only_newton_follows_are_found_and_confirmed_by_drake(robot, at, goal):
    job = load_job("shaving", "wheelchair", robot, paper=True)
    values = job.grid.values(np.array([at]))
    one = single_grid(job.grid.axes, [float(values[axis.name][0]) for axis in job.grid.axes])
    job = dataclasses.replace(job, grid=one)
    scene = job.scene()
    lowered = job.lowered(scene)
    lines = approach_lines(job)
    (table,) = sweep(lowered, job.task.weights, jobs=1, approaches=lines).tables
    assert table.reached[0, goal]
    q = np.asarray(table.arm_joints[np.sum(table.reached[0, :goal])], dtype=np.float64)
    finding = ApproachScene.of(job, scene, lowered).check(0, goal, q)
    assert finding is not None
    assert finding.is_true
