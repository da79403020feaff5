"""Distances on a grid as SciPy finds them, and surfaces as cutting triangles marks them."""

import numpy as np
import pytest
from scipy import ndimage

from tcs.model.robots.triangles import cut
from tcs_shapes.cells import FARTHEST, mark_surface, squared_distances


@pytest.fixture(params=[0.99, 0.999], ids="{:.1%} set".format)
def cells(request, rng):
    found = rng.random((19, 23, 17)) < request.param
    found[5:11, 4:9, 3:14] = False
    return found


def squares_of(cells):
    return np.rint(ndimage.distance_transform_edt(cells) ** 2).astype(int)


def test_squared_distances_are_those_of_scipy(cells):
    np.testing.assert_array_equal(squared_distances(cells, FARTHEST), squares_of(cells))
    np.testing.assert_array_equal(squared_distances(~cells, FARTHEST), squares_of(~cells))


@pytest.mark.parametrize("most", [1, 3])
def test_what_is_near_is_exact_and_what_is_far_stays_far(cells, most):
    found, expected = squared_distances(cells, most), squares_of(cells)
    near = expected <= most**2
    assert near.any()
    assert not near.all()
    np.testing.assert_array_equal(found[near], expected[near])
    assert (found[~near] > most**2).all()


def test_the_corners_of_pieces_are_marked(rng):
    triangles = rng.uniform(-0.1, 0.1, (40, 3, 3))
    # A triangle without area too.
    triangles[0] = triangles[0, :1]
    pitch = 0.02
    corners = np.rint(cut(triangles, pitch).reshape(-1, 3) / pitch).astype(int)
    first = corners.min(axis=0)
    expected = np.zeros(np.ptp(corners, axis=0) + 1, np.bool_)
    expected[tuple((corners - first).T)] = True
    found = np.zeros_like(expected)
    mark_surface(found, triangles, pitch, pitch, first)
    np.testing.assert_array_equal(found, expected)


def test_corners_beyond_the_grid_are_left_out():
    found = np.zeros((3, 3, 3), np.bool_)
    triangles = np.array([[[-9.0, 1.0, 1.0], [9.0, 1.0, 1.0], [9.0, 1.0, 1.0]]])
    mark_surface(found, triangles, 0.5, 1.0, np.zeros(3, np.int64))
    expected = np.zeros_like(found)
    expected[:, 1, 1] = True
    np.testing.assert_array_equal(found, expected)
