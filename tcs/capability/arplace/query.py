"""Queries: the probability of success over base positions under errors of the object's pose."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tcs.capability.arplace.model import Arplace
from tcs.capability.arplace.probability_map import FloorObstacle, ProbabilityMap
from tcs.capability.arplace.region_vectors import SIGNED_DISTANCE, counts_inside
from tcs.capability.arplace.table_error import displaced, displacement_covariance
from tcs.capability.arplace.task import PARAMETERS
from tcs.errors import SelectionError
from tcs.files.quantities import ANGLE, DEVIATION, POSITION, RADIUS
from tcs.kernel.arrays import FloatArray
from tcs.model.random_streams import check_draws, named_generator

AXES = ("x", "y", "z", "angle")
"""Axes of the object's pose in F, in the order of a covariance."""
_X, _Y, _Z, _ANGLE = range(4)
_CHUNK = 250
"""Most samples whose signed distances are in memory together: they fit into the processor's cache.
"""
_ONE_THREAD = 1 << 18
"""Multiplications up to which OpenBLAS multiplies matrices in one thread; waiting for a second
thread takes longer than a whole query if the processor is busy."""
_INDISTINCT = 4
"""Base positions whose numbers of successes differ by at most this many samples are equal: all see
the same samples, and four that favour one of two occur by chance once in sixteen times."""
_ROUNDING = 1e-9
"""Rounding of task parameters at the ends of their ranges [m or rad]."""
_Z95 = 1.959963984540054
"""Quantile of the normal distribution for an interval of 95 %."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ObjectPose:
    """Estimated pose of the tool at the object, in F."""

    distance: float
    """Distance from the table's edge [m]."""
    height: float
    """Height above the floor [m]."""
    angle: float = 0.0
    """Grasp angle [rad]."""
    y: float = 0.0
    """Position along the edge [m]."""

    @classmethod
    def middle_of(cls, arplace: Arplace) -> ObjectPose:
        """Return the pose in the middle of the learned parameters."""
        distance, height, angle = map(float, arplace.task.middle)
        return cls(distance=distance, height=height, angle=angle)


@dataclass(frozen=True, eq=False)
class Query:
    """Answer to a query."""

    map: ProbabilityMap
    """Probability of success for each base position."""
    x: float
    """Best base position in F [m]."""
    y: float
    success: float
    """Fraction of fresh samples in which the model predicts success from there."""
    interval: tuple[float, float]
    """Wilson interval of `success`, 95 %, for the number of samples; not for errors of the
    model."""
    outside: float
    """Fraction of samples with parameters outside the learned ranges; they count as failures."""
    samples: int
    """Number of samples."""
    seconds: float
    """Time of the query [s]."""

    def to_json(self) -> dict[str, Any]:
        """Return the answer as plain numbers."""
        return {
            "best": best_to_json(self.map, self.x, self.y),
            "success": self.success,
            "success_ci95": list(self.interval),
            "outside": self.outside,
            "samples": self.samples,
            "seconds": self.seconds,
        }


def best_to_json(found: ProbabilityMap, x: float, y: float) -> dict[str, float]:
    """Return a base position of a map as plain numbers."""
    return {
        "x": round(x, 9),
        "y": round(y, 9),
        "yaw_deg": round(math.degrees(found.base_yaw), 9),
        "torso_height": round(found.torso_height, 9),
    }


def covariance_of(
    std: Sequence[float] = (0.0, 0.0, 0.0, 0.0), planar: Sequence[float] | None = None
) -> FloatArray:
    """Return the covariance of the object's pose [m^2, rad^2], shape (4, 4).

    Args:
        std: Standard deviation of x, y, z [m] and angle [rad].
        planar: Variances and covariance xx, xy, yy [m^2], in place of those of x and y.

    Raises:
        SelectionError: If a value is out of its range, or the covariance is not one.

    >>> covariance_of((0.1, 0.2, 0.0, 0.0)).diagonal().round(3).tolist()
    [0.01, 0.04, 0.0, 0.0]
    """
    for axis, value in zip(AXES, std, strict=True):
        DEVIATION.check(value, f"the standard deviation of {axis}", SelectionError)
    covariance = np.diag(np.square(np.asarray(std, dtype=np.float64)))
    if planar is not None:
        xx, xy, yy = planar
        covariance[:2, :2] = [[xx, xy], [xy, yy]]
    return checked_covariance(covariance)


def checked_covariance(covariance: FloatArray) -> FloatArray:
    """Return a covariance of the object's pose.

    Raises:
        SelectionError: If it is not a symmetric, positive semidefinite matrix of shape (4, 4), or a
            variance is out of range.
    """
    matrix = np.asarray(covariance, dtype=np.float64)
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
        raise SelectionError("the covariance must have 4 x 4 finite numbers.")
    values = np.linalg.eigvalsh(matrix)
    rounding = 1e-12 * max(1.0, float(np.abs(values).max()))
    if not np.allclose(matrix, matrix.T, atol=rounding) or values[0] < -rounding:
        raise SelectionError("the covariance must be symmetric and positive semidefinite.")
    if matrix.max() > DEVIATION.high**2:
        raise SelectionError(f"the covariance has a variance above {DEVIATION.high**2:g}.")
    return matrix


def query(
    arplace: Arplace,
    pose: ObjectPose | None = None,
    covariance: FloatArray | None = None,
    *,
    obstacles: Sequence[FloorObstacle] = (),
    clearance: float | None = None,
    samples: int = 1000,
    seed: int = 0,
    table_covariance: FloatArray | None = None,
) -> Query:
    """Return the probability of success over base positions, and the best of them.

    Poses of the object are drawn from a normal distribution. The success model predicts the region
    of base positions for each; the fraction of regions that contain a base position is its
    probability. Among base positions whose counts differ by at most four samples, the best one is
    the farthest from all others. It is evaluated on fresh samples.

    Args:
        arplace: The model.
        pose: Estimated pose of the object; None is the middle of the learned parameters.
        covariance: Covariance of x, y, z, angle [m^2, rad^2], shape (4, 4); None is no error.
        obstacles: Obstacles besides the table.
        clearance: Least distance of the centre of the base from obstacles [m]; None is the radius
            of the base.
        samples: Number of samples; one suffices without error.
        seed: Seed of the random numbers.
        table_covariance: Covariance of x, y and yaw of the table along the axes of F [m, rad],
            shape (3, 3); the object and the base positions relative to it are displaced with it.
            None is no error.

    Raises:
        SelectionError: If the pose is outside the learned parameters, a parameter of a single
            learned value has an error, or no base position succeeds.
        TcsError: If the number of samples or the seed is out of range.

    Source:
        ITCM thesis, Appendix D.
    """
    begun = time.perf_counter()
    check_draws(samples, seed)
    pose = pose or ObjectPose.middle_of(arplace)
    spread = checked_covariance(np.zeros((4, 4)) if covariance is None else covariance)
    _check_pose(arplace, pose, spread)
    if clearance is not None:
        RADIUS.check(clearance, "the clearance", SelectionError)
    poses = _draw(pose, spread, samples, seed, "arplace map")
    found = _map(arplace, poses)
    displacement = np.zeros((2, 2))
    if table_covariance is not None:
        displacement = displacement_covariance(arplace, table_covariance, pose.y)
        found = displaced(found, displacement)
    if obstacles:
        radius = arplace.base_radius if clearance is None else clearance
        found = found.without(obstacles, radius)
    i, j = found.best(_INDISTINCT / samples if samples > _INDISTINCT else _ROUNDING)
    fresh = _draw(pose, spread, samples, seed, "arplace success")
    if displacement.any():
        success = float(displaced(_map(arplace, fresh), displacement).probability[i, j])
    else:
        at = (found.x[i : i + 1], found.y[j : j + 1])
        success = float(_count(arplace, fresh, at)[0, 0]) / samples
    return Query(
        map=found,
        x=float(found.x[i]),
        y=float(found.y[j]),
        success=success,
        interval=wilson_interval(success * samples, samples),
        outside=float(1.0 - _are_learned(arplace, poses).mean()),
        samples=samples,
        seconds=time.perf_counter() - begun,
    )


def wilson_interval(count: float, samples: int) -> tuple[float, float]:
    """Return the 95 % interval of a probability by Wilson's formula.

    >>> [round(end, 3) for end in wilson_interval(90, 100)]
    [0.826, 0.945]
    """
    fraction, square = count / samples, _Z95**2 / samples
    centre = (fraction + 0.5 * square) / (1.0 + square)
    half = _Z95 * math.sqrt(fraction * (1.0 - fraction) / samples + 0.25 * square / samples)
    half /= 1.0 + square
    return max(0.0, centre - half), min(1.0, centre + half)


def _check_pose(arplace: Arplace, pose: ObjectPose, covariance: FloatArray) -> None:
    """Check that the pose is within the learned parameters, and that errors can be represented."""
    POSITION.check(pose.y, "the object: its position along the edge", SelectionError)
    ANGLE.check(pose.angle, "the object: the grasp angle", SelectionError)
    low, high = arplace.task.limits
    at = (pose.distance, pose.height, pose.angle)
    for name, value, first, last in zip(PARAMETERS, at, low, high, strict=True):
        if not first - _ROUNDING <= value <= last + _ROUNDING:
            raise SelectionError(
                f"{name} {value:g} is outside the learned range, {first:g} to {last:g} (m or rad). "
                "Learn a model with a wider one."
            )
    for parameter, axis in enumerate((_X, _Z, _ANGLE)):
        if arplace.task.counts[parameter] == 1 and covariance[axis, axis] > 0.0:
            raise SelectionError(
                f"the error of {AXES[axis]} must be 0: the model was learned at a single "
                f"{PARAMETERS[parameter]}. Learn a model with several."
            )


def _draw(
    pose: ObjectPose, covariance: FloatArray, samples: int, seed: int, stream: str
) -> FloatArray:
    """Return samples of x, y, z and angle of the object, shape (samples, 4)."""
    values, axes = np.linalg.eigh(covariance)
    scale = axes * np.sqrt(np.maximum(values, 0.0))
    normal = named_generator(seed, stream).standard_normal((samples, 4))
    # Axes without an error must not get one by rounding.
    offset = np.where(covariance.diagonal() > 0.0, normal @ scale.T, 0.0)
    return np.asarray(offset + np.array((pose.distance, pose.y, pose.height, pose.angle)))


def _are_learned(arplace: Arplace, poses: FloatArray) -> FloatArray:
    """Return whether each pose is within the learned parameters, shape (n,)."""
    low, high = arplace.task.limits
    parameters = poses[:, [_X, _Z, _ANGLE]]
    return np.asarray(
        ((parameters >= low - _ROUNDING) & (parameters <= high + _ROUNDING)).all(axis=1)
    )


def _map(arplace: Arplace, poses: FloatArray) -> ProbabilityMap:
    """Return the fraction of poses that are reached from each base position of the grid."""
    x, y = arplace.grid
    window = arplace.window
    # Only rows to which a shift along y can move the window.
    low = y[window.y][0] + poses[:, _Y].min() - _ROUNDING
    high = y[window.y][-1] + poses[:, _Y].max() + _ROUNDING
    rows = slice(*map(int, np.searchsorted(y, (low, high))))
    count = np.zeros((len(x), len(y)))
    if rows.start < rows.stop:
        count[window.x, rows] = _count(arplace, poses, (x[window.x], y[rows]))
    yaw = math.radians(arplace.task.base_yaw_deg)
    return ProbabilityMap(x, y, count / len(poses), yaw, arplace.torso_height)


def _count(arplace: Arplace, poses: FloatArray, at: tuple[FloatArray, FloatArray]) -> FloatArray:
    """Return the number of poses that are reached from base positions, shape (x, y).

    Args:
        arplace: The model.
        poses: x, y, z and angle, shape (n, 4).
        at: x and y of the base positions, within the grid.
    """
    learned = poses[_are_learned(arplace, poses)]
    window, (x, y) = arplace.window, arplace.grid
    grid, model = (x[window.x], y[window.y]), window.model
    total: Any = 0
    most = max(len(learned), 1)
    if arplace.representation == SIGNED_DISTANCE:
        most = _CHUNK
        if len(at[0]) == 1 and at[0][0] in grid[0]:
            # Signed distances at other x need not be computed.
            column = np.flatnonzero(grid[0] == at[0][0])
            index = (np.arange(len(grid[1])) * len(grid[0]) + column).astype(np.int64)
            model = replace(model, distribution=model.distribution.part(index))
            grid = (at[0], grid[1])
    size = max(1, min(most, _ONE_THREAD // model.distribution.mean.size // model.kept))
    for start in range(0, max(len(learned), 1), size):
        part = learned[start : start + size]
        vectors = model.shapes(part[:, [_X, _Z, _ANGLE]])
        total = total + counts_inside(arplace.representation, vectors, grid, part[:, _Y], at)
    return np.asarray(total)
