"""Success of a task from one base pose, under errors of the base and of the task."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from scipy.stats import binomtest

from tcs.capability.merge import BasePose
from tcs.capability.surroundings import Surroundings
from tcs.capability.tasks import GraspTask
from tcs.errors import TaskError
from tcs.files.quantities import DEVIATION, DEVIATION_DEG
from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.model.random_streams import check_draws, named_generator


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseErrors:
    """Standard deviations of independent normal errors of the base and of the task."""

    base_position: float = 0.0
    """Of x and of y of the base, each, in the task frame F [m]."""
    base_yaw: float = 0.0
    """Of the heading of the base [rad]."""
    task_position: float = 0.0
    """Of x and of y of the tool poses, each, all displaced together in F [m]."""
    task_yaw: float = 0.0
    """Of a rotation of all tool poses about the z axis of F [rad]."""

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            TaskError: If a deviation is out of its physical range.
        """
        for field in fields(self):
            value, what = getattr(self, field.name), f"errors: {field.name}"
            if field.name.endswith("yaw"):
                DEVIATION_DEG.check(math.degrees(value), what, TaskError)
            else:
                DEVIATION.check(value, what, TaskError)

    def draw(self, samples: int, seed: int) -> tuple[FloatArray, FloatArray]:
        """Return displacements of base and task: x, y [m] and yaw [rad], shapes (samples, 3).

        Equal seeds give equal samples, scaled by the deviations.

        Raises:
            TcsError: If the number of samples or the seed is out of range.
        """
        check_draws(samples, seed)
        base, task = (
            named_generator(seed, name).standard_normal((samples, 3))
            * [position, position, yaw]
            for name, position, yaw in (
                ("base pose", self.base_position, self.base_yaw),
                ("task pose", self.task_position, self.task_yaw),
            )
        )  # fmt: skip
        return base, task


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TaskSuccess:
    """What a base pose reaches of a task in each sample."""

    body_blocked: BoolArray
    """Whether the body of the robot is in contact, shape (samples,)."""
    reached: BoolArray
    """Whether a position is reached and the body is free of contact, shape (samples, positions)."""

    @property
    def complete(self) -> float:
        """Fraction of the samples in which the whole task is feasible."""
        return float(self.reached.all(axis=1).mean())

    @property
    def complete_ci95(self) -> tuple[float, float]:
        """95 % confidence interval of that fraction, by Wilson."""
        count = int(np.count_nonzero(self.reached.all(axis=1)))
        interval = binomtest(count, len(self.reached)).proportion_ci(method="wilson")
        return float(interval.low), float(interval.high)

    @property
    def positions(self) -> float:
        """Mean fraction of the positions that are reached."""
        return float(self.reached.mean())

    def to_json(self) -> dict[str, Any]:
        """Return the fractions as plain containers."""
        return {
            "samples": len(self.reached),
            "complete": self.complete,
            "complete_ci95": list(self.complete_ci95),
            "positions": self.positions,
            "body_blocked": float(self.body_blocked.mean()),
        }


def success_under_error(
    around: Surroundings,
    task: GraspTask,
    base: BasePose,
    errors: PoseErrors,
    *,
    samples: int = 1000,
    seed: int = 0,
) -> TaskSuccess:
    """Return how much of a task a base pose reaches when base and task are displaced.

    The base and the tool poses move; the environment, such as the table, stays. The torso height is
    that of the base pose; arm postures are computed again in each sample.

    Args:
        around: The environment.
        task: The tool poses, in F.
        base: The base pose, in F.
        errors: Deviations of both.
        samples: Number of samples.
        seed: Seed of the samples; the same for every base pose, so that results are comparable.

    Raises:
        TcsError: If the number of samples or the seed is out of range.
    """
    found = [
        around.feasibility(displaced(task, *of_task), _moved(base, *of_base))
        for of_base, of_task in zip(*errors.draw(samples, seed), strict=True)
    ]
    blocked = np.array([one.body_blocked for one in found])
    reached = np.array([one.reached for one in found]) & ~blocked[:, None]
    return TaskSuccess(body_blocked=blocked, reached=reached)


def displaced(task: GraspTask, x: float, y: float, yaw: float) -> GraspTask:
    """Return a task whose tool poses are rotated about the z axis of F, then displaced.

    Args:
        task: The task.
        x: Displacement along x of F [m].
        y: Displacement along y of F [m].
        yaw: Rotation [rad].
    """
    c, s = math.cos(yaw), math.sin(yaw)
    positions = tuple(
        replace(
            one,
            x=float(x + c * one.x - s * one.y),
            y=float(y + s * one.x + c * one.y),
            grasps=tuple(replace(g, heading=float(g.heading + yaw)) for g in one.grasps),
        )
        for one in task.positions
    )
    return replace(task, positions=positions)


def _moved(base: BasePose, x: float, y: float, yaw: float) -> BasePose:
    """Return a base pose with displacements added [m, m, rad]."""
    return replace(base, x=base.x + x, y=base.y + y, yaw=base.yaw + yaw)
