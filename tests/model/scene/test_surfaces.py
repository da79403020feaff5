"""Contacts of the robot with itself where a table of distances says that surfaces are apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tcs.kernel.contacts import NO_CONTACT
from tcs.kernel.motion.edges import NO_PAIR
from tcs.kernel.motion.edges import posture_contact as motion_contact
from tcs.kernel.motion.scene import motion_scene, new_motion_workspace
from tcs.kernel.problem import build_problem
from tcs.kernel.rows import rows_at
from tcs.kernel.workspace import new_workspace
from tcs.model.robots import load_robot
from tcs.model.robots.distances import tables_in_force
from tcs.model.scene import Scene, SceneSpec, lower
from tcs.model.scene.neighbours import NeighbourList
from tests.chosen import some_of
from tests.reference.constructed import posture_contact, with_goals


@pytest.fixture(scope="module", params=some_of(["panda", "ur5"], "ur5"))
def specs(request, wheelchair):
    robot = load_robot(request.param)
    return [
        SceneSpec(each, wheelchair)
        for each in (robot, robot.model_copy(update={"distances": None}))
    ]


@pytest.fixture(scope="module")
def postures(specs):
    """Postures in which surfaces are close, and what shapes alone say far from the chair."""
    rng = np.random.default_rng(0)
    robot = specs[0].robot
    tables = tables_in_force(robot)
    limits = np.array([robot.joint_limits()[name] for name in robot.arm_joints])
    chosen, wanted = [], {True: 20, False: 8}
    while any(wanted.values()):
        q = rng.uniform(*limits.T)
        at = dict(zip(robot.arm_joints, q, strict=True))
        bounds = [table.bound(at) for table in tables]
        bound = min(bounds, key=lambda b: abs(b - 0.002))
        clear = bound > robot.self_margin
        if wanted[clear] and bound < 0.003:
            wanted[clear] -= 1
            chosen.append(q)
    plain = Scene(specs[1])
    plain.place_base(5.0, 5.0, 0.0)
    found = []
    for q in chosen:
        plain.set_arm(q)
        found.append({frozenset(contact[:2]) for contact in plain.violations()})
    return np.array(chosen), found


def test_surfaces_decide_where_the_table_says_so(specs, postures):
    pairs = {frozenset(table.pair) for table in tables_in_force(specs[0].robot)}
    scene = Scene(specs[0])
    scene.place_base(5.0, 5.0, 0.0)
    near, freed = NeighbourList(scene), 0
    for q, shapes in zip(*postures, strict=True):
        scene.set_arm(q)
        now = scene.violations()
        touching = {frozenset(contact[:2]) for contact in now}
        assert touching <= shapes
        assert shapes - touching <= pairs
        if shapes - touching:
            freed += 1
            assert near.violations() == now
            for a, b, distance in scene.clearances(0.003):
                assert (distance < scene.required_clearance(a, b)) == ({a, b} in touching)
    assert freed >= 4


def test_a_table_that_lies_is_found_out(specs, postures):
    tables = tuple(
        replace(table, corners=np.full_like(table.corners, 255))
        for table in tables_in_force(specs[0].robot)
    )
    pairs = {frozenset(table.pair) for table in tables}
    true, lying = Scene(specs[0]), Scene(specs[0])
    lying._surfaces._tables = {frozenset(table.pair): table for table in tables}
    caught = 0
    for q, shapes in zip(*postures, strict=True):
        if not shapes <= pairs or not shapes:
            continue
        for scene in (true, lying):
            scene.place_base(5.0, 5.0, 0.0)
            scene.set_arm(q)
        touching = lying.violations()
        # What it says more than the true tables are contacts within what a cell loses.
        assert len(touching) <= len(true.violations())
        caught += bool(touching)
    assert caught >= 3


def test_kernel_and_planner_agree_with_drake(specs, postures, shaving, full_grid):
    scene, where = Scene(specs[0]), {"base_x": 0.6, "base_y": -0.9, "base_yaw": 110.0}
    one = full_grid.overridden({k: {"start": v, "count": 1} for k, v in where.items()})
    lowered = lower(scene, shaving, one)
    q = np.zeros((len(postures[0]), 7))
    q[:, 7 - postures[0].shape[1] :] = postures[0]
    problem = build_problem(with_goals(lowered.arrays, lowered.grid, 0, q))
    row = rows_at(lowered.grid, [0])
    motion = motion_scene(problem, row)
    work, motion_work = new_workspace(problem), new_motion_workspace(motion)
    scene.place_base(where["base_x"], where["base_y"], np.deg2rad(where["base_yaw"]))
    found = []
    for g, posture in enumerate(q):
        scene.set_arm(posture)
        free = posture_contact(problem, work, row, g, posture) == NO_CONTACT
        planned = motion_contact(motion, motion_work, posture) == NO_PAIR
        found.append((free, planned, not scene.violations()))
    kernel, planner, drake = np.array(found).T
    assert kernel.sum() > 5
    np.testing.assert_array_equal(kernel, drake)
    np.testing.assert_array_equal(planner, drake)
