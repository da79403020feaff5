"""Grids of distances, measured as SciPy does it, and the space that they describe."""

import numpy as np
import pytest
from scipy import ndimage
from scipy.spatial.transform import Rotation

from tcs_shapes.solids import distances, extremes, solid_of, spaces_outside

PITCH = 0.002


@pytest.mark.parametrize("reach", [0.003, np.inf])
def test_distances_are_those_of_scipy(reach, rng):
    cells = rng.random((19, 23, 17)) < 0.999
    cells[5:11, 4:9, 3:14] = False
    expected = ndimage.distance_transform_edt(cells) * PITCH
    found = distances(cells, PITCH, reach)
    # Up to two edges of a cell farther, and never nearer than that.
    exact = expected <= reach + 2 * PITCH
    assert exact.any()
    assert exact.all() == np.isinf(reach)
    np.testing.assert_array_equal(found[exact], expected[exact])
    assert (found[~exact] > reach + 2 * PITCH).all()


def test_the_extremes_of_a_solid_span_all_of_it():
    u, v = np.meshgrid(np.linspace(0, np.pi, 40), np.linspace(0, 2 * np.pi, 60), indexing="ij")
    at = 0.04 * np.stack([np.sin(u) * np.cos(v), 0.7 * np.sin(u) * np.sin(v), np.cos(u)], axis=2)
    corners = [at[:-1, :-1], at[1:, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1], at[:-1, 1:]]
    solid = solid_of(np.stack(corners, axis=2).reshape(-1, 3, 3), PITCH, 0.005)
    within = solid.points(solid.outside <= 0.005)
    found = extremes(solid, 0.005)
    assert len(found) < len(within) / 50
    for R in Rotation.random(5, rng=np.random.default_rng(0)).as_matrix():
        for f in (np.min, np.max):
            np.testing.assert_allclose(f(found @ R, axis=0), f(within @ R, axis=0), atol=1e-12)


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
