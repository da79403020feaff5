"""The proof that robots' primitives enclose their meshes, and how much they exceed them."""

import sys
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy import ndimage

from tcs.model.robots import load_robot
from tcs.model.robots.primitives import enclosed
from tcs.model.robots.robot_file import RobotFile
from tcs.model.robots.urdf.surfaces import body_triangles
from tcs_shapes.bodies import enclosure, surfaces_to_enclose
from tests.model.robots.shipped import all_robots

PR2_ARM = (
    "shoulder_pan_link shoulder_lift_link upper_arm_roll_link upper_arm_link elbow_flex_link "
    "forearm_roll_link forearm_link wrist_flex_link wrist_roll_link gripper_palm_link "
    "gripper_l_finger_link gripper_r_finger_link gripper_l_finger_tip_link "
    "gripper_r_finger_tip_link"
).split()

PARTS = 20
"""Parts of a surface of which one after the other is looked at."""


@pytest.fixture(scope="module", params=all_robots())
def robot(request):
    return load_robot(request.param)


@pytest.fixture(scope="module")
def surfaces(robot):
    return surfaces_to_enclose(robot)


@pytest.fixture(scope="module")
def found(robot):
    return {body.body: body for body in enclosure(robot)}


def moved_by(robot, joint):
    model = robot.model()
    first = model.joints[joint].child
    return {body for body in model.links if model.chain(first, body) is not None}


def test_every_surface_has_a_carrier(robot, surfaces):
    triangles = body_triangles(robot.model())
    added = {body.name for body in robot.bodies}
    assert set(surfaces) == {shape.body for shape in robot.load_primitives()} - added
    assert sorted(b for members, _, _ in surfaces.values() for b in members) == sorted(triangles)
    assert sum(len(s) for _, _, s in surfaces.values()) == sum(map(len, triangles.values()))


def test_pr2_has_all_its_surfaces(pr2):
    # Base, 4 casters, 8 wheels, torso, head pan and tilt, 3 camera parts, laser, 14 on either arm.
    assert len(body_triangles(pr2.model())) == 1 + 4 + 8 + 1 + 2 + 3 + 1 + 2 * len(PR2_ARM)


def test_every_triangle_lies_inside_the_primitives(surfaces, found):
    outside = {name: body.outside for name, body in found.items()}
    assert outside == dict.fromkeys(surfaces, 0)
    triangles = {name: len(surface) for name, (_, _, surface) in surfaces.items()}
    assert {name: body.triangles for name, body in found.items()} == triangles


def test_primitives_could_not_be_a_millimetre_smaller(surfaces):
    """The proof can fail: if the primitives of a body are shrunk, some triangle protrudes."""
    for body, (_, shapes, surface) in surfaces.items():
        smaller = [shape.shrunk(0.001) for shape in shapes if min(shape.size) > 0.002]
        # In parts, as the first triangle that protrudes decides.
        parts = (surface[start::PARTS] for start in range(PARTS))
        assert any(not enclosed(smaller, part).all() for part in parts), body


def test_inside_of_closed_surfaces_is_enclosed_too(surfaces):
    """A hollow between primitives would hide what lies inside the robot."""
    for body, (_, shapes, surface) in surfaces.items():
        pitch = float(np.ptp(surface.reshape(-1, 3), axis=0).max()) / 15
        mesh = trimesh.Trimesh(**trimesh.triangles.to_kwargs(surface))
        voxels = mesh.voxelized(pitch)
        shell = np.pad(voxels.matrix, 1)
        hollow = np.argwhere(ndimage.binary_fill_holes(shell) & ~shell) - 1
        points = voxels.indices_to_points(hollow)
        inside = np.zeros(len(points), dtype=bool)
        for shape in shapes:
            inside |= shape.contains(points)
        assert inside.all(), body


def test_excess_of_arm_and_hand_is_at_most_two(robot, found):
    moved = moved_by(robot, robot.arm_joints[0])
    excess = {name: body.excess for name, body in found.items()}
    assert {body: e for body, e in excess.items() if body in moved and e > 2.0} == {}
    assert moved & excess.keys()


def test_excess_of_the_pr2_gripper_is_small(pr2, monkeypatch):
    hand = moved_by(pr2, pr2.arm_joints[-1])
    _look_at(monkeypatch, *hand)
    assert max(found.excess for found in enclosure(pr2)) <= 1.35


def _look_at(monkeypatch, *bodies):
    """Let `enclosure` look at some bodies of a robot only: all of them take seconds."""
    monkeypatch.setattr(
        sys.modules[enclosure.__module__],
        "surfaces_to_enclose",
        lambda robot: {b: s for b, s in surfaces_to_enclose(robot).items() if b in bodies},
    )


def test_both_arms_carry_the_same_shapes(pr2):
    for part in PR2_ARM:
        left, right = (
            [s for s in pr2.load_primitives() if s.body == f"{side}_{part}"] for side in "lr"
        )
        assert [(s.kind, s.size, s.xyz) for s in left] == [(s.kind, s.size, s.xyz) for s in right]


def test_number_of_shapes_is_small(robot):
    # The time of scoring grows with it.
    assert len(robot.load_primitives()) <= 1850


def test_protrusion_is_measured(pr2, monkeypatch):
    """Shapes shrunk by 5 mm leave triangles that protrude by 5 mm."""
    body = "l_forearm_roll_link"
    _look_at(monkeypatch, body)
    (sound,) = enclosure(pr2)
    assert (sound.outside, sound.farthest) == (0, 0.0)
    (worse,) = enclosure(_Shrunk.of(pr2, body))
    assert 0 < worse.outside < worse.triangles
    # The corner of a box moves by up to the root of three times what its faces do.
    assert 0.005 - 1e-5 <= worse.farthest <= 0.005 * np.sqrt(3)


def test_a_surface_without_any_shape_protrudes_completely(pr2, monkeypatch):
    body = "l_wrist_flex_link"
    _look_at(monkeypatch, body)
    bare = enclosure(_Shrunk.of(pr2, body, by=None))
    (found,) = bare
    assert found.outside == found.triangles > 0
    assert found.farthest == np.inf


class _Shrunk(RobotFile):
    """A robot with the shapes of one body shrunk, or left out."""

    body: str
    by: float | None

    @classmethod
    def of(cls, robot, body, by=0.005):
        return cls(**robot.model_dump(), body=body, by=by)

    def load_primitives(self):
        kept = []
        for shape in super().load_primitives():
            if shape.body != self.body:
                kept.append(shape)
            elif self.by is not None:
                kept.append(replace(shape, size=shape.shrunk(self.by).size))
        return tuple(kept)
