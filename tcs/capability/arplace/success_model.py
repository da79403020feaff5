"""Generalised success model: the shape of a region as a function of the task parameters."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcs.capability.arplace.point_distribution import PointDistribution
from tcs.errors import SelectionError, TcsError, UnknownNameError
from tcs.kernel.arrays import FloatArray

LINEAR, QUADRATIC, INTERPOLATED = "linear", "quadratic", "interpolated"
DEGREES = {LINEAR: 1, QUADRATIC: 2}
RULES = (LINEAR, QUADRATIC, INTERPOLATED)
"""Dependence of the deformation on the task parameters: polynomials fitted by least squares, or
multilinear interpolation between the learned grasps."""


@dataclass(frozen=True, eq=False)
class SuccessModel:
    """The coefficients of the kept modes as a function of the task parameters.

    Source:
        ITCM thesis, Appendix D.3.5: [1 T] W = B^T, solved by least squares; its Figure 45 uses a
        second degree. Interpolation is ours: polynomials do not follow regions that divide or
        close.
    """

    rule: str
    """One of `RULES`."""
    distribution: PointDistribution
    """The modes."""
    values: tuple[FloatArray, ...]
    """Distinct values of each task parameter, ascending."""
    weights: FloatArray
    """W: coefficients of the kept modes for each term, shape (terms, modes). The terms of an
    interpolation are the learned grasps."""

    @classmethod
    def of(
        cls, shapes: FloatArray, parameters: FloatArray, *, rule: str = QUADRATIC,
        energy: float = 0.99,
    ) -> SuccessModel:  # fmt: skip
        """Return the model of shapes at known task parameters.

        Args:
            shapes: Shape (shapes, size).
            parameters: Task parameters, shape (shapes, parameters).
            rule: One of `RULES`. A parameter with n values has at most degree n - 1.
            energy: Fraction of the variance that the kept modes hold.

        Raises:
            UnknownNameError: If there is no such rule.
            TcsError: If the energy is out of range.
            SelectionError: If shapes are to be interpolated between grasps of which some are
                missing or out of order.
        """
        if rule not in RULES:
            raise UnknownNameError("success model", rule, RULES)
        if not 0.0 < energy <= 1.0:
            raise TcsError(f"energy is {energy:g}; must be greater than 0, at most 1.")
        distribution = PointDistribution.of(shapes)
        kept = distribution.modes_for(energy)
        values = tuple(np.unique(column) for column in parameters.T)
        deformation = distribution.deformation(shapes)[:, :kept]
        if rule == INTERPOLATED:
            grid = np.stack(np.meshgrid(*values, indexing="ij"), axis=-1)
            if not np.array_equal(grid.reshape(-1, len(values)), parameters):
                raise SelectionError(
                    "regions cannot be interpolated, as those of some grasps are not represented. "
                    "Use the success model quadratic, or the representation signed-distance."
                )
            return cls(rule, distribution, values, deformation)
        features = polynomial_features(parameters, values, DEGREES[rule])
        weights = np.linalg.lstsq(features, deformation, rcond=None)[0]
        return cls(rule, distribution, values, np.asarray(weights, dtype=np.float64))

    @property
    def kept(self) -> int:
        """Number of modes that the model uses."""
        return int(self.weights.shape[1])

    def deformation(self, parameters: FloatArray) -> FloatArray:
        """Return the coefficients of the kept modes at task parameters, shape (n, modes).

        Args:
            parameters: Shape (n, parameters).
        """
        if self.rule == INTERPOLATED:
            features = interpolation_features(parameters, self.values)
        else:
            features = polynomial_features(parameters, self.values, DEGREES[self.rule])
        return np.asarray(features @ self.weights)

    def shapes(self, parameters: FloatArray) -> FloatArray:
        """Return the shapes at task parameters, shape (n, size).

        Args:
            parameters: Shape (n, parameters).
        """
        return self.distribution.shapes(self.deformation(parameters))


def terms_of(counts: Sequence[int], degree: int) -> NDArray[np.int64]:
    """Return the exponents of all terms of a polynomial, shape (terms, parameters).

    Args:
        counts: Number of distinct values of each parameter.
        degree: Greatest sum of the exponents of a term.

    >>> terms_of([10, 1, 2], 2).tolist()
    [[0, 0, 0], [0, 0, 1], [1, 0, 0], [1, 0, 1], [2, 0, 0]]
    """
    ranges = [range(min(degree, count - 1) + 1) for count in counts]
    terms = [powers for powers in itertools.product(*ranges) if sum(powers) <= degree]
    return np.array(terms, dtype=np.int64)


def polynomial_features(
    parameters: FloatArray, values: Sequence[FloatArray], degree: int
) -> FloatArray:
    """Return the terms of a polynomial of the parameters, each scaled to -1 .. 1.

    Args:
        parameters: Shape (n, parameters).
        values: Distinct values of each parameter, ascending.
        degree: Degree.

    Returns:
        Shape (n, terms).
    """
    ends = np.array([(v[0], v[-1]) for v in values])
    half = np.where(ends[:, 1] > ends[:, 0], 0.5 * (ends[:, 1] - ends[:, 0]), 1.0)
    scaled = (parameters - ends.mean(axis=1)) / half
    exponents = terms_of([len(v) for v in values], degree)
    features = np.ones((len(parameters), len(exponents)))
    for column, powers in enumerate(exponents):
        for parameter in np.flatnonzero(powers):
            features[:, column] *= scaled[:, parameter] ** powers[parameter]
    return features


def interpolation_features(parameters: FloatArray, values: Sequence[FloatArray]) -> FloatArray:
    """Return the weight of each learned grasp in a multilinear interpolation.

    Args:
        parameters: Shape (n, parameters); those beyond the values take the nearest one.
        values: Distinct values of each parameter, ascending and equally spaced.

    Returns:
        Shape (n, product of the numbers of values), sum 1 in each row.
    """
    features = np.ones((len(parameters), 1))
    for column, known in zip(parameters.T, values, strict=True):
        step = known[1] - known[0] if len(known) > 1 else 1.0
        along = np.clip((column - known[0]) / step, 0.0, len(known) - 1)
        weights = np.maximum(0.0, 1.0 - np.abs(along[:, None] - np.arange(len(known))))
        features = (features[:, :, None] * weights[:, None, :]).reshape(len(parameters), -1)
    return features
