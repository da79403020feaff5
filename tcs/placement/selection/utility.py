"""Utility of a set: its task-centric scores minus the cost of travel, TCS eq. (5)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError
from tcs.files.quantities import HEADING, POSITION, UTILITY_WEIGHT
from tcs.model.grid import Axis

MOST_PLACES = 0.5
"""Greatest fraction of the score that a further member may cost."""

Number = TypeVar("Number", float, NDArray[np.float64])


def check_weight(name: str, value: float) -> None:
    """Refuse a weight that is negative, not finite or too large.

    Raises:
        SelectionError: If it is not a number in the range of `UTILITY_WEIGHT`.
    """
    UTILITY_WEIGHT.check((value,), f"Weight {name}", SelectionError)


def check_coordinate(name: str, value: float, unit: str) -> None:
    """Refuse a coordinate of the current state that is not finite or too large.

    Args:
        name: Name of its axis.
        value: Current value [unit].
        unit: "m" or "rad".

    Raises:
        SelectionError: If it is not a number in the range of `POSITION` or `HEADING`.
    """
    quantity = POSITION if unit == "m" else HEADING
    quantity.check((value,), f"Current state: {name}", SelectionError)


def check_within_axis(axis: Axis, value: float, *, lowest: float | None = None) -> None:
    """Refuse a value that no state between or near the scored values of an axis has.

    A value may be half a step beyond either end: the joint need not stop where the grid does. An
    axis with a single value covers no range, so any value passes.

    Args:
        axis: An axis of the grid.
        value: Current value [m or rad].
        lowest: A value [m or rad] that passes although the axis starts above it.

    Raises:
        SelectionError: If the value is out of range.
    """
    if axis.count == 1:
        return
    first, last = axis.value(0), axis.value(-1)
    # Rounding of the steps must not refuse a value exactly half a step beyond an end.
    margin = (last - first) / (axis.count - 1) / 2.0 * (1.0 + 1e-9)
    low = first - margin if lowest is None else min(first - margin, lowest)
    if low <= value <= last + margin:
        return
    shown, begin, end = (
        f"{math.degrees(number) if axis.unit == 'deg' else number:g}"
        for number in (value, first, last)
    )
    raise SelectionError(
        f"Current state: {axis.name} is {shown} {axis.unit}, out of range: the scores cover "
        f"{begin} to {end} {axis.unit}. Give the present value, at most half a step beyond."
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class UtilityWeights:
    """Weights of the terms of the utility, TCS eq. (5); each a number from 0 to 1e9.

    The travel weight is per metre. At the default of 0.05, one metre of travel costs as much as
    five percent of P_R. At 1, one metre would offset a P_R of 1.
    """

    reachability: float = 1.0
    """alpha, the weight of TC-reachability P_R."""
    manipulability: float = 1.0
    """beta, the weight of TC-manipulability P_M."""
    travel: float = 0.05
    """gamma, the weight of the travel cost D."""
    success: float = 0.0
    """delta, the weight of the success under error P_S: the lower confidence bound of its estimate,
    so that a set with few, favourable samples does not outrank a good set with many. Above 0, only
    sets with an estimate can be selected."""
    places: float = 0.01
    """epsilon, the fraction of alpha P_R + beta P_M that each member after the first costs: a
    single that loses at most one percent is preferred to a pair. 0 in the paper."""
    environment: float = 0.01
    """kappa, what moving the environment from its present state costs, once for a set: as much as
    one percent of P_R. 0 in the paper."""
    preference: float = 0.05
    """pi, what a set costs that violates a preference: as much as five percent of P_R."""

    def __post_init__(self) -> None:
        """Refuse weights that are negative or not finite.

        Raises:
            SelectionError: If a weight is not a number from 0 to 1e9.
        """
        check_weight("alpha (reachability)", self.reachability)
        check_weight("beta (manipulability)", self.manipulability)
        check_weight("gamma (travel)", self.travel)
        check_weight("delta (success)", self.success)
        check_weight("kappa (environment)", self.environment)
        check_weight("pi (preference)", self.preference)
        check_weight("epsilon (places)", self.places)
        if self.places > MOST_PLACES:
            raise SelectionError(
                f"Weight epsilon (places) is {self.places:g}; must be at most {MOST_PLACES:g}, "
                "with which a third place has lost its value."
            )

    def of_size(self, members: int) -> UtilityWeights:
        """Return the weights by which sets of a size are compared: alpha and beta are reduced."""
        return _of_size(self, members)


@lru_cache(maxsize=64)
def _of_size(weights: UtilityWeights, members: int) -> UtilityWeights:
    """Return the weights for sets of a size, cached: their checks take a tenth of a search."""
    left = 1.0 - float(weights.places) * (members - 1)
    return replace(
        weights,
        reachability=float(weights.reachability) * left,
        manipulability=float(weights.manipulability) * left,
    )


PAPER_WEIGHTS = UtilityWeights(places=0.0, environment=0.0)
"""TCS eq. (5) alone, without the penalties for further places and for moving the environment."""


def utility(
    reachability: Number,
    manipulability: Number,
    cost: Number,
    weights: UtilityWeights,
    success: Number | None = None,
) -> Number:
    """Return alpha P_R + beta P_M - gamma D, TCS eq. (5), plus delta P_S if that is given.

    The order of the operations is part of the contract: the search bounds the utility by the same
    operations on greater scores and smaller costs, and rounding is monotone.

    Args:
        reachability: P_R of the sets.
        manipulability: P_M of the sets.
        cost: D of the sets.
        weights: alpha, beta, gamma, delta.
        success: P_S of the sets, a lower bound of their success under error.

    Returns:
        The utility of each set.

    >>> utility(1.0, 0.5, 2.0, UtilityWeights())
    1.4
    """
    without_error = (
        float(weights.reachability) * reachability + float(weights.manipulability) * manipulability
    ) - float(weights.travel) * cost
    return without_error if success is None else without_error + float(weights.success) * success
