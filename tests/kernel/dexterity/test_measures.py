"""Jacobian and isotropy at given joints, and rounding within the limits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tcs.kernel.dexterity.measures import isotropy_at, rounded_inward
from tcs.kernel.kinematics import jacobian
from tcs.kernel.verification import plain_dexterity
from tests.kernel.arms import drake_arm
from tests.kernel.shapes import random_arm, random_joints, turned_by
from tests.reference import kinematics as reference

STEP = 1e-6


@pytest.fixture(params=["pr2", "panda", *range(8)], ids=str)
def chain(request, lowered):
    """Real arms and random arms."""
    if request.param == "pr2":
        return lowered.arrays.chain
    if request.param == "panda":
        return drake_arm("panda").chain
    return random_arm(np.random.default_rng(request.param))


def kernel_jacobian(chain, q):
    J = np.full((6, 7), np.nan)
    jacobian(chain.R, chain.p, q, J)
    return J


def test_jacobian_is_the_derivative_of_the_tool_pose(chain, rng):
    for _ in range(10):
        q = random_joints(rng, chain)
        J = kernel_jacobian(chain, q)
        for i in range(7):
            after, before = (
                reference.link_poses(chain, q + sign * STEP * np.eye(7)[i])[-1] for sign in (1, -1)
            )
            # Central differences: STEP^2 plus rounding 1e-16 / STEP.
            velocity = (after[1] - before[1]) / (2 * STEP)
            np.testing.assert_allclose(J[3:, i], velocity, atol=1e-8)
            spin = turned_by(after[0] @ before[0].T) / (2 * STEP)
            np.testing.assert_allclose(J[:3, i], spin, atol=1e-8)


def test_jacobian_agrees_with_the_reference(chain, rng):
    for _ in range(20):
        q = random_joints(rng, chain)
        # The same sums in another order.
        exact = reference.jacobian(chain, q)
        np.testing.assert_allclose(kernel_jacobian(chain, q), exact, atol=1e-13)


def test_jacobian_agrees_with_drake(scene, lowered, full_grid, rng):
    chain = lowered.arrays.chain
    torso = full_grid.axis("torso").values
    for level in range(len(torso)):
        x, y, yaw = rng.uniform(-2, 2, 3)
        scene.place_base(x, y, yaw)
        scene.set_torso(torso[level])
        R_WA = reference.rot_z(yaw) @ lowered.arrays.arm_base_R[level]
        for _ in range(5):
            q = random_joints(rng, chain)
            scene.set_arm(q)
            ours = kernel_jacobian(chain, q)
            turned = np.vstack([R_WA @ ours[:3], R_WA @ ours[3:]])
            # A dozen products of rotations.
            np.testing.assert_allclose(turned, scene.tool_jacobian(), atol=1e-12)


def test_isotropy_is_the_equation(chain, rng):
    for _ in range(50):
        q = random_joints(rng, chain)
        exact = plain_dexterity.isotropy(reference.jacobian(chain, q))
        assert 0.0 <= exact <= 1.0
        # Determinants good to 1e-15 of the largest term; the sixth root of that is 3e-3 at zero.
        expected = pytest.approx(exact, abs=1e-10 if exact > 0.1 else 3e-3)
        assert isotropy_at(chain.R, chain.p, q) == expected


def test_isotropy_does_not_depend_on_the_first_joint(chain, rng):
    # A rotation of the whole arm about its first axis only rotates the Jacobian.
    q = random_joints(rng, chain)
    values = []
    for first in rng.uniform(-3, 3, 10):
        q[0] = first
        values.append(isotropy_at(chain.R, chain.p, q))
    # Rounding, magnified where the value is small.
    np.testing.assert_allclose(values, values[0], rtol=1e-9, atol=1e-9)


def test_isotropy_is_zero_where_the_arm_is_singular(lowered):
    chain = lowered.arrays.chain
    # Elbow and wrist straight and the shoulder level: axes 1 .. 7 leave a direction out.
    assert isotropy_at(chain.R, chain.p, np.zeros(7)) < 3e-3
    assert plain_dexterity.isotropy(reference.jacobian(chain, np.zeros(7))) < 3e-3


@given(
    st.lists(st.floats(-7.0, 7.0), min_size=7, max_size=7),
    st.lists(st.floats(-7.0, 7.0), min_size=7, max_size=7),
    st.integers(0, 2**7 - 1),
)
def test_rounding_never_passes_a_limit(lower, width, which):
    lower = np.array(lower)
    upper = lower + np.abs(width) + 1e-4
    q = np.where([(which >> i) & 1 for i in range(7)], lower, upper)
    out = np.full(7, np.nan)
    rounded_inward(q, lower, upper, out)
    assert np.all((out >= lower) & (out <= upper))
    np.testing.assert_array_equal(out, out.astype(np.float32))
    # One float32 spacing, 2^-23 of up to 16.
    np.testing.assert_allclose(out, q, atol=1e-6)


def test_rounding_leaves_joints_without_limits_alone():
    q = np.linspace(-3.1, 3.1, 7)
    out = np.full(7, np.nan)
    rounded_inward(q, np.full(7, -np.inf), np.full(7, np.inf), out)
    np.testing.assert_array_equal(out, q.astype(np.float32).astype(np.float64))
