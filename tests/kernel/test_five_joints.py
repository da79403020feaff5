"""Arms of five joints: all postures over a free rotation, scores against reference and scan."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tcs.errors import ArmClassError
from tcs.kernel.arrays import Chain
from tcs.kernel.dexterity import MEASURES
from tcs.kernel.dexterity.measures import measure_at
from tcs.kernel.five_joints.turned import turned_arm, turned_chain
from tcs.kernel.freedom.goals import free_goals
from tcs.kernel.problem import build_problem
from tcs.kernel.rows import rows_at
from tcs.kernel.scores import ARM_BLOCKED, JOINT_LIMITS, REACHED, TOO_FAR
from tcs.kernel.six_joints.solutions import six_joint_solutions
from tcs.kernel.solvers import new_solver
from tcs.kernel.verification.newton_solutions import newton_solutions, within
from tcs.kernel.verification.plain_dexterity import measured, prescribed
from tcs.kernel.verification.scans import dense_scan
from tcs.model.tasks import Freedom
from tests.kernel.judge import stratified
from tests.kernel.shapes import about, around, random_arm, rotation
from tests.kernel.toy import scores_of, toy_grid, toy_scene
from tests.reference.kinematics import jacobian, link_poses
from tests.reference.pairs import is_served
from tests.reference.pairs import score as reference_score

AXIS = (0.6, 0.0, 0.8)
TURN = Freedom(axis=AXIS, rotates=True)
SEED = 8


@cache
def five_joint_chain(seed, slides=()):
    """Return a random arm of five joints: any twists and offsets, prismatic at some indices."""
    rng = np.random.default_rng(seed)
    R = np.array([np.eye(3)] * 3 + [rotation(rng) for _ in range(5)])
    p = rng.uniform(-0.3, 0.3, (8, 3))
    p[1:3] = 0.0
    own, sliding = random_arm(rng), np.zeros(7)
    sliding[list(slides)] = 1.0
    lower, upper = np.full(7, -np.inf), np.full(7, np.inf)
    lower[2:], upper[2:] = own.lower[2:], own.upper[2:]
    return Chain(R, p, lower, upper, 5, sliding)


def drawn(rng, chain):
    """Return joints within the limits and the tool pose there."""
    q = rng.uniform(np.maximum(chain.lower, -np.pi), np.minimum(chain.upper, np.pi))
    q[:2] = 0.0
    return q, link_poses(chain, q)[-1]


def scene_of(free, goals=3):
    chain = five_joint_chain(SEED)
    scene = toy_scene(chain, SEED, goals=goals, obstacles=3, states=1)
    return scene._replace(freedom=np.repeat(free.row()[None], goals, axis=0))


@pytest.mark.parametrize("slides", [(), (3, 4, 6)], ids=["revolute", "three prismatic"])
def test_every_posture_is_found_whatever_the_angle_of_the_goal(slides, rng):
    for seed in range(4):
        chain, axis = five_joint_chain(seed, slides), np.array(AXIS)
        arm = turned_arm(chain, axis)
        for _ in range(20):
            q, (R, p) = drawn(rng, chain)
            angle = rng.uniform(-np.pi, np.pi)
            goal = R @ about(axis, -angle)
            found = six_joint_solutions(arm, goal, p)
            postures = np.concatenate([np.zeros((len(found), 2)), found[:, 1:6]], axis=1)
            apart = [np.abs(around(other - q)).max() for other in postures]
            best = int(np.argmin(apart))
            assert apart[best] < 1e-6
            assert around(-found[best, 6] - angle) == pytest.approx(0.0, abs=1e-6)
            for other, turned in zip(postures, found[:, 6], strict=True):
                S, s = link_poses(chain, other)[-1]
                np.testing.assert_allclose(S, goal @ about(axis, -turned), atol=2e-7)
                np.testing.assert_allclose(s, p, atol=2e-7)


def test_newtons_method_finds_no_further_posture(rng):
    chain, axis = five_joint_chain(1), np.array(AXIS)
    arm, turned = turned_arm(chain, axis), turned_chain(chain, axis)
    for _ in range(3):
        _, (R, p) = drawn(rng, chain)
        found = six_joint_solutions(arm, R, p)
        for other in within(turned, newton_solutions(turned, R, p)):
            assert min(np.abs(around(other - q)).max() for q in found) < 1e-6


def test_the_measure_is_of_the_five_directions_that_goals_prescribe(rng):
    chain = five_joint_chain(SEED)
    scene = scene_of(TURN, goals=1)
    for measure in MEASURES:
        problem = build_problem(scene, measure)
        q, (R, _) = drawn(rng, chain)
        J = prescribed(jacobian(chain, q), R @ np.array(AXIS))
        assert J.shape == (5, 5)
        expected = measured(J, q, chain.lower, chain.upper, measure)
        assert measure_at(problem, q) == pytest.approx(expected, abs=1e-7)


def test_the_isotropy_vanishes_where_the_free_rotation_replaces_a_joint():
    """With the last joint about the free axis, it moves the tool in no direction that counts."""
    chain = five_joint_chain(SEED)
    R, p = chain.R.copy(), chain.p.copy()
    R[7], p[7] = np.eye(3), [0.0, 0.0, 0.2]
    chain = chain._replace(R=R, p=p)
    scene = toy_scene(chain, SEED, goals=1, states=1)._replace(
        freedom=Freedom(axis=(0.0, 0.0, 1.0), rotates=True).row()[None]
    )
    problem = build_problem(scene)
    assert measure_at(problem, np.linspace(0.0, 0.6, 7)) < 1e-3
    with pytest.raises(ArmClassError, match=r"adds nothing.*another axis"):
        new_solver(problem)


def test_goals_without_a_free_rotation_are_refused():
    scene = toy_scene(five_joint_chain(SEED), SEED, goals=1, states=1)
    with pytest.raises(ArmClassError, match="five joints cannot take every tool pose"):
        new_solver(build_problem(scene))


def test_kernel_agrees_with_reference(rng):
    scene, grid = scene_of(TURN), toy_grid(states=1)
    scores = scores_of(scene, grid)
    assert np.sum(scores.reason == REACHED) > 5
    for h, g in stratified(rng, scores.reason, 3):
        expected, reason = reference_score(scene, grid, int(h), int(g)), scores.reason[h, g]
        if expected.clearance > 1e-6:  # at contact, rounding decides
            assert reason == expected.reason, (h, g)
        if reason == REACHED:
            assert scores.dexterity[h, g] == pytest.approx(expected.dexterity, abs=1e-6)
            assert is_served(scene, grid, h, g, scores.joints[h, g].astype(float))


@pytest.mark.parametrize("tilt", [0.0, 0.4], ids=["rotation", "cone"])
def test_dense_scan_finds_what_the_sweep_finds(tilt, rng, monkeypatch):
    monkeypatch.setattr("tcs.kernel.verification.scans.POSES", 100)
    scene, grid = scene_of(Freedom(axis=AXIS, rotates=True, tilt=tilt)), toy_grid(states=1)
    problem, scores = build_problem(scene), scores_of(scene, grid)
    sampled = np.isin(scores.reason, (REACHED, JOINT_LIMITS, ARM_BLOCKED, TOO_FAR))
    for h, g in stratified(rng, np.where(sampled, scores.reason, 99), 3):
        if not sampled[h, g]:
            continue
        q = np.full(7, np.nan)
        value = dense_scan(problem, rows_at(grid, [h]), g, 0, q)
        if value < 0.0 and tilt > 0.0:
            continue  # few poses are drawn: none need reach
        assert (value >= 0.0) == (scores.reason[h, g] == REACHED)
        assert is_served(scene, grid, h, g, q) or value < 0.0
        if value >= 0.0 and tilt == 0.0:
            assert value == pytest.approx(float(scores.dexterity[h, g]), abs=1e-6)


def test_any_orientation_only_adds_to_a_rotation():
    turning, grid = scene_of(TURN, goals=1), toy_grid(states=1)
    scene = scene_of(Freedom(axis=AXIS, rotates=True, tilt=np.pi), goals=1)
    some, more = scores_of(turning, grid), scores_of(scene, grid)
    assert np.all((more.reason == REACHED) | (some.reason != REACHED))
    gained = np.argwhere((more.reason == REACHED) & (some.reason != REACHED))
    assert len(gained) > 0
    for h, g in gained[:5]:
        assert is_served(scene, grid, h, g, more.joints[h, g].astype(float))


def test_the_angle_about_the_axis_is_not_sampled():
    chain = five_joint_chain(SEED)
    goals = free_goals(TURN.row()[None], chain)
    assert list(goals.first) == [0, 1]
    cone = free_goals(Freedom(axis=AXIS, rotates=True, tilt=0.4).row()[None], chain)
    assert np.all(cone.u[:, 0] == 0.0)
    assert len(np.unique(cone.u[:, 1])) > 10
