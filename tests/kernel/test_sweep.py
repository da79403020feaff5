"""The compiled sweep against the plain-loop twin, and laws that any sweep must keep."""

from __future__ import annotations

import dataclasses
import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tcs.kernel import reference_pairs
from tcs.kernel.arrays import BOX, SPHERE, GridArrays
from tcs.kernel.pairs import (
    ARM_BLOCKED,
    BODY_BLOCKED,
    GRIPPER_BLOCKED,
    JOINT_LIMITS,
    REACHED,
)
from tcs.kernel.problem import build_problem
from tcs.kernel.reference import compose, isotropy, jacobian, link_poses, shapes_of, turn
from tcs.kernel.stand import arm_radius
from tcs.scoring import sweep
from tcs.tables import Reason
from tests.kernel.shapes import placed, random_arm, rotation, straight_arm
from tests.kernel.toy import (
    goal_in_base,
    scores_of,
    size_of,
    toy_grid,
    toy_scene,
    with_obstacle,
)

ROOT = Path(__file__).parents[2]
MASKS = ("arm_vs_arm", "arm_vs_body", "arm_vs_room", "body_vs_room")
ROUNDING = 2e-6
"""Joints are float32: seven roundings of 1.2e-7 rad move a far corner by up to 1e-6 m."""


def chain_of(seed, lowered):
    """Return the PR2's arm for even seeds, another arm of the class for odd ones."""
    if seed % 2 == 0:
        return lowered.arrays.chain
    chain = random_arm(np.random.default_rng(seed))
    # The twin walks the arcs of joint 1 between limits only.
    lower, upper = chain.lower.copy(), chain.upper.copy()
    lower[0], upper[0] = -2.0, 2.5
    return chain._replace(lower=lower, upper=upper)


def is_true(scene, grid, h, g, q):
    """Return whether the twin finds joints q at the goal, in their limits and free."""
    eased = scene._replace(
        margin=scene.margin - ROUNDING,
        room=scene.room._replace(pad=np.maximum(scene.room.pad - ROUNDING, 0.0)),
    )
    return reference_pairs.confirms(eased, grid, int(h), int(g), q.astype(np.float64))


def compare(scene, grid, scores, pairs, strays=0):
    """Hold the kernel's answers against the twin's, away from contact.

    Where a window is narrower than the lanes, rounding may show it to one of the two only: so
    many pairs may stray, and a claim of the kernel must be true even then.
    """
    strayed = 0
    for h, g in pairs:
        twin = reference_pairs.score(scene, grid, int(h), int(g))
        reason = int(scores.reason[h, g])
        if reason == REACHED and twin.reason == ARM_BLOCKED:
            # The kernel looks between two contacts as well; the twin can judge what it found.
            assert is_true(scene, grid, h, g, scores.joints[h, g])
        elif twin.clearance > 1e-6:  # at contact, rounding decides
            close = abs(scores.isotropy[h, g] - twin.isotropy) < 1e-4
            if reason != twin.reason or not close:
                assert {reason, twin.reason} <= {REACHED, JOINT_LIMITS, ARM_BLOCKED}, (h, g)
                assert reason != REACHED or is_true(scene, grid, h, g, scores.joints[h, g])
                strayed += 1
            # The outermost lanes of an arc lie on a limit: rounding decides whether they count,
            # and the refinement starts elsewhere. Its last spacing is 0.0125 (2/7)^3 = 3e-4 rad.
            # What is stored is held to 1e-6 in test_every_reached_pair_is_at_its_goal_and_free.
    assert strayed <= strays


def stratified(rng, reason, number):
    """Return up to `number` random pairs of every reason that occurs."""
    pairs = []
    for value in np.unique(reason):
        found = np.argwhere(reason == value)
        pairs.extend(found[rng.choice(len(found), min(number, len(found)), replace=False)])
    return pairs


@pytest.mark.parametrize("seed", range(6))
def test_the_kernel_agrees_with_the_twin_in_random_rooms(lowered, seed):
    scene, grid = toy_scene(chain_of(seed, lowered), seed, obstacles=2 + seed), toy_grid()
    scores = scores_of(scene, grid)
    pairs = stratified(np.random.default_rng(seed), scores.reason, 2)
    compare(scene, grid, scores, pairs)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 160))
def test_the_kernel_agrees_with_the_twin_in_many_random_rooms(lowered, seed):
    scene, grid = toy_scene(chain_of(seed, lowered), seed, obstacles=seed % 14), toy_grid()
    scores = scores_of(scene, grid)
    compare(scene, grid, scores, stratified(np.random.default_rng(seed), scores.reason, 6), 1)


def test_random_rooms_show_every_reason(lowered):
    # The tests above look at what occurs; so everything must occur.
    counts = np.zeros(len(Reason), int)
    for seed in range(8):
        scene = toy_scene(chain_of(seed, lowered), seed, obstacles=2 + seed)
        counts += np.bincount(scores_of(scene, toy_grid()).reason.ravel(), minlength=len(Reason))
    assert np.all(counts > 10), counts


@pytest.mark.parametrize("seed", range(30))
def test_every_reached_pair_is_at_its_goal_and_free(lowered, seed):
    chain = chain_of(seed, lowered)
    scene, grid = toy_scene(chain, seed, obstacles=seed % 10), toy_grid()
    scores = scores_of(scene, grid)
    reached = np.argwhere(scores.reason == REACHED)
    assert np.all(scores.isotropy[scores.reason != REACHED] == 0)
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
        assert scores.isotropy[h, g] == pytest.approx(exact, abs=1e-6 if exact > 0.05 else 3e-3)
    for h, g in np.random.default_rng(seed).permutation(reached)[:12]:
        assert is_true(scene, grid, h, g, scores.joints[h, g])


@pytest.mark.parametrize("seed", range(6))
def test_moving_room_goals_and_robot_together_changes_nothing(lowered, seed):
    scene, grid = toy_scene(chain_of(seed, lowered), seed), toy_grid()
    quarter, shift = turn(np.pi / 2), np.array([0.7, -1.3, 0.0])
    moved = scene._replace(
        room=scene.room._replace(R=quarter @ scene.room.R, p=scene.room.p @ quarter.T + shift),
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

    # Rounding of 1e-16 in other frames: it may turn a tie, or a lane at the edge of an arc.
    different = turned(after.reason) != before.reason
    assert np.mean(different) < 0.002
    both = (turned(after.reason) == REACHED) & (before.reason == REACHED)
    assert both.any()
    # As between kernel and twin above.
    gap = np.abs(turned(after.isotropy) - before.isotropy)[both]
    assert np.quantile(gap, 0.75) < 1e-6
    assert gap.max() < 1e-4


@pytest.mark.parametrize("seed", range(12))
def test_an_obstacle_more_reaches_nothing_more(lowered, seed):
    # Of the verdict alone: with several convex obstacles the best measure that a search with
    # finite steps finds may even rise when an obstacle sends its refinement elsewhere.
    rng = np.random.default_rng(seed)
    scene, grid = toy_scene(chain_of(seed, lowered), seed, obstacles=4), toy_grid()
    kind = (BOX, SPHERE)[seed % 2]
    # Close to a goal, so that it matters.
    p = scene.goal_p[0, 0] + rng.normal(scale=0.2, size=3)
    fuller = with_obstacle(scene, placed(kind, [0.15, 0.1, 0.2], rotation(rng), p, body=20))
    before, after = scores_of(scene, grid), scores_of(fuller, grid)
    # Looking between two contacts depends on which contacts there are: what is new must be true.
    for h, g in np.argwhere((after.reason == REACHED) & (before.reason != REACHED)):
        assert is_true(scene, grid, h, g, after.joints[h, g])
    assert np.sum(after.reason == REACHED) <= np.sum(before.reason == REACHED)
    # Base and gripper are exact questions: for them the law holds without exception.
    for reason in (BODY_BLOCKED, GRIPPER_BLOCKED):
        blocked = before.reason == reason
        assert np.all(np.isin(after.reason[blocked], (BODY_BLOCKED, GRIPPER_BLOCKED)))


def test_an_obstacle_on_the_gripper_blocks_it_wherever_the_robot_stands(lowered):
    scene, grid = toy_scene(lowered.arrays.chain, 2, obstacles=0, states=1), toy_grid(states=1)
    fuller = with_obstacle(scene, placed(SPHERE, [0.02, 0, 0], p=scene.goal_p[0, 1], body=9))
    scores = scores_of(fuller, grid)
    assert np.all(np.isin(scores.reason[:, 1], (BODY_BLOCKED, GRIPPER_BLOCKED)))


def test_states_of_the_environment_are_scored_each_for_itself(lowered):
    scene, grid = toy_scene(lowered.arrays.chain, 4, states=2), toy_grid(states=2)
    both = scores_of(scene, grid)
    half = size_of(grid) // 2
    for state in (0, 1):
        room = scene.room._replace(
            R=scene.room.R[state : state + 1], p=scene.room.p[state : state + 1]
        )
        alone = scene._replace(
            room=room,
            goal_R=scene.goal_R[state : state + 1],
            goal_p=scene.goal_p[state : state + 1],
        )
        one = scores_of(alone, toy_grid(states=1))
        rows = slice(state * half, (state + 1) * half)
        np.testing.assert_array_equal(one.reason, both.reason[rows])
        np.testing.assert_array_equal(one.isotropy, both.isotropy[rows])


@pytest.mark.parametrize("seed", range(4))
def test_slices_give_what_one_sweep_gives(lowered, seed):
    rng = np.random.default_rng(seed)
    scene, grid = toy_scene(chain_of(seed, lowered), seed, obstacles=9), toy_grid()
    whole = scores_of(scene, grid)
    cuts = np.sort(rng.choice(np.arange(1, size_of(grid)), 12, replace=False)).tolist()
    parts = scores_of(scene, grid, cuts)
    for name in ("reason", "isotropy", "joints"):
        np.testing.assert_array_equal(getattr(parts, name), getattr(whole, name), err_msg=name)
    # Which of several contacts names a blocked arm is the one that was found first.
    named = whole.reason != ARM_BLOCKED
    np.testing.assert_array_equal(parts.contact[named], whole.contact[named])
    assert np.all(parts.contact[~named] >= 0)


def test_every_order_of_the_shapes_gives_the_same_verdicts(lowered, rng):
    scene, grid = toy_scene(lowered.arrays.chain, 6, obstacles=8), toy_grid()
    order = rng.permutation(len(scene.room.kind))
    room = scene.room
    shuffled = scene._replace(
        room=room._replace(
            **{name: getattr(room, name)[order] for name in ("kind", "size", "pad", "body")},
            R=room.R[:, order],
            p=room.p[:, order],
        ),
        arm_vs_room=scene.arm_vs_room[:, order],
        body_vs_room=scene.body_vs_room[:, order],
    )
    before, after = scores_of(scene, grid), scores_of(shuffled, grid)
    np.testing.assert_array_equal(after.reason, before.reason)
    np.testing.assert_array_equal(after.isotropy, before.isotropy)


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


def test_a_room_without_shapes_blocks_nothing(lowered):
    scene, grid = toy_scene(lowered.arrays.chain, 2, obstacles=0, states=1), toy_grid(states=1)
    room = scene.room
    empty = scene._replace(
        room=room._replace(
            **{name: getattr(room, name)[:0] for name in ("kind", "size", "pad", "body", "frame")},
            R=room.R[:, :0],
            p=room.p[:, :0],
        ),
        arm_vs_room=scene.arm_vs_room[:, :0],
        body_vs_room=scene.body_vs_room[:, :0],
    )
    reasons = scores_of(empty, grid).reason
    assert not np.any(reasons == BODY_BLOCKED)
    assert np.any(reasons == REACHED)


@pytest.mark.parametrize("offset", [0.0, 0.1], ids=["shoulder on axis 1", "shoulder beside it"])
def test_goals_at_singularities_are_reached_truly_or_not_at_all(offset, rng):
    # Multiples of 45 degrees put wrist, aim and elbow exactly along axes: 0/0 in the closed form,
    # and limits of the same multiples put the first lanes of the search there.
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
    # Straight up, this arm needs every centimetre that `arm_radius` grants.
    chain = straight_arm(np.full(7, 3.0), 0.0)
    scene, grid = toy_scene(chain, 0), toy_grid()
    radius = arm_radius(build_problem(scene, grid))
    extents = []
    for q in (np.zeros(7), *rng.uniform(-3, 3, (50, 7))):
        poses = link_poses(chain, q)
        for shape, frame in zip(shapes_of(scene.arm, 0), scene.arm.frame, strict=True):
            placed_there = shape.moved(poses[frame - 1])
            extents.append(np.linalg.norm(placed_there.p) + placed_there.ball)
    assert 0.9 * radius < max(extents) <= radius - scene.margin


def test_a_margin_of_zero_still_sees_shapes_inside_each_other(lowered):
    scene, grid = toy_scene(lowered.arrays.chain, 2, obstacles=8), toy_grid()
    tight, loose = scores_of(scene._replace(margin=1e-9), grid), scores_of(scene, grid)
    none = scores_of(scene._replace(margin=0.0), grid)
    np.testing.assert_array_equal(none.reason, tight.reason)
    assert np.sum(none.reason == BODY_BLOCKED) > 0.9 * np.sum(loose.reason == BODY_BLOCKED)


# --- the real scene ---------------------------------------------------------------------------


@pytest.fixture(scope="module")
def real(lowered):
    """Every third place and every heading of the wheelchair grid, scored by the public sweep."""
    grid = lowered.grid._replace(
        base_x=lowered.grid.base_x[::3],
        base_y=lowered.grid.base_y[1::3],
        base_yaw=lowered.grid.base_yaw,
    )
    small = dataclasses.replace(lowered, grid=grid)
    weights = np.full(lowered.arrays.goal_p.shape[1], 1 / lowered.arrays.goal_p.shape[1])
    return small, weights, sweep(small, weights, jobs=2).scores


def test_two_jobs_give_what_one_gives(real):
    small, weights, two = real
    one = sweep(small, weights, jobs=1).scores
    for name in ("isotropy", "reason", "pair", "arm_joints"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name), err_msg=name)
    assert one.pair_names == two.pair_names


def test_pairs_are_named_exactly_where_something_blocks(real):
    _, _, scores = real
    blocked = np.isin(
        scores.reason, (Reason.BODY_BLOCKED, Reason.GRIPPER_BLOCKED, Reason.ARM_BLOCKED)
    )
    np.testing.assert_array_equal(scores.pair >= 0, blocked)
    assert scores.pair.max() == len(scores.pair_names) - 1


@pytest.mark.parametrize("number", [1, pytest.param(20, marks=pytest.mark.slow)])
def test_the_kernel_agrees_with_the_twin_on_real_pairs(real, number):
    small, _, scores = real
    joints = np.zeros((*scores.reason.shape, 7), np.float32)
    joints[scores.reason == REACHED] = scores.arm_joints

    @dataclasses.dataclass
    class Answers:
        reason: np.ndarray
        isotropy: np.ndarray
        joints: np.ndarray

    answers = Answers(scores.reason, scores.isotropy, joints)
    pairs = stratified(np.random.default_rng(number), scores.reason, number)
    assert {int(scores.reason[h, g]) for h, g in pairs} == set(map(int, Reason))
    compare(small.arrays, small.grid, answers, pairs)


def test_reached_pairs_are_true_for_the_twin(real, rng):
    small, _, scores = real
    reached = np.argwhere(scores.reason == REACHED)
    # The twin takes a second a pair here; `tcs verify` has Drake judge thousands.
    for h, g in reached[rng.choice(len(reached), 4, replace=False)]:
        q = np.asarray(scores.joints_of(int(h), int(g)))
        assert is_true(small.arrays, small.grid, h, g, q)


SCRIPT = """
import pickle, sys
import numpy as np
from tcs.kernel.problem import build_problem
from tcs.kernel.sweep import Scores, gripper_contacts, score_slice
with open(sys.argv[1], "rb") as file:
    scene, grid, rows = pickle.load(file)
problem = build_problem(scene, grid)
goals = scene.goal_p.shape[1]
shape = (rows[1] - rows[0], goals)
scores = Scores(
    np.full(shape, 99, np.uint8),
    np.zeros(shape, np.int32),
    np.zeros(shape, np.float32),
    np.zeros((*shape, 7), np.float32),
)
with np.errstate(all="ignore"):
    score_slice(problem, gripper_contacts(problem), *rows, scores)
with open(sys.argv[2], "wb") as file:
    pickle.dump(tuple(scores), file)
"""


def test_without_the_compiler_the_answers_are_the_same(lowered, tmp_path):
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
    # Near the flat top of the measure that decides which lane wins, within the last spacing of
    # the refinement: 0.0125 (2/7)^3 = 3e-4 rad of joint 1, and a few times that elsewhere.
    np.testing.assert_allclose(value, whole.isotropy[slice(*rows)], atol=1e-6)
    np.testing.assert_allclose(joints, whole.joints[slice(*rows)], atol=1e-3)
