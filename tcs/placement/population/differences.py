"""Which measures tell the people who are served from those who are not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import BoolArray, FloatArray, IntArray
from tcs.model.people import LINKS, Bodies

COMPARED = tuple(
    sorted({name for sums in LINKS.values() for measures in sums for name in measures})
)
"""The measures that sizes of the model depend on; others can only be correlated with these."""
_LEAST = 0.02
"""Least fraction of the people on either side of a limit."""


@dataclass(frozen=True, slots=True)
class Difference:
    """How well one measure alone tells the people who are served from the others."""

    measure: str
    """Name of the measure."""
    auc: float
    """Probability that it is greater for somebody who is not served than for somebody who is; 0.5
    says nothing, 0 and 1 everything."""

    def to_json(self) -> dict[str, Any]:
        """Return the difference as plain containers."""
        return {"measure": self.measure, "auc": round(self.auc, 6)}


@dataclass(frozen=True, slots=True)
class Part:
    """The people between limits of measures."""

    conditions: tuple[tuple[str, str, float], ...]
    """Measure, "<=" or ">", and limit [m; kg for the mass] of each condition."""
    bodies: int
    """Number of people who satisfy all of them."""
    served: float
    """Fraction of these who are served."""

    def to_json(self) -> dict[str, Any]:
        """Return the part as plain containers."""
        return {
            "conditions": [
                {"measure": name, "is": sign, "limit": limit}
                for name, sign, limit in self.conditions
            ],
            "bodies": self.bodies,
            "served": self.served,
        }


def ranking(people: Bodies, served: BoolArray) -> tuple[Difference, ...]:
    """Return the compared measures, the one that tells most first; () if all or none are served.

    Args:
        people: N people.
        served: Whether each is served, shape (N,).
    """
    lost = int(np.count_nonzero(~served))
    if lost in (0, served.size):
        return ()
    found = []
    for name in COMPARED:
        ranks = _ranks(_values(people, name))
        above = float(ranks[~served].sum()) - lost * (lost + 1) / 2
        found.append(Difference(name, above / (lost * (served.size - lost))))
    return tuple(sorted(found, key=lambda one: -abs(one.auc - 0.5)))


def _ranks(values: FloatArray) -> FloatArray:
    """Return the ranks of values from 1, equal ones with the mean of theirs, shape (N,)."""
    # As scipy.stats.rankdata, whose import takes as long as the population.
    _, which, count = np.unique(values, return_inverse=True, return_counts=True)
    last = np.cumsum(count)
    return np.asarray((last - (count - 1) / 2.0)[which])


def tree(people: Bodies, served: BoolArray, depth: int = 2) -> tuple[Part, ...]:
    """Return a partition of the people by limits of measures: the leaves of a decision tree.

    Each part is divided at the limit, of all measures, that leaves the least Gini impurity, with a
    fiftieth of all people or more on either side.

    Args:
        people: N people.
        served: Whether each is served, shape (N,).
        depth: Greatest number of conditions of a part.

    Returns:
        The parts, the least served first; one part without conditions if no limit helps.
    """
    values = np.stack([_values(people, name) for name in COMPARED], axis=1)
    least = max(1, round(_LEAST * served.size))
    parts = _divided(values, served, np.arange(served.size), (), depth, least)
    return tuple(sorted(parts, key=lambda part: part.served))


def _values(people: Bodies, name: str) -> FloatArray:
    return np.asarray(people.values[:, people.measures.index(name)])


def _divided(
    values: FloatArray,
    served: BoolArray,
    rows: IntArray,
    conditions: tuple[tuple[str, str, float], ...],
    depth: int,
    least: int,
) -> list[Part]:
    """Return the parts of the people in some rows."""
    split = _best_split(values[rows], served[rows], least) if depth > 0 else None
    if split is None:
        return [Part(conditions, rows.size, float(served[rows].mean()))]
    column, limit = split
    above = values[rows, column] > limit
    found = []
    for sign, chosen in (("<=", ~above), (">", above)):
        further = (*conditions, (COMPARED[column], sign, limit))
        found += _divided(values, served, rows[chosen], further, depth - 1, least)
    return found


def _best_split(values: FloatArray, served: BoolArray, least: int) -> tuple[int, float] | None:
    """Return column and limit that leave the least impurity, None if none lowers it."""
    count, total = served.size, int(np.count_nonzero(served))
    best, found = _impurity(np.array([total]), np.array([count]))[0], None
    below = np.arange(1, count)
    for column in range(values.shape[1]):
        order = np.argsort(values[:, column], kind="stable")
        x = values[order, column]
        reached = np.cumsum(served[order], dtype=np.int64)[:-1]
        impurity = _impurity(reached, below) + _impurity(total - reached, count - below)
        allowed = (np.diff(x) > 0.0) & (below >= least) & (count - below >= least)
        impurity[~allowed] = np.inf
        at = int(np.argmin(impurity)) if impurity.size else 0
        if impurity.size and impurity[at] < best - 1e-9:
            best, found = impurity[at], (column, float(0.5 * (x[at] + x[at + 1])))
    return found


def _impurity(served: IntArray, count: IntArray) -> NDArray[np.float64]:
    """Return the Gini impurity of groups, times their number of people."""
    return np.asarray(2.0 * served * (count - served) / count)
