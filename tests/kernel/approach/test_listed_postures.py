"""Approaches of arms without the grid of a free joint, against the plain-loop reference.

Six joints; three of them prismatic; five, whose tool may rotate on the way; seven without a closed
form.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from tcs.kernel.approach.sweep import ApproachLines, ReachedPairs, approach_spline, score_approaches
from tcs.kernel.contacts import NO_CONTACT
from tcs.kernel.dexterity.measures import measure_at
from tcs.kernel.five_joints.turned import turned_chain
from tcs.kernel.problem import build_problem
from tcs.kernel.rows import grid_rows, rows_at
from tcs.kernel.scores import APPROACH_BLOCKED, APPROACH_LIMITS, REACHED
from tcs.kernel.verification.newton_solutions import newton_solutions, within
from tests.chosen import some_of
from tests.kernel.arms import drake_arm
from tests.kernel.test_five_joints import AXIS, TURN, five_joint_chain
from tests.kernel.test_six_joints import six_joint_chain
from tests.kernel.test_sliding_arms import sliding_chain
from tests.kernel.toy import goal_in_base, scores_of, toy_grid, toy_scene
from tests.reference.kinematics import jacobian, link_poses
from tests.reference.motion import least_excess
from tests.reference.pairs import placed_scene

GRID = toy_grid(states=1)
BACK = np.array([-0.1, 0.0, 0.0])
"""From the goal to the begin of the approach, in the tool frame [m]."""
FASTEST = 2.0
FEW = slice(0, 30)
STEPS = 20
STARTS = 120
"""Enough for all postures at a goal: most are found from dozens of them."""
CLEAR = 1e-3
"""Distance from limits and contacts within which certificates may decide [rad or m]."""


def with_short_slides(chain):
    """Return an arm whose prismatic joints end lines."""
    short = np.where(chain.slides > 0.0, 0.6, np.inf)
    lower, upper = np.maximum(chain.lower, -short), np.minimum(chain.upper, short)
    return chain._replace(lower=lower, upper=upper)


ARMS = {
    "parallel axes": lambda: six_joint_chain("parallel axes", 10),
    "mixed slides": lambda: with_short_slides(sliding_chain((1, 4, 6), 3)),
    "five": lambda: five_joint_chain(8),
    "traced": lambda: drake_arm("baxter").chain,
}
SEEDS = {"parallel axes": 10, "mixed slides": 3, "five": 8, "traced": 0}
LISTED = ["parallel axes", "mixed slides", "five"]


@cache
def scene_of(name):
    chain, seed = ARMS[name](), SEEDS[name]
    scene = toy_scene(chain, seed, obstacles=6, states=1)
    if name == "five":
        scene = scene._replace(freedom=np.repeat(TURN.row()[None], 5, axis=0))
    return scene


@cache
def lines_of(name):
    goals, joints = scene_of(name).goal_p.shape[1], scene_of(name).chain.joints
    fastest = np.full((goals, 7), np.inf)
    fastest[:, 7 - joints :] = FASTEST
    return ApproachLines(np.tile(-BACK, (goals, 1)), fastest)


@cache
def approached(name):
    """Return the first reached pairs, scored with approach, and how they were before."""
    scene, scores = scene_of(name), scores_of(scene_of(name), GRID)
    pairs = np.argwhere(scores.reason == REACHED)[FEW]
    at = tuple(pairs.T)
    before = ReachedPairs(pairs, *(array[at].copy() for array in scores))
    found = ReachedPairs(pairs, *(array[at].copy() for array in scores))
    score_approaches(build_problem(scene), lines_of(name), grid_rows(GRID), found)
    return before, found


def line_of(name, h, g, q):
    """Return where the tool is at the goal with joints q, in A: R, p; and the way from there."""
    R, p = goal_in_base(scene_of(name), GRID, h, g)
    if name == "five":
        R, p = link_poses(scene_of(name).chain, q)[-1]
    return R, p, R @ BACK


def turned_by(name, R, S):
    """Return how far S is turned from R, leaving the rotation aside that is free."""
    off = R.T @ S - np.eye(3)
    return np.abs(off @ AXIS if name == "five" else off).max()


@pytest.mark.parametrize("name", some_of(ARMS, "parallel axes", "mixed slides", "traced"))
def test_approaches_are_straight_within_limits_and_free_by_the_reference(name):
    scene, (before, found) = scene_of(name), approached(name)
    chain, problem = scene.chain, build_problem(scene)
    reached = found.reason == REACHED
    assert reached.any()
    assert {APPROACH_LIMITS, APPROACH_BLOCKED} & {*found.reason.tolist()}
    np.testing.assert_array_equal(found.contact != NO_CONTACT, found.reason == APPROACH_BLOCKED)
    assert np.all(found.dexterity[reached] <= before.dexterity[reached] + 1e-3)
    moved = np.any(found.joints != before.joints, axis=1)
    chosen = [*np.flatnonzero(reached & moved)[:2], *np.flatnonzero(reached & ~moved)[:2]]
    for n in chosen:
        h, g = map(int, found.pair[n])
        q = found.joints[n].astype(float)
        spline = approach_spline(problem, lines_of(name), rows_at(GRID, [h]), g, q)
        assert spline is not None
        curve = CubicHermiteSpline(np.linspace(0.0, 1.0, len(spline[0])), *spline)
        np.testing.assert_allclose(curve(1.0), q, atol=1e-5)
        (R, p, back), plain = line_of(name, h, g, q), placed_scene(scene, GRID, h, g)[0]
        for fraction in np.linspace(0.0, 1.0, STEPS):
            posture = curve(fraction)
            S, s = link_poses(chain, posture)[-1]
            assert np.abs(s - p - (1.0 - fraction) * back).max() < 1e-3
            assert turned_by(name, R, S) < 1e-3
            assert np.all((posture >= chain.lower - 1e-9) & (posture <= chain.upper + 1e-9))
            assert least_excess(plain, posture) > -1e-9
        assert np.abs(curve.derivative()(np.linspace(0.0, 1.0, STEPS))).max() < 1.1 * FASTEST


def solutions(name, h, g):
    """Return all postures at a goal, found from many starts."""
    chain, (R, p) = scene_of(name).chain, goal_in_base(scene_of(name), GRID, h, g)
    if name != "five":
        return within(chain, newton_solutions(chain, R, p, STARTS))
    turned = turned_chain(chain, np.array(AXIS))
    found = within(turned, newton_solutions(turned, R, p, STARTS))
    return np.concatenate([np.zeros((len(found), 2)), found[:, 1:6]], axis=1)


def spare(name, h, g, q):
    """Return what a line keeps from limits and contacts at least, negative if it does not."""
    chain, plain = scene_of(name).chain, placed_scene(scene_of(name), GRID, h, g)[0]
    R, p, back = line_of(name, h, g, q)
    least, own = np.inf, slice(7 - chain.joints, None)
    for n in range(STEPS + 1):
        before = q.copy()
        for _ in range(8):
            S, s = link_poses(chain, q)[-1]
            E = R @ S.T
            error = np.array([E[2, 1] - E[1, 2], E[0, 2] - E[2, 0], E[1, 0] - E[0, 1]]) / 2
            J, error = jacobian(chain, q), np.append(error, p + n / STEPS * back - s)
            if name == "five":
                J = np.column_stack([J, np.append(R @ AXIS, np.zeros(3))])
            step = np.linalg.lstsq(J, error, rcond=1e-9)[0]
            q[own] += step[: chain.joints]
        if np.abs(q - before).max() > 0.5:
            return -np.inf
        speed = FASTEST / STEPS - np.abs(q - before).max() if n else np.inf
        limits = np.minimum(q - chain.lower, chain.upper - q)[own].min()
        least = min(least, STEPS * speed, limits, least_excess(plain, q))
        if least < -CLEAR:
            return least
    return least


@pytest.mark.parametrize("name", some_of(LISTED, "mixed slides"))
def test_the_best_of_all_postures_that_can_be_left_is_found(name):
    _, found = approached(name)
    problem = build_problem(scene_of(name))
    judged = {True: 0, False: 0}
    order = np.argsort(found.joints[:, -1])
    for n in order:
        h, g = map(int, found.pair[n])
        at_goal = solutions(name, h, g)
        kept = np.array([spare(name, h, g, q.copy()) for q in at_goal])
        if np.any(np.abs(kept) < CLEAR):
            continue
        assert (found.reason[n] == REACHED) == np.any(kept > 0.0)
        judged[bool(np.any(kept > 0.0))] += 1
        if found.reason[n] == REACHED:
            measures = [measure_at(problem, q) for q in at_goal[kept > 0.0]]
            assert found.dexterity[n] == pytest.approx(max(measures), abs=1e-5)
        if min(judged.values()) >= 2:
            return
    assert min(judged.values()) > 0
