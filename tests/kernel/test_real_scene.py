"""The sweep of the real scene: PR2, wheelchair and person."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from tcs.kernel.contacts import NO_CONTACT
from tcs.kernel.problem import build_problem
from tcs.kernel.rows import rows_at
from tcs.kernel.scores import GRIPPER_BLOCKED_BY_ROBOT, REACHED
from tcs.kernel.sweep import score
from tcs.kernel.workspace import new_workspace
from tcs.model.scene import Scene, SceneSpec, lower
from tcs.placement.scoring import sweep
from tcs.placement.tables import Reason
from tests.chosen import some_of
from tests.kernel.judge import compare, is_true, stratified
from tests.reference.constructed import posture_contact, random_posture, with_goals


@pytest.fixture(scope="module")
def real(lowered):
    """Every third base position and every heading of the wheelchair grid, scored by the sweep."""
    grid = lowered.grid._replace(
        base_x=lowered.grid.base_x[::3],
        base_y=lowered.grid.base_y[1::3],
        base_yaw=lowered.grid.base_yaw,
    )
    small = dataclasses.replace(lowered, grid=grid)
    weights = np.full(lowered.arrays.goal_p.shape[1], 1 / lowered.arrays.goal_p.shape[1])
    return small, weights, sweep(small, weights, jobs=2).tables[0]


def test_two_jobs_give_what_one_gives(real):
    small, weights, two = real
    one = sweep(small, weights, jobs=1).tables[0]
    for name in ("dexterity", "reason", "pair", "arm_joints"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name), err_msg=name)
    assert one.pair_names == two.pair_names


def test_contacts_are_reported_exactly_where_something_blocks(real):
    _, _, scores = real
    blocked = np.isin(
        scores.reason,
        (
            Reason.BODY_BLOCKED,
            Reason.GRIPPER_BLOCKED_BY_ENVIRONMENT,
            Reason.GRIPPER_BLOCKED_BY_ROBOT,
            Reason.ARM_BLOCKED,
        ),
    )
    np.testing.assert_array_equal(scores.pair >= 0, blocked)
    assert scores.pair.max() == len(scores.pair_names) - 1


# Seconds for a pair that is not reached: `test_sweep` compares all reasons in scenes of few shapes,
# and a dense scan those of the real one in `tests/placement/scoring/test_verify.py`.
@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 20])
def test_the_kernel_agrees_with_the_reference_on_real_pairs(real, number):
    small, _, scores = real
    joints = np.zeros((*scores.reason.shape, 7), np.float32)
    joints[scores.reason == REACHED] = scores.arm_joints

    @dataclasses.dataclass
    class Answers:
        reason: np.ndarray
        dexterity: np.ndarray
        joints: np.ndarray

    answers = Answers(scores.reason, scores.dexterity, joints)
    pairs = stratified(np.random.default_rng(number), scores.reason, number)
    # Of this task's goals, the environment itself blocks the gripper at none.
    every = set(map(int, Reason)) - {Reason.GRIPPER_BLOCKED_BY_ENVIRONMENT, Reason.EXCLUDED}
    # Approaches were not requested, and no two arms at once.
    every -= {Reason.APPROACH_LIMITS, Reason.APPROACH_BLOCKED}
    every -= {Reason.OTHER_GOAL_UNREACHED, Reason.ARMS_BLOCKED}
    assert {int(scores.reason[h, g]) for h, g in pairs} == every
    compare(small.arrays, small.grid, answers, pairs)


def test_reached_pairs_are_true_for_the_reference(real, rng):
    small, _, scores = real
    reached = np.argwhere(scores.reason == REACHED)
    # The reference takes a second per pair; `tcs verify` checks thousands by Drake.
    for h, g in reached[rng.choice(len(reached), 2, replace=False)]:
        q = np.asarray(scores.joints_of(int(h), int(g)))
        assert is_true(small.arrays, small.grid, h, g, q)


@pytest.mark.parametrize(
    ("own", "outer"), some_of([(0.0016, 0.0), (0.0003, 0.05)], (0.0003, 0.05)), ids=str
)
def test_the_kernel_agrees_with_drake_at_margins_of_its_own(spec, shaving, full_grid, own, outer):
    scene = Scene(
        SceneSpec(
            spec.robot.model_copy(update={"self_margin": own}),
            spec.environment.model_copy(update={"contact_margin": outer}),
        )
    )
    # One configuration, beside the chair.
    where = {"base_x": 0.6, "base_y": -0.9, "base_yaw": 110.0, "torso": 0.3}
    one = full_grid.overridden({k: {"start": v, "count": 1} for k, v in where.items()})
    lowered = lower(scene, shaving, one)
    arrays, grid = lowered.arrays, lowered.grid
    rng = np.random.default_rng(0)
    postures = np.array([random_posture(rng, arrays.chain) for _ in range(50)])
    problem = build_problem(with_goals(arrays, grid, 0, postures))
    work = new_workspace(problem)
    scene.place_base(where["base_x"], where["base_y"], np.deg2rad(where["base_yaw"]))
    scene.set_torso(where["torso"])
    found = []
    for g, q in enumerate(postures):
        scene.set_arm(q)
        free = posture_contact(problem, work, rows_at(grid, [0]), g, q) == NO_CONTACT
        found.append((free, not scene.violations()))
    kernel, drake = np.array(found).T
    assert 8 < kernel.sum() < 47
    np.testing.assert_array_equal(kernel, drake)


@pytest.mark.parametrize(("h", "g"), [(54470, 6), (54470, 7), (55934, 6)], ids=str)
def test_gripper_against_robot_is_reported_before_joint_limits(lowered, h, g):
    # Joint 1 would have to pass its limits, and the gripper at the goal touches the robot.
    scores = score(build_problem(lowered.arrays), rows_at(lowered.grid, [h]))
    assert scores.reason[0, g] == GRIPPER_BLOCKED_BY_ROBOT
    assert scores.contact[0, g] >= 0
