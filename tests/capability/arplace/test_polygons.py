"""Points of a grid inside closed polygons."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.capability.arplace.polygons import counts_inside, winding_numbers


@pytest.mark.parametrize("seed", range(5))
def test_counts_are_those_of_the_winding_numbers(seed):
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, (60, 12)), axis=1)
    # Random radii make some boundaries meet a line four times, negative ones make them cross
    # themselves; the last are clockwise.
    radius = rng.uniform(-0.2, 1.0, (60, 12))
    radius[:20] = rng.uniform(0.8, 1.0, (20, 1))
    polygons = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
    polygons[50:] = polygons[50:, ::-1]
    x, y = np.linspace(-0.9, 0.8, 18), np.linspace(-1.1, 1.1, 23)
    expected = np.count_nonzero(winding_numbers(polygons, x, y) > 0, axis=0)
    np.testing.assert_array_equal(counts_inside(polygons, x, y), expected)
    np.testing.assert_array_equal(counts_inside(polygons, x[3:4], y[7:8]), expected[3:4, 7:8])
