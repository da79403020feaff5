"""Rules for which sets of configurations are kept, and which of them is the best."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcs.errors import UnknownNameError
from tcs.placement.tables.equations import tc_reachability

RULES = ("paper", "code2015")
"""Names of the rules. "paper": singles that reach at least one goal; larger sets whose P_M is
greater than the best P_M of any smaller set (TCS section IV-A). "code2015": the rules of
hrl_base_selection in gt-ros-pkg/hrl-assistive (BSD), state of 30 April 2015; see `CODE2015`."""

FRACTION_TOLERANCE = 1e-9
"""Tolerance of a fraction of the goals: two fifths can add up to one bit less than 0.40."""


@dataclass(frozen=True, slots=True)
class Code2015:
    """The constants of hrl_base_selection that decide which sets are kept."""

    least_single: float = 0.40
    """Least P_R of a single."""
    reachability: float = 0.98
    """Least P_R of a pair, as a multiple of the best single's P_R."""
    manipulability: float = 1.01
    """Least P_M of a pair, as a multiple of the best single's P_M."""
    gain: float = 1.01
    """Least P_M of a pair, as a multiple of each member's own P_M."""
    decimals: int = 3
    """Number of decimals to which base x and y [m] are rounded before distances are computed."""


CODE2015 = Code2015()
"""The best single is the first in descending order of P_R, then P_M; so is the best set."""


@dataclass(frozen=True, slots=True)
class PairLimits:
    """Least scores of a kept pair; all three conditions must hold."""

    reachability: float
    """Least P_R."""
    manipulability: float
    """Least P_M."""
    gain: float
    """Least P_M, as a multiple of the P_M of either member."""


def check_rule(rule: str) -> None:
    """Check that a rule exists.

    Raises:
        UnknownNameError: If the rule is not one of `RULES`.
    """
    if rule not in RULES:
        raise UnknownNameError("rule", rule, RULES, where="sets")


def candidates_of(
    reached: NDArray[np.bool_], weights: NDArray[np.float64], rule: str
) -> NDArray[np.int32]:
    """Return the candidates: configurations kept as singles and in larger sets, shape (C,).

    Args:
        reached: Whether a goal is reached, shape (H, G).
        weights: Weights of the goals, sum 1, shape (G,).
        rule: One of `RULES`.
    """
    kept = reached.any(axis=1)
    if rule == "code2015":
        kept &= tc_reachability(reached, weights) >= CODE2015.least_single - FRACTION_TOLERANCE
    return np.flatnonzero(kept).astype(np.int32)


def pair_limits(
    rule: str, reachability: NDArray[np.float64], manipulability: NDArray[np.float64]
) -> PairLimits:
    """Return the least scores of a kept pair, given the scores of the singles, shapes (C,)."""
    if rule == "code2015":
        if not reachability.size:
            return PairLimits(0.0, 0.0, CODE2015.gain)
        best = np.lexsort((-manipulability, -reachability))[0]
        return PairLimits(
            CODE2015.reachability * float(reachability[best]) - FRACTION_TOLERANCE,
            CODE2015.manipulability * float(manipulability[best]),
            CODE2015.gain,
        )
    # Greater than the maximum means at least the next greater number.
    return PairLimits(0.0, float(np.nextafter(manipulability.max(initial=0.0), np.inf)), 0.0)


def order_keys(
    rule: str, reachability: NDArray[np.float64], manipulability: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the keys by which sets are ordered, first and second, greatest first."""
    if rule == "code2015":
        return reachability, manipulability
    return reachability + manipulability, np.zeros_like(manipulability)


def spaced_places(rule: str, xy: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the positions whose distances are compared with the least one, shape (N, 2) [m]."""
    return np.round(xy, CODE2015.decimals) if rule == "code2015" else xy
