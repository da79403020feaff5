"""Distinct rows, and triangles cut into pieces."""

import numpy as np
import pytest

from tcs.model.robots.triangles import cut, distinct, halved, longest_edges


@pytest.mark.parametrize("columns", [1, 3, 9])
def test_distinct_rows_are_those_of_numpy(columns, rng):
    rows = rng.integers(-2, 3, size=(400, columns)).astype(float)
    found, number = distinct(rows)
    expected, inverse = np.unique(rows, axis=0, return_inverse=True)
    np.testing.assert_array_equal(found, expected)
    np.testing.assert_array_equal(number, inverse.ravel())
    np.testing.assert_array_equal(found[number], rows)


def test_no_rows_are_distinct():
    found, number = distinct(np.empty((0, 3)))
    assert found.shape == (0, 3)
    assert number.shape == (0,)


def test_triangles_are_cut_at_the_middle_of_their_longest_edge():
    triangle = np.array([[[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 4.0, 0.0]]])
    np.testing.assert_allclose(longest_edges(triangle), 5.0)
    middle = [1.5, 2.0, 0.0]
    first, second = halved(triangle)
    np.testing.assert_allclose(first, [[3.0, 0.0, 0.0], middle, [0.0, 0.0, 0.0]])
    np.testing.assert_allclose(second, [middle, [0.0, 4.0, 0.0], [0.0, 0.0, 0.0]])


def test_pieces_have_the_area_of_the_triangles_and_short_edges(rng):
    triangles = rng.normal(size=(20, 3, 3))
    pieces = cut(triangles, 0.3)
    assert longest_edges(pieces).max() <= 0.3

    def area(corners):
        edges = corners[:, 1:] - corners[:, :1]
        return np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1).sum() / 2

    assert area(pieces) == pytest.approx(area(triangles), rel=1e-12)
