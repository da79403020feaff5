"""Errors of the pose of the table itself, which displace all base positions relative to it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import map_coordinates

from tcs.capability.arplace.model import Arplace
from tcs.capability.arplace.probability_map import ProbabilityMap
from tcs.errors import SelectionError
from tcs.files.quantities import DEVIATION
from tcs.kernel.arrays import FloatArray

_SIDE = 9
"""Displacements along each principal axis."""
_SIGMAS = 3.0
"""Greatest displacement along a principal axis, in standard deviations."""


def displacement_covariance(arplace: Arplace, covariance: FloatArray, y: float) -> FloatArray:
    """Return the covariance of base positions relative to the table [m^2], shape (2, 2).

    A rotation of the table displaces base positions in proportion to their distance; that of the
    mean reached base position is used for all. The heading itself is not varied.

    Args:
        arplace: The model.
        covariance: Covariance of x, y and yaw of the table along the axes of F [m, rad].
        y: Position of the object along the edge [m].

    Raises:
        SelectionError: If the covariance is not one.
    """
    matrix = np.asarray(covariance, dtype=np.float64)
    if matrix.shape != (3, 3) or not np.isfinite(matrix).all():
        raise SelectionError("the covariance of the table must have 3 x 3 finite numbers.")
    least = float(np.linalg.eigvalsh(0.5 * (matrix + matrix.T))[0])
    if not np.allclose(matrix, matrix.T, atol=1e-9) or least < -1e-9:
        raise SelectionError(
            "the covariance of the table must be symmetric and positive semidefinite."
        )
    if matrix.max() > DEVIATION.high**2:
        raise SelectionError(f"the table has a variance above {DEVIATION.high**2:g}.")
    base_x, base_y = arplace.grid
    weight = arplace.reached.sum(axis=0).astype(np.float64)
    weight /= max(weight.sum(), 1.0)
    x_mean = float(weight.sum(axis=1) @ base_x)
    y_mean = float(weight.sum(axis=0) @ base_y) + y
    jacobian = np.array([[1.0, 0.0, -y_mean], [0.0, 1.0, x_mean]])
    return np.asarray(jacobian @ matrix @ jacobian.T)


def displaced(found: ProbabilityMap, covariance: FloatArray) -> ProbabilityMap:
    """Return a map averaged over normal displacements of the base relative to the table.

    Probabilities between base positions are interpolated; beyond the map they are 0.

    Args:
        found: The map without displacements.
        covariance: Covariance of x and y [m^2], shape (2, 2).
    """
    if not covariance.any():
        return found
    values, axes = np.linalg.eigh(covariance)
    along = np.linspace(-_SIGMAS, _SIGMAS, _SIDE)
    density = np.exp(-0.5 * along**2)
    weights = np.outer(density, density).ravel() / density.sum() ** 2
    steps = np.stack(np.meshgrid(along, along, indexing="ij"), axis=-1).reshape(-1, 2)
    shifts = steps @ (axes * np.sqrt(np.maximum(values, 0.0))).T
    spacing = [_spacing(found.x), _spacing(found.y)]
    index = np.stack(np.meshgrid(*map(np.arange, found.probability.shape), indexing="ij"))
    total = np.zeros_like(found.probability)
    for shift, weight in zip(shifts, weights, strict=True):
        at = index + (shift / spacing)[:, None, None]
        total += weight * map_coordinates(found.probability, at, order=1, mode="constant")
    return replace(found, probability=np.clip(total, 0.0, 1.0))


def _spacing(values: FloatArray) -> float:
    return float(values[1] - values[0]) if len(values) > 1 else 1.0
