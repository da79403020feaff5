"""Errors of the table's pose in queries of ARPlace."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.capability.arplace import ObjectPose, query
from tcs.capability.arplace.table_error import displaced, displacement_covariance
from tcs.errors import SelectionError
from tests.capability.arplace.example import model

POSE = ObjectPose(distance=0.1, height=0.5)


def test_no_error_of_the_table_changes_nothing():
    arplace = model()
    free = query(arplace, POSE, samples=1)
    fixed = query(arplace, POSE, samples=1, table_covariance=np.zeros((3, 3)))
    np.testing.assert_array_equal(free.map.probability, fixed.map.probability)
    assert (free.x, free.y, free.success) == (fixed.x, fixed.y, fixed.success)


def test_an_error_spreads_the_probability_over_the_rim():
    arplace = model()
    free = query(arplace, POSE, samples=1).map
    error = np.diag([0.1**2, 0.1**2, 0.0])
    found = query(arplace, POSE, samples=1, table_covariance=error)
    inside = free.probability == 1.0
    assert found.map.probability[inside].min() < 0.7
    assert found.map.probability[~inside].max() > 0.3
    assert found.success > 0.98
    # What leaves the region enters the rest of the map; the disc ends 8 cm before the map does.
    assert found.map.probability.sum() == pytest.approx(free.probability.sum(), rel=0.02)


def test_displacements_have_the_given_covariance():
    arplace = model()
    free = query(arplace, POSE, samples=1).map
    one = np.zeros_like(free.probability)
    one[5, 9] = 1.0
    covariance = np.array([[0.02, 0.01], [0.01, 0.03]])
    spread = displaced(type(free)(free.x, free.y, one, 0.0, 0.0), covariance).probability
    x, y = np.meshgrid(free.x - free.x[5], free.y - free.y[9], indexing="ij")
    moments = [[(spread * a * b).sum() for b in (x, y)] for a in (x, y)]
    # Interpolation between positions 0.1 m apart adds up to 0.1**2 / 4; three deviations are
    # within the map.
    np.testing.assert_allclose(moments, covariance, atol=0.003)


def test_a_rotation_of_the_table_displaces_the_base_along_the_edge():
    error = np.diag([0.0, 0.0, 0.3**2])
    found = displacement_covariance(model(), error, 0.0)
    # The discs are about x -0.6 to -0.4 m, y 0.
    np.testing.assert_allclose(found, np.diag([0.0, (0.5 * 0.3) ** 2]), atol=1e-3)
    aside = displacement_covariance(model(), error, 0.4)
    np.testing.assert_allclose(aside[0, 0], (0.4 * 0.3) ** 2, atol=1e-3)


@pytest.mark.parametrize(
    "covariance", [np.eye(2), -np.eye(3), np.full((3, 3), np.nan), np.eye(3) * 1e6]
)
def test_an_invalid_covariance_is_refused(covariance):
    with pytest.raises(SelectionError, match="table"):
        query(model(), POSE, samples=1, table_covariance=covariance)
