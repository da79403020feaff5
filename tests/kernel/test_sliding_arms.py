"""Arms of three prismatic and three revolute joints: closed form, kinematics, coupled links."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.errors import ArmClassError
from tcs.kernel.arrays import Chain
from tcs.kernel.kinematics import jacobian as kernel_jacobian
from tcs.kernel.problem import with_slides
from tcs.kernel.six_joints.arm import six_joint_arm
from tcs.kernel.six_joints.solutions import six_joint_solutions
from tcs.kernel.verification.newton_solutions import newton_solutions, within
from tests.kernel.shapes import about, around, rotation
from tests.reference.kinematics import coupled_pose, jacobian, link_poses

ORDERS = {"slides first": (1, 2, 3), "mixed": (1, 4, 6), "slides last": (4, 5, 6)}


def sliding_chain(order, seed):
    """Return a random arm with prismatic joints at these indices."""
    rng = np.random.default_rng(seed)
    R, p = np.array([rotation(rng) for _ in range(8)]), rng.uniform(-0.3, 0.3, (8, 3))
    slides, lower, upper = np.zeros(7), np.full(7, -2.5), np.full(7, 2.0)
    slides[list(order)] = 1.0, 4.0, 1.0
    lower[0], upper[0] = -np.inf, np.inf
    return Chain(R, p, lower, upper, 6, slides)


def drawn(rng, chain):
    q = rng.uniform(np.maximum(chain.lower, -1), np.minimum(chain.upper, 1))
    q[0] = 0.0
    return q, link_poses(chain, q)[-1]


def apart(q, other, chain):
    off = q - other
    return np.abs(np.where(chain.slides > 0, off, around(off))).max()


@pytest.mark.parametrize("name", ORDERS)
def test_every_posture_is_among_the_solutions_of_its_pose(name, rng):
    for seed in range(5):
        chain = sliding_chain(ORDERS[name], seed)
        arm = six_joint_arm(chain)
        for _ in range(20):
            q, (R, p) = drawn(rng, chain)
            found = six_joint_solutions(arm, R, p)
            assert min(apart(q, other, chain) for other in found) < 1e-6
            for other in found:
                S, s = link_poses(chain, other)[-1]
                np.testing.assert_allclose(S, R, atol=1e-7)
                np.testing.assert_allclose(s, p, atol=1e-7)


@pytest.mark.parametrize("name", ORDERS)
def test_newtons_method_finds_the_same_solutions(name):
    chain, rng = sliding_chain(ORDERS[name], 7), np.random.default_rng(0)
    _, (R, p) = drawn(rng, chain)
    found = six_joint_solutions(six_joint_arm(chain), R, p)
    expected = within(chain, newton_solutions(chain, R, p))
    assert len(found) == len(expected) > 0
    assert all(min(apart(q, other, chain) for other in found) < 1e-6 for q in expected)


@pytest.mark.parametrize("name", ORDERS)
def test_jacobian_is_the_change_of_the_tool_pose(name, rng):
    chain = sliding_chain(ORDERS[name], 3)
    q, (R, p) = drawn(rng, chain)
    J = np.empty((6, 7))
    kernel_jacobian(chain.R.copy(), with_slides(chain), q, J)
    np.testing.assert_allclose(J[:, 1:], jacobian(chain, q), atol=1e-12)
    step = 1e-6
    for i in range(1, 7):
        moved = q.copy()
        moved[i] += step
        S, s = link_poses(chain, moved)[-1]
        E = (S @ R.T - np.eye(3)) / step
        expected = [E[2, 1], E[0, 2], E[1, 0], *((s - p) / step)]
        # Forward differences of unit curvature.
        np.testing.assert_allclose(J[:, i], expected, atol=1e-5)


def test_a_coupled_link_makes_a_fraction_of_the_motion():
    chain = sliding_chain((1, 2, 3), 1)._replace(coupled=np.array([[2.0, 0.25], [2.0, 0.5]]))
    q = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    poses = link_poses(chain, q)
    rest = q.copy()
    rest[2] = 0.0
    begin, tip = link_poses(chain, rest)[2][1], poses[2][1]
    for frame, fraction in ((8, 0.25), (9, 0.5)):
        R, p = coupled_pose(chain, q, poses, frame)
        np.testing.assert_allclose(p, begin + fraction * (tip - begin), atol=1e-12)
        np.testing.assert_array_equal(R, poses[2][0])
    assert np.linalg.norm(tip - begin) == pytest.approx(0.8)


def test_unsupported_arms_are_refused_in_a_line():
    chain = sliding_chain((1, 2, 3), 0)
    two = chain._replace(slides=np.array([0, 1.0, 1, 0, 0, 0, 0]))
    with pytest.raises(ArmClassError, match="2 prismatic joints among six"):
        six_joint_arm(two)
    R = chain.R.copy()
    R[5] = about(np.array([0, 0, 1.0]), 0.3)
    with pytest.raises(ArmClassError, match="parallel"):
        six_joint_arm(chain._replace(R=R))
