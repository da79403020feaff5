"""Goals with freedom: their poses, and scores against other scenes, reference and dense scan."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tcs.kernel import sweep
from tcs.kernel.contacts import NO_CONTACT
from tcs.kernel.dexterity import dexterity
from tcs.kernel.freedom.cap import cap_cosine, cap_pose
from tcs.kernel.freedom.forms import COLUMNS
from tcs.kernel.freedom.goals import free_goals
from tcs.kernel.freedom.reach import wrist_reach
from tcs.kernel.problem import build_problem
from tcs.kernel.rows import grid_rows, rows_at
from tcs.kernel.scores import ARM_BLOCKED, BODY_BLOCKED, JOINT_LIMITS, REACHED, TOO_FAR
from tcs.kernel.sweep import blocked_grippers, gripper_contacts
from tcs.kernel.verification import scans
from tcs.kernel.verification.scans import dense_scans, drawn_poses
from tcs.model.tasks import Freedom
from tests.kernel.shapes import about, random_arm, rotation, straight_arm
from tests.kernel.test_six_joints import six_joint_chain
from tests.kernel.toy import scores_of, toy_grid, toy_scene
from tests.reference.kinematics import compose, link_poses
from tests.reference.pairs import at_offset, free_score, is_served, offset

X = (1.0, 0.0, 0.0)
FREEDOMS = {
    "rotation": Freedom(axis=(0.6, 0.0, 0.8), rotates=True),
    "symmetry": Freedom(axis=X, fold=3),
    "cone": Freedom(axis=X, tilt=0.4),
    "cone, rotation": Freedom(axis=X, tilt=0.4, rotates=True),
    "box": Freedom(box=(0.01, 0.0, 0.03)),
    "orientation": Freedom.of_orientation(),
}
SEED = 4
CHAIN = random_arm(np.random.default_rng(SEED))


def scene_with(free, goals=2, seed=SEED, chain=CHAIN):
    """Return a toy scene whose goals are all free."""
    scene = toy_scene(chain, seed, goals=goals, states=1)
    rows = np.repeat(free.row()[None], goals, axis=0)
    return scene._replace(freedom=rows)


@pytest.mark.parametrize("name", FREEDOMS)
def test_sampled_and_drawn_poses_are_within_the_freedom(name):
    free = FREEDOMS[name]
    goals = free_goals(free.row()[None], CHAIN)
    assert np.all(goals.u[0] == 0.0)
    tools = [offset(goals.form[0], u) for u in goals.u]
    tools += list(zip(*drawn_poses(goals.form[0]), strict=True))
    for R, p in tools:
        assert max(free.errors(R, p)) < 1e-9
    apart = {tuple(np.round(np.append(R, p), 6)) for R, p in tools[: goals.first[1]]}
    assert len(apart) == goals.first[1]


def test_a_scene_without_freedom_is_scored_as_before():
    scene = toy_scene(CHAIN, SEED, goals=2, states=1)
    none = scene._replace(freedom=np.zeros((2, COLUMNS)))
    for one, other in zip(
        scores_of(scene, toy_grid(states=1)), scores_of(none, toy_grid(states=1)), strict=True
    ):
        np.testing.assert_array_equal(one, other)


def test_a_symmetric_tool_scores_the_better_of_its_poses():
    scene, grid = scene_with(Freedom(axis=X, fold=2)), toy_grid(states=1)
    both = scores_of(scene, grid)
    turned = scene._replace(
        goal_R=scene.goal_R @ about(np.array(X), math.pi), freedom=scene.freedom[:0]
    )
    parts = [scores_of(scene._replace(freedom=scene.freedom[:0]), grid), scores_of(turned, grid)]
    reached = [part.reason == REACHED for part in parts]
    assert np.any(reached[0] & ~reached[1])
    assert np.any(reached[1] & ~reached[0])
    np.testing.assert_array_equal(both.reason == REACHED, reached[0] | reached[1])
    better = np.maximum(
        *(np.where(r, p.dexterity, 0.0) for r, p in zip(reached, parts, strict=True))
    )
    # A rotation by pi is rounded.
    np.testing.assert_allclose(
        np.where(both.reason == REACHED, both.dexterity, 0), better, atol=1e-6
    )


def turning_chain(limit, chain=CHAIN):
    """Return an arm whose last joint turns the tool on the spot, within limits [rad]."""
    chain = chain._replace(
        R=chain.R.copy(),
        p=chain.p.copy(),
        lower=np.append(chain.lower[:6], -limit),
        upper=np.append(chain.upper[:6], limit),
    )
    chain.p[7] = [0.0, 0.0, 0.2]
    return chain


def axis_of_last(chain):
    """Return the axis of the last joint in the tool frame."""
    return tuple(chain.R[7].T @ [0.0, 0.0, 1.0])


def test_a_rotation_that_the_last_joint_makes_frees_nothing():
    chain = turning_chain(np.inf)
    scene = scene_with(Freedom(axis=axis_of_last(chain), rotates=True), chain=chain)
    # Only the gripper, which the last joint carries, tells one angle from another.
    bare = np.zeros_like(scene.arm_vs_environment), np.zeros_like(scene.arm_vs_body)
    scene = scene._replace(
        arm_vs_environment=bare[0], arm_vs_body=bare[1], arm_vs_arm=np.zeros_like(scene.arm_vs_arm)
    )
    grid = toy_grid(states=1)
    free, nominal = (
        scores_of(scene, grid),
        scores_of(scene._replace(freedom=scene.freedom[:0]), grid),
    )
    reached = nominal.reason == REACHED
    assert 5 < np.sum(reached) < reached.size
    # The bound of the wrist knows some to be too far that the arcs of the elbow leave open.
    known = (free.reason == TOO_FAR) & (nominal.reason == JOINT_LIMITS)
    np.testing.assert_array_equal(free.reason, np.where(known, TOO_FAR, nominal.reason))
    np.testing.assert_array_equal(free.joints, nominal.joints)


@pytest.mark.parametrize("joints", ["six", "seven"])
@pytest.mark.parametrize("limit", [np.inf, 2.0, 0.6])
def test_a_rotation_about_the_last_axis_reaches_what_its_angles_reach(joints, limit):
    """One angle decides for all that the last joint makes, but for contacts with the gripper."""
    chain = CHAIN if joints == "seven" else six_joint_chain("spherical wrist", 10)
    wide = chain._replace(lower=np.full(7, -3.0), upper=np.full(7, 3.0))
    chain = turning_chain(limit, wide)
    axis = axis_of_last(chain)
    scene = toy_scene(chain, 10, obstacles=2, goals=4, states=1)
    rows = np.repeat(Freedom(axis=axis, rotates=True).row()[None], 4, axis=0)
    scene = scene._replace(freedom=rows)
    grid, free = toy_grid(states=1), free_goals(scene.freedom, chain)
    assert np.all(free.turned)
    assert len(free.u) == 1
    scores = scores_of(scene, grid)
    best, angles = np.zeros(scores.reason.shape), np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    for angle in angles:
        turned = scene.goal_R @ about(np.array(axis), angle)
        part = scores_of(scene._replace(goal_R=turned, freedom=scene.freedom[:0]), grid)
        best = np.maximum(best, np.where(part.reason == REACHED, part.dexterity, 0.0))
    reached = scores.reason == REACHED
    assert 2 < np.sum(reached) < reached.size
    assert np.all(reached | (best == 0.0))
    assert np.mean(reached == (best > 0.0)) > 0.97
    both = reached & (best > 0.0)
    assert np.all(scores.dexterity[both] >= 0.98 * best[both])
    for h, g in np.argwhere(reached):
        assert is_served(scene, grid, h, g, scores.joints[h, g].astype(float))


def test_other_rotations_are_sampled():
    chain = turning_chain(2.0)
    last, aside = axis_of_last(chain), axis_of_last(chain._replace(R=chain.R[::-1]))
    rows = np.stack([Freedom(axis=axis, rotates=True).row() for axis in (last, aside)])
    np.testing.assert_array_equal(free_goals(rows, chain).turned, [True, False])
    beside = chain._replace(p=np.array(chain.p) + 0.01)
    assert not np.any(free_goals(rows, beside).turned)
    # A measure that falls near limits depends on the angle of a limited joint, of no other.
    limited = dexterity("isotropy-limited")
    assert not np.any(free_goals(rows, chain, limited).turned)
    endless = turning_chain(np.inf)
    assert free_goals(rows, endless, limited).turned[0]


def test_kernel_agrees_with_reference():
    scene, grid = scene_with(FREEDOMS["rotation"], goals=1), toy_grid(states=1)
    scores, free = scores_of(scene, grid), free_goals(scene.freedom, CHAIN)
    nominal = scores_of(scene._replace(freedom=scene.freedom[:0]), grid)
    reached = scores.reason == REACHED
    assert np.all(reached | (nominal.reason != REACHED))
    assert np.any(reached & (nominal.reason != REACHED))
    gained = np.argwhere(reached & (nominal.reason != REACHED))
    for h, g in gained:
        assert is_served(scene, grid, h, g, scores.joints[h, g].astype(float))
        bent = scores.joints[h, g].astype(float)
        bent[3] += 1e-3
        assert not is_served(scene, grid, h, g, bent)
    h, g = gained[0]
    expected = free_score(scene, grid, h, g, free)
    # Refinement, and poses between the samples, only add to what the reference finds.
    assert scores.dexterity[h, g] >= expected.dexterity - 1e-6


@pytest.mark.parametrize("name", FREEDOMS)
def test_dense_scan_finds_no_further_solution(name, rng, monkeypatch):
    monkeypatch.setattr(scans, "ANGLES", 72)
    monkeypatch.setattr(scans, "POSES", 100)
    scene, grid = scene_with(FREEDOMS[name]), toy_grid(states=1)
    scores, problem = scores_of(scene, grid), build_problem(scene)
    never = np.isin(scores.reason, (JOINT_LIMITS, ARM_BLOCKED, TOO_FAR))
    pairs = np.argwhere(never)
    pairs = pairs[rng.choice(len(pairs), min(4, len(pairs)), replace=False)]
    assert np.all(
        dense_scans(problem, grid_rows(grid), pairs, 800, np.empty((len(pairs), 7))) < 0.0
    )
    found = np.argwhere(scores.reason == REACHED)[:2]
    values = dense_scans(problem, grid_rows(grid), found, 800, np.empty((len(found), 7)))
    assert np.all(values > 0.0)


def test_a_gripper_is_blocked_where_all_its_poses_are():
    scene = scene_with(FREEDOMS["rotation"], goals=4)
    problem = build_problem(scene)
    free, every, samples = problem.goals.freedom, [], []
    for g in range(4):
        poses = [at_offset(scene, g, offset(free.form[g], u)) for u in free.u]
        codes = [gripper_contacts(build_problem(posed))[0, g] for posed in poses]
        every.append(np.all(np.array(codes) != NO_CONTACT))
        samples.append(np.all(np.array(codes[: free.first[1]]) != NO_CONTACT))
    of_samples = gripper_contacts(problem)[0] != NO_CONTACT
    np.testing.assert_array_equal(free.codes, free.first)
    parts = [np.all(of_samples[a:b]) for a, b in itertools.pairwise(free.first)]
    np.testing.assert_array_equal(parts, samples)
    np.testing.assert_array_equal(blocked_grippers(problem)[0], every)


def test_a_free_pose_between_blocked_samples_counts(monkeypatch):
    problem = build_problem(scene_with(FREEDOMS["rotation"], goals=4))
    expected = blocked_grippers(problem)
    assert not np.all(expected)
    codes = np.zeros_like(gripper_contacts(problem))
    monkeypatch.setattr(sweep, "gripper_contacts", lambda _: codes)
    np.testing.assert_array_equal(blocked_grippers(problem), expected)


def test_goals_with_the_same_freedom_share_their_poses():
    rows = np.stack([FREEDOMS[name].row() for name in ("cone", "orientation", "cone")])
    free = free_goals(rows, CHAIN)
    assert free.start[0] == free.start[2] != free.start[1]
    one, both = (free_goals(rows[chosen], CHAIN) for chosen in ([1], [0, 1]))
    assert len(free.u) == len(both.u)
    a = free.start[1]
    np.testing.assert_array_equal(free.u[a : a + len(one.u)], one.u)
    rows_of = [
        x.children[x.child_first[i] : x.child_first[i + 1]] for x, i in ((free, a), (one, 0))
    ]
    np.testing.assert_array_equal(*rows_of)


@pytest.mark.parametrize("name", ["rotation", "cone", "orientation"])
def test_further_poses_are_next_to_their_samples(name):
    free = free_goals(FREEDOMS[name].row()[None], CHAIN)
    samples, poses = free.first[1], len(free.u)
    if free.fallback[0] >= 0:
        poses = free.start[free.fallback[0]]
    assert poses > 2 * samples
    turns = Rotation.from_matrix([offset(free.form[0], u)[0] for u in free.u])
    rng = np.random.default_rng(0)
    for k in rng.choice(np.arange(samples, poses), 40, replace=False):
        apart = (turns[:samples].inv() * turns[k]).magnitude()
        nearest = np.sort(apart)[:2]
        two = np.unique(free.parents[k])
        if name != "cone":
            # The angles of a rotation are spaced evenly, and two samples may be as near.
            np.testing.assert_allclose(np.sort(apart[two]), nearest, atol=1e-9)
        for i in two:
            assert k in free.children[free.child_first[i] : free.child_first[i + 1]]
    children = free.children[: free.child_first[poses]]
    assert np.all(np.bincount(children, minlength=poses)[samples:] > 0)


def cone(degrees, **more):
    """Return the freedom of a cone about x."""
    return Freedom(axis=X, tilt=math.radians(degrees), **more)


BOX = (0.01, 0.01, 0.02)
WIDER = {
    "cone": [cone(d) for d in (3, 12, 20, 25, 30, 90)],
    "rotation": [cone(20), cone(20, rotates=True), cone(33, rotates=True)],
    "rotation first": [Freedom(axis=X, rotates=True), cone(20, rotates=True)],
    "symmetry": [cone(20, fold=2), cone(25, fold=4), cone(25, rotates=True)],
    "symmetry alone": [Freedom(axis=X, fold=6), Freedom(axis=X, rotates=True)],
    "box": [Freedom(box=(0.01, 0.0, 0.0)), Freedom(box=BOX), Freedom(box=(0.012, 0.03, 0.02))],
    "all": [cone(20, box=BOX), cone(20, box=BOX, rotates=True), cone(40, box=BOX, rotates=True)],
    "displaced": [Freedom(axis=X, rotates=True, box=BOX), cone(10, box=BOX, rotates=True)],
    "orientation": [Freedom.of_orientation(), Freedom.of_orientation(BOX)],
}
"""Freedoms, each within the next one."""


@pytest.mark.parametrize("name", WIDER)
def test_a_wider_freedom_has_the_poses_of_a_narrower_one(name):
    """And the same samples next to each of them: so what is tried, until one serves, is more."""
    found = []
    for free in WIDER[name]:
        goals = free_goals(free.row()[None], CHAIN)
        keys, samples = [u.tobytes() for u in goals.u + 0.0], goals.first[1]
        near = {
            (keys[n], keys[k])
            for n in range(samples)
            for k in goals.children[goals.child_first[n] : goals.child_first[n + 1]]
        }
        found.append((set(keys[:samples]), near))
    for narrow, wide in itertools.pairwise(found):
        assert narrow[0] < wide[0] or (narrow[0] == wide[0] and narrow[1] < wide[1])
        assert narrow[1] <= wide[1]


@pytest.mark.parametrize("joints", ["six", "seven"])
@pytest.mark.parametrize("name", ["cone", "rotation", "box", "all"])
def test_a_wider_freedom_reaches_no_less(name, joints):
    chain = CHAIN if joints == "seven" else six_joint_chain("spherical wrist", 10)
    before = np.zeros(1, np.bool_)
    for free in WIDER[name][1:4]:
        scene = scene_with(free, goals=3, seed=10, chain=chain)
        reached = scores_of(scene, toy_grid(states=1)).reason == REACHED
        assert np.all(reached | ~before)
        before = reached
    assert 1 < np.sum(before) < before.size


def test_any_orientation_reaches_no_less_than_a_cone():
    """Of these pairs a wide cone reached some that the search of any orientation missed."""
    chain = six_joint_chain("spherical wrist", 10)
    grid, wide = toy_grid(states=1), cone(179)
    scene = toy_scene(chain, 10, obstacles=12, goals=3, states=1)
    freed = [
        scores_of(scene._replace(freedom=np.repeat(free.row()[None], 3, axis=0)), grid)
        for free in (wide, Freedom.of_orientation())
    ]
    reached = [scores.reason == REACHED for scores in freed]
    assert np.sum(reached[0]) > 5
    assert np.all(reached[1] | ~reached[0])
    free = free_goals(Freedom.of_orientation().row()[None], chain)
    widest = free_goals(cone(179.999999).row()[None], chain)
    last = free.start[free.fallback[0]]
    assert {u.tobytes() for u in widest.u + 0.0} <= {u.tobytes() for u in free.u[last:] + 0.0}


def test_a_nominal_goal_beside_a_free_one_keeps_its_score():
    scene, grid = scene_with(FREEDOMS["orientation"]), toy_grid(states=1)
    mixed = scene._replace(freedom=scene.freedom * [[0.0], [1.0]])
    nominal = scores_of(scene._replace(freedom=scene.freedom[:0]), grid)
    scores = scores_of(mixed, grid)
    np.testing.assert_array_equal(scores.reason[:, 0] == REACHED, nominal.reason[:, 0] == REACHED)
    np.testing.assert_array_equal(scores.joints[:, 0], nominal.joints[:, 0])
    moved = at_offset(
        mixed, 1, offset(free_goals(mixed.freedom, CHAIN).form[1], np.array([1.0, 0.2, 0, 0, 0, 0]))
    )
    assert np.abs(moved.goal_R[:, 1] - scene.goal_R[:, 1]).max() > 0.1


def test_prismatic_joints_that_come_first_bound_the_wrist(rng):
    chain = random_arm(rng)
    sliding = np.array([0.0, 1.0, 1.0, 2.0, 0.0, 0.0, 0.0])
    R, p = chain.R.copy(), chain.p.copy()
    R[1], p[1] = np.eye(3), 0.0
    lower, upper = np.maximum(chain.lower, -np.pi), np.minimum(chain.upper, np.pi)
    lower[:4], upper[:4] = [0.0, -0.2, 0.1, 0.0], [0.0, 0.3, 0.9, 0.2]
    chain = chain._replace(R=R, p=p, lower=lower, upper=upper, joints=6, slides=sliding)
    reach = wrist_reach(chain)
    assert reach.slabs.shape == (3, 4)
    nearest = np.full(3, np.inf)
    for n in range(2000):
        q = rng.uniform(lower, upper)
        if n < 1000:
            q[1:4] = np.where(n >> np.arange(3) & 1, lower[1:4], upper[1:4])
        R_AT, p_AT = link_poses(chain, q)[-1]
        away = p_AT + R_AT @ reach.wrist - reach.pivot
        assert np.linalg.norm(away) <= reach.span
        left = reach.slabs[:, 3] - np.abs(reach.slabs[:, :3] @ away)
        nearest = np.minimum(nearest, left)
    assert np.all((nearest >= 0.0) & (nearest < 0.5 * reach.slabs[:, 3]))


@pytest.mark.parametrize(
    "free", [*FREEDOMS.values(), cone(70), Freedom(axis=X, fold=2, tilt=0.3)], ids=str
)
def test_wrists_are_in_a_sphere(free):
    free = free_goals(free.row()[None], CHAIN)
    away = np.linalg.norm(free.wrist - free.around[0, :3], axis=1)
    assert np.all(away <= free.around[0, 3] + 1e-9)
    assert np.max(away) > 0.4 * free.around[0, 3]


def straight_chain(joints):
    """Return an arm of right angles that can be straight: 0.42 + 0.4 m to its wrist."""
    chain = straight_arm(np.full(7, np.inf), 0.0)
    if joints == 7:
        return chain
    R, p = chain.R.copy(), chain.p.copy()
    # Without the joint that rotates the upper arm, the elbow bends about the shoulder's direction.
    R[1:3], p[1] = np.stack([np.eye(3), R[1]]), 0.0
    R[3] = np.eye(3)
    p[3] = [0.42, 0.0, 0.0]
    return chain._replace(R=R, p=p, joints=6)


@pytest.mark.parametrize("joints", [5, 6, 7])
@pytest.mark.parametrize("slides", [(), (3, 4)], ids=["revolute", "prismatic"])
def test_no_posture_takes_the_wrist_out_of_its_reach(joints, slides, rng):
    chain = random_arm(rng)
    sliding = np.zeros(7)
    sliding[list(slides)] = 0.5
    R, p = chain.R.copy(), chain.p.copy()
    R[1 : 8 - joints], p[1 : 8 - joints] = np.eye(3), 0.0
    lower, upper = np.maximum(chain.lower, -np.pi), np.minimum(chain.upper, np.pi)
    lower[: 7 - joints], upper[: 7 - joints] = 0.0, 0.0
    chain = chain._replace(R=R, p=p, lower=lower, upper=upper, joints=joints, slides=sliding)
    reach, farthest = wrist_reach(chain), 0.0
    for _ in range(500):
        ends = rng.random(7) < 0.3
        q = np.where(ends, np.where(rng.random(7) < 0.5, lower, upper), rng.uniform(lower, upper))
        R_AT, p_AT = link_poses(chain, q)[-1]
        away = np.linalg.norm(p_AT + R_AT @ reach.wrist - reach.pivot)
        assert away <= reach.span
        farthest = max(farthest, away)
    assert farthest > 0.5 * reach.span


@pytest.mark.parametrize("joints", [6, 7])
def test_a_straight_arm_spans_its_reach(joints):
    reach = wrist_reach(straight_chain(joints))
    assert reach.span == pytest.approx(0.82, abs=1e-6)
    np.testing.assert_allclose(reach.pivot, [0.0, 0.0, 0.34], atol=1e-6)
    np.testing.assert_allclose(reach.wrist, [0.0, 0.0, -0.126], atol=1e-6)


@pytest.mark.parametrize("name", ["rotation", "cone", "box", "orientation"])
def test_wrists_are_where_the_poses_take_them(name):
    free = free_goals(FREEDOMS[name].row()[None], CHAIN)
    for u, wrist in zip(free.u, free.wrist, strict=True):
        R, p = offset(free.form[0], u)
        np.testing.assert_allclose(wrist, p + R @ free.reach.wrist, atol=1e-12)


def test_poses_of_a_cap_are_evenly_in_it(rng):
    free = free_goals(FREEDOMS["orientation"].row()[None], straight_chain(7))
    reach, pivot = free.reach, rotation(rng) @ [0.0, 0.0, 0.93]
    cosine = cap_cosine(reach.wrist, pivot, reach.span)
    wrists, tools = [], []
    for n in range(200):
        u = np.empty(6)
        cap_pose(free.form[0], reach.wrist, pivot, cosine, n, u)
        R, p = offset(free.form[0], u)
        np.testing.assert_array_equal(p, 0.0)
        assert np.linalg.norm(R @ reach.wrist - pivot) <= reach.span + 1e-9
        wrists.append(R @ reach.wrist / np.linalg.norm(reach.wrist))
        tools.append(R)
    # The mean of the cap is half its height from the rim, along its middle.
    middle = pivot / np.linalg.norm(pivot)
    np.testing.assert_allclose(np.mean(wrists, axis=0), (1.0 + cosine) / 2.0 * middle, atol=0.01)
    # Rotations about the wrist are even: a fixed direction across it has no mean.
    assert np.linalg.norm(np.mean(tools, axis=0) @ X) < 0.1
    # Beyond the rim, the wrist is out of reach.
    edge = np.arccos(cosine) + 0.01
    beyond = about(np.cross(middle, np.eye(3)[0]), edge) @ middle * np.linalg.norm(reach.wrist)
    assert np.linalg.norm(beyond - pivot) > reach.span


@pytest.mark.parametrize(
    ("away", "cosine"),
    # With the wrist 0.1 m from the tool and a span of 0.7 m; where the pivot is 0.7 m away, the
    # rim of the cap is at an isosceles triangle.
    [(0.0, -1.0), (0.59, -1.0), (0.7, 0.05 / 0.7), (0.8 - 1e-12, 1.0), (0.81, 2.0)],
)
def test_a_cap_holds_what_is_within_reach(away, cosine):
    pivot = np.array([away, 0.0, 0.0])
    assert cap_cosine(np.array([0.0, 0.0, -0.1]), pivot, 0.7) == pytest.approx(cosine, abs=1e-9)


def test_a_wrist_at_the_tool_has_no_cap():
    assert cap_cosine(np.zeros(3), np.array([0.69, 0.0, 0.0]), 0.7) == -1.0
    assert cap_cosine(np.zeros(3), np.array([0.71, 0.0, 0.0]), 0.7) == 2.0


@pytest.mark.parametrize("joints", [6, 7])
def test_goals_at_the_edge_of_reach_are_reached(joints, rng):
    """The directions from which they are reached are few: 2 to 14 degrees about a single one."""
    chain = straight_chain(joints)
    scene, grid = scene_with(FREEDOMS["orientation"], goals=1, chain=chain), toy_grid(states=1)
    bare = np.zeros_like(scene.arm_vs_environment), np.zeros_like(scene.arm_vs_body)
    scene = scene._replace(
        arm_vs_environment=bare[0], arm_vs_body=bare[1], arm_vs_arm=np.zeros_like(scene.arm_vs_arm)
    )
    alone = grid._replace(
        base_x=np.zeros(1), base_y=np.zeros(1), base_yaw=np.zeros(1), torso_levels=1
    )
    scene = scene._replace(
        arm_base_R=scene.arm_base_R[:1],
        arm_base_p=scene.arm_base_p[:1],
        body=scene.body._replace(R=scene.body.R[:1], p=scene.body.p[:1] + 9.0),
    )
    for short in np.repeat([1e-4, 3e-4, 1e-3, 4e-3, -1e-4], 4):
        direction = rotation(rng)[:, 0]
        p_AG = np.array([0.0, 0.0, 0.34]) + (0.82 + 0.126 - short) * direction
        R_WG, p_WG = compose((scene.arm_base_R[0], scene.arm_base_p[0]), (rotation(rng), p_AG))
        posed = scene._replace(goal_R=R_WG[None, None], goal_p=p_WG[None, None])
        scores = scores_of(posed, alone)
        assert scores.reason[0, 0] == (REACHED if short > 0 else TOO_FAR), short
        if short > 0:
            assert is_served(posed, alone, 0, 0, scores.joints[0, 0].astype(float))


def test_a_pose_free_of_contact_among_blocked_ones_is_found():
    """One pair of this scene is reached by few orientations, none of which is next to a sample."""
    chain = six_joint_chain("spherical wrist", 10)
    scene, grid = toy_scene(chain, 10, obstacles=12, goals=3, states=1), toy_grid(states=1)
    scene = scene._replace(freedom=np.repeat(FREEDOMS["orientation"].row()[None], 3, axis=0))
    scores, problem = scores_of(scene, grid), build_problem(scene)
    assert np.sum(scores.reason == REACHED) > 9
    for goal in range(3):
        left = np.flatnonzero(~np.isin(scores.reason[:, goal], (REACHED, BODY_BLOCKED)))
        assert len(left) > 10
        posed = scans.at_poses(problem, 0, goal)
        for h in left:
            # Goals of the scan are poses without freedom.
            assert scans.best_score(posed, rows_at(grid, [h]))[0] < 0.0


def test_samples_of_any_orientation_leave_no_wide_gap():
    """Half of all orientations are within 25 degrees of a sample; with 96 samples, within 30."""
    goals = free_goals(FREEDOMS["orientation"].row()[None], CHAIN)
    samples = Rotation.from_matrix([offset(goals.form[0], u)[0] for u in goals.u[: goals.first[1]]])
    drawn = Rotation.random(300, random_state=1)
    nearest = [np.degrees((samples.inv() * one).magnitude().min()) for one in drawn]
    assert np.median(nearest) < 25.0
