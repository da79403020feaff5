"""Approaches of reached pairs: against the plain-loop reference, obstacles and limits."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from tcs.kernel.approach.scene import compile_checks
from tcs.kernel.approach.sweep import ApproachLines, ReachedPairs, approach_spline, score_approaches
from tcs.kernel.arrays import SPHERE
from tcs.kernel.contacts import NO_CONTACT
from tcs.kernel.dexterity.measures import measure_at
from tcs.kernel.motion.edges import curve_is_free, is_placed_free
from tcs.kernel.problem import build_problem
from tcs.kernel.rows import grid_rows, rows_at
from tcs.kernel.scores import APPROACH_BLOCKED, APPROACH_LIMITS, REACHED
from tests.kernel.arms import drake_arm
from tests.kernel.shapes import placed
from tests.kernel.toy import goal_in_base, scores_of, toy_grid, toy_scene, with_obstacle
from tests.reference.kinematics import link_poses
from tests.reference.motion import least_excess
from tests.reference.pairs import placed_scene

GRID = toy_grid()
BACK = np.array([-0.1, 0.0, 0.0])
"""From the goal to the begin of the approach, in the tool frame [m]."""
FEW = slice(0, 40)
SLACK = 2e-3
"""Distance of joint limits from a motion [rad]: windows get narrower than the spacing of 0.0125."""


@pytest.fixture(scope="module")
def scene():
    return toy_scene(drake_arm("pr2 left").chain, 3, obstacles=12)


@pytest.fixture(scope="module")
def scores(scene):
    return scores_of(scene, GRID)


def lines(scene, *, offset=-BACK, fastest=2.0):
    goals = scene.goal_p.shape[1]
    return ApproachLines(np.tile(offset, (goals, 1)), np.full((goals, 7), fastest))


def approached(scene, scores, **changes):
    """Return the first reached pairs, scored with approach."""
    pairs = np.argwhere(scores.reason == REACHED)[FEW]
    at = tuple(pairs.T)
    found = ReachedPairs(
        pairs, scores.reason[at], scores.contact[at], scores.dexterity[at], scores.joints[at]
    )
    score_approaches(build_problem(scene), lines(scene, **changes), grid_rows(GRID), found)
    return found


@pytest.fixture(scope="module")
def found(scene, scores):
    return approached(scene, scores)


def test_every_outcome_occurs_and_the_best_posture_stays_where_it_is_approachable(scores, found):
    assert set(found.reason.tolist()) == {REACHED, APPROACH_LIMITS, APPROACH_BLOCKED}
    at = tuple(found.pair.T)
    reached = found.reason == REACHED
    same = np.all(found.joints == scores.joints[at], axis=1)
    assert 0 < np.sum(same & reached) < reached.sum()
    np.testing.assert_array_equal(
        found.dexterity[same & reached], scores.dexterity[at][same & reached]
    )
    # The search of scoring refines its best posture to about this much.
    assert np.all(found.dexterity[reached] <= scores.dexterity[at][reached] + 1e-3)
    assert not found.dexterity[~reached].any()
    np.testing.assert_array_equal(found.contact != NO_CONTACT, found.reason == APPROACH_BLOCKED)


def test_checks_that_are_compiled_beforehand_are_those_that_approaches_use(scene, found):
    functions = measure_at.inner, is_placed_free, curve_is_free
    before = [sum(function.stats.cache_misses.values()) for function in functions]
    compile_checks(build_problem(scene))
    # For other types they would be compiled anew.
    assert before == [sum(function.stats.cache_misses.values()) for function in functions]
    assert all(function.signatures for function in functions)


def test_approaches_are_straight_within_limits_and_free_by_the_reference(scene, found):
    problem, chain = build_problem(scene), scene.chain
    for n in np.flatnonzero(found.reason == REACHED)[:3]:
        h, g = map(int, found.pair[n])
        spline = approach_spline(problem, lines(scene), rows_at(GRID, [h]), g, found.joints[n])
        assert spline is not None
        points, tangents = spline
        np.testing.assert_allclose(points[-1], found.joints[n], atol=1e-5)
        curve = CubicHermiteSpline(np.linspace(0.0, 1.0, len(points)), points, tangents)
        R_AG, p_AG = goal_in_base(scene, GRID, h, g)
        plain = placed_scene(scene, GRID, h, g)[0]
        for fraction in np.linspace(0.0, 1.0, 40):
            q = curve(fraction)
            R, p = link_poses(chain, q)[-1]
            on_line = p_AG + (1.0 - fraction) * (R_AG @ BACK)
            assert np.abs(p - on_line).max() < 1e-3
            assert np.abs(R - R_AG).max() < 1e-3
            assert np.all((q >= chain.lower - 1e-9) & (q <= chain.upper + 1e-9))
            assert least_excess(plain, q) > -1e-9
        assert np.abs(curve.derivative()(np.linspace(0.0, 1.0, 40))).max() < 2.2


def test_an_obstacle_on_the_line_alone_blocks_the_approach_and_is_named(scene, scores, found):
    body = int(scene.environment.body.max()) + 1
    flipped = 0
    for n in np.flatnonzero(found.reason == REACHED):
        h, g = map(int, found.pair[n])
        s = h // (len(scores.reason) // GRID.environment_states)
        R_WG, p_WG = scene.goal_R[s, g], scene.goal_p[s, g]
        # The palm is there when the approach begins, and 10 cm away at the goal.
        palm = -0.5 * scene.chain.R[7].T @ scene.chain.p[7]
        centre = p_WG + R_WG @ (BACK * 0.95 + palm)
        more = with_obstacle(scene, placed(SPHERE, [0.01, 0, 0], p=centre, body=body))
        again = scores_of(more, GRID)
        if again.reason[h, g] != REACHED:
            continue
        here = ReachedPairs(found.pair[n : n + 1], *(a[h, g : g + 1].copy() for a in again))
        problem = build_problem(more)
        score_approaches(problem, lines(more), grid_rows(GRID), here)
        assert here.reason[0] == APPROACH_BLOCKED
        bodies = problem.environment.bodies + problem.robot_bodies
        assert divmod(int(here.contact[0]), bodies) == (5, body)
        flipped += 1
        if flipped == 2:
            return
    pytest.fail("no goal is free with the obstacle")


def test_scores_of_a_pair_do_not_depend_on_the_pairs_before(scene, scores, found):
    problem = build_problem(scene)
    for n in np.flatnonzero(found.reason != APPROACH_LIMITS)[-12:]:
        h, g = map(int, found.pair[n])
        here = ReachedPairs(found.pair[n : n + 1], *(a[h, g : g + 1].copy() for a in scores))
        score_approaches(problem, lines(scene), grid_rows(GRID), here)
        for alone, among in zip(here, found, strict=True):
            np.testing.assert_array_equal(alone, among[n : n + 1])


def test_obstacles_far_away_change_nothing(scene, scores, found):
    far = with_obstacle(scene, placed(SPHERE, [0.2, 0, 0], p=[9.0, 9.0, 0.5]))
    for before, after in zip(found, approached(far, scores), strict=True):
        np.testing.assert_array_equal(before, after)


def test_limits_end_approaches(scene, scores, found):
    reached = found.reason == REACHED
    slow = approached(scene, scores, fastest=0.01)
    assert np.all(slow.reason[reached] == APPROACH_LIMITS)
    # Beyond the reach of the arm.
    long = approached(scene, scores, offset=-10.0 * BACK, fastest=20.0)
    assert np.sum(long.reason == APPROACH_LIMITS) > np.sum(found.reason == APPROACH_LIMITS)
    n = int(np.flatnonzero(reached)[0])
    chain, elbow = scene.chain, float(found.joints[n, 3])
    lower, upper = chain.lower.copy(), chain.upper.copy()
    lower[3], upper[3] = elbow - 1e-3, elbow + 1e-3
    stiff = scene._replace(chain=chain._replace(lower=lower, upper=upper))
    here = ReachedPairs(*(array[n : n + 1].copy() for array in found))
    score_approaches(build_problem(stiff), lines(stiff), grid_rows(GRID), here)
    assert here.reason[0] == APPROACH_LIMITS
    assert here.contact[0] == NO_CONTACT


def test_windows_narrower_than_the_columns_are_found(scene, found):
    count = found_again = 0
    for n in np.flatnonzero(found.reason == REACHED)[:20]:
        h, g = map(int, found.pair[n])
        row = rows_at(GRID, [h])
        spline = approach_spline(build_problem(scene), lines(scene), row, g, found.joints[n])
        assert spline is not None
        # Limits around a known motion leave few values of the free joint at each level.
        points, chain = spline[0], scene.chain
        lower, upper = chain.lower.copy(), chain.upper.copy()
        kept = np.isfinite(lower) & np.isfinite(upper)
        lower[kept] = np.maximum(lower, points.min(axis=0) - SLACK)[kept]
        upper[kept] = np.minimum(upper, points.max(axis=0) + SLACK)[kept]
        narrow = scene._replace(chain=chain._replace(lower=lower, upper=upper))
        here = ReachedPairs(*(array[n : n + 1].copy() for array in found))
        problem = build_problem(narrow)
        score_approaches(problem, lines(narrow), grid_rows(GRID), here)
        if here.reason[0] == REACHED:
            assert approach_spline(problem, lines(narrow), row, g, here.joints[0]) is not None
            found_again += 1
        count += 1
    # The other lines leave the limits between the levels, or another line is found and blocked.
    assert found_again > count / 2 > 5
