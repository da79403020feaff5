"""Boxes rotated until little space outside the body costs anything."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tcs_shapes import shared_surface as orienting
from tcs_shapes.shared_surface import least_protruding


@pytest.fixture(scope="module")
def grid():
    """Points 1 cm apart around a metre."""
    along = np.linspace(-0.5, 0.5, 101)
    return np.stack(np.meshgrid(along, along, along), axis=-1).reshape(-1, 3)


def box_points(R, size):
    """Corners of a box about the origin."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return signs * np.array(size) / 2 @ R.T


def volume(points, R):
    return float(np.ptp(points @ R, axis=0).prod())


@pytest.mark.parametrize("angles", [(20, 0, 0), (0, -25, 10), (12, 8, -30)])
def test_a_tilted_box_is_found(grid, angles):
    size = (0.3, 0.5, 0.2)
    R_true = Rotation.from_euler("xyz", angles, degrees=True).as_matrix()
    points = box_points(R_true, size)
    outside = grid[np.any(np.abs(grid @ R_true) > np.array(size) / 2 + 0.005, axis=1)]
    costs = np.full(len(outside), 1e-6)
    R = least_protruding(points, np.eye(3), outside, costs, 1e-3)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    # The last step is 1 degree, and a box 1 degree off is some 4 % larger.
    assert volume(points, R) < 1.1 * np.prod(size) < 0.8 * volume(points, np.eye(3))


def test_dear_space_is_avoided_though_the_box_gets_larger(grid):
    # The ends of a bar along the diagonal of a square: the box with the least volume follows it.
    points = np.array([[-0.2, -0.2, 0.0], [0.2, 0.2, 0.0], [0.2, 0.2, 0.1], [-0.2, -0.2, 0.1]])
    along = least_protruding(points, np.eye(3), np.empty((0, 3)), np.empty(0), 1.0)
    assert volume(points, along) < 0.1 * volume(points, np.eye(3))
    # In the middle of the diagonal nothing may be: no box around the ends leaves it out.
    beside = grid[(np.abs(grid[:, 0] - grid[:, 1]) < 0.02) & (np.abs(grid[:, 0]) > 0.22)]
    R = least_protruding(points, np.eye(3), beside, np.full(len(beside), 1.0), 1e-3)
    seen, low, high = beside @ R, (points @ R).min(axis=0), (points @ R).max(axis=0)
    assert not ((seen >= low) & (seen <= high)).all(axis=1).any()


def test_an_orientation_that_cannot_be_better_stays(grid):
    points = box_points(np.eye(3), (0.3, 0.5, 0.2))
    R = least_protruding(points, np.eye(3), np.empty((0, 3)), np.empty(0), 1.0)
    np.testing.assert_array_equal(R, np.eye(3))


def test_many_points_are_thinned_to_the_same_ones(grid, monkeypatch):
    points = box_points(Rotation.from_euler("z", 20, degrees=True).as_matrix(), (0.3, 0.5, 0.2))
    costs = np.full(len(grid), 1e-6)
    monkeypatch.setattr(orienting, "_DRAWN", 500)
    first, second = (least_protruding(points, np.eye(3), grid, costs, 0.0) for _ in range(2))
    np.testing.assert_array_equal(first, second)
    assert volume(points, first) < 0.9 * volume(points, np.eye(3))
