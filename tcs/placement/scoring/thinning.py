"""Candidates that can matter: what is left of very many, and the best pair of all of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcs.placement.tables.equations import tc_manipulability, tc_reachability

MOST_CANDIDATES = 50_000
"""Most candidates of which all sets are kept: a billion pairs, some ten seconds of work."""

TILE = 0.10
"""Side of the squares of the floor in which one candidate may stand for others [m]."""

TOLERANCE = 0.01
"""Dexterity that a goal may lose when one candidate stands for another: a fiftieth of that of a
good posture, and less than the pose errors of a base change it."""

_AT_ONCE = 64
"""Vectors that are compared with all others in one operation."""

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Candidates:
    """Configurations that sets may be made of, n of them in the order that breaks ties."""

    number: NDArray[np.int32]
    """Flat indices in the grid, shape (n,)."""
    reached: NDArray[np.bool_]
    """Whether a goal is reached, shape (n, G)."""
    dexterity: FloatArray
    """Dexterity, 0 where not reached, shape (n, G)."""
    xy: FloatArray
    """Base positions [m], shape (n, 2)."""
    place: IntArray
    """Number of the base position, shape (n,)."""
    tile: IntArray
    """Number of the square of the floor, shape (n,)."""
    state: IntArray
    """Number that the members of a set must share, shape (n,)."""
    kind: IntArray
    """Number that one candidate and another it stands for must share, shape (n,): arm and state of
    the environment."""

    def some(self, rows: NDArray[np.bool_] | IntArray) -> Candidates:
        """Return some of them."""
        return Candidates(**{name: getattr(self, name)[rows] for name in self.__slots__})


def tiles_of(xy: FloatArray) -> IntArray:
    """Return a number of the square of the floor of each position, shape (n,)."""
    # Positions on a line between squares count to the next one, however they were rounded.
    along = np.floor(xy / TILE + 1e-6).astype(np.int64)
    return np.asarray(np.unique(along, axis=0, return_inverse=True)[1]).reshape(-1)


def undominated(candidates: Candidates) -> IntArray:
    """Return the rows of the candidates that no other at the same place is as good as.

    Another one that is as good has the same base position, arm and state of the environment,
    reaches the same goals or more, and none of them with less dexterity. In any set it can take the
    place of the first without a loss of P_R or P_M, at the same distance from the other members.
    """
    values = np.concatenate([candidates.reached, candidates.dexterity], axis=1)
    return _fronts(values, _groups(candidates.place, candidates.kind))


def representatives(candidates: Candidates) -> IntArray:
    """Return the rows of candidates that together stand for all.

    For every other one there is one of them in the same square of the floor, with the same arm
    and state of the environment, that reaches the same goals or more, each with a dexterity that is
    less by `TOLERANCE` at most.
    """
    steps = np.ceil(candidates.dexterity / TOLERANCE)
    values = np.concatenate([candidates.reached, steps], axis=1)
    return _fronts(values, _groups(candidates.tile, candidates.kind))


def best_pair(
    candidates: Candidates,
    weights: FloatArray,
    *,
    least_distance: float,
    least_manipulability: float,
    to_beat: float,
) -> tuple[int, int] | None:
    """Return the rows of the pair with the greatest P_R + P_M, None if it is not above a bound.

    Squares of the floor are opened in the order of what their members could reach together, until
    no other ones can hold a better pair; so the search is exact.

    Args:
        candidates: The candidates.
        weights: Weights of the goals, shape (G,).
        least_distance: Least distance of the members [m].
        least_manipulability: Least P_M of the pair.
        to_beat: The bound.
    """
    tiles = _Tiles.of(candidates)
    best, members = to_beat, None
    for first, second, bound in tiles.pairs(weights, least_distance, to_beat):
        if bound <= best:
            break
        a = _promising(candidates, tiles.rows(first), tiles, second, weights, best)
        b = _promising(candidates, tiles.rows(second), tiles, first, weights, best)
        for rows in np.array_split(a, -(-a.size * b.size // 2**18) or 1):
            total = _totals(candidates, rows, b, weights, least_distance, least_manipulability)
            if total.size and total.max() > best:
                i, j = np.unravel_index(np.argmax(total), total.shape)
                best, members = float(total[i, j]), (int(rows[i]), int(b[j]))
    return None if members is None else (min(members), max(members))


@dataclass(frozen=True, eq=False)
class _Tiles:
    """Candidates by the square of the floor that they stand in, and what each reaches at most."""

    order: IntArray
    start: IntArray
    reached: NDArray[np.bool_]
    dexterity: FloatArray
    low: FloatArray
    high: FloatArray

    @classmethod
    def of(cls, candidates: Candidates) -> _Tiles:
        # Members of a set share the state, so squares are divided by it.
        tile = _groups(candidates.tile, candidates.state)
        order = np.argsort(tile, kind="stable")
        start = np.searchsorted(tile[order], np.arange(tile.max(initial=-1) + 2))
        first = start[:-1]
        xy = candidates.xy[order]
        return cls(
            order,
            start,
            np.logical_or.reduceat(candidates.reached[order], first, axis=0),
            np.maximum.reduceat(candidates.dexterity[order], first, axis=0),
            np.minimum.reduceat(xy, first, axis=0),
            np.maximum.reduceat(xy, first, axis=0),
        )

    def rows(self, tile: int) -> IntArray:
        """Return the candidates of a square."""
        return self.order[self.start[tile] : self.start[tile + 1]]

    def pairs(
        self, weights: FloatArray, least_distance: float, to_beat: float
    ) -> Iterator[tuple[int, int, float]]:
        """Yield pairs of squares with a bound on their P_R + P_M above one, greatest first."""
        firsts, seconds, bounds = [], [], []
        for first in range(len(self.low)):
            others = slice(first, None)
            bound = tc_reachability(self.reached[first] | self.reached[others], weights)
            bound += tc_manipulability(
                np.maximum(self.dexterity[first], self.dexterity[others]), weights
            )
            span = np.maximum(
                self.high[first] - self.low[others], self.high[others] - self.low[first]
            )
            far = np.hypot(span[:, 0], span[:, 1]) >= least_distance - 1e-6
            some = np.flatnonzero((bound > to_beat) & far)
            firsts.append(np.full(some.size, first))
            seconds.append(some + first)
            bounds.append(bound[some])
        if not bounds:
            return
        bound = np.concatenate(bounds)
        pairs = np.stack([np.concatenate(firsts), np.concatenate(seconds)], axis=1)
        for i in np.argsort(-bound, kind="stable").tolist():
            yield int(pairs[i, 0]), int(pairs[i, 1]), float(bound[i])


def _promising(
    candidates: Candidates,
    rows: IntArray,
    tiles: _Tiles,
    other: int,
    weights: FloatArray,
    best: float,
) -> IntArray:
    """Return those of some candidates that may be in a better pair with one of another square."""
    bound = tc_reachability(candidates.reached[rows] | tiles.reached[other], weights)
    bound += tc_manipulability(
        np.maximum(candidates.dexterity[rows], tiles.dexterity[other]), weights
    )
    return rows[bound > best]


def _totals(
    candidates: Candidates,
    a: IntArray,
    b: IntArray,
    weights: FloatArray,
    least_distance: float,
    least_manipulability: float,
) -> FloatArray:
    """Return P_R + P_M of each pair of one of `a` and one of `b`, -1 where it is not kept."""
    reached = candidates.reached[a][:, None] | candidates.reached[b]
    dexterity = np.maximum(candidates.dexterity[a][:, None], candidates.dexterity[b])
    manipulability = tc_manipulability(dexterity, weights)
    total = tc_reachability(reached, weights) + manipulability
    gap = candidates.xy[a][:, None] - candidates.xy[b]
    distance = np.sqrt(gap[..., 0] * gap[..., 0] + gap[..., 1] * gap[..., 1])
    kept = (distance >= least_distance) & (manipulability >= least_manipulability)
    kept &= (candidates.state[a][:, None] == candidates.state[b]) & (a[:, None] != b)
    return np.where(kept, total, -1.0)


def _groups(*keys: IntArray) -> IntArray:
    """Return one number for each different combination of numbers >= 0, from 0."""
    joined = np.zeros(len(keys[0]), dtype=np.int64)
    for key in keys:
        joined = joined * (int(key.max(initial=0)) + 1) + key
    return np.asarray(np.unique(joined, return_inverse=True)[1]).reshape(-1)


def _fronts(values: NDArray[np.floating], group: IntArray) -> IntArray:
    """Return the rows, ascending, of the vectors that no other of their group is >= everywhere.

    Of equal vectors the first is returned.
    """
    # A vector that is >= another everywhere has no smaller sum.
    order = np.lexsort((-values.sum(axis=1), group))
    ends = np.flatnonzero(np.diff(group[order])) + 1
    kept = [_front(values[rows], rows) for rows in np.split(order, ends)]
    return np.sort(np.concatenate(kept)) if len(order) else order


def _front(values: NDArray[np.floating], rows: IntArray) -> IntArray:
    """Return the rows of vectors, sorted by falling sums, that no other is >= everywhere."""
    kept = []
    while len(rows):
        head = values[:_AT_ONCE]
        covers = (head[:, None] >= head).all(axis=2)
        # An earlier one covers: of equal ones the first stays.
        first = ~np.triu(covers, 1).any(axis=0)
        kept.append(rows[:_AT_ONCE][first])
        head, values, rows = head[first], values[_AT_ONCE:], rows[_AT_ONCE:]
        left = ~(head[:, None] >= values).all(axis=2).any(axis=0)
        values, rows = values[left], rows[left]
    return np.concatenate(kept)
