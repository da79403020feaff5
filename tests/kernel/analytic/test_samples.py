"""The closed form in samples: against forward kinematics and against the plain-loop reference."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.kernel.analytic.ik import sample_joints, within, wrist_goal
from tcs.kernel.analytic.solver import arm_solver
from tcs.kernel.verification.plain_dexterity import isotropy
from tests.chosen import some_of
from tests.kernel.arms import drake_arm
from tests.kernel.sampled import slack_and_measure
from tests.kernel.shapes import around, random_arm, random_joints, rotation
from tests.reference.kinematics import free_joint, jacobian, link_poses, solutions

WRISTS, SHOULDERS = range(12), [f"shoulder {i}" for i in range(12)]
ARMS = [
    *("pr2", "tiago", "panda"),
    *some_of(WRISTS, *WRISTS[:4]),
    *some_of(SHOULDERS, *SHOULDERS[:4]),
]


@pytest.fixture(params=ARMS, ids=str)
def chain(request, lowered):
    """Real arms, and random arms of either class with random limits."""
    if request.param == "pr2":
        return lowered.arrays.chain
    if request.param in ("tiago", "panda"):
        return drake_arm(request.param).chain
    spherical_shoulder = isinstance(request.param, str)
    seed = int(request.param.split()[1]) if spherical_shoulder else request.param
    return random_arm(np.random.default_rng(seed), spherical_shoulder=spherical_shoulder)


def goal_of(arm, X_AG):
    goal = np.full((4, 3), np.nan)
    wrist_goal(arm, X_AG[0], X_AG[1], goal)
    return goal


def is_regular(arm, chain, q):
    """Return whether small errors stay small: neither elbow, aim nor wrist is close to straight.

    Errors of 1e-16 in a cosine grow to 1e-16/sine in its angle.
    """
    found = solutions(chain, link_poses(chain, q)[-1], q[free_joint(chain)])
    own = min(np.max(np.abs(around(s.q - q))) for s in found.values())
    return own < 1e-7 and isotropy(jacobian(chain, q)) > 0.02


def test_some_branch_returns_the_joints_that_made_the_goal(chain, rng):
    arm = arm_solver(chain)
    regular, free = 0, free_joint(chain)
    for _ in range(100):
        q = random_joints(rng, chain)
        goal = goal_of(arm, link_poses(chain, q)[-1])
        errors = []
        for branch in arm.branches:
            slack, _ = slack_and_measure(arm, goal, branch, q[free])
            joints = np.empty(7)
            sample_joints(arm, goal, branch, q[free], joints)
            # At a limit the slack is a difference of cosines, off by some 1e-12 at most.
            if slack[0] >= -1e-12:
                errors.append(np.max(np.abs(around(joints - q))))
        if is_regular(arm, chain, q):
            regular += 1
            # sqrt(1 - c^2) near c = 1 halves the digits: 1e-16 becomes 1e-8 at the worst.
            assert min(errors) < 1e-7
    assert regular > 30


def test_every_feasible_sample_reaches_the_goal_within_the_limits(chain, rng):
    arm = arm_solver(chain)
    seen = 0
    for _ in range(60):
        X_AG = link_poses(chain, random_joints(rng, chain))[-1]
        goal = goal_of(arm, X_AG)
        angles = rng.uniform(-np.pi, np.pi, 60)
        for branch in arm.branches:
            slack, measure = slack_and_measure(arm, goal, branch, angles)
            for angle, value in zip(angles[slack >= 0], measure[slack >= 0], strict=True):
                q = np.empty(7)
                sample_joints(arm, goal, branch, angle, q)
                R, p = link_poses(chain, q)[-1]
                # Forward kinematics of angles good to 1e-10 over arms of about 2 m.
                np.testing.assert_allclose(R, X_AG[0], atol=1e-9)
                np.testing.assert_allclose(p, X_AG[1], atol=1e-9)
                assert np.all((q >= chain.lower) & (q <= chain.upper))
                exact = isotropy(jacobian(chain, q))
                # The sixth root of a determinant's rounding, 1e-16, is 2e-3 at a singularity.
                assert value ** (1 / 6) == pytest.approx(exact, abs=1e-9 if exact > 0.05 else 3e-3)
                seen += 1
    assert seen > 20


def test_samples_agree_with_the_reference_branch_by_branch(chain, rng):
    arm = arm_solver(chain)
    for _ in range(25):
        X_AG = rotation(rng), rng.uniform(-0.7, 0.7, 3)
        goal = goal_of(arm, X_AG)
        for angle in rng.uniform(-np.pi, np.pi, 6):
            expected = solutions(chain, X_AG, angle)
            for branch in arm.branches:
                slack, _ = slack_and_measure(arm, goal, branch, angle)
                exact = expected[tuple(branch)]
                # Differences of cosines, each good to some 1e-15, and the same out of reach, where
                # the search for narrow windows follows them. Where the elbow would be stretched
                # straight along axis 3, the slack is one rounding error over another, below -1e30.
                if exact.slack > -1e6:
                    assert slack[0] == pytest.approx(exact.slack, rel=1e-9, abs=1e-9)
                if abs(exact.slack) > 1e-9:
                    assert (slack[0] >= 0) == (exact.slack >= 0)
                if exact.slack > 1e-6:
                    q = np.empty(7)
                    sample_joints(arm, goal, branch, angle, q)
                    np.testing.assert_allclose(around(q - exact.q), 0.0, atol=1e-8)
    missing = [signs for signs in expected if list(signs) not in arm.branches.tolist()]
    # Branches that are left out never have a solution within the limits.
    for _ in range(50):
        expected = solutions(
            chain, link_poses(chain, random_joints(rng, chain))[-1], rng.uniform(-3, 3)
        )
        assert all(expected[signs].slack < 1e-9 for signs in missing)


def test_slack_is_negative_out_of_reach(chain, rng):
    arm = arm_solver(chain)
    length = np.linalg.norm(chain.p, axis=1).sum()
    for _ in range(20):
        away = rng.normal(size=3)
        goal = goal_of(arm, (rotation(rng), away / np.linalg.norm(away) * (2 * length + 0.1)))
        for branch in arm.branches:
            slack, _ = slack_and_measure(arm, goal, branch, rng.uniform(-3, 3, 20))
            assert np.all(slack < 0)


@pytest.mark.parametrize("name", ["pr2 left", "panda"])
def test_the_free_joint_out_of_its_limits_is_infeasible(name, rng):
    chain = drake_arm(name).chain
    arm, free = arm_solver(chain), free_joint(chain)
    for _ in range(50):
        q = random_joints(rng, chain)
        goal = goal_of(arm, link_poses(chain, q)[-1])
        outside = np.array([chain.lower[free] - 1e-6, chain.upper[free] + 1e-6, np.pi])
        for branch in arm.branches:
            slack, _ = slack_and_measure(arm, goal, branch, outside)
            assert np.all(slack < 0)


@pytest.mark.parametrize("turns", [-3, -1, 0, 2])
def test_within_shifts_an_angle_into_its_limits(turns):
    full = 2 * np.pi
    # A few roundings of an angle of up to 20 rad.
    assert within(1.0 + turns * full, 0.5, 3.0) == pytest.approx(1.0, abs=1e-14)
    assert within(-1.0 + turns * full, 4.5, 6.0) == pytest.approx(full - 1.0, abs=1e-14)
    assert within(-1.0 + turns * full, -np.inf, np.inf) == pytest.approx(-1.0, abs=1e-14)
    assert within(4.0 + turns * full, -np.inf, np.inf) == pytest.approx(4.0 - full, abs=1e-14)
    # Wider than a full turn, and not about zero.
    assert within(-2.0 + turns * full, -1.0, 6.0) == pytest.approx(full - 2.0, abs=1e-14)
    assert within(np.nextafter(3.0, 4.0), 0.5, 3.0) == 3.0
