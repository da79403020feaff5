"""Made-up labels: regions whose shape is known."""

from __future__ import annotations

import numpy as np

from tcs.capability.arplace import Arplace, ModelOptions, TableTask
from tcs.capability.arplace.learning import generalised
from tcs.model.grid import Axis

TASK = TableTask(
    distance=Axis("distance", "m", 0.0, 0.1, 3),
    height=Axis("height", "m", 0.5, 0.1, 1),
    base_x=Axis("base_x", "m", -1.0, 0.1, 11),
    base_y=Axis("base_y", "m", -0.9, 0.1, 19),
)
"""Three grasps, 0.1 m apart, and 11 x 19 base positions, 0.1 m apart."""


def discs(task: TableTask = TASK, *, radius: float = 0.42, hole: float = 0.0) -> np.ndarray:
    """Return labels of discs about (distance - 0.6, 0), with a hole in the middle."""
    x, y = np.meshgrid(task.base_x.values, task.base_y.values, indexing="ij")
    away = [np.hypot(x - (grasp[0] - 0.6), y) for grasp in task.parameters]
    return np.array([(r <= radius) & (r >= hole) for r in away])


def two_parts(task: TableTask = TASK) -> np.ndarray:
    """Return labels of two parts that are one in the middle grasp, and none in the last one."""
    x, y = np.meshgrid(task.base_x.values, task.base_y.values, indexing="ij")
    near = (x > -0.75) & (x < -0.25)
    apart = near & (np.abs(y) < 0.65) & (np.abs(y) > 0.25)
    return np.array([apart, near & (np.abs(y) < 0.65), np.zeros_like(near)])


def model(labels: np.ndarray | None = None, **options) -> Arplace:
    """Return the model of labels, by default of discs."""
    reached = discs() if labels is None else labels
    return generalised(TASK, reached, ModelOptions(**options), base_radius=0.3)
