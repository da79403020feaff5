"""Grids of distances: interpolated along other axes, and measured, as SciPy does it."""

import numpy as np
import pytest
from scipy import ndimage
from scipy.spatial.transform import Rotation

from tcs.model.robots.fitting.growth import _interpolated
from tcs.model.robots.fitting.solid import distances, solid_of, spaces_outside

PITCH = 0.002


@pytest.fixture
def cells(rng):
    found = rng.random((19, 23, 17)) < 0.999
    found[5:11, 4:9, 3:14] = False
    return found


@pytest.mark.parametrize("axis", ["x", "y", "z", "xyz"])
@pytest.mark.parametrize("angle", [0, 15, 75])
def test_values_along_turned_axes_are_those_of_scipy(cells, axis, angle, rng):
    values = (distances(cells, PITCH) + rng.random(cells.shape)).astype(np.float32)
    R = Rotation.from_euler(axis, [angle] * len(axis), degrees=True).as_matrix()
    # From outside the grid to outside it.
    start, count = rng.uniform(-9.0, 3.0, 3), (31, 28, 40)
    found = _interpolated(values, R, start, count)
    expected = ndimage.affine_transform(values, R, start, count, order=1, mode="nearest")
    assert found.dtype == np.float32
    # A last digit of single precision: sums are in another order.
    np.testing.assert_allclose(found, expected, rtol=3e-7)


def test_distances_are_those_of_scipy(cells):
    expected = ndimage.distance_transform_edt(cells) * PITCH
    np.testing.assert_array_equal(distances(cells, PITCH), expected)


def test_a_space_does_not_depend_on_the_other_balls():
    # A bowl with a narrow opening, which a small ball enters and a large one does not.
    u, v = np.meshgrid(np.linspace(0.3, np.pi, 60), np.linspace(0, 2 * np.pi, 90), indexing="ij")
    at = 0.04 * np.stack([np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)], axis=2)
    corners = [at[:-1, :-1], at[1:, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1], at[:-1, 1:]]
    triangles = np.stack(corners, axis=2).reshape(-1, 3, 3)
    balls = (0.004, 0.01), (0.02, 0.0)
    spaces = spaces_outside(triangles, PITCH, balls)
    at_centre = []
    for (empty, origin), (radius, reach) in zip(spaces, balls, strict=True):
        alone = solid_of(triangles, PITCH, reach, radius)
        np.testing.assert_array_equal(empty, alone.outside > 0.0)
        np.testing.assert_array_equal(origin, alone.origin)
        at_centre.append(bool(empty[tuple(np.rint(-origin / PITCH).astype(int))]))
    assert at_centre == [True, False]
