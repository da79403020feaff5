"""Points in blocks: few of them decide a distance, which is that of all."""

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from tcs_shapes.clearance import blocks_of, least_distance


def test_each_point_is_in_the_ball_of_its_block():
    points = np.random.default_rng(0).uniform(-0.1, 0.1, (500, 3))
    blocks = blocks_of(points)
    assert len(blocks.centres) > 100
    np.testing.assert_array_equal(np.sort(blocks.points, axis=0), np.sort(points, axis=0))
    for k, (centre, radius) in enumerate(zip(blocks.centres, blocks.radii, strict=True)):
        own = blocks.of(np.array([k]))
        assert len(own)
        assert np.linalg.norm(own - centre, axis=1).max() <= radius


@pytest.mark.parametrize("offset", [-0.02, 0.0, 0.01, 0.03, 0.045, 0.06, 0.3])
@pytest.mark.parametrize("seed", range(3))
def test_the_least_distance_is_that_of_all_points(offset, seed):
    rng = np.random.default_rng(seed)
    still, moved = rng.uniform(0.0, 0.1, (2, 700, 3))
    R, p = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
    # The moved points in their frame, so that R and p bring them beside the still ones.
    moved[:, 0] += 0.1 + offset
    found = least_distance(cKDTree(still), blocks_of((moved - p) @ R), R, p, 0.05)
    everything = np.linalg.norm(still[:, None] - moved[None], axis=2).min()
    # A rotation there and back rounds coordinates of a few metres.
    assert found == pytest.approx(min(everything, 0.05), abs=1e-14)


def test_a_single_point_decides():
    points = np.full((1000, 3), 1.0)
    points[777] = [0.0, 0.0, 0.004]
    tree = cKDTree(np.zeros((1, 3)))
    assert least_distance(tree, blocks_of(points), np.eye(3), np.zeros(3), 0.05) == 0.004
