"""Heat maps of base poses against a plain loop."""

import numpy as np
import pytest

from tcs.output.draw.heat_map import headings_at, heat_map_of

STEP = 0.05


@pytest.fixture
def poses():
    rng = np.random.default_rng(0)
    along = np.unique(np.column_stack([rng.integers(-9, 5, 300), rng.integers(3, 12, 300)]), axis=0)
    some = along[rng.integers(0, len(along), 500)]
    yaw = rng.integers(-8, 16, 500) * np.pi / 8
    return np.column_stack([some * STEP, yaw, rng.random(500)])


def test_each_cell_has_the_best_score_of_its_headings(poses):
    found = heat_map_of(poses, STEP)
    x, y = (0.5 * (edges[1:] + edges[:-1]) for edges in found.edges)
    assert found.best.shape == (y.size, x.size)
    for i, j in np.ndindex(*found.best.shape):
        here = (np.abs(poses[:, 0] - x[j]) < 1e-9) & (np.abs(poses[:, 1] - y[i]) < 1e-9)
        expected = poses[here, 3].max() if here.any() else np.nan
        np.testing.assert_equal(found.best[i, j], expected)
    # No empty row or column at an edge.
    known = ~np.isnan(found.best)
    assert known[0].any() and known[-1].any() and known[:, 0].any() and known[:, -1].any()  # noqa: PT018


def test_every_heading_is_listed_once_and_in_order(poses):
    found = headings_at(poses, STEP)
    listed = [(x, y, yaw, score) for (x, y), headings in found.items() for yaw, score in headings]
    assert len(listed) == len(poses)
    expected = [
        (round(x / STEP), round(y / STEP), round(np.degrees(yaw), 3) % 360.0, score)
        for x, y, yaw, score in poses
    ]
    np.testing.assert_allclose(sorted(listed), sorted(expected))
    for headings in found.values():
        yaws = [yaw for yaw, _ in headings]
        assert yaws == sorted(yaws)
        assert 0.0 <= yaws[0]
        assert yaws[-1] < 360.0
