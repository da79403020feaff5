"""No joint angles exceed the bound of the dexterity, no configuration that of P_R + P_M."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.model.robots import load_robot
from tcs.model.scene import EMPTY_ENVIRONMENT, Scene, SceneSpec, arm_chain
from tcs.placement.refinement.dexterity_bound import (
    ANGLES,
    _parts,
    _relaxed,
    descent,
    dexterity_bound,
    forearm,
    wrist_height,
)
from tcs.placement.refinement.goal_bound import GoalLimits, goal_bounds
from tcs.placement.refinement.intervals import Interval, cosine


def grams(chain, q):
    """Return J J^T at joint angles, shape (n, 7), and the cosine between axes 5 and 7."""
    R, p = np.tile(np.eye(3), (len(q), 1, 1)), np.zeros((len(q), 3))
    axes, origins = [], []
    for i in range(7):
        p = p + R @ chain.p[i]
        turn = np.tile(np.eye(3), (len(q), 1, 1))
        turn[:, 0, 0] = turn[:, 1, 1] = np.cos(q[:, i])
        turn[:, 1, 0] = np.sin(q[:, i])
        turn[:, 0, 1] = -turn[:, 1, 0]
        R = R @ chain.R[i] @ turn
        axes.append(R[:, :, 2])
        origins.append(p)
    tool = p + R @ chain.p[7]
    linear = [np.cross(z, tool - o) for z, o in zip(axes, origins, strict=True)]
    J = np.concatenate([np.stack(linear, axis=2), np.stack(axes, axis=2)], axis=1)
    return J @ J.transpose(0, 2, 1), np.sum(axes[4] * axes[6], axis=1)


def isotropies(chain, q):
    """Return the isotropy at joint angles, shape (n, 7), from the geometric Jacobian."""
    M, _ = grams(chain, q)
    trace = np.trace(M, axis1=1, axis2=2)
    return np.linalg.det(M).clip(0.0) ** (1 / 6) / (trace / 6)


def random_angles(chain, rng, count):
    low = np.where(np.isfinite(chain.lower), chain.lower, -np.pi)
    high = np.where(np.isfinite(chain.upper), chain.upper, np.pi)
    return rng.uniform(low, high, (count, 7)), low, high


def attacked(chain, rng):
    """Return the greatest isotropy that random search finds."""
    q, low, high = random_angles(chain, rng, 5000)
    for width in np.geomspace(0.5, 0.01, 12):
        best = q[np.argsort(-isotropies(chain, q))[:30]]
        around = np.repeat(best, 10, axis=0)
        q = np.clip(around + rng.normal(0.0, width, around.shape), low, high)
        q = np.concatenate([best, q])
    return isotropies(chain, q).max()


def test_search_does_not_exceed_the_bound_and_comes_close(lowered, rng):
    chain = lowered.arrays.chain
    bound, found = dexterity_bound(chain, "isotropy"), attacked(chain, rng)
    assert found <= bound
    # The relaxation, not the search, accounts for the difference: 0.391 against 0.417.
    assert bound < 0.42
    assert found > 0.39


def test_determinant_and_trace_are_bounded_at_every_angle_of_the_wrist(lowered, rng):
    chain = lowered.arrays.chain
    q, _, _ = random_angles(chain, rng, 4000)
    M, cosine_57 = grams(chain, q)
    c, s = np.abs(cosine_57), np.sqrt(1.0 - cosine_57**2)
    parts = _parts(chain, Interval(q[:, 1:4], q[:, 1:4]))
    excess = parts.determinant(c, s) - np.linalg.det(M)
    lack = np.trace(M, axis1=1, axis2=2) - parts.trace(c, s, chain.p[7, 2])
    assert np.all(excess >= -1e-12)
    assert np.all(lack >= -1e-12)
    # Some postures attain them nearly.
    assert excess.min() < 1e-4
    assert lack.min() < 1e-2


def test_the_bound_falls_with_every_halving(lowered, rng):
    chain = lowered.arrays.chain
    coarse, fine = descent(chain, 0.05), descent(chain, 0.02)
    assert np.all(np.diff(fine) <= 1e-12)
    assert coarse[-1] > fine[-1] > 0.39
    assert coarse[0] == fine[0]


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["baxter", "iiwa7", "panda", "tiago", "xarm7", "gen3", "fr3"])
def test_search_does_not_exceed_the_bound_of_other_arms(robot, rng):
    chain, _ = arm_chain(Scene(SceneSpec(load_robot(robot), EMPTY_ENVIRONMENT)))
    assert attacked(chain, rng) <= dexterity_bound(chain, "isotropy") <= 1.0


def test_relaxed_isotropy_of_a_box_exceeds_the_isotropy_in_it(lowered, rng):
    chain = lowered.arrays.chain
    q, low, high = random_angles(chain, rng, 500)
    width = rng.uniform(0.0, 0.3, (len(q), 3))
    box = Interval(q[:, 1:4] - width, q[:, 1:4] + width)
    bounds = _relaxed(chain, box)
    for _ in range(10):
        inside = q.copy()
        inside[:, 1:4] = rng.uniform(box.low, box.high)
        inside[:, 4:] = rng.uniform(low[4:], high[4:], (len(q), 3))
        # Rounding of the determinant near a singularity.
        assert np.all(isotropies(chain, inside) <= bounds + 1e-9)


def test_cosine_of_an_interval_holds_all_cosines(rng):
    low = rng.uniform(-7.0, 7.0, 3000)
    angle = Interval(low, low + rng.uniform(0.0, 3.0, low.size))
    found = cosine(angle)
    at = np.cos(rng.uniform(angle.low, angle.high, (200, low.size)))
    assert np.all(found.low <= at.min(axis=0) + 1e-12)
    assert np.all(found.high >= at.max(axis=0) - 1e-12)
    whole = cosine(Interval(np.array([0.0, -0.1, 3.0]), np.array([1.0, 0.1, 3.3])))
    np.testing.assert_allclose(whole.high, [1.0, 1.0, np.cos(3.0 + 0.3)])
    np.testing.assert_allclose(whole.low, [np.cos(1.0), np.cos(0.1), -1.0])


def test_other_measures_have_the_trivial_bound(lowered):
    assert dexterity_bound(lowered.arrays.chain, "inverse-condition") == 1.0


def heights_and_tilts(chain, q):
    """Return the wrist centre's distance from joint 1 along its axis, and the angle of axis 7."""
    R, p = np.tile(np.eye(3), (len(q), 1, 1)), np.zeros((len(q), 3))
    frames = []
    for i in range(7):
        p = p + R @ chain.p[i]
        turn = np.tile(np.eye(3), (len(q), 1, 1))
        turn[:, 0, 0] = turn[:, 1, 1] = np.cos(q[:, i])
        turn[:, 1, 0] = np.sin(q[:, i])
        turn[:, 0, 1] = -turn[:, 1, 0]
        R = R @ chain.R[i] @ turn
        frames.append((R[:, :, 2], p))
    (z1, o1), (z7, wrist) = frames[0], frames[6]
    return np.sum(z1 * (wrist - o1), axis=1), np.arccos(np.sum(z1 * z7, axis=1).clip(-1.0, 1.0))


def test_no_posture_that_a_goal_allows_exceeds_its_bound(lowered, rng):
    chain = lowered.arrays.chain
    q, _, _ = random_angles(chain, rng, 12)
    height, tilt = heights_and_tilts(chain, q)
    limits = GoalLimits(height - 0.02, height + 0.02, tilt)
    bounds = goal_bounds(chain, limits, 0.05)
    assert np.all(isotropies(chain, q) <= bounds)
    assert bounds.min() < 0.85 * bounds.max()


def test_the_box_of_a_posture_is_allowed_with_the_angle_of_its_wrist(lowered, rng):
    chain = lowered.arrays.chain
    q, _, _ = random_angles(chain, rng, 400)
    height, tilt = heights_and_tilts(chain, q)
    limits = GoalLimits(height - 0.001, height + 0.001, tilt)
    box = Interval(q[:, 1:4] - 0.001, q[:, 1:4] + 0.001)
    _, cosine_57 = grams(chain, q)
    at = np.searchsorted(ANGLES, np.arccos(np.abs(cosine_57)), side="right") - 1
    left_out = 0.0
    for goal in range(len(q)):
        of_goal = box.rows(np.array([goal]))
        fits, angles = limits.allowed(goal, wrist_height(chain, of_goal), forearm(chain, of_goal))
        assert fits[0]
        assert angles[0, at[goal]]
        left_out += np.mean(~angles) / len(q)
    assert left_out > 0.1


def test_limits_of_goals_follow_from_their_poses(lowered, rng):
    chain, arrays = lowered.arrays.chain, lowered.arrays
    q, _, _ = random_angles(chain, rng, 5)
    height, tilt = heights_and_tilts(chain, q)
    R, p = np.tile(np.eye(3), (len(q), 1, 1)), np.zeros((len(q), 3))
    for i in range(8):
        p = p + R @ chain.p[i]
        R = R @ chain.R[i]
        if i < 7:
            c, s, turn = np.cos(q[:, i]), np.sin(q[:, i]), np.tile(np.eye(3), (len(q), 1, 1))
            turn[:, 0, 0] = turn[:, 1, 1] = c
            turn[:, 1, 0], turn[:, 0, 1] = s, -s
            R = R @ turn
    ends = [0, -1]
    R_BA, p_BA = arrays.arm_base_R[ends], arrays.arm_base_p[ends]
    found = GoalLimits.of(chain, R_BA, p_BA, R_BA[0] @ R, p_BA[0] + p @ R_BA[0].T)
    travel = p_BA[1, 2] - p_BA[0, 2]
    assert travel > 0.2
    np.testing.assert_allclose(found.high, height, atol=2e-6)
    np.testing.assert_allclose(found.low, height - travel, atol=2e-6)
    np.testing.assert_allclose(found.tilt, tilt, atol=1e-6)
    leaning = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    assert GoalLimits.of(chain, leaning @ R_BA, p_BA, R, p) is None
