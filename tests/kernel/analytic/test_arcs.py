"""The arcs of the free joint and the windows in a row of samples."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.kernel.analytic.arcs import (
    IN_REACH,
    INSET,
    MAX_ARCS,
    OUT_OF_LIMITS,
    OUT_OF_REACH,
    elbow_arcs,
    windows_of,
)
from tcs.kernel.analytic.ik import wrist_goal
from tcs.kernel.analytic.scratch import MAX_WINDOWS
from tcs.kernel.analytic.solver import arm_solver
from tests.kernel.arms import drake_arm
from tests.kernel.sampled import slack_and_measure
from tests.kernel.shapes import random_arm, random_joints, rotation
from tests.reference import candidates as reference_candidates
from tests.reference.kinematics import free_joint, link_poses

DENSE = 2000
ENDS = 2 * INSET
"""Distance of the ends of arcs from the limits of joint 1, with a margin."""


def arcs_of(arm, X_AG):
    goal, arcs = np.empty((4, 3)), np.full((MAX_ARCS, 2), np.nan)
    wrist_goal(arm, X_AG[0], X_AG[1], goal)
    count, reach = elbow_arcs(arm, goal, arcs)
    return goal, arcs[:count], reach


def distance_left(arm, chain, X_AG, angles):
    """Return how far |SW|^2 is inside what the elbow spans [m^2], by forward kinematics."""
    c, s = np.cos(angles), np.sin(angles)
    R_A7 = X_AG[0] @ chain.R[7].T
    p_A7 = X_AG[1] - R_A7 @ chain.p[7]
    if free_joint(chain) == 0:
        v, other = chain.R[0].T @ (p_A7 - chain.p[0]), chain.p[1]
    else:
        # Origin of L6 in L7 at zero, rotated back by joint 7; the shoulder in L7.
        v, other = -chain.R[6].T @ chain.p[6], R_A7.T @ (chain.p[0] - p_A7)
    x = np.stack([c * v[0] + s * v[1], -s * v[0] + c * v[1], np.full_like(c, v[2])], axis=-1)
    square = np.sum((x - other) ** 2, axis=-1)
    near, far = reference_candidates.elbow_spans(chain)
    return np.minimum(square - near, far - square)


def in_some(arcs, angles, tolerance):
    """Return whether each angle lies in one of the arcs, modulo full turns."""
    turned = angles[:, None, None] + 2 * np.pi * np.arange(-2, 3)[:, None]
    inside = (turned >= arcs[:, 0] - tolerance) & (turned <= arcs[:, 1] + tolerance)
    return inside.any(axis=(1, 2))


def goals(rng, chain, number):
    """Return goals, half of them reached by some joints, half at random."""
    length = np.linalg.norm(chain.p, axis=1).sum()
    for i in range(number):
        if i % 2:
            yield link_poses(chain, random_joints(rng, chain))[-1]
        else:
            yield rotation(rng), rng.uniform(-length, length, 3)


@pytest.fixture(params=["pr2", "panda", *range(15), *(f"shoulder {i}" for i in range(15))], ids=str)
def chain(request, lowered):
    """Real arms, and random arms of either class."""
    if request.param == "pr2":
        return lowered.arrays.chain
    if request.param == "panda":
        return drake_arm("panda").chain
    spherical_shoulder = isinstance(request.param, str)
    seed = int(request.param.split()[1]) if spherical_shoulder else request.param
    return random_arm(np.random.default_rng(seed), spherical_shoulder=spherical_shoulder)


def test_arcs_are_what_a_dense_scan_finds(chain):
    rng = np.random.default_rng(1)
    arm, free = arm_solver(chain), free_joint(chain)
    limited = np.isfinite(chain.lower[free])
    lower, upper = (chain.lower[free], chain.upper[free]) if limited else (-np.pi, np.pi)
    angles = np.linspace(lower, upper, DENSE)
    for X_AG in goals(rng, chain, 40):
        _, arcs, reach = arcs_of(arm, X_AG)
        left = distance_left(arm, chain, X_AG, angles)
        assert (reach == IN_REACH) == (len(arcs) > 0)
        if len(arcs) == 0:
            # Rounding of squares of up to 4 m^2.
            assert np.all(left < 1e-12)
            continue
        assert np.all(arcs[:, 0] <= arcs[:, 1])
        if limited:
            assert np.all((arcs >= lower) & (arcs <= upper))
        # |SW|^2 changes by at most 1 m^2 per radian here; at the end of an arc, as the square root.
        assert np.all(in_some(arcs, angles[left > 1e-9], ENDS))
        assert not np.any(in_some(arcs, angles[left < -1e-9], -1e-12))


def test_feasible_angles_lie_in_the_arcs(chain):
    rng = np.random.default_rng(2)
    arm = arm_solver(chain)
    angles = np.linspace(-np.pi, np.pi, DENSE)
    seen = 0
    for X_AG in goals(rng, chain, 40):
        goal, arcs, reach = arcs_of(arm, X_AG)
        for branch in arm.branches:
            slack, _ = slack_and_measure(arm, goal, branch, angles)
            feasible = angles[slack >= 0]
            seen += len(feasible)
            assert reach == IN_REACH or len(feasible) == 0
            # A cosine's rounding, 1e-16, is 1e-8 in its angle where the cosine is flat.
            assert np.all(in_some(arcs, feasible, 1e-7))
    assert seen > 100


@pytest.mark.parametrize("spherical_shoulder", [False, True])
@pytest.mark.parametrize("seed", range(15))
def test_out_of_reach_and_out_of_limits_are_distinguished(seed, spherical_shoulder):
    rng = np.random.default_rng(seed)
    chain = random_arm(rng, spherical_shoulder=spherical_shoulder)
    free = free_joint(chain)
    lower, upper = chain.lower.copy(), chain.upper.copy()
    lower[free], upper[free] = 0.3, 0.9
    chain = chain._replace(lower=lower, upper=upper)
    arm = arm_solver(chain)
    everywhere = np.linspace(-np.pi, np.pi, DENSE)
    for X_AG in goals(rng, chain, 60):
        _, _, reach = arcs_of(arm, X_AG)
        left = distance_left(arm, chain, X_AG, everywhere)
        if reach == OUT_OF_REACH:
            assert np.all(left < 1e-12)
        elif reach == OUT_OF_LIMITS:
            # Some angle suffices, except in arcs narrower than the scan's spacing.
            assert left.max() > -1e-5


def test_a_goal_above_the_axis_of_joint_1_leaves_the_whole_range_or_nothing(lowered):
    # The distance from shoulder to wrist does not depend on joint 1 there: 0/0 for an arc.
    chain = lowered.arrays.chain
    arm = arm_solver(chain)
    tool = chain.R[7].T @ chain.p[7]
    for height in (0.0, 0.2, 0.4, 0.6, 0.7, 0.8, 2.0):
        on_axis = chain.p[0] + chain.R[0] @ np.array([0.0, 0.0, height])
        _, arcs, reach = arcs_of(arm, (np.eye(3), on_axis + tool))
        near, far = reference_candidates.elbow_spans(chain)
        square = np.sum((np.array([0.0, 0.0, height]) - chain.p[1]) ** 2)
        if near < square < far:
            # The wrist is on the axis up to rounding, so the arcs may be cut at one point.
            assert reach == IN_REACH
            assert np.sum(arcs[:, 1] - arcs[:, 0]) == pytest.approx(
                chain.upper[0] - chain.lower[0], abs=MAX_ARCS * ENDS
            )
        else:
            assert reach == OUT_OF_REACH


@pytest.mark.parametrize("centre", [-np.pi, -3.0, -0.1, 0.0, 3.0, np.pi])
def test_arcs_wrap_where_the_goal_lies_behind(lowered, centre):
    # Limits at the seam of the angle: [2.5, 3.9] holds pi.
    chain = lowered.arrays.chain
    lower, upper = chain.lower.copy(), chain.upper.copy()
    lower[0], upper[0] = 2.5, 3.9
    chain = chain._replace(lower=lower, upper=upper)
    arm = arm_solver(chain)
    angles = np.linspace(2.5, 3.9, DENSE)
    found = 0
    for distance in np.linspace(0.1, 0.9, 30):
        p = chain.p[0] + distance * np.array([np.cos(centre), np.sin(centre), 0.1])
        X_AG = np.eye(3), p + chain.R[7].T @ chain.p[7]
        _, arcs, _ = arcs_of(arm, X_AG)
        left = distance_left(arm, chain, X_AG, angles)
        found += len(arcs)
        if len(arcs):
            assert np.all(in_some(arcs, angles[left > 1e-9], ENDS))
        else:
            assert np.all(left < 1e-9)
    assert found > 0


@pytest.mark.parametrize("seed", range(200))
def test_windows_are_those_of_the_reference(seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 48))
    slack = rng.normal(size=count) * 10 ** rng.uniform(-2, 0.3)
    if seed % 3 == 0:
        slack = np.convolve(rng.normal(size=count + 6), np.ones(7), "valid")
    if seed % 5 == 0:
        slack = np.round(slack, 1) + 0.0
    windows = np.empty((MAX_WINDOWS, 2))
    step = 0.13
    found = windows_of(slack, count, step, windows, 0)
    expected = reference_candidates.windows_of(slack.tolist(), step)
    assert sorted(map(tuple, windows[:found])) == sorted(expected)


def test_no_row_of_the_first_pass_has_more_windows_than_fit():
    # 48 samples, every other one feasible: the most windows there can be.
    slack = np.tile([1.0, -1.0], 24)
    windows = np.empty((MAX_WINDOWS, 2))
    assert windows_of(slack, 48, 0.1, windows, 0) == 24
