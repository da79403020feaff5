"""Boundaries: around the base positions that reach a grasp, from a support vector machine."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import contourpy
import numpy as np

from tcs.capability.arplace.polygons import distances, signed_area
from tcs.errors import TcsError
from tcs.files.quantities import SIZE
from tcs.kernel.arrays import BoolArray, FloatArray

REFINEMENT = 4
"""The boundary is drawn on a grid this much finer than that of the base positions."""
FARTHEST = 0.5
"""Greatest magnitude of a signed distance [m]; that of an empty region is -FARTHEST."""
_ON_BOUNDARY = 1e-4
"""Least magnitude of a signed distance [m], far above the rounding of float32."""

Boundary = tuple[FloatArray, ...]
"""Polygons [m]: outer boundaries anticlockwise, holes clockwise. Empty for an empty region."""


@dataclass(frozen=True, slots=True)
class Classifier:
    """Parameters of the support vector machine, with a Gaussian kernel exp(-|a - b|^2 / scale^2).

    Source:
        ITCM thesis, Appendix D.3.1, prints an infinite box constraint and a scale of 1. In metres
        that scale is as wide as the region itself; see `docs/arplace.md` for both.
    """

    scale: float = 0.15
    """Scale of the kernel [m]."""
    box: float = 1e6
    """Box constraint, the cost of a label on the wrong side."""

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            TcsError: If one is out of its range.
        """
        SIZE.check(self.scale, "the scale of the support vector machine", TcsError)
        if not 0.0 < self.box < 1e12:
            raise TcsError(f"box constraint {self.box:g}: must be greater than 0, less than 1e12.")


@dataclass(frozen=True, eq=False)
class Region:
    """A region of base positions."""

    boundary: Boundary
    """Its boundaries."""
    signed_distance: FloatArray
    """Distance of each base position from the boundary [m], positive inside, shape (x, y)."""

    @property
    def components(self) -> int:
        """Number of separate parts."""
        return sum(1 for polygon in self.boundary if _is_anticlockwise(polygon))

    @property
    def holes(self) -> int:
        """Number of holes."""
        return len(self.boundary) - self.components

    @property
    def is_simple(self) -> bool:
        """Whether it has a single boundary: one part without a hole."""
        return len(self.boundary) == 1


def region_of(x: FloatArray, y: FloatArray, reached: BoolArray, classifier: Classifier) -> Region:
    """Return the region that a support vector machine learns from labels.

    A layer of base positions that are not reached is added around the grid, so that all boundaries
    are closed.

    Args:
        x: Base positions along x [m], equally spaced, shape (nx,).
        y: The same along y, shape (ny,).
        reached: Labels, shape (nx, ny).
        classifier: Parameters.

    Raises:
        TcsError: If scikit-learn is not installed.

    Source:
        ITCM thesis, Appendix D.3.1.
    """
    if not reached.any():
        return Region((), np.full(reached.shape, -FARTHEST))
    x_wide, y_wide = _extended(x), _extended(y)
    wide = np.pad(reached, 1)
    points = _points(x_wide, y_wide)
    machine = _support_vector_machine()(
        kernel="rbf", gamma=classifier.scale**-2, C=classifier.box, cache_size=200
    ).fit(points, wide.ravel())
    fine_x, fine_y = _refined(x_wide), _refined(y_wide)
    decision = machine.decision_function(_points(fine_x, fine_y))
    decision = decision.reshape(len(fine_x), len(fine_y))
    boundary = boundary_of(fine_x, fine_y, decision)
    if not boundary:
        return Region((), np.full(reached.shape, -FARTHEST))
    inner = decision[REFINEMENT:-REFINEMENT:REFINEMENT, REFINEMENT:-REFINEMENT:REFINEMENT]
    return Region(boundary, signed_distance(boundary, x, y, inner > 0.0))


def boundary_of(x: FloatArray, y: FloatArray, field: FloatArray) -> Boundary:
    """Return the boundaries of the region where a field on a grid is positive.

    Args:
        x: Coordinates of the grid [m], shape (nx,).
        y: The same along y, shape (ny,).
        field: Values, shape (nx, ny); the region is closed at the edges of the grid.
    """
    generator = contourpy.contour_generator(x, y, field.T, fill_type=contourpy.FillType.OuterOffset)
    filled: Any = generator.filled(0.0, np.inf)
    points, offsets = filled
    return tuple(
        np.asarray(part[start : stop - 1], dtype=np.float64)
        for part, ends in zip(points, offsets, strict=True)
        for start, stop in itertools.pairwise(ends)
    )


def signed_distance(
    boundary: Boundary, x: FloatArray, y: FloatArray, is_in: BoolArray
) -> FloatArray:
    """Return the signed distance of grid points from a boundary [m], at most `FARTHEST`.

    Args:
        boundary: At least one polygon.
        x: Coordinates of the grid [m], shape (nx,).
        y: The same along y, shape (ny,).
        is_in: Whether each point is in the region, shape (nx, ny).
    """
    apart = distances(boundary, _points(x, y)).reshape(len(x), len(y))
    # A point on the boundary must keep its sign when distances are rounded.
    apart = np.clip(apart, _ON_BOUNDARY, FARTHEST)
    return np.where(is_in, apart, -apart)


def _is_anticlockwise(polygon: FloatArray) -> bool:
    return signed_area(polygon) > 0.0


def _support_vector_machine() -> Callable[..., Any]:
    """Return the class of support vector machines.

    Raises:
        TcsError: If scikit-learn is not installed.
    """
    try:
        from sklearn.svm import SVC
    except ImportError:
        raise TcsError(
            "learning an ARPlace needs the package scikit-learn: pip install 'tcs[arplace]'."
        ) from None
    return SVC  # type: ignore[no-any-return]


def _extended(values: FloatArray) -> FloatArray:
    """Return equally spaced values with one more at each end."""
    step = values[1] - values[0]
    return np.concatenate([[values[0] - step], values, [values[-1] + step]])


def _refined(values: FloatArray) -> FloatArray:
    """Return equally spaced values with `REFINEMENT` - 1 more between neighbours."""
    at = np.arange((len(values) - 1) * REFINEMENT + 1) / REFINEMENT
    return np.interp(at, np.arange(len(values)), values)


def _points(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the points of a grid in C order over (x, y), shape (nx ny, 2)."""
    return np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
