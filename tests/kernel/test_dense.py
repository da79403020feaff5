"""The dense scan, and comparison of the search with it."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.kernel.analytic.solver import outside_solver
from tcs.kernel.problem import build_problem
from tcs.kernel.rows import grid_rows, rows_at
from tcs.kernel.scores import ARM_BLOCKED, JOINT_LIMITS, REACHED
from tcs.kernel.verification import dense
from tcs.kernel.verification.dense import DENSE_SAMPLES
from tcs.kernel.verification.plain_dexterity import isotropy
from tcs.kernel.verification.scans import dense_scan, dense_scans
from tests.kernel.judge import chain_of
from tests.kernel.sampled import slack_and_measure
from tests.kernel.toy import scores_of, toy_grid, toy_scene
from tests.reference import pairs as reference_pairs
from tests.reference.kinematics import free_joint, jacobian

SEEDS = range(10)


def scene_of(seed, lowered):
    chain = chain_of(seed, lowered, spherical_shoulder=bool(seed & 2))
    return toy_scene(chain, seed, obstacles=3 + seed), toy_grid()


def sample(rng, chosen, number):
    found = np.argwhere(chosen)
    return found[rng.choice(len(found), min(number, len(found)), replace=False)]


@pytest.mark.parametrize("seed", SEEDS)
def test_the_scan_finds_what_the_search_found_or_better(lowered, seed, rng):
    scene, grid = scene_of(seed, lowered)
    scores, problem = scores_of(scene, grid), build_problem(scene)
    shortfalls = []
    for h, g in sample(rng, scores.reason == REACHED, 12):
        q = np.full(7, np.nan)
        value = dense_scan(problem, rows_at(grid, [h]), g, DENSE_SAMPLES, q)
        # Only the search finds free intervals narrower than the scan's 1/32 degree.
        assert value >= 0.0
        # 1/32 degree is 5e-4 rad, and the isotropy of these arms changes by up to 2 per radian.
        assert value >= scores.dexterity[h, g] - 2e-3
        shortfalls.append(value - scores.dexterity[h, g])
    # Refinement compensates the finer scan, except where the scan finds another peak.
    assert np.median(shortfalls) < 5e-4


@pytest.mark.parametrize("seed", range(4))
def test_no_branch_is_solved_where_the_elbow_does_not_span_the_distance(lowered, seed, rng):
    # The scan leaves out what this tells apart: so it must never leave out a solution.
    scene, _ = scene_of(seed, lowered)
    arm, spans_any = build_problem(scene).arm, dense._elbow_spans_any.py_func
    angles = np.linspace(-np.pi, np.pi, 512)
    table = np.stack([angles, np.cos(angles), np.sin(angles)])
    left_out = solved = 0
    for _ in range(400):
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        goal = np.stack([rng.uniform(-0.9, 0.9, 3), axes[2], axes[0], rng.uniform(-0.1, 0.1, 3)])
        is_spanned = spans_any(arm, goal, table, 0, 512)
        left_out += not is_spanned
        for branch in arm.branches:
            slack, _ = slack_and_measure(arm, goal, branch, angles)
            assert is_spanned or np.all(slack < 0.0)
            solved += np.any(slack >= 0.0)
    # Both cases occur.
    assert left_out > 20
    assert solved > 5


@pytest.mark.parametrize("outside", [False, True], ids=["analytic", "numeric"])
def test_pairs_are_scanned_together_as_alone(lowered, rng, outside):
    # Scratch memory is shared: what one pair leaves in it must not reach the next.
    scene, grid = scene_of(3, lowered)
    scores, problem = scores_of(scene, grid), build_problem(scene)
    if outside:
        problem = problem._replace(arm=outside_solver(scene.chain))
    chosen = [sample(rng, scores.reason == r, 2) for r in (REACHED, JOINT_LIMITS, ARM_BLOCKED)]
    pairs = rng.permutation(np.concatenate(chosen))
    assert len(pairs) > 2
    joints, alone = np.full((len(pairs), 7), np.nan), np.full((len(pairs), 7), np.nan)
    values = dense_scans(problem, grid_rows(grid), pairs, DENSE_SAMPLES, joints)
    for (h, g), value, q in zip(pairs, values, alone, strict=True):
        assert dense_scan(problem, rows_at(grid, [h]), g, DENSE_SAMPLES, q) == value
    assert np.any(values >= 0.0)
    np.testing.assert_array_equal(joints[values >= 0.0], alone[values >= 0.0])


@pytest.mark.parametrize("seed", SEEDS)
def test_what_the_scan_finds_is_true(lowered, seed, rng):
    scene, grid = scene_of(seed, lowered)
    scores, problem = scores_of(scene, grid), build_problem(scene)
    for h, g in sample(rng, scores.reason == REACHED, 5):
        q = np.full(7, np.nan)
        value = dense_scan(problem, rows_at(grid, [h]), g, 2000, q)
        if value >= 0.0:
            # The reference's chain of rotations rounds differently, by 1e-15.
            eased = scene._replace(margin=scene.margin - 1e-9, self_margin=scene.self_margin - 1e-9)
            assert reference_pairs.confirms(eased, grid, int(h), int(g), q)
            exact = isotropy(jacobian(scene.chain, q))
            assert value == pytest.approx(exact, abs=1e-9 if exact > 0.1 else 3e-3)


def test_the_search_misses_little_that_the_scan_finds(lowered, rng):
    # A floor only: with some hundred pairs, 98 % lies well below the .998 that is measured on the
    # real scene (benchmarks/), and far above what one forgotten branch or arc would leave.
    reached = missed = scanned = candidates = 0
    for seed in SEEDS:
        scene, grid = scene_of(seed, lowered)
        scores, problem = scores_of(scene, grid), build_problem(scene)
        reached += np.sum(scores.reason == REACHED)
        blocked = np.isin(scores.reason, (JOINT_LIMITS, ARM_BLOCKED))
        candidates += np.sum(blocked)
        for h, g in sample(rng, blocked, 40):
            missed += dense_scan(problem, rows_at(grid, [h]), g, DENSE_SAMPLES, np.empty(7)) >= 0.0
            scanned += 1
    assert scanned > 200
    assert reached / (reached + candidates * missed / scanned) > 0.98


def test_nothing_is_found_too_far_away(lowered):
    scene, grid = scene_of(0, lowered)
    problem = build_problem(scene._replace(goal_p=scene.goal_p + 10.0))
    assert dense_scan(problem, rows_at(grid, [0]), 0, 500, np.empty(7)) == -1.0


@pytest.mark.parametrize(
    "spherical_shoulder", [False, True], ids=["spherical-wrist", "spherical-shoulder"]
)
@pytest.mark.parametrize("samples", [2, 511, 512, 513, 514, 1025])
def test_every_number_of_samples_is_scanned_to_its_end(lowered, samples, spherical_shoulder):
    # Samples come in blocks of 512; a goal reached only at the last angle shows a lost block.
    chain = chain_of(4, lowered, spherical_shoulder=spherical_shoulder)
    free = free_joint(chain)
    scene, grid = toy_scene(chain, 4, obstacles=0, goals=5), toy_grid()
    scores = scores_of(scene, grid)
    h, g = np.argwhere(scores.reason == REACHED)[0]
    angle = float(scores.joints[h, g, free])
    lower, upper = chain.lower.copy(), chain.upper.copy()
    lower[free], upper[free] = angle - 0.5, angle
    problem = build_problem(scene._replace(chain=chain._replace(lower=lower, upper=upper)))
    q = np.full(7, np.nan)
    assert dense_scan(problem, rows_at(grid, [h]), g, samples, q) >= 0.0
    assert q[free] <= angle
