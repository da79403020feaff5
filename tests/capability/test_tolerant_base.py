"""The base pose of a task map under errors of the task's pose."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.capability import MapGrid, TaskMap, best_under_error
from tcs.capability.tasks import Grasp, GraspPosition, GraspTask
from tcs.capability.volume import Box, Nearness

TASK = GraspTask("t", (GraspPosition(0.0, 0.0, 0.4, (Grasp(0.0),)),))
NONE = np.zeros((3, 3))


def task_map(score) -> TaskMap:
    """Return a map of one torso height with its base positions about x -1 m, y 0."""
    values = np.asarray(score, np.float32)
    box = Box(-25, -values.shape[0] // 2, *values.shape[:2])
    return TaskMap(
        "TS-ICM", TASK, MapGrid.of(0.05, 8, "side"), box, np.array([0.1]), values[None],
        Nearness(0.0, 0.0),
    )  # fmt: skip


def with_island() -> TaskMap:
    """Return a map with a wide region of score 0.6 and a single cell of score 0.9."""
    score = np.full((15, 15, 8), np.nan)
    score[2:11, 2:11] = 0.6
    score[13, 13, 3] = 0.9
    return task_map(score)


def test_without_error_the_best_base_pose_remains():
    found = with_island()
    best = best_under_error(found, NONE)
    assert best.base == found.best()
    assert (best.expected_score, best.feasible) == (pytest.approx(0.9), 1.0)


def test_an_error_moves_the_base_pose_away_from_the_rim():
    best = best_under_error(with_island(), np.diag([0.02, 0.02, 0.01]) ** 2)
    assert best.base.score == pytest.approx(0.6)
    assert best.feasible > 0.99
    assert best.expected_score == pytest.approx(0.6 * best.feasible)


def test_the_probability_is_that_of_the_normal_distribution():
    score = np.full((41, 41, 8), np.nan)
    score[:21] = 0.5
    found = task_map(score)
    wide = best_under_error(found, np.diag([1e-12, 1e-12, 1e-12]))
    assert wide.feasible == pytest.approx(1.0)
    # Of half a plane with its rim one cell away, a deviation of 5 cm along x leaves 84 %, and
    # interpolation beyond the rim some more; 2000 samples have a deviation of 0.8 %.
    score = np.full((3, 41, 8), np.nan)
    score[1] = 0.5
    strip = best_under_error(task_map(score), np.diag([0.05**2, 0.0, 0.0]), samples=2000)
    expected = 1.0 - np.mean(np.minimum(np.abs(np.random.default_rng(0).normal(size=200_000)), 1.0))
    assert strip.feasible == pytest.approx(expected, abs=0.04)


def test_the_heading_error_acts_at_the_distance_of_the_base():
    score = np.full((3, 41, 8), 0.5)
    wide, turned = (
        best_under_error(task_map(score), np.diag([0.0, 0.0, std]) ** 2) for std in (1e-9, 0.3)
    )
    assert wide.feasible == pytest.approx(1.0)
    assert turned.feasible < 0.9
