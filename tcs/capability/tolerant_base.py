"""The base pose of a task map that remains good if the task is not where it was found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tcs.capability.merge import BasePose, TaskMap
from tcs.kernel.arrays import FloatArray
from tcs.model.random_streams import check_draws, named_generator

MOST_CONSIDERED = 1000
"""Greatest number of base poses that are compared, those with the highest scores first."""


@dataclass(frozen=True, slots=True)
class ErrorTolerantBase:
    """A base pose, chosen for the scores that it has when the pose of the task has an error."""

    base: BasePose
    """The base pose in F, with the score that it has without an error."""
    expected_score: float
    """Mean score over random errors; where the task is infeasible the score is 0."""
    feasible: float
    """Probability that the task is feasible."""
    samples: int
    """Number of random errors."""

    def to_json(self) -> dict[str, Any]:
        """Return the base pose and its scores as plain numbers."""
        return {
            **self.base.to_json(),
            "expected_score": self.expected_score,
            "feasible": self.feasible,
            "samples": self.samples,
        }


def best_under_error(
    found: TaskMap, covariance: FloatArray, *, samples: int = 500, seed: int = 0
) -> ErrorTolerantBase:
    """Return the base pose of the greatest expected score under errors of the task's pose.

    The base drives to a pose relative to the task frame as it was found; relative to the true task
    it is then displaced and rotated by the error. Between the cells of the map the score is
    interpolated linearly, and 0 counts where the task is infeasible. The base pose is chosen on
    one set of random errors and evaluated on another.

    Args:
        found: The task map.
        covariance: Covariance of x, y and yaw along the axes of F [m, rad], shape (3, 3).
        samples: Number of random errors.
        seed: Seed of the random numbers.

    Raises:
        TcsError: If the number of samples or the seed is out of range.
    """
    check_draws(samples, seed)
    poses = found.base_poses
    poses = poses[np.argsort(-poses[:, 4], kind="stable")[:MOST_CONSIDERED]]
    errors = _errors(covariance, samples, seed, "choice")
    expected = np.array([_scores(found, row, errors)[0] for row in poses])
    best = poses[int(np.argmax(expected))]
    score, feasible = _scores(found, best, _errors(covariance, samples, seed, "evaluation"))
    return ErrorTolerantBase(BasePose(*map(float, best)), score, feasible, samples)


def _errors(covariance: FloatArray, samples: int, seed: int, use: str) -> FloatArray:
    """Return random errors of x, y [m] and yaw [rad], shape (samples, 3)."""
    values, axes = np.linalg.eigh(covariance)
    normal = named_generator(seed, f"located task {use}").standard_normal((samples, 3))
    return np.asarray(normal @ (axes * np.sqrt(np.maximum(values, 0.0))).T)


def _scores(found: TaskMap, row: FloatArray, errors: FloatArray) -> tuple[float, float]:
    """Return mean score and probability of feasibility of a base pose over errors."""
    x, y, yaw, torso_height = row[:4]
    c, s = np.cos(errors[:, 2]), np.sin(errors[:, 2])
    grid, box = found.grid, found.box
    level = int(np.argmin(np.abs(found.torso_heights - torso_height)))
    score = found.score[level]
    at = np.stack(
        [
            (c * x - s * y + errors[:, 0]) / grid.step - box.x,
            (s * x + c * y + errors[:, 1]) / grid.step - box.y,
            (yaw + errors[:, 2]) / grid.yaw_step,
        ]
    )
    # Rounding must not move a base pose without an error off its cell.
    at = np.where(np.abs(at - np.rint(at)) < 1e-6, np.rint(at), at)
    low = np.floor(at).astype(np.int64)
    fraction = at - low
    mean, feasible = np.zeros(len(errors)), np.zeros(len(errors))
    for corner in np.ndindex(2, 2, 2):
        side = np.array(corner)[:, None]
        weight = np.where(side == 1, fraction, 1.0 - fraction).prod(axis=0)
        i, j, k = low + side
        inside = (i >= 0) & (i < score.shape[0]) & (j >= 0) & (j < score.shape[1])
        value = score[
            np.clip(i, 0, score.shape[0] - 1), np.clip(j, 0, score.shape[1] - 1), k % grid.yaw_bins
        ]
        reached = inside & ~np.isnan(value)
        mean += np.where(reached, weight * np.nan_to_num(value), 0.0)
        feasible += np.where(reached, weight, 0.0)
    return float(mean.mean()), float(feasible.mean())
