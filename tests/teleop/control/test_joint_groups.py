from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

from tcs.teleop import Settings, load_arm
from tcs.teleop.control.joint_groups import (
    bounded_group_motion,
    elbow_direction,
    group_motion,
    holding_rates,
)

GROUPS = Settings().groups


def outside(group):
    return [joint for joint in range(7) if joint not in group]


@given(seed=st.integers(0, 10**6), group=st.sampled_from(GROUPS))
def test_a_group_moves_while_the_tool_is_held(iiwa, seed, group):
    joints = iiwa.random_joints(np.random.default_rng(seed), 1)[0]
    J = iiwa.kinematics(joints).jacobian[3:]
    motion = group_motion(J, group, 0.4)
    assert motion.rates[group[0]] == 0.4
    # Rates reach some hundred rad/s where a group is nearly locked, rounded to 1e-14 of that.
    assert np.linalg.norm(J @ motion.rates) < 1e-10
    assert motion.slip < 1e-10
    assert motion.exact == (not motion.rates[outside(group)].any())


@pytest.mark.parametrize("group", GROUPS)
def test_no_motion_that_holds_the_tool_moves_less_outside_the_group(iiwa, group, rng):
    others = outside(group)
    for joints in iiwa.random_joints(rng, 20):
        J = iiwa.kinematics(joints).jacobian[3:]
        followers = np.linalg.svd(J[:, group[1:]], compute_uv=False)
        if followers.min(initial=1.0) < 0.002:
            # There, and only there, their own rates are weighted as well.
            continue
        motion = group_motion(J, group, 1.0)
        free = np.delete(np.arange(7), group[0])
        *_, Vt = np.linalg.svd(J[:, free])
        # Any other such motion differs by something in the null space of the other six joints.
        for direction in Vt[3:]:
            for step in (1e-3, -1e-3):
                other = motion.rates.copy()
                other[free] += step * direction
                assert np.linalg.norm(J @ other) < 1e-9
                gain = np.linalg.norm(motion.rates[others]) - np.linalg.norm(other[others])
                assert gain < 1e-12


def test_a_general_solver_finds_the_same_motion(iiwa, ready):
    group, joints = (1, 3, 5), ready + np.array([0.3, 0, 0.4, 0, -0.5, 0, 0])
    J = iiwa.kinematics(joints).jacobian[3:]
    others = outside(group)
    found = minimize(
        lambda rates: (rates[others] ** 2).sum(),
        np.zeros(7),
        constraints=[
            {"type": "eq", "fun": lambda rates: J @ rates},
            {"type": "eq", "fun": lambda rates: rates[group[0]] - 1.0},
        ],
        options={"ftol": 1e-14, "maxiter": 300},
    ).x
    ours = group_motion(J, group, 1.0).rates
    # SLSQP stops where the sum of squares changes by 1e-14, the rates then by its root.
    np.testing.assert_allclose(ours[others], found[others], atol=1e-5)


class TestWhichPosturesAreExact:
    @pytest.mark.parametrize("name", ["iiwa7", "panda"])
    def test_group_1_always_on_a_spherical_shoulder(self, name, rng):
        arm = load_arm(name)
        exact = [
            group_motion(arm.kinematics(joints).jacobian[3:], GROUPS[0], 1.0).exact
            for joints in arm.random_joints(rng, 300)
        ]
        # Except in postures in which joints 2 and 3 are nearly singular: 0.7 % were measured.
        assert np.mean(exact) > 0.97

    def test_group_1_never_on_a_shoulder_with_an_offset(self, rng):
        arm = load_arm("pr2")
        for joints in arm.random_joints(rng, 50):
            assert not group_motion(arm.kinematics(joints).jacobian[3:], GROUPS[0], 1.0).exact

    @pytest.mark.parametrize("group", [GROUPS[1], GROUPS[2]])
    def test_groups_2_and_3_where_the_arm_lies_in_a_plane(self, iiwa, group, rng):
        flat, bent = [], []
        for joints in iiwa.random_joints(rng, 200):
            bent.append(group_motion(iiwa.kinematics(joints).jacobian[3:], group, 1.0).exact)
            joints[[2, 4]] = 0.0
            flat.append(group_motion(iiwa.kinematics(joints).jacobian[3:], group, 1.0).exact)
        assert np.mean(flat) > 0.95
        assert not any(bent)

    @pytest.mark.parametrize("name", ["iiwa7", "panda", "pr2", "tiago"])
    def test_group_4_wherever_the_tool_lies_on_the_last_axis(self, name, rng):
        arm = load_arm(name)
        for joints in arm.random_joints(rng, 50):
            motion = group_motion(arm.kinematics(joints).jacobian[3:], GROUPS[3], 1.0)
            assert motion.exact
            np.testing.assert_array_equal(motion.rates, np.eye(7)[6])


def test_a_group_that_cannot_hold_the_tool_reports_the_slip(iiwa, ready):
    J = iiwa.kinematics(ready).jacobian[3:].copy()
    # As with joints 3 to 7 locked.
    J[:, 2:] = 0.0
    motion = group_motion(J, GROUPS[0], 1.0)
    assert motion.slip == pytest.approx(np.linalg.norm(J @ motion.rates))
    assert motion.slip > 0.1
    assert not motion.exact


class TestBounded:
    free = np.full(7, np.inf)

    @pytest.mark.parametrize("group", GROUPS)
    def test_without_bounds_it_is_the_motion_of_the_group(self, iiwa, ready, group):
        J = iiwa.kinematics(ready + np.array([0.2, 0.1, 0.3, 0, 0.4, 0, 0])).jacobian[3:]
        plain = group_motion(J, group, 0.4).rates
        rates, held = bounded_group_motion(J, group, 0.4, -self.free, self.free)
        assert not held.any()
        # Weights in place of strict order: followers count a thousandth of the others, so the
        # others help where followers race.
        np.testing.assert_allclose(rates, plain, atol=0.1 * np.abs(plain).max())
        assert np.linalg.norm(J @ rates) < 1e-6

    def test_the_tool_is_held_within_any_bounds(self, iiwa, rng):
        slowed = 0
        for joints in iiwa.random_joints(rng, 200):
            J = iiwa.kinematics(joints).jacobian[3:]
            lower = np.where(rng.random(7) < 0.5, 0.0, -np.inf)
            upper = np.where(rng.random(7) < 0.5, 0.0, np.inf)
            upper[0] = np.inf
            rates, held = bounded_group_motion(J, GROUPS[0], 0.4, lower, upper)
            assert ((rates >= lower) & (rates <= upper)).all()
            assert not rates[held].any()
            # What the lead joint's missing 0.4 rad/s pulls with, through a weak direction.
            assert np.linalg.norm(J @ rates) < 1e-4
            slowed += rates[0] < 1e-3
        # Some bounds leave a motion, others none.
        assert 20 < slowed < 180


def test_drift_is_corrected_during_the_motion(iiwa, ready):
    J = iiwa.kinematics(ready + 0.2).jacobian[3:]
    velocity = np.array([0.01, -0.02, 0.005])
    motion = group_motion(J, GROUPS[0], 0.3, velocity)
    np.testing.assert_allclose(J @ motion.rates, velocity, atol=1e-13)


def test_rates_are_continuous_where_the_weights_begin(iiwa):
    # In nearly stretched postures joints 2 and 3 hardly move the tool; rates change continuously.
    rates = []
    for bend in np.linspace(0.004, 0.02, 400):
        joints = np.array([0.3, 0.5, 0.2, -bend, 0.0, 0.0, 0.0])
        rates.append(group_motion(iiwa.kinematics(joints).jacobian[3:], GROUPS[0], 1.0).rates)
    rates = np.array(rates)
    jumps = np.abs(np.diff(rates, axis=0)).max(axis=1)
    # No step between neighbours is more than a few times the one next to it.
    assert (jumps[1:] < 3.0 * jumps[:-1] + 1e-2).all()


def test_the_basis_is_seven_by_four_and_spans_the_null_space(iiwa, ready):
    J = iiwa.kinematics(ready + 0.2).jacobian[3:]
    N = np.stack([group_motion(J, group, 1.0).rates for group in GROUPS], axis=1)
    assert N.shape == (7, 4)
    assert np.linalg.matrix_rank(N) == 4
    np.testing.assert_allclose(J @ N, 0.0, atol=1e-12)
    np.testing.assert_array_equal([N[g[0], i] for i, g in enumerate(GROUPS)], np.ones(4))


def test_rates_that_hold_the_tool_are_the_closest_ones_between_the_bounds(iiwa, ready, rng):
    J = iiwa.kinematics(ready + 0.2).jacobian[3:]
    desired = rng.normal(size=7)
    bounds = np.full(7, 0.4)
    rates = holding_rates(J, desired, np.zeros(3), desired - bounds, desired + bounds)
    np.testing.assert_allclose(J @ rates, 0.0, atol=1e-5)
    assert (np.abs(rates - desired) <= bounds).all()
    closest = minimize(
        lambda x: ((x - desired) ** 2).sum(),
        desired,
        bounds=np.transpose([desired - bounds, desired + bounds]),
        constraints={"type": "eq", "fun": lambda x: J @ x},
    )
    np.testing.assert_allclose(rates, closest.x, atol=1e-4)


class TestElbow:
    def test_it_holds_the_whole_pose(self, iiwa, rng):
        for joints in iiwa.random_joints(rng, 50):
            J = iiwa.kinematics(joints).jacobian
            direction = elbow_direction(J)
            np.testing.assert_allclose(J @ direction, 0.0, atol=1e-10)
            assert np.abs(direction).max() == pytest.approx(1.0)

    def test_it_never_changes_sign(self, iiwa, ready):
        joints, before = ready + 0.1, None
        # More than a whole turn of the elbow, no limits: back where it was.
        for _ in range(3000):
            direction = elbow_direction(iiwa.kinematics(joints).jacobian)
            if before is not None:
                assert direction @ before > 0.0
            before = direction
            joints = joints + 0.005 * direction

    def test_it_is_the_vector_of_minors(self, iiwa, ready):
        J = iiwa.kinematics(ready + 0.1).jacobian
        minors = [(-1) ** (6 + i) * np.linalg.det(np.delete(J, i, axis=1)) for i in range(7)]
        expected = np.array(minors) / np.abs(minors).max()
        np.testing.assert_allclose(elbow_direction(J), expected, atol=1e-12)
