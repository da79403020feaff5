"""ARPlace: a model of the base positions that reach a grasp, learned from labels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from tcs.capability.arplace.boundary import FARTHEST, Boundary
from tcs.capability.arplace.landmarks import COUNT
from tcs.capability.arplace.region_vectors import (
    REPRESENTATIONS,
    SIGNED_DISTANCE,
    boundary_from,
    is_inside,
)
from tcs.capability.arplace.success_model import INTERPOLATED, SuccessModel
from tcs.capability.arplace.task import TableTask
from tcs.errors import TcsError, UnknownNameError
from tcs.kernel.arrays import BoolArray, FloatArray


@dataclass(frozen=True, slots=True)
class Window:
    """Part of the grid of base positions, and a success model of the regions in it."""

    x: slice
    """Range along x."""
    y: slice
    """Range along y."""
    model: SuccessModel
    """The model."""


@dataclass(frozen=True, eq=False)
class Arplace:
    """Labels of a task, the boundaries around them, and the model that generalises them."""

    task: TableTask
    """Grasps and base positions."""
    reached: BoolArray
    """Labels, shape (grasps, x, y)."""
    boundaries: tuple[Boundary, ...]
    """Boundaries of each grasp, from the support vector machine."""
    representation: str
    """Representation of the regions, one of `REPRESENTATIONS`."""
    vectors: FloatArray
    """Regions as vectors, shape (used, size)."""
    used: BoolArray
    """Whether each grasp has a region that can be represented, shape (grasps,)."""
    rule: str
    """Rule of the success model, one of `tcs.capability.arplace.success_model.RULES`."""
    energy: float
    """Fraction of the variance that its modes hold."""
    torso_height: float
    """Torso height [m]."""
    base_radius: float
    """Radius about the base's origin that encloses what is fixed to the base [m]."""
    metadata: Mapping[str, Any]
    """Robot, classifier, digest of the scene and version of the program."""
    success_model: SuccessModel = field(init=False, repr=False, compare=False)
    """The generalised success model."""

    def __post_init__(self) -> None:
        """Check that the values fit together.

        Raises:
            TcsError: If they do not.
            UnknownNameError: If there is no such representation.
        """
        if self.representation not in REPRESENTATIONS:
            raise UnknownNameError("representation", self.representation, REPRESENTATIONS)
        grasps, x, y = len(self.task), self.task.base_x.count, self.task.base_y.count
        size = x * y if self.representation == SIGNED_DISTANCE else 2 * COUNT
        used = int(np.count_nonzero(self.used))
        if (
            self.reached.shape != (grasps, x, y)
            or self.used.shape != (grasps,)
            or self.vectors.shape != (used, size)
            or len(self.boundaries) != grasps
            or used < 1
        ):
            raise TcsError("labels, boundaries and regions do not fit the task")
        if not np.isfinite(self.vectors).all() or np.abs(self.vectors).max() > 100.0 * FARTHEST:
            raise TcsError("the regions have coordinates that are not in metres")
        if not (np.isfinite(self.torso_height) and 0.0 <= self.base_radius < 100.0):
            raise TcsError("torso height or radius of the base are not in metres")
        for array in (self.reached, self.vectors, self.used):
            array.flags.writeable = False
        # Built here, so that a model that cannot be built is not accepted.
        object.__setattr__(self, "success_model", self.success_model_of(self.rule, self.energy))

    def success_model_of(self, rule: str, energy: float) -> SuccessModel:
        """Return a success model of the same regions by another rule or with another energy.

        Raises:
            TcsError: As `SuccessModel.of`.
        """
        parameters = self.task.parameters[self.used]
        return SuccessModel.of(self.vectors, parameters, rule=rule, energy=energy)

    @property
    def grid(self) -> tuple[FloatArray, FloatArray]:
        """Base positions along x and along y [m], y relative to the object."""
        return self.task.base_x.values, self.task.base_y.values

    @cached_property
    def window(self) -> Window:
        """The base positions where the success model can predict success, and the model there.

        An interpolation between regions contains no base position that none of them contains, so
        signed distances elsewhere need not be computed.
        """
        nx, ny = self.reached.shape[1:]
        model = self.success_model
        if self.representation != SIGNED_DISTANCE or model.rule != INTERPOLATED:
            return Window(slice(0, nx), slice(0, ny), model)
        learned = (model.shapes(self.task.parameters) > 0.0).any(axis=0).reshape(ny, nx)
        x, y = (_extent(np.asarray(learned.any(axis=axis))) for axis in (0, 1))
        index = np.arange(nx * ny).reshape(ny, nx)[y, x].ravel()
        return Window(x, y, replace(model, distribution=model.distribution.part(index)))

    @property
    def simple(self) -> BoolArray:
        """Whether each grasp has a single boundary, shape (grasps,)."""
        return np.array([len(boundary) == 1 for boundary in self.boundaries], dtype=np.bool_)

    def predicted(
        self,
        parameters: FloatArray,
        model: SuccessModel | None = None,
        at: tuple[FloatArray, FloatArray] | None = None,
    ) -> BoolArray:
        """Return the base positions that the success model predicts to reach grasps.

        Args:
            parameters: Distance [m], height [m] and angle [rad] of each grasp, shape (n, 3).
            model: Success model; None is that of the file.
            at: x and y of the base positions [m], equally spaced; None are those of the grid.

        Returns:
            Shape (n, x, y).
        """
        vectors = (model or self.success_model).shapes(parameters)
        shift = np.zeros(len(vectors))
        return is_inside(self.representation, vectors, self.grid, shift, at)

    def predicted_boundary(
        self, parameters: FloatArray, model: SuccessModel | None = None
    ) -> Boundary:
        """Return the boundaries that the success model predicts for one grasp.

        Args:
            parameters: Distance [m], height [m] and angle [rad], shape (3,).
            model: Success model; None is that of the file.
        """
        vector = (model or self.success_model).shapes(parameters[None])[0]
        return boundary_from(self.representation, vector, self.grid)


def _extent(used: BoolArray) -> slice:
    """Return the range of the true values with one more at each end, two values or more."""
    at = np.flatnonzero(used) if used.any() else np.zeros(1, np.int64)
    return slice(max(int(at[0]) - 1, 0), min(int(at[-1]) + 2, len(used)))


@dataclass(frozen=True, slots=True)
class Errors:
    """Base positions at which predictions differ from labels, over some grasps."""

    labels: int
    """Number of labels."""
    reached: int
    """Labels that are reached."""
    false_inclusions: int
    """Predicted to be reached, but not reached."""
    false_exclusions: int
    """Reached, but not predicted."""

    @classmethod
    def of(cls, predicted: BoolArray, reached: BoolArray) -> Errors:
        """Return the errors of predictions of the same shape as labels."""
        return cls(
            reached.size,
            int(np.count_nonzero(reached)),
            int(np.count_nonzero(predicted & ~reached)),
            int(np.count_nonzero(reached & ~predicted)),
        )


def reconstruction_errors(arplace: Arplace, model: SuccessModel | None = None) -> Errors:
    """Return the errors of the success model at the grasps that it was learned from.

    Args:
        arplace: The labels.
        model: Success model; None is that of the file.
    """
    return Errors.of(arplace.predicted(arplace.task.parameters, model), arplace.reached)
