"""The motion of the free joint between the levels of the grid."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.kernel.approach.curve import _path_at
from tcs.kernel.approach.grid import PIECES, LineGrid, new_grid
from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import jit


@jit
def along(grid: LineGrid, fractions: FloatArray, angles: FloatArray, rates: FloatArray) -> None:
    for n in range(len(fractions)):
        angles[n], rates[n] = _path_at(grid, fractions[n])


def follow(is_bent, path):
    """Return fractions of the line, the free joint there and its derivative."""
    grid, fractions = new_grid(), np.linspace(0.0, 1.0, 81)
    grid.path[:], grid.is_bent[0] = path, is_bent
    angles, rates = np.empty((2, len(fractions)))
    along(grid, fractions, angles, rates)
    return fractions, angles, rates


@pytest.mark.parametrize("is_bent", [False, True], ids=["straight", "bent"])
def test_the_free_joint_passes_the_levels_smoothly(rng, is_bent):
    path = rng.normal(size=PIECES + 1)
    fractions, angles, rates = follow(is_bent, path)
    np.testing.assert_allclose(angles[::20], path, atol=1e-12)
    # Of second order in the spacing of 1 / 80, by third derivatives of up to some thousand.
    np.testing.assert_allclose(np.gradient(angles, fractions)[1:-1], rates[1:-1], atol=1.0)
    assert np.abs(rates).max() > 1.0


def test_with_bent_ends_the_free_joint_follows_a_parabola(rng):
    a, b, c = rng.normal(size=3)
    levels = np.linspace(0.0, 1.0, PIECES + 1)
    fractions, angles, rates = follow(True, a + b * levels + c * levels**2)
    # Rounding.
    np.testing.assert_allclose(angles, a + b * fractions + c * fractions**2, atol=1e-12)
    np.testing.assert_allclose(rates, b + 2.0 * c * fractions, atol=1e-11)
    _, coarse, _ = follow(False, a + b * levels + c * levels**2)
    inner = (fractions >= 1.0 / PIECES) & (fractions <= 1.0 - 1.0 / PIECES)
    np.testing.assert_allclose(coarse[inner], angles[inner], atol=1e-12)
    assert np.abs(coarse - angles).max() > 1e-4
