"""Distances on a grid as SciPy finds them, and surfaces as cutting triangles marks them."""

import itertools

import numpy as np
import pytest
from scipy import ndimage
from scipy.spatial.transform import Rotation

from tcs.model.robots.triangles import cut
from tcs_shapes.cells import FARTHEST, counts_beyond, grow_boxes, mark_surface, squared_distances

PITCH = 0.002


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


@pytest.fixture
def distances(rng):
    cells = rng.random((19, 23, 17)) < 0.999
    cells[5:11, 4:9, 3:14] = False
    return (ndimage.distance_transform_edt(cells) * PITCH).astype(np.float32)


def sums_of(blocked):
    counts = np.zeros(np.array(blocked.shape) + 1, int)
    counts[1:, 1:, 1:] = blocked.cumsum(axis=0).cumsum(axis=1).cumsum(axis=2)
    return counts


@pytest.mark.parametrize("axis", ["x", "y", "z", "xyz"])
@pytest.mark.parametrize("angle", [0, 15, 75])
def test_cells_beyond_a_limit_are_those_that_scipy_interpolates(distances, axis, angle, rng):
    R = Rotation.from_euler(axis, [angle] * len(axis), degrees=True).as_matrix()
    # From outside the grid to outside it.
    start, shape = rng.uniform(-9.0, 3.0, 3), np.array([31, 28, 40])
    values = ndimage.affine_transform(
        distances, R, start, tuple(shape), order=1, mode="nearest", output=np.float64
    )
    # Between the values, so that rounding decides nothing.
    limit = 0.0031
    assert np.abs(values - limit).min() > 1e-9
    found = counts_beyond(distances, PITCH, limit, R, start, shape)
    np.testing.assert_array_equal(found, sums_of(values > limit))


def test_boxes_grow_until_each_side_is_blocked(rng):
    blocked = rng.random((30, 25, 20)) < 0.01
    counts = sums_of(blocked).astype(np.int32)
    seeds = np.argwhere(~blocked)[rng.choice((~blocked).sum(), 50)]
    boxes = np.stack([seeds, seeds], axis=1)
    grow_boxes(counts, boxes, np.argsort(rng.random((len(seeds), 6)), axis=1))

    def is_free(low, high):
        inside = (low >= 0).all() and (high < blocked.shape).all()
        part = tuple(slice(a, b + 1) for a, b in zip(low, high, strict=True))
        return bool(inside and not blocked[part].any())

    for seed, (low, high) in zip(seeds, boxes, strict=True):
        assert (low <= seed).all()
        assert (seed <= high).all()
        assert is_free(low, high)
        for end, axis in itertools.product(range(2), range(3)):
            sides = np.stack([low, high])
            sides[end, axis] += 2 * end - 1
            assert not is_free(*sides)


def test_the_order_of_the_sides_decides():
    blocked = np.zeros((20, 20, 1), np.bool_)
    blocked[15, 15] = True
    seed = np.array([[10, 10, 0]])
    for order, expected in (([3, 4, 0, 1, 2, 5], [19, 14]), ([4, 3, 0, 1, 2, 5], [14, 19])):
        box = np.stack([seed, seed], axis=1)
        grow_boxes(sums_of(blocked).astype(np.int32), box, np.array([order]))
        np.testing.assert_array_equal(box[0, 1, :2], expected)
