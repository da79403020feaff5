"""The rules that decide which sets of configurations are kept, and which of them is the best."""

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

SHARE_TOLERANCE = 1e-9
"""Twice a fifth of the goals can add up to one bit less than 0.40; a billionth of a goal is
none."""


@dataclass(frozen=True, slots=True)
class Code2015:
    """The figures of hrl_base_selection that decide which sets are kept."""

    least_single: float = 0.40
    """Least P_R of a single."""
    reachability: float = 0.98
    """A pair's P_R is at least this much of the best single's."""
    manipulability: float = 1.01
    """A pair's P_M is at least this much of the best single's."""
    gain: float = 1.01
    """A pair's P_M is at least this much of each member's own."""
    decimals: int = 3
    """Base x and y are rounded to so many decimals before distances are taken [m]."""


CODE2015 = Code2015()
"""The best single is the first in descending order of P_R, then P_M; so is the best set."""


@dataclass(frozen=True, slots=True)
class PairLimits:
    """What the scores of a pair must come up to; each of the three has to hold."""

    reachability: float
    """Least P_R."""
    manipulability: float
    """Least P_M."""
    gain: float
    """P_M must be at least this much of that of either member."""


def check_rule(rule: str) -> None:
    """Refuse a rule that is not known.

    Raises:
        UnknownNameError: If it is none of `RULES`.
    """
    if rule not in RULES:
        raise UnknownNameError("rule", rule, RULES, where="sets")


def candidates_of(
    reached: NDArray[np.bool_], weights: NDArray[np.float64], rule: str
) -> NDArray[np.int32]:
    """Return the configurations kept as singles, of which larger sets consist, shape (C,).

    Args:
        reached: Whether a goal is reached, shape (H, G).
        weights: Weights of the goals, sum 1, shape (G,).
        rule: One of `RULES`.
    """
    kept = reached.any(axis=1)
    if rule == "code2015":
        share = tc_reachability(reached, weights)
        kept &= share >= CODE2015.least_single - SHARE_TOLERANCE
    return np.flatnonzero(kept).astype(np.int32)


def pair_limits(
    rule: str, reachability: NDArray[np.float64], manipulability: NDArray[np.float64]
) -> PairLimits:
    """Return what a pair has to come up to, given the scores of the singles, shapes (C,)."""
    if rule == "code2015":
        if not reachability.size:
            return PairLimits(0.0, 0.0, CODE2015.gain)
        best = np.lexsort((-manipulability, -reachability))[0]
        return PairLimits(
            CODE2015.reachability * float(reachability[best]) - SHARE_TOLERANCE,
            CODE2015.manipulability * float(manipulability[best]),
            CODE2015.gain,
        )
    # "Greater than" is "at least the next number".
    return PairLimits(0.0, float(np.nextafter(manipulability.max(initial=0.0), np.inf)), 0.0)


def order_keys(
    rule: str, reachability: NDArray[np.float64], manipulability: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return what sets are ordered by, greatest first: the first key, then the second."""
    if rule == "code2015":
        return reachability, manipulability
    return reachability + manipulability, np.zeros_like(manipulability)


def spaced_places(rule: str, xy: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the places between which the least distance is taken, shape (N, 2) [m]."""
    return np.round(xy, CODE2015.decimals) if rule == "code2015" else xy
