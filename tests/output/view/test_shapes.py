"""Shapes as they are drawn."""

import numpy as np
import pytest

from tcs.output.view.shapes import rounded_box


@pytest.mark.parametrize("size", [(0.2, 0.3, 0.4), (0.02, 0.5, 0.1)])
def test_a_rounded_box_is_closed_and_within_the_box(size):
    corners, faces = rounded_box(np.array(size))
    half = 0.5 * np.array(size)
    # It touches every side, and no corner.
    np.testing.assert_allclose(corners.max(axis=1), half, atol=1e-9)
    np.testing.assert_allclose(corners.min(axis=1), -half, atol=1e-9)
    assert (np.abs(corners).T / half).min(axis=1).max() < 0.99
    # Each edge belongs to two triangles, once in either direction; all look outward.
    edges = np.concatenate([faces[[i, (i + 1) % 3]].T for i in range(3)])
    assert len(np.unique(edges, axis=0)) == len(edges)
    assert {tuple(e) for e in edges.tolist()} == {tuple(e[::-1]) for e in edges.tolist()}
    volume = np.linalg.det(corners.T[faces.T]).sum() / 6.0
    assert 0.7 * np.prod(size) < volume < np.prod(size)
