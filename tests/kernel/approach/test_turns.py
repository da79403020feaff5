"""Samples with their sines and cosines, beside those of scoring."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.kernel.analytic.ik import sample_joints, wrist_goal
from tcs.kernel.analytic.samples import MAX_SAMPLES, ROW, ROWS, solve_samples
from tcs.kernel.analytic.solver import LAST, ArmSolver, arm_solver
from tcs.kernel.approach.turns import fill_angles, place_sample
from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import jit
from tcs.kernel.motion.link_poses import LANES
from tests.kernel.arms import ARMS, drake_arm
from tests.kernel.shapes import rotation


@jit
def sample(
    arm: ArmSolver,
    goal: FloatArray,
    branch: IntArray,
    free: float,
    q: FloatArray,
    turns: FloatArray,
) -> None:
    place_sample(arm, goal, branch, free, q, turns)


@jit
def angles(turns: FloatArray) -> None:
    fill_angles(turns)


def test_angles_are_those_of_the_library(rng):
    turns = np.zeros((3, LANES))
    eighths = np.pi / 8.0 * np.arange(-7, 9)
    for some in [*rng.uniform(-np.pi, np.pi, (500, LANES)), *eighths.reshape(-1, LANES)]:
        turns[1], turns[2] = np.sin(some), np.cos(some)
        angles(turns)
        # Half a last bit of pi, and the last bit but one of the arc tangent.
        np.testing.assert_allclose(turns[0], np.arctan2(turns[1], turns[2]), rtol=0, atol=6e-16)


@pytest.mark.parametrize("name", [name for name in ARMS if name != "baxter"])
def test_samples_are_those_of_scoring(rng, name):
    chain = drake_arm(name).chain
    arm = arm_solver(chain)
    goal, q, turns = np.empty((4, 3)), np.empty((2, 7)), np.zeros((3, LANES))
    rows, slack = np.empty(ROWS * ROW), np.empty(MAX_SAMPLES)
    free = LAST if arm.free == LAST else 0
    found = 0
    for _ in range(3000):
        wrist_goal(arm, rotation(rng), rng.uniform(-0.8, 0.8, 3), goal)
        angle = rng.uniform(-1.0, 1.0)
        solved = np.full(1, np.cos(angle)), np.full(1, np.sin(angle))
        for branch in arm.branches:
            solve_samples(arm, goal, branch, *solved, 1, rows, slack)
            # Nearer to a singularity, angles are as uncertain as rounding makes them.
            if slack[0] < 1e-6:
                continue
            sample_joints(arm, goal, branch, angle, q[0])
            sample(arm, goal, branch, angle, q[1], turns)
            np.testing.assert_allclose(q[1], q[0], rtol=0, atol=1e-11)
            np.testing.assert_allclose(turns[1, :7], np.sin(q[0]), rtol=0, atol=1e-11)
            np.testing.assert_allclose(turns[2, :7], np.cos(q[0]), rtol=0, atol=1e-11)
            found += q[1, free] == q[0, free]
    assert found > 20
