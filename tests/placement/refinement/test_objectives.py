"""Objectives of a refinement, on small tables with known values."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.placement.refinement.displaced import BALL, LEVER, DisplacedBases
from tcs.placement.refinement.objectives import (
    BEFORE_RADIUS,
    TIE,
    BallObjective,
    Features,
    ScoreObjective,
    TocObjective,
)
from tcs.placement.refinement.points import Points, PointScores

WEIGHTS = np.array([0.75, 0.25])
ALONE = Features(np.array([[[True, False]]]), np.array([[[0.4, 0.0]]], np.float32))
TOGETHER = Features(
    np.array([[[True, False], [True, True]]]), np.array([[[0.4, 0.0], [0.2, 0.8]]], np.float32)
)


def test_the_score_takes_the_best_member_at_each_goal():
    objective = ScoreObjective(WEIGHTS)
    assert objective.values(ALONE)[0] == pytest.approx(0.75 + 0.3)
    assert objective.values(TOGETHER)[0] == pytest.approx(1.0 + 0.3 + 0.2)


def test_toc_weighs_reachability_tenfold_and_two_members_less():
    objective = TocObjective(WEIGHTS)
    assert objective.values(ALONE)[0] == pytest.approx(7.5 + 0.3)
    assert objective.values(TOGETHER)[0] == pytest.approx(10.0 + 0.95 * 0.5)


class Floor:
    """Reaches goal 0 where x is at most 0.03, goal 1 everywhere."""

    def score(self, points: Points) -> PointScores:
        reached = np.column_stack([points.values[:, 0] <= 0.03, np.ones(len(points.values), bool)])
        return PointScores(
            reached, 0.5 * reached.astype(np.float32), np.zeros((len(reached), 2, 7))
        )


def test_the_ball_ends_at_the_nearest_displacement_that_loses_a_goal(rng):
    displaced = DisplacedBases.in_ball(Floor(), 4000, rng)
    at = Points(np.zeros((1, 4)), np.zeros(1, dtype=np.int64))
    # 4,000 samples leave a gap of less than 5 mm in front of the plane x = 0.03.
    np.testing.assert_allclose(displaced.radii(at)[0], [0.03, BALL], atol=0.005)
    assert np.all(displaced.radii(at)[0] >= 0.03)


def test_displacements_fill_the_ball(rng):
    displaced = DisplacedBases.in_ball(Floor(), 4000, rng)
    assert np.all(np.diff(displaced.sizes) >= 0.0)
    assert displaced.sizes[-1] <= BALL
    # Half of the radius holds an eighth of the volume; the standard deviation is 0.005.
    assert np.mean(displaced.sizes <= BALL / 2) == pytest.approx(0.125, abs=0.02)
    assert np.abs(displaced.offsets[:, 2]).max() > 0.9 * BALL / LEVER


def test_the_ball_of_a_set_is_that_of_the_member_that_keeps_each_goal_longest():
    objective = BallObjective(WEIGHTS, DisplacedBases(None, np.zeros((1, 3))))
    reached = np.array([[True, False], [True, True]])
    radii = np.array([[0.08, 0.0], [0.02, 0.05]])
    dexterity = np.array([[0.4, 0.0], [0.2, 0.8]])
    features = Features(
        np.concatenate([reached, reached], axis=1)[None],
        np.concatenate([radii, dexterity], axis=1, dtype=np.float32)[None],
    )
    assert objective.radius(features)[0] == pytest.approx(0.05)
    expected = BEFORE_RADIUS + 0.05 + TIE * (0.75 * 0.4 + 0.25 * 0.8)
    assert objective.values(features)[0] == pytest.approx(expected)
    # The first member alone reaches less, however far it may be displaced.
    alone = Features(*(array[:, :1] for array in features))
    assert objective.radius(alone)[0] == pytest.approx(0.08)
    assert objective.values(alone)[0] < objective.values(features)[0]
