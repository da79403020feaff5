"""Shapes as they are drawn."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.geometry import Box, Capsule, Rgba, Sphere
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.tree import BodyIndex

from tcs.output.view import open_meshcat
from tcs.output.view.scene_objects import SceneShapes
from tcs.output.view.shapes import BodyShape, draw_shapes, rounded_box, sharp_box

GREY, RED = Rgba(0.5, 0.5, 0.5, 1.0), Rgba(1.0, 0.0, 0.0, 1.0)
SINGLE = 1e-7
"""Greatest rounding of a coordinate below 1 m: half of 2^-24, and the sums before it."""


class Drawn:
    """Records what a Meshcat receives."""

    def __init__(self):
        self.meshes, self.objects, self.poses = {}, {}, {}

    def SetTriangleMesh(self, path, corners, faces, colour):
        assert path not in self.meshes
        self.meshes[path] = corners.copy(), faces.copy(), colour

    def SetObject(self, path, shape, colour):
        assert path not in self.objects
        self.objects[path] = shape, colour

    def SetTransform(self, path, pose):
        self.poses[path] = pose


def drawn(shapes, **options):
    found = Drawn()
    draw_shapes(found, "robot", shapes, **options)
    return found


def own_corners(one):
    """Return the corners of a box in its body's frame [m], shape (8, 3), by Drake's pose alone."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return np.array([one.X_LS @ (0.5 * sign * one.shape.size()) for sign in signs])


def volume(corners, faces):
    """Return what closed surfaces enclose [m^3]: negative if their triangles look inward."""
    return np.linalg.det(corners.T[faces.T]).sum() / 6.0


def assert_closed(faces):
    """Check that each edge belongs to two triangles, once in either direction."""
    edges = np.concatenate([faces[[i, (i + 1) % 3]].T for i in range(3)])
    assert len(np.unique(edges, axis=0)) == len(edges)
    assert {tuple(e) for e in edges.tolist()} == {tuple(e[::-1]) for e in edges.tolist()}


@pytest.mark.parametrize("size", [(0.2, 0.3, 0.4), (0.02, 0.5, 0.1)])
def test_a_rounded_box_is_closed_and_within_the_box(size):
    corners, faces = rounded_box(np.array(size))
    half = 0.5 * np.array(size)
    # It touches every side, and no corner.
    np.testing.assert_allclose(corners.max(axis=1), half, atol=1e-9)
    np.testing.assert_allclose(corners.min(axis=1), -half, atol=1e-9)
    assert (np.abs(corners).T / half).min(axis=1).max() < 0.99
    assert_closed(faces)
    assert 0.7 * np.prod(size) < volume(corners, faces) < np.prod(size)


def test_a_sharp_box_is_closed_and_looks_outward():
    size = np.array([0.02, 0.5, 0.1])
    corners, faces = sharp_box(size)
    np.testing.assert_array_equal(np.abs(corners).T, np.tile(0.5 * size, (8, 1)))
    assert_closed(faces)
    # Each triangle lies in one side.
    sides = [np.ptp(corners[:, face], axis=1).min() for face in faces.T]
    np.testing.assert_array_equal(sides, np.zeros(12))
    assert volume(corners, faces) == pytest.approx(np.prod(size), rel=1e-12)


@pytest.mark.parametrize("is_robot", [True, False], ids=["robot", "environment"])
def test_the_mesh_of_each_body_is_the_surface_of_its_boxes(scene, shaving, is_robot):
    made = SceneShapes(scene, shaving, meshes=False)
    shapes = made._robot if is_robot else made._environment
    found = drawn(shapes)
    boxes = {}
    for one in shapes:
        if isinstance(one.shape, Box) and not one.is_rounded:
            boxes.setdefault(int(one.body), []).append(one)
    assert sum(map(len, boxes.values())) > 20
    for body, ones in boxes.items():
        (mesh,) = (mesh for path, mesh in found.meshes.items() if path.startswith(f"robot/{body}/"))
        corners, faces, colour = mesh
        assert {one.colour == colour for one in ones} == {True}
        # Which corner of the mesh is one of which box, by Drake's pose: sums in another order.
        of_box = np.stack([nearest(corners.T, own_corners(one)) < 1e-12 for one in ones])
        assert of_box.any(axis=0).all()
        np.testing.assert_array_less(7, of_box.sum(axis=1))
        assert corners.shape[1] == 8 * len(ones)
        # Each triangle is one of a box; they are closed, and enclose what the boxes do.
        assert of_box[:, faces].all(axis=1).any(axis=0).all()
        assert faces.shape[1] == 12 * len(ones)
        assert_closed(faces)
        total = sum(np.prod(one.shape.size()) for one in ones)
        assert volume(corners, faces) == pytest.approx(total, rel=1e-9)


def nearest(points, others):
    """Return the distance of each point from the nearest of others [m], shape (n,)."""
    return np.linalg.norm(points[:, None] - others, axis=2).min(axis=1)


def placed(body, shape, colour=GREY, *, is_rounded=False):
    X_LS = RigidTransform(RollPitchYaw(0.3, -0.2, 1.0), [0.1, 0.2 * body, 0.3])
    return BodyShape(BodyIndex(body), shape, X_LS, colour, is_rounded)


def test_bodies_and_colours_stay_apart_and_round_shapes_stay_round():
    shapes = [
        placed(3, Box(0.1, 0.2, 0.3)),
        placed(3, Sphere(0.1)),
        placed(3, Box(0.1, 0.1, 0.1), RED),
        placed(4, Box(0.4, 0.4, 0.4), is_rounded=True),
        placed(3, Box(0.3, 0.2, 0.1)),
        placed(4, Capsule(0.1, 0.2), RED),
    ]
    found = drawn(shapes)
    sent = sorted(
        (path.split("/")[1], m[0].shape[1], m[2] == RED) for path, m in found.meshes.items()
    )
    corners, faces = rounded_box(np.full(3, 0.4))
    assert sent == [("3", 8, True), ("3", 16, False), ("4", corners.shape[1], False)]
    (rounded,) = (mesh for path, mesh in found.meshes.items() if path.startswith("robot/4/"))
    np.testing.assert_allclose(rounded[0], shapes[3].X_LS.multiply(corners), atol=1e-15)
    np.testing.assert_array_equal(rounded[1], faces)
    # Meshes are in the frames of their bodies, which alone are moved.
    assert set(found.poses) == set(found.objects)
    assert not set(found.meshes) & set(found.objects)
    round_ones = {path.split("/")[1]: (path, *sent) for path, sent in found.objects.items()}
    for one in (shapes[1], shapes[5]):
        path, shape, colour = round_ones[str(int(one.body))]
        assert (type(shape), colour) == (type(one.shape), one.colour)
        assert found.poses[path].IsExactlyEqualTo(one.X_LS)


def test_a_page_has_the_corners_in_single_precision():
    meshcat = open_meshcat()
    shapes = [placed(3, Box(0.1, 0.2, 0.3)), placed(3, Box(0.31, 0.17, 0.1))]
    draw_shapes(meshcat, "robot", shapes)
    ((path, (corners, faces, _)),) = drawn(shapes).meshes.items()
    exact = np.concatenate([own_corners(one) for one in shapes])
    single = corners.T.astype(np.float32)
    np.testing.assert_allclose(single, exact, rtol=0.0, atol=SINGLE)
    packed = meshcat._GetPackedObject(path)
    assert single.tobytes() in packed
    assert faces.T.astype(np.uint32).tobytes() in packed


def test_a_box_takes_320_bytes_of_a_page():
    """Eight corners and twelve triangles of three numbers of four bytes, in base 64."""
    sizes = []
    for count in (100, 200):
        meshcat = open_meshcat()
        draw_shapes(meshcat, "robot", [placed(3, Box(0.1, 0.2, 0.3))] * count)
        sizes.append(len(meshcat.StaticHtml()))
    # Names and lengths of arrays differ by a few bytes.
    assert sizes[1] - sizes[0] == pytest.approx(100 * 320, abs=50)
