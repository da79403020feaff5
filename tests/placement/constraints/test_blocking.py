"""Blocked candidates and solutions, checked against Drake."""

import numpy as np
import pytest

from tcs.model.scene import EnvironmentFile, Scene
from tcs.model.scene.contacts import Group
from tcs.model.scene.spec import SceneSpec
from tcs.placement.constraints import Obstacle
from tcs.placement.constraints.blocking import blocked_bodies, blocked_solutions
from tcs.placement.scoring import load_job, score
from tcs.placement.scoring.offline import robot_shapes
from tcs.placement.selection import SelectionTables
from tcs.placement.store.robot_shapes import RobotShapes
from tests.environments import CORNER, write_environment

OBSTACLES = (
    Obstacle.parse("0.75 -0.75 0.2 0.3 20"),
    Obstacle.parse("0.8 0.35 0.15 0.15 -40 0.75 1.1"),
    Obstacle.parse("0.6 -0.2 0.05 0.3 0 1.2 1.3"),
    Obstacle.parse("1.5 1.2 0.4 0.4 10 0 0.5"),
)
"""Beside a base, at the height of the arm, between two base poses, and beside another base."""


@pytest.fixture(scope="module")
def corner(tmp_path_factory):
    path = write_environment(tmp_path_factory.mktemp("blocking"), "corner", CORNER)
    return score("shaving", path, paper=True), load_job("shaving", path, "pr2", paper=True)


@pytest.fixture(scope="module")
def drake(corner):
    """Scene with the obstacles in it."""
    job = corner[1]
    environment = job.spec.environment
    boxes = [
        {
            "name": f"seen_{i}",
            "box": [float(size) for size in 2 * obstacle.half],
            "xyz": [float(value) for value in obstacle.centre],
            "rpy_deg": [0.0, 0.0, float(np.rad2deg(obstacle.yaw))],
        }
        for i, obstacle in enumerate(OBSTACLES)
    ]
    content = environment.model_dump() | {"obstacles": [*environment.obstacles, *boxes]}
    return Scene(SceneSpec(job.spec.robot, EnvironmentFile.model_validate(content)))


def test_obstacles_block_what_drake_finds_in_contact(corner, drake):
    file, job = corner
    tables = SelectionTables.of(file)
    (postures,) = tables.postures
    pairs = postures.pairs
    bodies = np.stack([blocked_bodies(obstacle, postures) for obstacle in OBSTACLES])
    everyone = np.ones(len(tables.sets.candidates), dtype=np.bool_)
    arms = np.stack([blocked_solutions(obstacle, postures, everyone) for obstacle in OBSTACLES])
    margin = job.spec.environment.contact_margin
    at_rest = {}
    arm_names = {part.name for part in drake.built.parts if part.group.name == "ARM"}
    for pair in range(0, len(pairs[0]), 3):
        candidate, goal = (int(numbers[pair]) for numbers in pairs)
        h = int(tables.sets.candidates[candidate])
        here = job.grid.configuration(h)
        drake.place_base(here.base_x, here.base_y, here.base_yaw)
        drake.set_torso(here.torso)
        # At the goal the arm counts, at rest the whole robot.
        tried = [(True, file.nominal.scores.joints_of(h, int(goal)))]
        if candidate not in at_rest:
            at_rest[candidate] = {}
            tried += [(False, rest) for rest in job.spec.robot.rest_postures().values()]
        least = dict(at_rest[candidate])
        for is_arm, q in tried:
            drake.set_arm(q)
            for robot, other, distance in drake.clearances(0.06):
                if other.startswith("seen_") and (robot in arm_names or not is_arm):
                    key = (is_arm, int(other.removeprefix("seen_")))
                    least[key] = min(distance, least.get(key, np.inf))
        at_rest[candidate] = {key: d for key, d in least.items() if not key[0]}
        for i in range(len(OBSTACLES)):
            for is_arm, found in ((True, arms[i, pair]), (False, bodies[i, candidate])):
                distance = least.get((is_arm, i), np.inf)
                if distance < margin:
                    assert found, (is_arm, i, pair, distance)
                # Drake's distance between boxes can be too large by centimetres.
                if distance > 0.05:
                    assert not found, (is_arm, i, pair, distance)
    for blocked in (bodies, arms):
        assert 0 < blocked.sum() < blocked.size


def test_the_stored_shapes_hold_at_every_torso_level(corner):
    file, job = corner
    shapes = file.robot_shapes
    arrays = job.lowered(job.scene()).arrays
    for level in range(len(shapes.torso_shift)):
        mounted = (shapes.body.frame == 1)[:, None]
        np.testing.assert_allclose(
            shapes.body.p + mounted * shapes.torso_shift[level], arrays.body.p[level], atol=1e-9
        )
    assert shapes.torso_shift[:, 2].tolist() == pytest.approx([0.0, 0.15])


def test_the_stored_shapes_of_an_arm_that_drives_and_slides_are_where_drake_has_them(rng):
    job = load_job("feeding", "wheelchair", "stretch", paper=True)
    scene = job.scene()
    shapes = RobotShapes.from_dict(robot_shapes(job.lowered(scene).arrays).to_dict())
    lower, upper = scene.arm_limits
    q = rng.uniform(lower, upper)
    scene.place_base(0.0, 0.0, 0.0)
    scene.set_arm(q)
    parts = [part for part in scene.built.parts if part.group is Group.ARM]
    links_R, links_p = shapes.link_poses(np.append(0.0, q)[None], np.zeros(1, dtype=np.int64))
    assert {part.carrier for part in parts} > {2, 7, 8}
    for i, part in enumerate(parts):
        X_WG, link = scene.shape_pose(part), shapes.arm.frame[i] - 1
        p = links_p[0, link] + links_R[0, link] @ shapes.arm.p[i]
        np.testing.assert_allclose(p, X_WG.translation(), atol=1e-9)
        R = links_R[0, link] @ shapes.arm.R[i]
        np.testing.assert_allclose(R, X_WG.rotation().matrix(), atol=1e-9)
