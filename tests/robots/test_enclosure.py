"""The proof that a robot's primitives enclose its meshes, and how much they exceed them."""

import numpy as np
import pytest
import trimesh
from scipy import ndimage

from tcs.robots.boxes import hull_volume
from tcs.robots.geometry import body_triangles, welded_top
from tcs.robots.primitives import enclosed, union_volume

ARM_AND_GRIPPER = (
    "shoulder_pan_link shoulder_lift_link upper_arm_roll_link upper_arm_link elbow_flex_link "
    "forearm_roll_link forearm_link wrist_flex_link wrist_roll_link gripper_palm_link "
    "gripper_l_finger_link gripper_r_finger_link gripper_l_finger_tip_link "
    "gripper_r_finger_tip_link"
).split()


@pytest.fixture(scope="module")
def triangles(pr2):
    return body_triangles(pr2.model())


@pytest.fixture(scope="module")
def around(pr2, triangles):
    """Triangles that each body's primitives have to enclose: its own, or all that it carries."""
    model = pr2.model()
    carriers = {shape.body for shape in pr2.load_primitives()}
    found = {}
    for body, own in triangles.items():
        top, R, p = welded_top(model, body)
        carrier = body
        if body not in carriers:
            (carrier,) = (c for c in carriers if welded_top(model, c)[0] == top)
            _, R_c, p_c = welded_top(model, carrier)
            own = (own @ R.T + p - p_c) @ R_c
        found.setdefault(carrier, []).append(own)
    return {carrier: np.concatenate(pieces) for carrier, pieces in found.items()}


def shapes_of(pr2, body):
    return [shape for shape in pr2.load_primitives() if shape.body == body]


def test_every_surface_has_a_carrier(pr2, triangles, around):
    # Base, 4 casters, 8 wheels, torso, head pan and tilt, 3 camera parts, laser, 14 on either arm.
    assert len(triangles) == 1 + 4 + 8 + 1 + 2 + 3 + 1 + 2 * len(ARM_AND_GRIPPER)
    assert set(around) == {shape.body for shape in pr2.load_primitives()}
    assert sum(map(len, around.values())) == sum(map(len, triangles.values()))


def test_every_triangle_lies_inside_one_primitive(pr2, around):
    outside = {
        body: int((~enclosed(shapes_of(pr2, body), surface)).sum())
        for body, surface in around.items()
    }
    assert outside == dict.fromkeys(around, 0)


def test_no_primitive_could_be_a_millimetre_smaller(pr2, around):
    """The proof can fail: shrink any one primitive, and some triangle stands out."""
    for body, surface in around.items():
        shapes = shapes_of(pr2, body)
        for i, shape in enumerate(shapes):
            thinner = min(shape.size) > 0.002
            rest = shapes[:i] + shapes[i + 1 :]
            smaller = [*rest, shape.shrunk(0.001)] if thinner else rest
            assert not enclosed(smaller, surface).all(), f"{body}, shape {i}"


def test_inside_of_closed_surfaces_is_enclosed_too(pr2, around):
    """A hollow between primitives would hide what lies inside the robot."""
    for body, surface in around.items():
        pitch = float(np.ptp(surface.reshape(-1, 3), axis=0).max()) / 25
        mesh = trimesh.Trimesh(**trimesh.triangles.to_kwargs(surface))
        voxels = mesh.voxelized(pitch)
        shell = np.pad(voxels.matrix, 1)
        hollow = np.argwhere(ndimage.binary_fill_holes(shell) & ~shell) - 1
        points = voxels.indices_to_points(hollow)
        inside = np.zeros(len(points), dtype=bool)
        for shape in shapes_of(pr2, body):
            inside |= shape.contains(points)
        assert inside.all(), body


@pytest.mark.parametrize("side", ["l", "r"])
def test_excess_of_arm_and_gripper_is_at_most_two(pr2, around, side):
    for body in (f"{side}_{part}" for part in ARM_AND_GRIPPER):
        excess = union_volume(shapes_of(pr2, body)) / hull_volume(around[body])
        limit = 1.35 if "gripper" in body else 2.0
        assert excess <= limit, body


def test_both_arms_carry_the_same_shapes(pr2):
    for part in ARM_AND_GRIPPER:
        left, right = (shapes_of(pr2, f"{side}_{part}") for side in "lr")
        assert [(s.kind, s.size, s.xyz) for s in left] == [(s.kind, s.size, s.xyz) for s in right]


def test_number_of_shapes_is_small(pr2):
    # The time of scoring grows with it.
    assert len(pr2.load_primitives()) <= 70
