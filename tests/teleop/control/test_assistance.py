from __future__ import annotations

import numpy as np
import pytest

from tcs.teleop import Command, Mode, Teleoperation, load_arm
from tcs.teleop.control.assistance import isotropy_gradient, posture_rates
from tcs.teleop.control.state import range_fraction


def log_isotropy(arm, joints):
    J = arm.kinematics(joints).jacobian
    square = J @ J.T
    return np.linalg.slogdet(square)[1] / 6 - np.log(np.trace(square) / 6)


@pytest.mark.parametrize("name", ["iiwa7", "pr2", "tiago"])
def test_the_gradient_is_the_derivative_of_log_isotropy(name, rng):
    arm, step = load_arm(name), 1e-5
    for joints in arm.random_joints(rng, 30):
        J = arm.kinematics(joints).jacobian
        if np.linalg.svd(J, compute_uv=False)[-1] < 0.05:
            # There the inverse is damped on purpose.
            continue
        change = [
            (log_isotropy(arm, joints + step * e) - log_isotropy(arm, joints - step * e))
            / (2 * step)
            for e in np.eye(7)
        ]
        # Damping of 1e-6 of the trace, of size 7, against squares of 0.05: 0.3 %.
        np.testing.assert_allclose(isotropy_gradient(J), change, rtol=0.01, atol=1e-3)


def test_the_gradient_is_finite_at_a_singularity(iiwa):
    assert np.isfinite(isotropy_gradient(iiwa.kinematics(np.zeros(7)).jacobian)).all()


@pytest.mark.parametrize("side", [-1, 1])
def test_a_joint_near_a_limit_moves_away_from_it(iiwa, ready, side):
    for joint in range(7):
        joints = ready.copy()
        joints[joint] = side * (iiwa.upper[joint] - 0.02)
        rates = posture_rates(iiwa, joints, iiwa.kinematics(joints).jacobian, 0.3)
        assert side * rates[joint] < -0.2
        assert np.abs(rates).max() <= 0.9 + 1e-12


def test_rates_are_finite_at_a_limit_and_without_limits(iiwa):
    for arm, joints in [(iiwa, iiwa.upper.copy()), (load_arm("pr2"), np.full(7, 40.0))]:
        rates = posture_rates(arm, joints, arm.kinematics(joints).jacobian, 0.3)
        assert np.isfinite(rates).all()


def test_range_fractions_run_from_limit_to_limit():
    arm = load_arm("pr2")
    lower, upper = (np.where(arm.bounded, x, 9.0) for x in (arm.lower, arm.upper))
    expected = np.where(arm.bounded, 1.0, 0.5)
    np.testing.assert_allclose(range_fraction(arm, upper), expected)
    np.testing.assert_allclose(range_fraction(arm, lower), 1.0 - expected)


def test_a_stretched_arm_is_reported_without_a_joint(iiwa, ready):
    session = Teleoperation(iiwa, ready, mode=Mode.ASSISTED)
    reasons = {session.step(Command(linear=(0.1, 0, 0))).reason for _ in range(900)}
    assert reasons == {"", "the arm is fully stretched: the tool cannot move in that direction."}
