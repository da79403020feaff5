"""The compiled sweep against the plain-loop reference, and invariants of any sweep."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tcs.kernel import shape_groups
from tcs.kernel.arrays import BOX, SPHERE, GridArrays
from tcs.kernel.problem import build_problem
from tcs.kernel.scores import (
    ARM_BLOCKED,
    BODY_BLOCKED,
    GRIPPER_BLOCKED_BY_ENVIRONMENT,
    GRIPPER_BLOCKED_BY_ROBOT,
    REACHED,
)
from tcs.kernel.verification.plain_dexterity import isotropy
from tcs.placement.tables import Reason
from tests.chosen import some_of
from tests.kernel.judge import ROUNDING, chain_of, compare, is_true, stratified
from tests.kernel.shapes import placed, rotation, straight_arm
from tests.kernel.toy import (
    crowded,
    goal_in_base,
    scores_of,
    size_of,
    toy_grid,
    toy_scene,
    with_obstacle,
)
from tests.reference.kinematics import compose, jacobian, link_poses, rot_z, shapes_of

ROOT = Path(__file__).parents[2]
MASKS = ("arm_vs_arm", "arm_vs_body", "arm_vs_environment", "body_vs_environment")


# The Panda (even seeds, spherical shoulder) has all eight branches within its limits: the reference
# takes seconds for a pair there.
FEW = [(seed, False, 2) for seed in (2, 3, 5)] + [(seed, True, 2) for seed in (3, 5)]
MANY = [
    *((seed, False, 2) for seed in (4, 6, 7)),
    *((seed, True, 2) for seed in (7, 9)),
    *((seed, False, 6) for seed in range(100, 160)),
    *((seed, True, 6 if seed % 2 else 2) for seed in range(100, 130)),
]


@pytest.mark.parametrize(
    ("seed", "spherical_shoulder", "number"),
    some_of([*FEW, *MANY], *FEW),
)
def test_the_kernel_agrees_with_the_reference_in_random_scenes(
    lowered, seed, spherical_shoulder, number
):
    chain = chain_of(seed, lowered, spherical_shoulder=spherical_shoulder)
    scene, grid = toy_scene(chain, seed, obstacles=seed % 14), toy_grid()
    scores = scores_of(scene, grid)
    compare(scene, grid, scores, stratified(np.random.default_rng(seed), scores.reason, number))


@pytest.mark.parametrize("seed", some_of(range(3), 2))
def test_clusters_of_a_body_with_many_shapes_change_no_score(lowered, seed, monkeypatch):
    chain = chain_of(seed, lowered)
    rng, grid = np.random.default_rng(seed), toy_grid()
    scene = crowded(toy_scene(chain, seed, obstacles=4), rng, 30)
    assert max(np.diff(build_problem(scene).links.groups.clusters)) > 2
    scores = scores_of(scene, grid)
    compare(scene, grid, scores, stratified(rng, scores.reason, 1))
    monkeypatch.setattr(shape_groups, "CLUSTER", len(scene.body.type))
    assert max(np.diff(build_problem(scene).body.groups.clusters)) == 1
    whole = scores_of(scene, grid)
    for name in ("reason", "contact", "dexterity", "joints"):
        np.testing.assert_array_equal(getattr(scores, name), getattr(whole, name))
    assert len(np.unique(scores.reason)) > 4


@pytest.mark.parametrize(
    "spherical_shoulder", [False, True], ids=["spherical-wrist", "spherical-shoulder"]
)
def test_random_scenes_show_every_reason(lowered, spherical_shoulder):
    # The tests above cover only reasons that occur, so every reason must occur, but for that
    # of configurations that are not scored.
    counts = np.zeros(Reason.EXCLUDED, int)
    for seed in range(8):
        chain = chain_of(seed, lowered, spherical_shoulder=spherical_shoulder)
        scene = toy_scene(chain, seed, obstacles=2 + seed)
        reason = scores_of(scene, toy_grid()).reason.ravel()
        counts += np.bincount(reason, minlength=Reason.EXCLUDED)
    assert np.all(counts > 10), counts


@pytest.mark.parametrize("seed", range(30))
def test_every_reached_pair_is_at_its_goal_and_free(lowered, seed):
    chain = chain_of(seed, lowered, spherical_shoulder=bool(seed & 2))
    scene, grid = toy_scene(chain, seed, obstacles=seed % 10), toy_grid()
    scores = scores_of(scene, grid)
    reached = np.argwhere(scores.reason == REACHED)
    assert np.all(scores.dexterity[scores.reason != REACHED] == 0)
    assert np.all(scores.joints[scores.reason != REACHED] == 0)
    for h, g in reached:
        q = scores.joints[h, g].astype(np.float64)
        assert np.all((q >= chain.lower) & (q <= chain.upper))
        R, p = link_poses(chain, q)[-1]
        X_AG = goal_in_base(scene, grid, h, g)
        np.testing.assert_allclose(R, X_AG[0], atol=ROUNDING)
        np.testing.assert_allclose(p, X_AG[1], atol=ROUNDING)
        # One float32 rounding, and the sixth root of a determinant near zero.
        exact = isotropy(jacobian(chain, q))
        assert scores.dexterity[h, g] == pytest.approx(exact, abs=1e-6 if exact > 0.05 else 3e-3)
    for h, g in np.random.default_rng(seed).permutation(reached)[:12]:
        assert is_true(scene, grid, h, g, scores.joints[h, g])


@pytest.mark.parametrize("seed", range(6))
def test_moving_environment_goals_and_robot_together_changes_nothing(lowered, seed):
    chain = chain_of(seed, lowered, spherical_shoulder=bool(seed & 2))
    scene, grid = toy_scene(chain, seed), toy_grid()
    quarter, shift = rot_z(np.pi / 2), np.array([0.7, -1.3, 0.0])
    moved = scene._replace(
        environment=scene.environment._replace(
            R=quarter @ scene.environment.R, p=scene.environment.p @ quarter.T + shift
        ),
        goal_R=quarter @ scene.goal_R,
        goal_p=scene.goal_p @ quarter.T + shift,
    )
    # (x, y, yaw) -> (-y, x, yaw + 90 deg) + shift: the axes change places.
    moved_grid = GridArrays(
        environment_states=grid.environment_states,
        base_x=-grid.base_y + shift[0],
        base_y=grid.base_x + shift[1],
        base_yaw=grid.base_yaw + np.pi / 2,
        torso_levels=grid.torso_levels,
    )
    before, after = scores_of(scene, grid), scores_of(moved, moved_grid)
    shape = (grid.environment_states, 3, 3, 4, 2)

    def turned(values):
        values = values.reshape(*shape, *values.shape[1:])
        return values.swapaxes(1, 2).reshape(size_of(grid), *values.shape[5:])

    # Rounding of 1e-16 in other frames may decide a tie, or a sample at the end of an arc.
    different = turned(after.reason) != before.reason
    assert np.mean(different) < 0.002
    both = (turned(after.reason) == REACHED) & (before.reason == REACHED)
    assert both.any()
    # As between kernel and reference above.
    gap = np.abs(turned(after.dexterity) - before.dexterity)[both]
    assert np.quantile(gap, 0.75) < 1e-6
    assert gap.max() < 1e-4


@pytest.mark.parametrize("seed", range(12))
def test_another_obstacle_never_adds_a_reached_goal(lowered, seed):
    # Of the verdict alone: with several convex obstacles the best measure that a search with
    # finite steps finds may even rise when an obstacle sends its refinement elsewhere.
    rng = np.random.default_rng(seed)
    chain = chain_of(seed, lowered, spherical_shoulder=bool(seed & 2))
    scene, grid = toy_scene(chain, seed, obstacles=4), toy_grid()
    shape_type = (BOX, SPHERE)[seed % 2]
    # Close to a goal, so that it matters.
    p = scene.goal_p[0, 0] + rng.normal(scale=0.2, size=3)
    fuller = with_obstacle(scene, placed(shape_type, [0.15, 0.1, 0.2], rotation(rng), p, body=20))
    before, after = scores_of(scene, grid), scores_of(fuller, grid)
    # The search between two contacts depends on the contacts: a new solution must be true.
    for h, g in np.argwhere((after.reason == REACHED) & (before.reason != REACHED)):
        assert is_true(scene, grid, h, g, after.joints[h, g])
    assert np.sum(after.reason == REACHED) <= np.sum(before.reason == REACHED)
    # Contacts of base and gripper are exact: for them the invariant holds without exception.
    for reason, later in (
        (BODY_BLOCKED, (BODY_BLOCKED,)),
        (GRIPPER_BLOCKED_BY_ENVIRONMENT, (BODY_BLOCKED, GRIPPER_BLOCKED_BY_ENVIRONMENT)),
        (
            GRIPPER_BLOCKED_BY_ROBOT,
            (BODY_BLOCKED, GRIPPER_BLOCKED_BY_ENVIRONMENT, GRIPPER_BLOCKED_BY_ROBOT),
        ),
    ):
        blocked = before.reason == reason
        assert np.all(np.isin(after.reason[blocked], later))


def test_an_obstacle_on_the_gripper_blocks_it_at_every_base_pose(lowered):
    scene, grid = toy_scene(lowered.arrays.chain, 2, obstacles=0, states=1), toy_grid(states=1)
    fuller = with_obstacle(scene, placed(SPHERE, [0.02, 0, 0], p=scene.goal_p[0, 1], body=9))
    scores = scores_of(fuller, grid)
    assert np.all(np.isin(scores.reason[:, 1], (BODY_BLOCKED, GRIPPER_BLOCKED_BY_ENVIRONMENT)))


def test_states_of_the_environment_are_scored_independently(lowered):
    scene, grid = toy_scene(lowered.arrays.chain, 4, states=2), toy_grid(states=2)
    both = scores_of(scene, grid)
    half = size_of(grid) // 2
    for state in (0, 1):
        environment = scene.environment._replace(
            R=scene.environment.R[state : state + 1], p=scene.environment.p[state : state + 1]
        )
        alone = scene._replace(
            environment=environment,
            goal_R=scene.goal_R[state : state + 1],
            goal_p=scene.goal_p[state : state + 1],
        )
        one = scores_of(alone, toy_grid(states=1))
        rows = slice(state * half, (state + 1) * half)
        np.testing.assert_array_equal(one.reason, both.reason[rows])
        np.testing.assert_array_equal(one.dexterity, both.dexterity[rows])


@pytest.mark.parametrize("seed", range(4))
def test_slices_give_what_one_sweep_gives(lowered, seed):
    rng = np.random.default_rng(seed)
    chain = chain_of(seed, lowered, spherical_shoulder=bool(seed & 2))
    scene, grid = toy_scene(chain, seed, obstacles=9), toy_grid()
    whole = scores_of(scene, grid)
    cuts = np.sort(rng.choice(np.arange(1, size_of(grid)), 12, replace=False)).tolist()
    parts = scores_of(scene, grid, cuts)
    for name in ("reason", "contact", "dexterity", "joints"):
        np.testing.assert_array_equal(getattr(parts, name), getattr(whole, name), err_msg=name)
    # Which of several contacts names a blocked arm is the one that was found first.
    named = whole.reason != ARM_BLOCKED
    np.testing.assert_array_equal(parts.contact[named], whole.contact[named])
    assert np.all(parts.contact[~named] >= 0)


def test_every_order_of_the_shapes_gives_the_same_verdicts(lowered, rng):
    scene, grid = toy_scene(lowered.arrays.chain, 6, obstacles=8), toy_grid()
    order = rng.permutation(len(scene.environment.type))
    environment = scene.environment
    shuffled = scene._replace(
        environment=environment._replace(
            **{name: getattr(environment, name)[order] for name in ("type", "size", "pad", "body")},
            R=environment.R[:, order],
            p=environment.p[:, order],
        ),
        arm_vs_environment=scene.arm_vs_environment[:, order],
        body_vs_environment=scene.body_vs_environment[:, order],
    )
    before, after = scores_of(scene, grid), scores_of(shuffled, grid)
    np.testing.assert_array_equal(after.reason, before.reason)
    np.testing.assert_array_equal(after.dexterity, before.dexterity)


def test_a_grid_of_one_value_is_one_row_of_a_larger_one(lowered):
    scene, grid = toy_scene(lowered.arrays.chain, 0, states=1), toy_grid(states=1)
    whole = scores_of(scene, grid)
    single = grid._replace(
        base_x=grid.base_x[1:2], base_y=grid.base_y[2:3], base_yaw=grid.base_yaw[3:4]
    )
    one = scores_of(scene, single)
    h = np.ravel_multi_index((1, 2, 3, 0), (3, 3, 4, 2))
    np.testing.assert_array_equal(one.reason, whole.reason[h : h + 2])
    np.testing.assert_array_equal(one.joints, whole.joints[h : h + 2])


def test_an_environment_without_shapes_blocks_nothing(lowered):
    scene, grid = toy_scene(lowered.arrays.chain, 2, obstacles=0, states=1), toy_grid(states=1)
    environment = scene.environment
    empty = scene._replace(
        environment=environment._replace(
            **{
                name: getattr(environment, name)[:0]
                for name in ("type", "size", "pad", "body", "frame")
            },
            R=environment.R[:, :0],
            p=environment.p[:, :0],
        ),
        arm_vs_environment=scene.arm_vs_environment[:, :0],
        body_vs_environment=scene.body_vs_environment[:, :0],
    )
    reasons = scores_of(empty, grid).reason
    assert not np.any(reasons == BODY_BLOCKED)
    assert np.any(reasons == REACHED)


@pytest.mark.parametrize("offset", [0.0, 0.1], ids=["shoulder on axis 1", "shoulder beside it"])
def test_goals_at_singularities_are_reached_truly_or_not_at_all(offset, rng):
    # Multiples of 45 degrees put wrist, aim and elbow exactly along axes: 0/0 in the closed form,
    # and limits of the same multiples put the first samples of the search there.
    nice = np.deg2rad(np.arange(-180, 181, 45))
    here = np.zeros(1)
    grid = GridArrays(1, here, here, here, 2)
    reached = 0
    for _ in range(60):
        limits = np.deg2rad(rng.choice([45.0, 90.0, 135.0, 150.0, 170.0], 7))
        chain = straight_arm(limits, offset)
        scene = toy_scene(chain, 0, obstacles=0, goals=8, states=1)
        X_WA = scene.arm_base_R[0], scene.arm_base_p[0]
        targets = [compose(X_WA, link_poses(chain, rng.choice(nice, 7))[-1]) for _ in range(8)]
        scene = scene._replace(
            goal_R=np.array([[R for R, _ in targets]]),
            goal_p=np.array([[p for _, p in targets]]),
            **{name: np.zeros_like(getattr(scene, name)) for name in MASKS},
        )
        scores = scores_of(scene, grid)
        for h, g in np.argwhere(scores.reason == REACHED):
            q = scores.joints[h, g].astype(np.float64)
            assert np.all(np.abs(q) <= limits)
            R, p = link_poses(chain, q)[-1]
            X_AG = goal_in_base(scene, grid, h, g)
            np.testing.assert_allclose(R, X_AG[0], atol=ROUNDING)
            np.testing.assert_allclose(p, X_AG[1], atol=ROUNDING)
            reached += 1
    assert reached > 100


def test_nothing_the_arm_can_touch_is_left_off_the_list(rng):
    # Straight up, this arm reaches as far as `arm_radius` allows.
    chain = straight_arm(np.full(7, 3.0), 0.0)
    scene = toy_scene(chain, 0)
    radius = build_problem(scene).clearances.arm_radius
    extents = []
    for q in (np.zeros(7), *rng.uniform(-3, 3, (50, 7))):
        poses = link_poses(chain, q)
        for shape, frame in zip(shapes_of(scene.arm, 0), scene.arm.frame, strict=True):
            placed_there = shape.moved(poses[frame - 1])
            extents.append(np.linalg.norm(placed_there.p) + placed_there.sphere)
    assert 0.9 * radius < max(extents) <= radius - scene.margin


def test_a_margin_of_zero_still_detects_overlapping_shapes(lowered):
    scene, grid = toy_scene(lowered.arrays.chain, 2, obstacles=8), toy_grid()
    loose = scores_of(scene, grid)
    tight, none = (
        scores_of(scene._replace(margin=margin, self_margin=margin), grid) for margin in (1e-9, 0.0)
    )
    np.testing.assert_array_equal(none.reason, tight.reason)
    assert np.sum(none.reason == BODY_BLOCKED) > 0.9 * np.sum(loose.reason == BODY_BLOCKED)


SCRIPT = """
import pickle, sys
import numpy as np
from tcs.kernel.problem import build_problem
from tcs.kernel.sweep import score
from tcs.kernel.rows import grid_rows
with open(sys.argv[1], "rb") as file:
    scene, grid, rows = pickle.load(file)
with np.errstate(all="ignore"):
    scores = score(build_problem(scene), grid_rows(grid, *rows))
with open(sys.argv[2], "wb") as file:
    pickle.dump(tuple(scores), file)
"""


def test_without_the_compiler_the_results_are_the_same(lowered, tmp_path):
    scene, grid = toy_scene(lowered.arrays.chain, 2, obstacles=3, goals=3), toy_grid()
    whole = scores_of(scene, grid)
    # Two rows that reach something: a reached pair takes seconds without the compiler.
    first = int(np.argmax((whole.reason == REACHED).sum(axis=1) == 1))
    rows = (first, first + 2)
    (tmp_path / "in").write_bytes(pickle.dumps((scene, grid, rows)))
    subprocess.run(
        [sys.executable, "-c", SCRIPT, str(tmp_path / "in"), str(tmp_path / "out")],
        check=True,
        env={**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ROOT)},
        timeout=120,
    )
    reason, _, value, joints = pickle.loads((tmp_path / "out").read_bytes())
    np.testing.assert_array_equal(reason, whole.reason[slice(*rows)])
    assert np.any(reason == REACHED)
    # No contraction and no reordering in compiled code: only sin, cos, ... may round otherwise.
    # Near the flat top of the measure that decides which sample wins, within the last spacing of
    # the refinement: 0.0125 (2/7)^3 = 3e-4 rad of joint 1, and a few times that elsewhere.
    np.testing.assert_allclose(value, whole.dexterity[slice(*rows)], atol=1e-6)
    np.testing.assert_allclose(joints, whole.joints[slice(*rows)], atol=1e-3)
