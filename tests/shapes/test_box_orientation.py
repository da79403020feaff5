"""Smallest rectangles and boxes around points, against plain searches."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from tcs_shapes.containment import box_cost, tightest_rectangles


@pytest.mark.parametrize("seed", range(5))
def test_a_rectangle_has_a_side_on_the_hull_and_is_the_smallest(seed):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(60, 3)) * [3.0, 2.0, 1.0]
    # On a grid, many are in a row.
    points = np.round(points, 1) if seed % 2 else points
    frames = Rotation.random(7, rng=rng).as_matrix()
    angles, areas = tightest_rectangles(points, frames)
    for frame, angle, area in zip(frames, angles, areas, strict=True):
        seen = (points @ frame)[:, :2]
        corners = seen[ConvexHull(seen).vertices]
        edges = np.roll(corners, -1, axis=0) - corners

        def area_at(angle, seen=seen):
            c, s = np.cos(angle), np.sin(angle)
            return np.ptp(seen @ [c, s]) * np.ptp(seen @ [-s, c])

        least = min(area_at(np.arctan2(y, x)) for x, y in edges)
        # Rounding of a few products.
        assert area == pytest.approx(least, rel=1e-12)
        assert area_at(angle) == pytest.approx(least, rel=1e-12)
        assert area <= min(area_at(a) for a in np.linspace(0, np.pi / 2, 200)) * (1 + 1e-12)


def test_points_in_a_line_have_a_rectangle_without_area():
    points = np.linspace(0, 1, 5)[:, None] * [3.0, 4.0, 0.0]
    angles, areas = tightest_rectangles(points, np.eye(3)[None])
    # Rounding of products of up to 5 m.
    assert areas[0] == pytest.approx(0.0, abs=1e-14)
    assert np.tan(angles[0]) == pytest.approx(4 / 3)


def test_the_cost_of_a_box(rng):
    points, outside = rng.uniform(-1, 1, (50, 3)), rng.uniform(-2, 2, (2000, 3))
    costs, R = rng.random(2000), Rotation.random(rng=rng).as_matrix()
    seen, others = points @ R, outside @ R
    low, high = seen.min(axis=0), seen.max(axis=0)
    within = ((others >= low) & (others <= high)).all(axis=1)
    assert 100 < within.sum() < 1900
    expected = costs[within].sum() + 0.3 * (high - low).prod()
    assert box_cost(points, outside, costs, R, 0.3) == pytest.approx(expected, rel=1e-12)
