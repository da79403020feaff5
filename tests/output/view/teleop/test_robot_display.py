from __future__ import annotations

import numpy as np
import pytest
from pydrake.math import RotationMatrix

from tcs.output.view.teleop.robot_display import (
    PATH,
    TARGET,
    TOOL,
    RobotDisplay,
    Trail,
    draw_course,
    pose_of,
)
from tcs.teleop import load_arm
from tests.output.view.teleop.conftest import Instead


class Spy:
    """Records the lines that it receives."""

    def __init__(self):
        self.lines, self.sent = {}, 0

    def SetLine(self, path, points, _width, _colour):
        self.lines[path] = points.T.copy()
        self.sent += len(points.T)

    def Delete(self, path):
        if path == PATH:
            self.lines.clear()
        else:
            del self.lines[path]

    @property
    def points(self):
        """Return all points in the order of the path."""
        pieces = sorted(self.lines.items(), key=lambda one: int(one[0].split("/")[1]))
        return np.vstack([pieces[0][1], *(piece[1:] for _, piece in pieces[1:])])


def along(count, step=0.01):
    return np.column_stack([step * np.arange(count), np.zeros(count), np.ones(count)])


@pytest.fixture
def spy():
    return Spy()


def test_the_path_is_complete_and_only_its_end_is_sent_again(spy):
    trail = Trail(spy)
    way = along(300)
    for point in way:
        trail.add(point)
    np.testing.assert_array_equal(spy.points, way)
    # A path sent completely each time would have 300 * 301 / 2 points.
    assert spy.sent < 300 * 25


def test_a_tool_at_rest_draws_nothing(spy):
    trail = Trail(spy)
    for _ in range(5):
        trail.add(np.ones(3))
    trail.add(np.ones(3) + 1e-4)
    assert not spy.lines


def test_a_long_path_loses_its_oldest_pieces(spy):
    trail = Trail(spy)
    way = along(3000)
    for point in way:
        trail.add(point)
    kept = spy.points
    assert 1900 < len(kept) < 2100
    np.testing.assert_array_equal(kept, way[-len(kept) :])


def test_after_a_jump_a_new_path_begins(spy):
    trail = Trail(spy)
    for point in along(50):
        trail.add(point)
    trail.clear()
    assert not spy.lines
    there = along(3) + 1.0
    for point in there:
        trail.add(point)
    np.testing.assert_array_equal(spy.points, there)


def test_rounding_in_a_rotation_is_no_error():
    R = RotationMatrix.MakeZRotation(0.3).matrix()
    found = pose_of(R + 1e-9, np.zeros(3)).rotation().matrix()
    # The nearest rotation is no farther away than the rounding.
    np.testing.assert_allclose(found, R, atol=1e-8)
    np.testing.assert_allclose(found @ found.T, np.eye(3), atol=1e-14)


def test_live_there_is_a_target_and_played_back_there_is_none(iiwa_display, meshcat):
    iiwa_display.set_up(meshcat, np.array([0.6, 0.0, 1.0]))
    assert meshcat.HasPath(TARGET)
    assert meshcat.HasPath(TOOL)
    meshcat.Delete()
    iiwa_display.set_up(meshcat, np.array([0.6, 0.0, 1.0]), target=False)
    assert not meshcat.HasPath(TARGET)
    assert meshcat.HasPath(TOOL)


@pytest.mark.parametrize("name", ["pr2", "tiago", "panda"])
def test_the_robot_is_in_the_posture_of_the_arm(name):
    arm = load_arm(name, torso_height=0.2)
    display = RobotDisplay(arm, meshes=False)
    joints = arm.random_joints(np.random.default_rng(1), 1)[0]
    display.poses(joints)
    X_WT = display._scene.tool_pose()
    at = arm.kinematics(joints)
    # Two computations along the same chain: rounding.
    np.testing.assert_allclose(X_WT.translation(), at.p, atol=1e-12)
    np.testing.assert_allclose(X_WT.rotation().matrix(), at.R, atol=1e-12)


@pytest.mark.parametrize(("name", "left"), [("pr2", True), ("pr2_right", False), ("iiwa7", False)])
def test_the_camera_is_on_the_side_of_the_arm(name, left, meshcat):
    seen = []
    arm = load_arm(name)
    spy = Instead(meshcat, SetCameraPose=lambda *places: seen.append(places))
    RobotDisplay(arm, meshes=False).set_up(spy, arm.kinematics(np.zeros(7)).p)
    ((camera, target),) = seen
    assert (camera[1] > target[1]) == left


def test_a_line_leads_from_the_green_sphere_to_the_red_one():
    placed = {}

    class Spy:
        def SetObject(self, path, shape, colour):
            self.length = getattr(shape, "length", lambda: None)() or self.length

        def SetTransform(self, path, pose):
            placed[path] = pose

        length = None

    spy = Spy()
    start, end = np.array([0.6, 0.2, 0.9]), np.array([-0.1, 0.3, 0.8])
    draw_course(spy, start, end, 0.02)
    np.testing.assert_array_equal(placed["course/start"].translation(), start)
    np.testing.assert_array_equal(placed["course/end"].translation(), end)
    ends = [placed["course/line"] @ np.array([0.0, 0.0, s * spy.length / 2]) for s in (-1, 1)]
    # A cylinder along its own z axis: rounding.
    np.testing.assert_allclose(ends, [start, end], atol=1e-12)
