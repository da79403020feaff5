"""The order in which sets are preferred: by the recommendation, or by the utility.

Nobody asked for a certain set unless weights are given. What is recommended then is decided here
and nowhere else.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tcs.placement.selection.choice import Basis
from tcs.placement.selection.utility import UtilityWeights

FloatArray = NDArray[np.float64]

_DEFAULT = UtilityWeights()
_TIE = 1e-6
"""Weight of the default utility beside the success under error: estimates from some thousand
samples that differ by less are equal."""
_ROBUST = replace(
    _DEFAULT,
    reachability=_TIE * _DEFAULT.reachability,
    manipulability=_TIE * _DEFAULT.manipulability,
    travel=_TIE * _DEFAULT.travel,
    environment=_TIE * _DEFAULT.environment,
    success=1.0,
)
_MOST_GOALS = UtilityWeights(reachability=1e6, travel=0.0, places=0.0, environment=0.0)
"""P_R before P_M: the weight of no goal is as little as a millionth of all."""
_SAME_REACHABILITY = 6
"""Decimals to which P_R is compared."""


@dataclass(frozen=True, slots=True)
class Ranking:
    """How sets are compared in one selection."""

    weights: UtilityWeights
    """Weights of the utility by which they are compared."""
    stated: UtilityWeights
    """Weights of the utility that is stated of the chosen set: those that were given, or the
    default ones."""
    basis: Basis = "utility"
    to_gain: float = 0.0
    """What a set has to gain by a further member: more than the greatest dexterity, so that only
    a further goal suffices; 0 where the weights decide."""

    def rank(
        self, reachability: FloatArray, manipulability: FloatArray, members: int, value: FloatArray
    ) -> FloatArray:
        """Return keys by which sets of a size are compared, the first before the others, (3, n).

        Args:
            reachability: P_R of the sets, shape (n,).
            manipulability: P_M of the sets, shape (n,).
            members: Number of their members.
            value: Their utility less their penalties, shape (n,).
        """
        if self.to_gain:
            goals = np.round(reachability, _SAME_REACHABILITY)
            return np.stack([goals, np.full(goals.shape, -float(members)), manipulability])
        return np.stack([value, np.zeros_like(value), np.zeros_like(value)])


def ranking_of(
    weights: UtilityWeights | None,
    *,
    is_known: bool,
    estimated: bool,
    preferences: bool,
    most_dexterity: float,
) -> Ranking:
    """Return how sets are compared.

    Args:
        weights: Weights that were given; None for the recommended set.
        is_known: Whether the current state is known. If not, travel and moving the environment
            cost nothing.
        estimated: Whether the success under error of sets was estimated.
        preferences: Whether there are preferences, which cost a part of the utility.
        most_dexterity: Greatest dexterity of any candidate at any goal.
    """
    if weights is not None:
        given = weights if is_known else replace(weights, travel=0.0, environment=0.0)
        return Ranking(given, given)
    if estimated:
        robust = _ROBUST if is_known else replace(_ROBUST, travel=0.0, environment=0.0)
        return Ranking(robust, _stated(is_known), "success")
    if is_known or preferences:
        return Ranking(_stated(is_known), _stated(is_known))
    return Ranking(_MOST_GOALS, _stated(is_known), "goals", to_gain=max(most_dexterity, 1.0))


def _stated(is_known: bool) -> UtilityWeights:
    """Return the default weights; without a current state, travel costs nothing."""
    return _DEFAULT if is_known else replace(_DEFAULT, travel=0.0, environment=0.0)
