"""Constants of an arm: its class, its branches, the range of its elbow."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from tcs.errors import ArmClassError
from tcs.kernel.analytic.solver import (
    FIRST,
    LAST,
    _signs_within,
    arm_solver,
    cos_range,
    reversed_chain,
)
from tests.kernel.arms import drake_arm
from tests.kernel.shapes import random_arm, straight_arm
from tests.reference.kinematics import compose, elbow, free_joint, link_poses, rot_z

ends = st.tuples(st.floats(-8.0, 8.0), st.floats(-8.0, 8.0)).map(sorted)


def test_the_pr2_belongs_to_the_class(lowered):
    # Its soft limits leave one side of the elbow and one of the wrist: 2 of 8 branches.
    arm = arm_solver(lowered.arrays.chain)
    assert arm.branches.tolist() == [[-1, 1, -1], [-1, -1, -1]]


@pytest.mark.parametrize(
    ("name", "free"),
    [("pr2 left", FIRST), ("pr2 right", FIRST), ("tiago", FIRST), ("panda", LAST)],
    ids=lambda value: str(value),
)
def test_real_arms_belong_to_one_of_the_classes(name, free):
    chain = drake_arm(name).chain
    assert arm_solver(chain).free == free
    assert free_joint(chain) == free


def test_an_arm_of_both_classes_is_not_reversed():
    # Spherical shoulder and spherical wrist, like a KUKA iiwa: reversed it fits as well.
    chain = straight_arm(np.full(7, 2.0), 0.0)
    assert arm_solver(chain).free == FIRST
    assert arm_solver(reversed_chain(chain)).free == FIRST
    assert free_joint(chain) == FIRST


def test_baxter_is_outside_and_the_message_states_the_distances():
    # Its URDF: shoulder 0.069 m from axis 1, wrist bend 0.01 m from the forearm's axis.
    with pytest.raises(ArmClassError) as caught:
        arm_solver(drake_arm("baxter").chain)
    wrist, shoulder = str(caught.value).split("The spherical-shoulder class")
    assert "5, 6 and 7 in one point, but axes 5 and 6 pass each other 0.01 m apart" in wrist
    assert "axes 1 and 2 pass each other 0.069 m apart" in shoulder
    assert "axes 5 and 6 pass each other 0.01 m apart" in shoulder


@pytest.mark.parametrize("spherical_shoulder", [False, True])
@pytest.mark.parametrize("seed", range(10))
def test_axes_that_pass_each_other_are_refused_with_their_distance(seed, spherical_shoulder):
    rng = np.random.default_rng(seed)
    chain = random_arm(rng, spherical_shoulder=spherical_shoulder)
    i = int(rng.choice([1, 2, 5] if spherical_shoulder else [2, 5, 6]))
    p = chain.p.copy()
    p[i] = rng.normal(scale=0.01, size=3)
    chain = chain._replace(p=p)
    (R, a), (S, b) = link_poses(chain, rng.uniform(-3, 3, 7))[i - 1 : i + 1]
    along = np.stack([R[:, 2], -S[:, 2]], axis=1)
    apart = np.sqrt(np.linalg.lstsq(along, b - a, rcond=None)[1][0])
    # As many digits as the message shows.
    with pytest.raises(
        ArmClassError, match=f"axes {i} and {i + 1} pass each other {apart:.3g} m apart"
    ):
        arm_solver(chain)


@pytest.mark.parametrize(
    ("spherical_shoulder", "row"), [(False, 5), (False, 6), (True, 1), (True, 2)]
)
def test_three_axes_that_meet_in_two_points_are_refused(spherical_shoulder, row, rng):
    chain = random_arm(rng, spherical_shoulder=spherical_shoulder)
    p = chain.p.copy()
    # Along the middle one of the three axes.
    p[row] = 0.004 * (np.eye(3)[2] if row in (2, 6) else chain.R[row][:, 2])
    first, middle, last = (1, 2, 3) if spherical_shoulder else (5, 6, 7)
    expected = rf"axis {middle} meets {first} and {last} 0\.004 m apart"
    with pytest.raises(ArmClassError, match=expected):
        arm_solver(chain._replace(p=p))


def test_parallel_axes_are_refused(rng):
    chain = random_arm(rng)
    R = chain.R.copy()
    R[5] = rot_z(0.4)
    with pytest.raises(ArmClassError, match="axes 5 and 6 are parallel"):
        arm_solver(chain._replace(R=R))


def test_link_frames_beside_the_meeting_point_are_refused(rng):
    chain = random_arm(rng)
    p = chain.p.copy()
    p[2] = 0.1 * chain.R[2][:, 2]
    with pytest.raises(ArmClassError, match="link frames L2, L3 do not lie where their axes meet"):
        arm_solver(chain._replace(p=p))


@pytest.mark.parametrize("seed", range(10))
def test_the_reversed_chain_exchanges_base_and_tool(seed):
    rng = np.random.default_rng(seed)
    chain = random_arm(rng, spherical_shoulder=bool(seed % 2))
    back = reversed_chain(chain)
    for q in rng.uniform(-3, 3, (10, 7)):
        R, p = compose(link_poses(chain, q)[-1], link_poses(back, q[::-1])[-1])
        # Sixteen products of rotations.
        np.testing.assert_allclose(R, np.eye(3), atol=1e-14)
        np.testing.assert_allclose(p, 0.0, atol=1e-14)
    np.testing.assert_array_equal(back.lower[::-1], chain.lower)
    np.testing.assert_array_equal(back.upper[::-1], chain.upper)


def test_an_elbow_that_does_not_bend_the_arm_is_refused(lowered):
    chain = lowered.arrays.chain
    p = chain.p.copy()
    p[4] = 0.0
    with pytest.raises(ArmClassError, match="joint 4"):
        arm_solver(chain._replace(p=p))


@pytest.mark.parametrize("seed", range(20))
def test_reach_is_the_distance_from_shoulder_to_wrist(seed):
    # Offset elbows included: `random_arm` draws all other offsets at random.
    rng = np.random.default_rng(seed)
    chain = random_arm(rng)
    arm = arm_solver(chain)
    for q4 in rng.uniform(-np.pi, np.pi, 20):
        square = float(np.sum((chain.p[3] + chain.R[3] @ rot_z(q4) @ chain.p[4]) ** 2))
        # A handful of products of numbers below 1: rounding stays at 1e-16 each.
        cosine = np.cos(q4 - arm.reach[2])
        assert square == pytest.approx(arm.reach[0] + arm.reach[1] * cosine, abs=1e-14)
        assert elbow(chain, square)[1] == pytest.approx(cosine, abs=1e-10)


@given(ends)
def test_signs_within_are_those_of_a_dense_sampling(interval):
    lower, upper = interval
    inside = np.sin(np.linspace(lower, upper, 2001))
    # Signs of values that rounding cannot flip must be there; zero belongs to both signs.
    signs = _signs_within(lower, upper, True)
    assert (1 in signs) or not np.any(inside > 1e-9)
    assert (-1 in signs) or not np.any(inside < -1e-9)


@given(ends)
def test_signs_within_are_no_more_than_needed(interval):
    lower, upper = interval
    margin = min(abs(np.remainder(end + np.pi / 2, np.pi) - np.pi / 2) for end in interval)
    # An end at a multiple of pi belongs to both halves: either result is correct there.
    assume(margin > 1e-6)
    inside = np.sin(np.append(np.linspace(lower, upper, 2001), [lower, upper]))
    signs = _signs_within(lower, upper, True)
    assert set(signs) == {int(np.sign(value)) for value in inside if value != 0.0}


@given(ends)
def test_cosine_range_is_that_of_a_dense_sampling(interval):
    lower, upper = interval
    least, most = cos_range(lower, upper, True)
    inside = np.cos(np.linspace(lower, upper, 4001))
    # Spacing is at most 16/4000 = 0.004 rad: a cosine changes by 0.004^2/8 = 2e-6 around its
    # extremum between two samples, and is monotonic elsewhere.
    assert least <= inside.min() + 1e-15
    assert most >= inside.max() - 1e-15
    assert least == pytest.approx(inside.min(), abs=3e-6)
    assert most == pytest.approx(inside.max(), abs=3e-6)


def test_a_joint_without_limits_has_both_signs_and_the_whole_range():
    assert _signs_within(-np.inf, np.inf, False) == [1, -1]
    assert cos_range(-np.inf, np.inf, False).tolist() == [-1.0, 1.0]


@pytest.mark.parametrize("seed", range(10))
def test_no_branch_that_occurs_is_left_out(seed):
    rng = np.random.default_rng(seed)
    chain = random_arm(rng)
    arm = arm_solver(chain)
    lower = np.where(np.isfinite(chain.lower), chain.lower, -np.pi)
    upper = np.where(np.isfinite(chain.upper), chain.upper, np.pi)
    kept = {tuple(branch) for branch in arm.branches}
    f, row = chain.R[6][:, 2], chain.R[5][2]
    phase = np.arctan2(row[1] * f[0] - row[0] * f[1], row[0] * f[0] + row[1] * f[1])
    for q4, q6 in rng.uniform(lower[[3, 5]], upper[[3, 5]], (200, 2)):
        signs = int(np.sign(np.sin(q4 - arm.reach[2]))), int(np.sign(np.sin(q6 - phase)))
        assert {(signs[0], 1, signs[1]), (signs[0], -1, signs[1])} <= kept


def test_limits_wider_than_a_turn_are_no_limits(lowered):
    chain = lowered.arrays.chain
    lower, upper = chain.lower.copy(), chain.upper.copy()
    lower[3], upper[3] = -3.2, 3.2
    arm = arm_solver(chain._replace(lower=lower, upper=upper))
    # The numbers are kept: an angle must be shifted into them.
    assert (arm.lower[3], arm.upper[3]) == (-3.2, 3.2)
    assert arm.limit_cos[3] == -1.0
    assert len(arm.branches) == 4
    assert arm.elbow_cos.tolist() == [-1.0, 1.0]
