"""Questionnaires: NASA-TLX workload, and van der Laan's usefulness and satisfaction.

The functions score the answers of people. Scripted operators give no answers, so the tables of the
experiment contain no such scores.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from tcs.errors import DataFileError

LAAN_ITEMS = (
    ("useful", "useless"),
    ("pleasant", "unpleasant"),
    ("bad", "good"),
    ("nice", "annoying"),
    ("effective", "superfluous"),
    ("irritating", "likeable"),
    ("assisting", "worthless"),
    ("undesirable", "desirable"),
    ("raising alertness", "sleep-inducing"),
)
"""Labels of the left and the right end of each scale."""
LAAN_MIRRORED = (3, 6, 8)
"""Items, counted from 1, whose right end is positive."""
LAAN_USEFULNESS = (1, 3, 5, 7, 9)
"""Items of the usefulness score."""
LAAN_SATISFACTION = (2, 4, 6, 8)
"""Items of the satisfaction score."""
TLX_DIMENSIONS = (
    "mental demand",
    "physical demand",
    "temporal demand",
    "performance",
    "effort",
    "frustration",
)
TLX_PAIRS = 15
"""Number of pairs of dimensions that are compared; each gives one point of weight."""
_TLX_STEPS = 20


@dataclass(frozen=True, slots=True)
class Acceptance:
    """Van der Laan's two scores, each in [-2, 2]."""

    usefulness: float
    satisfaction: float


def van_der_laan(ticks: Sequence[int]) -> Acceptance:
    """Return usefulness and satisfaction from the nine items.

    Args:
        ticks: Box ticked in each item, from 1 for the leftmost to 5 for the rightmost.

    Raises:
        DataFileError: If there are not nine ticks, or one is not 1 to 5.

    Source:
        Van der Laan, Heino, De Waard, Transp. Res. C 5 (1997), as in the null-space paper: a tick
        scores from +2 at the left to -2 at the right, with the opposite sign for items 3, 6 and 8;
        usefulness is the mean of the odd items, satisfaction that of the even items.

    >>> van_der_laan([1, 1, 5, 1, 1, 5, 1, 5, 1])
    Acceptance(usefulness=2.0, satisfaction=2.0)
    """
    if len(ticks) != len(LAAN_ITEMS):
        raise DataFileError(f"van der Laan's questionnaire has 9 items; {len(ticks)} were given.")
    for item, tick in enumerate(ticks, start=1):
        if tick not in (1, 2, 3, 4, 5):
            raise DataFileError(f"van der Laan, item {item}: tick {tick} must be 1 to 5.")
    score = {
        item: tick - 3 if item in LAAN_MIRRORED else 3 - tick
        for item, tick in enumerate(ticks, start=1)
    }
    return Acceptance(
        sum(score[item] for item in LAAN_USEFULNESS) / len(LAAN_USEFULNESS),
        sum(score[item] for item in LAAN_SATISFACTION) / len(LAAN_SATISFACTION),
    )


def weighted_workload(ratings: Mapping[str, int], weights: Mapping[str, int]) -> float:
    """Return the weighted workload, 0 to 100.

    Args:
        ratings: Rating of each of `TLX_DIMENSIONS`, 0 to 20 as on the scale of the form.
        weights: Number of pairs in which each dimension was chosen, 0 to 5; 15 in total.

    Raises:
        DataFileError: If a dimension is missing or unknown, or a number is out of range.

    Source:
        NASA-TLX; ITCM thesis, eq. (27).

    >>> weighted_workload(dict.fromkeys(TLX_DIMENSIONS, 10), dict(zip(TLX_DIMENSIONS, range(6))))
    50.0
    """
    for what, given, most in (("rating", ratings, _TLX_STEPS), ("weight", weights, 5)):
        if set(given) != set(TLX_DIMENSIONS):
            raise DataFileError(
                f"NASA-TLX {what}s are of {', '.join(sorted(given)) or 'nothing'}; must be of each "
                f"of: {', '.join(TLX_DIMENSIONS)}."
            )
        for name, value in given.items():
            # In this form the comparison is false for nan as well.
            if not 0 <= value <= most:
                raise DataFileError(f"NASA-TLX {what} of {name} is {value}; must be 0 to {most}.")
    total = sum(weights.values())
    if total != TLX_PAIRS:
        raise DataFileError(f"NASA-TLX weights add up to {total}; must be {TLX_PAIRS}.")
    scale = 100 // _TLX_STEPS
    return sum(ratings[name] * scale * weights[name] for name in TLX_DIMENSIONS) / TLX_PAIRS
