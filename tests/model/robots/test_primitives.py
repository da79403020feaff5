"""Primitives: what they contain, how large they are, and their file."""

import numpy as np
import pytest

from tcs.errors import RobotError
from tcs.model.robots import Primitive, read_primitives, union_volume, write_primitives
from tcs.model.robots.primitives import enclosed, quaternion_of_rpy, rotation_of
from tcs.model.robots.triangles import cut, longest_edges

IDENTITY = (1.0, 0.0, 0.0, 0.0)


def shape(kind="box", size=(2.0, 4.0, 6.0), xyz=(0.0, 0.0, 0.0), quaternion=IDENTITY):
    return Primitive(body="b", kind=kind, size=size, xyz=xyz, quaternion=quaternion)


def test_box_contains_its_corners_only_just():
    assert shape().contains(np.array([1.0, 2.0, 3.0]))
    assert not shape().contains(np.array([1.0, 2.0, 3.001]))


def test_capsule_ends_in_half_spheres():
    capsule = shape("capsule", (1.0, 2.0))
    points = np.array([[0, 0, 2.0], [1, 0, 1], [0.8, 0, 1.59], [0.8, 0, 1.61], [1.001, 0, 0]])
    np.testing.assert_array_equal(capsule.contains(points), [True, True, True, False, False])


def test_pose_is_that_of_the_shape_in_the_body():
    turned = shape(xyz=(10.0, 0.0, 0.0), quaternion=quaternion_of_rpy((0, 0, np.pi / 2)))
    # Its long side of 4 now lies along x.
    assert turned.contains(np.array([11.9, 0.9, 2.9]))
    assert not turned.contains(np.array([10.0, 1.1, 0.0]))


@pytest.mark.parametrize(
    ("kind", "size"), [("box", (2.0, 1.0, 4.0)), ("capsule", (1.0, 2.0)), ("sphere", (2.0,))]
)
def test_bounds_are_the_tight_box_around_a_shape(kind, size, rng):
    turned = shape(kind, size, (3.0, 1.0, -2.0), quaternion_of_rpy((0.3, -0.5, 1.2)))
    directions = rng.normal(size=(20_000, 3))
    # The surface along each direction from the centre, by halving.
    inner, outer = np.zeros((20_000, 1)), np.full((20_000, 1), 4.0)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for _ in range(30):
        middle = (inner + outer) / 2
        inside = turned.contains(turned.xyz + middle * directions)[:, None]
        inner, outer = np.where(inside, middle, inner), np.where(inside, outer, middle)
    surface = turned.xyz + inner * directions
    least, greatest = turned.bounds
    assert (surface >= least - 1e-6).all()
    assert (surface <= greatest + 1e-6).all()
    # Corners are what 20,000 directions come closest to least: by centimetres of 4 m.
    np.testing.assert_allclose(surface.min(axis=0), least, atol=0.05)
    np.testing.assert_allclose(surface.max(axis=0), greatest, atol=0.05)


def test_rotation_is_that_of_roll_pitch_yaw():
    c, s = np.cos(0.3), np.sin(0.3)
    np.testing.assert_allclose(
        rotation_of(quaternion_of_rpy((0.3, 0.0, 0.0))),
        [[1, 0, 0], [0, c, -s], [0, s, c]],
        atol=1e-15,  # rounding
    )


@pytest.mark.parametrize(
    ("kind", "size", "volume"),
    [
        ("box", (2.0, 3.0, 4.0), 24.0),
        ("sphere", (2.0,), 4 / 3 * np.pi * 8),
        ("capsule", (2.0, 3.0), 4 / 3 * np.pi * 8 + np.pi * 4 * 3),
    ],
)
def test_volumes_match_closed_form(kind, size, volume):
    assert shape(kind, size).volume == pytest.approx(volume, rel=1e-15)
    assert union_volume([shape(kind, size)]) == shape(kind, size).volume


def test_union_counts_the_overlap_once():
    halves = [shape(size=(2.0, 1.0, 1.0)), shape(size=(2.0, 1.0, 1.0), xyz=(1.0, 0.0, 0.0))]
    # Each point counts 1 or 1/2, half of them either: sd 0.25 over 20,000 points in each of two
    # boxes of volume 2 gives a standard error of 0.005; four of these.
    assert union_volume(halves) == pytest.approx(3.0, abs=0.02)
    apart = [shape(size=(1.0, 1.0, 1.0)), shape("sphere", (1.0,), xyz=(5.0, 0.0, 0.0))]
    assert union_volume(apart) == pytest.approx(1 + 4 / 3 * np.pi, rel=1e-12)


def test_union_is_the_same_each_time():
    shapes = [shape(), shape(xyz=(0.5, 0.5, 0.5))]
    assert union_volume(shapes) == union_volume(shapes)


def test_triangle_needs_all_corners():
    triangle = np.array([[[0.0, 0, 0], [0.9, 0, 0], [1.1, 0, 0]]])
    assert not shape().contains_triangles(triangle)[0]
    assert shape().shrunk(-0.2).contains_triangles(triangle)[0]


def test_triangle_may_be_enclosed_piece_by_piece():
    first, second = shape(size=(2.2, 1.0, 1.0)), shape(size=(2.2, 1.0, 1.0), xyz=(2.0, 0.0, 0.0))
    triangle = np.array([[[-1.0, 0.0, 0.0], [3.0, 0.0, 0.0], [1.0, 0.4, 0.0]]])
    assert not first.contains_triangles(triangle)[0]
    assert not second.contains_triangles(triangle)[0]
    assert enclosed([first, second], triangle)[0]


def test_a_gap_between_primitives_is_found():
    """The corners of the triangle are enclosed; its middle protrudes through a gap of 2 mm."""
    first, second = shape(size=(1.998, 1.0, 1.0)), shape(size=(1.998, 1.0, 1.0), xyz=(2.0, 0, 0))
    triangle = np.array([[[-0.9, 0.0, 0.0], [2.9, 0.0, 0.0], [0.5, 0.4, 0.0]]])
    assert all(np.any([s.contains(corner) for s in (first, second)]) for corner in triangle[0])
    assert not enclosed([first, second], triangle)[0]


def test_primitives_that_only_just_touch_do_not_enclose_what_crosses():
    first, second = shape(size=(2.0, 1.0, 1.0)), shape(size=(2.0, 1.0, 1.0), xyz=(2.0, 0.0, 0.0))
    triangle = np.array([[[-0.9, 0.0, 0.0], [2.7, 0.0, 0.0], [0.4, 0.3, 0.0]]])
    assert not enclosed([first, second], triangle)[0]


def test_cutting_keeps_the_surface():
    triangles = np.random.default_rng(0).normal(size=(5, 3, 3))
    pieces = cut(triangles, 0.3)
    assert longest_edges(pieces).max() <= 0.3

    def area(corners):
        sides = corners[:, 1:] - corners[:, :1]
        return np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() / 2

    assert area(pieces) == pytest.approx(area(triangles), rel=1e-12)


def test_file_round_trip(tmp_path):
    path = tmp_path / "p.csv"
    shapes = (
        shape(size=(0.1, 0.2, 0.3), xyz=(-0.123456, 0.0, 1.0)),
        shape("capsule", (0.05, 0.25)),
        shape("sphere", (0.5,), quaternion=(0.6, 0.0, 0.8, 0.0)),
    )
    write_primitives(path, shapes)
    assert read_primitives(path) == shapes


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("box", "cone", "line 2.*kind is 'cone', but must be sphere"),
        ("0.100000", "-0.100000", "line 2.*positive"),
        ("0.100000", "wide", "line 2.*wide"),
        ("1.000000000", "0.900000000", "line 2.*length 1"),
        ("size_a", "width", "line 2: its columns must be"),
        ("0.300000", "", "line 2.*needs 3"),
    ],
)
def test_broken_files_get_one_clear_line(old, new, message, tmp_path):
    path = tmp_path / "p.csv"
    write_primitives(path, [shape(size=(0.1, 0.2, 0.3))])
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(RobotError, match=message) as caught:
        read_primitives(path)
    assert "\n" not in str(caught.value)
