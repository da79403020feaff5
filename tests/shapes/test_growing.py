"""Boxes that grow on a rotated grid, as plain loops and SciPy have them."""

import itertools

import numpy as np
import pytest
from scipy import ndimage
from scipy.spatial.transform import Rotation

from tcs_shapes.cells import counts_beyond, grow_boxes

PITCH = 0.002


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
