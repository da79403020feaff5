from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear
from scipy.spatial.transform import Rotation

from tcs.teleop.control.bounds import rate_bounds
from tcs.teleop.control.resolved_rate import (
    clamped_rates,
    pose_error,
    resolved_rates,
    rotated,
    rotation_vector,
    smallest_singular_value,
)

LENGTH = 0.1


@given(seed=st.integers(0, 10**6), angle=st.floats(0.0, np.pi - 1e-6))
def test_rotation_vector_is_axis_times_angle(seed, angle):
    axis = np.random.default_rng(seed).normal(size=3)
    vector = angle * axis / np.linalg.norm(axis)
    R = Rotation.from_rotvec(vector).as_matrix()
    # A matrix knows its angle to the root of rounding near half a turn, to rounding elsewhere.
    tolerance = 1e-12 if angle < 3.0 else 1e-7
    np.testing.assert_allclose(rotation_vector(R), vector, atol=tolerance)


def test_half_a_turn_has_a_rotation_vector_too():
    R = np.diag([-1.0, 1.0, -1.0])
    np.testing.assert_allclose(np.abs(rotation_vector(R)), [0.0, np.pi, 0.0], atol=1e-7)


def test_the_identity_has_a_zero_rotation_vector():
    assert not rotation_vector(np.eye(3)).any()


@given(seed=st.integers(0, 10**6), time=st.floats(0.0, 2.0))
def test_rotation_agrees_with_scipy(seed, time):
    rng = np.random.default_rng(seed)
    R = Rotation.random(rng=rng).as_matrix()
    twist = rng.normal(size=3)
    exact = Rotation.from_rotvec(time * twist).as_matrix() @ R
    np.testing.assert_allclose(rotated(R, twist, time), exact, atol=1e-13)


@given(seed=st.integers(0, 10**6))
def test_rotation_by_the_error_takes_the_tool_to_its_target(seed):
    rng = np.random.default_rng(seed)
    R, R_target = (Rotation.random(rng=rng).as_matrix() for _ in range(2))
    p, p_target = rng.normal(size=(2, 3))
    error = pose_error(R_target, p_target, R, p)
    # As far as the rotation vector knows its angle near half a turn.
    np.testing.assert_allclose(rotated(R, error[:3], 1.0), R_target, atol=1e-6)
    np.testing.assert_allclose(p + error[3:], p_target, atol=1e-14)


def test_a_difference_of_quaternions_would_lead_elsewhere():
    # Why the printed equation is not used: it rotates about another axis, half as fast.
    R, R_target = np.eye(3), Rotation.from_rotvec([1.0, 0.5, 0.0]).as_matrix()
    here, there = (Rotation.from_matrix(M).as_quat(scalar_first=True) for M in (R, R_target))
    start = Rotation.from_rotvec([0.0, 0.0, 1.0]).as_matrix()
    turned_here, turned_there = (
        Rotation.from_matrix(M @ start).as_quat(scalar_first=True) for M in (R, R_target)
    )
    difference, turned = (there - here)[1:], (turned_there - turned_here)[1:]
    exact = pose_error(R_target, np.zeros(3), R, np.zeros(3))[:3]
    assert np.linalg.norm(difference) < 0.55 * np.linalg.norm(exact)
    # The same rotation of the tool, from another orientation: the error is the same, the
    # difference of quaternions is not.
    again = pose_error(R_target @ start, np.zeros(3), R @ start, np.zeros(3))[:3]
    np.testing.assert_allclose(again, exact, atol=1e-12)
    assert np.linalg.norm(turned - difference) > 0.1


@given(seed=st.integers(0, 10**6))
def test_resolved_rates_are_the_pseudo_inverse(iiwa, seed):
    rng = np.random.default_rng(seed)
    J = iiwa.kinematics(iiwa.random_joints(rng, 1)[0]).jacobian
    twist = rng.normal(size=6)
    rates, smallest = resolved_rates(J, twist)
    # Random postures come as close to a singularity as 1e-3.
    np.testing.assert_allclose(rates, np.linalg.pinv(J) @ twist, rtol=1e-8, atol=1e-8)
    assert smallest == pytest.approx(np.linalg.svd(J, compute_uv=False)[-1])


def test_the_length_leaves_the_pseudo_inverse_as_it_is(iiwa, ready):
    J, twist = iiwa.kinematics(ready).jacobian, np.arange(6.0)
    ours, _ = resolved_rates(J, twist, length=0.1)
    np.testing.assert_allclose(ours, np.linalg.pinv(J) @ twist, atol=1e-11)


def test_damping_bounds_the_rates_at_a_singularity_and_does_nothing_elsewhere(iiwa, ready):
    settings = {"length": LENGTH, "damping": 0.02, "singular": 0.02}
    J = iiwa.kinematics(ready).jacobian
    twist = np.array([0.0, 0, 0, 0.1, 0, 0])
    plain, _ = resolved_rates(J, twist)
    damped, _ = resolved_rates(J, twist, **settings)
    np.testing.assert_allclose(damped, plain, atol=1e-12)
    # Stretched out, elbow and wrist nearly straight: the outward direction is singular.
    straight = ready.copy()
    straight[3], straight[5] = 1e-6, 1e-6
    J = iiwa.kinematics(straight).jacobian
    outwards = np.concatenate([np.zeros(3), iiwa.kinematics(straight).R[:, 0]])
    wild, _ = resolved_rates(J, 0.1 * outwards)
    calm, smallest = resolved_rates(J, 0.1 * outwards, **settings)
    assert smallest < 1e-4
    assert np.abs(wild).max() > 100.0
    # Damped least squares give at most |V| / (2 damping).
    assert np.linalg.norm(calm) <= 0.1 / (2 * 0.02)


def test_the_smallest_singular_value(iiwa, ready):
    straight = np.zeros(7)
    J = iiwa.kinematics(straight).jacobian
    assert smallest_singular_value(J, LENGTH) < 1e-12
    assert smallest_singular_value(J[3:], LENGTH) < 1e-12
    J = iiwa.kinematics(ready).jacobian
    assert smallest_singular_value(J, LENGTH) > 0.05


class TestClamped:
    def test_with_one_joint_at_its_limit_the_tool_moves_as_commanded(self, iiwa, rng):
        # Joint 4 alone stretches the arm, so any other may be held without losing a direction.
        for joints in iiwa.random_joints(rng, 200):
            held = int(rng.choice([0, 1, 2, 4, 5, 6]))
            joints[held] = iiwa.upper[held]
            J = iiwa.kinematics(joints).jacobian
            free = np.delete(np.arange(7), held)
            if np.linalg.svd(J[:, free], compute_uv=False)[-1] < 0.05:
                continue
            lower, upper = rate_bounds(iiwa, joints, 0.01, 5.0)
            lower[free], upper[free] = -np.inf, np.inf
            twist = 0.1 * rng.normal(size=6)
            rates, _ = clamped_rates(J, twist, lower, upper, length=LENGTH)
            assert rates[held] <= 0.0
            # The added 1e-8 shifts a motion by 1e-8 / (0.05 * 0.1)^2 of itself at most.
            np.testing.assert_allclose(J @ rates, twist, atol=1e-3 * np.abs(twist).max())

    def test_without_a_bound_in_the_way_it_is_the_pseudo_inverse(self, iiwa, ready):
        J, twist = iiwa.kinematics(ready).jacobian, np.array([0.1, 0, 0.2, 0.1, 0.05, -0.1])
        free = np.full(7, 10.0)
        rates, held = clamped_rates(J, twist, -free, free, length=LENGTH)
        np.testing.assert_allclose(rates, np.linalg.pinv(J) @ twist, atol=1e-5)
        assert not held.any()

    def test_with_several_at_their_limits_nothing_comes_closer(self, iiwa, rng):
        weights = np.repeat([LENGTH, 1.0], 3)
        for joints in iiwa.random_joints(rng, 50):
            J = iiwa.kinematics(joints).jacobian
            lower, upper = -rng.random(7), rng.random(7)
            lower[rng.random(7) < 0.4] = -1e-9
            upper[rng.random(7) < 0.4] = 1e-9
            twist = rng.normal(size=6)
            ours, _ = clamped_rates(J, twist, lower, upper, length=LENGTH)
            theirs = lsq_linear(weights[:, None] * J, weights * twist, (lower, upper)).x
            off = [np.linalg.norm(weights * (J @ rates - twist)) for rates in (ours, theirs)]
            # The regularisation may cost 1e-8 |rates|^2.
            assert off[0] <= off[1] + 1e-6
