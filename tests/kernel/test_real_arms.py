"""Inverse kinematics of real arms, goals and verdicts from Drake's plant of their own URDF."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.kernel.analytic.ik import sample_joints, wrist_goal
from tcs.kernel.analytic.solver import arm_solver
from tcs.kernel.dexterity.measures import isotropy_at
from tests.kernel.arms import drake_arm
from tests.kernel.sampled import slack_and_measure
from tests.kernel.shapes import around, random_joints
from tests.reference.kinematics import free_joint, link_poses, solutions

# A dozen products of rotations over an arm of about 1 m.
EXACT = 1e-12


@pytest.fixture(params=["panda", "tiago", "pr2 left", "pr2 right"])
def arm(request):
    """An arm in Drake."""
    return drake_arm(request.param)


def kernel_solutions(chain, X_AG, angle):
    """Return joints, slack and isotropy of every branch at an angle of the free joint."""
    solver, goal = arm_solver(chain), np.full((4, 3), np.nan)
    wrist_goal(solver, X_AG[0], X_AG[1], goal)
    found = []
    for branch in solver.branches:
        slack, measure = slack_and_measure(solver, goal, branch, angle)
        q = np.full(7, np.nan)
        sample_joints(solver, goal, branch, angle, q)
        found.append((q, slack[0], max(measure[0], 0.0) ** (1 / 6)))
    return found


def test_the_chain_is_drakes(arm, rng):
    for q in rng.uniform(-3, 3, (50, 7)):
        R, p = link_poses(arm.chain, q)[-1]
        S, s = arm.tool_pose(q)
        np.testing.assert_allclose(R, S, atol=EXACT)
        np.testing.assert_allclose(p, s, atol=EXACT)


def test_every_solution_reaches_the_goal_in_drake_within_the_limits(arm, rng):
    chain, free = arm.chain, free_joint(arm.chain)
    lower = max(chain.lower[free], -np.pi)
    upper = min(chain.upper[free], np.pi)
    seen = 0
    for _ in range(60):
        X_AG = arm.tool_pose(random_joints(rng, chain))
        for angle in rng.uniform(lower, upper, 20):
            for q, slack, isotropy in kernel_solutions(chain, X_AG, angle):
                if slack < 0:
                    continue
                R, p = arm.tool_pose(q)
                # Away from singularities rounding is far below this; AT_GOAL guards the rest.
                np.testing.assert_allclose(R, X_AG[0], atol=1e-9)
                np.testing.assert_allclose(p, X_AG[1], atol=1e-9)
                assert np.all((q >= chain.lower) & (q <= chain.upper))
                assert q[free] == pytest.approx(angle, abs=1e-15)
                exact = isotropy_at(chain.R, chain.p, q)
                # The sixth root of a determinant's rounding, 1e-16, is 2e-3 at a singularity.
                assert isotropy == pytest.approx(exact, abs=1e-9 if exact > 0.05 else 3e-3)
                seen += 1
    assert seen > 100


def test_every_posture_is_among_the_solutions(arm, rng):
    # Completeness: at the value of the free joint, one branch gives the other six joints.
    chain, free = arm.chain, free_joint(arm.chain)
    worst = []
    for _ in range(500):
        q = random_joints(rng, chain)
        errors = [
            np.max(np.abs(around(found - q)))
            for found, slack, _ in kernel_solutions(chain, arm.tool_pose(q), q[free])
            # At a limit the slack is a difference of cosines, off by some 1e-12 at most.
            if slack >= -1e-12
        ]
        worst.append(min(errors))
    # sqrt(1 - c^2) near c = 1 halves the digits: 1e-16 becomes 1e-8 where a branch ends.
    assert max(worst) < 1e-6
    # TIAGo's URDF rounds angles to 12 digits, so its axes 2 and 3 miss each other by 4e-13 m.
    assert np.median(worst) < 1e-11


def test_the_solutions_are_those_of_the_reference(arm, rng):
    chain, free = arm.chain, free_joint(arm.chain)
    for _ in range(40):
        q = random_joints(rng, chain)
        X_AG = arm.tool_pose(q)
        angle = rng.uniform(-3.0, 3.0)
        expected = solutions(chain, X_AG, angle)
        branches = arm_solver(chain).branches
        for branch, (found, slack, _) in zip(
            branches, kernel_solutions(chain, X_AG, angle), strict=True
        ):
            exact = expected[tuple(branch)]
            if abs(exact.slack) > 1e-9:
                assert (slack >= 0) == (exact.slack >= 0)
            if exact.slack > 1e-6:
                np.testing.assert_allclose(around(found - exact.q), 0.0, atol=1e-8)
                assert found[free] == pytest.approx(angle, abs=1e-15)
