"""The shortest tour through goals, each with several postures, from rest and back."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import FloatArray

EXACT = 10
"""Greatest number of goals for which the tour is the shortest one."""
LEAST_GAIN = 1e-9
"""Least reduction of the cost for which a part of the tour is reversed."""

Leg = Callable[[int, int], FloatArray]
"""Costs from each posture of one goal to each of another, shape (n, m); -1 stands for rest, which
has one posture."""
REST = -1


def best_tour(sizes: Sequence[int], leg: Leg) -> tuple[tuple[int, int], ...]:
    """Return goals in the order of the tour, each with the number of its posture.

    Up to EXACT goals it is the shortest tour (Held, Karp 1962, over all postures of each goal). For
    more, each next goal is the nearest one, and then parts of the tour are reversed as long as that
    shortens it (2-opt, Croes 1958).

    Args:
        sizes: Number of postures of each goal, each at least 1.
        leg: Costs between postures of two goals.

    >>> at = [np.array([3.0, -9.0]), np.array([-8.0, 2.0]), np.array([1.0])]
    >>> where = lambda g: np.zeros(1) if g == REST else at[g]
    >>> tour = best_tour([2, 2, 1], lambda a, b: np.abs(where(a)[:, None] - where(b)[None]))
    >>> sorted(dict(tour).items())
    [(0, 0), (1, 1), (2, 0)]
    """
    if not sizes:
        return ()
    if len(sizes) <= EXACT:
        return _exact(sizes, leg)
    return _reversed_where_shorter(sizes, leg, [goal for goal, _ in _nearest(sizes, leg)])


def given_tour(sizes: Sequence[int], leg: Leg) -> tuple[tuple[int, int], ...]:
    """Return the goals in their own order, each with the posture of the shortest such tour.

    Args:
        sizes: Number of postures of each goal, each at least 1.
        leg: Costs between postures of two goals.
    """
    return _in_order(range(len(sizes)), leg)[1] if sizes else ()


Choices = tuple[FloatArray, NDArray[np.intp], NDArray[np.intp]]
"""For each posture of a goal: least cost of a way to it, goal visited before, and its posture."""


def _exact(sizes: Sequence[int], leg: Leg) -> tuple[tuple[int, int], ...]:
    """Return the shortest tour, by dynamic programming over the sets of visited goals."""
    goals = range(len(sizes))
    legs = {(a, b): leg(a, b) for a in goals for b in goals if a != b}
    none = np.zeros(0, np.intp)
    # The ways from rest through a set of goals, a bit mask, that end at one of them.
    ways: dict[tuple[int, int], Choices] = {
        (1 << g, g): (leg(REST, g)[0], none, none) for g in goals
    }
    for count in range(2, len(sizes) + 1):
        for chosen in combinations(goals, count):
            mask = sum(1 << g for g in chosen)
            for last in chosen:
                others = [g for g in chosen if g != last]
                costs = [ways[mask ^ 1 << last, g][0][:, None] + legs[g, last] for g in others]
                ways[mask, last] = _least(others, costs)
    mask = (1 << len(sizes)) - 1
    totals = [ways[mask, g][0] + leg(g, REST)[:, 0] for g in goals]
    goal = int(np.argmin([total.min() for total in totals]))
    posture = int(totals[goal].argmin())
    tour = [(goal, posture)]
    while mask & (mask - 1):
        _, previous, postures = ways[mask, goal]
        mask ^= 1 << goal
        goal, posture = int(previous[posture]), int(postures[posture])
        tour.append((goal, posture))
    return tuple(reversed(tour))


def _least(goals: Sequence[int], costs: Sequence[FloatArray]) -> Choices:
    """Return the cheapest way to each posture of a goal, over the goals that may come before.

    Args:
        goals: The goals that may come before.
        costs: For each of them, costs over each of its postures (rows) to each posture (columns).
    """
    least = np.array([cost.min(axis=0) for cost in costs])
    rows = np.array([cost.argmin(axis=0) for cost in costs])
    which = least.argmin(axis=0)
    return least.min(axis=0), np.array(goals)[which], rows[which, np.arange(len(which))]


def _nearest(sizes: Sequence[int], leg: Leg) -> tuple[tuple[int, int], ...]:
    left, tour = set(range(len(sizes))), []
    goal, posture = REST, 0
    while left:
        rows = {g: leg(goal, g)[posture] for g in sorted(left)}
        goal = min(rows, key=lambda g: float(rows[g].min()))
        posture = int(rows[goal].argmin())
        left.remove(goal)
        tour.append((goal, posture))
    return tuple(tour)


def _in_order(order: Sequence[int], leg: Leg) -> tuple[float, tuple[tuple[int, int], ...]]:
    """Return cost and postures of the shortest tour through goals in a given order."""
    cost, choices = leg(REST, order[0])[0], []
    for before, goal in itertools.pairwise(order):
        totals = cost[:, None] + leg(before, goal)
        choices.append(totals.argmin(axis=0))
        cost = totals.min(axis=0)
    cost = cost + leg(order[-1], REST)[:, 0]
    postures = [int(cost.argmin())]
    for choice in reversed(choices):
        postures.append(int(choice[postures[-1]]))
    return float(cost.min()), tuple(zip(order, reversed(postures), strict=True))


def _reversed_where_shorter(
    sizes: Sequence[int], leg: Leg, order: list[int]
) -> tuple[tuple[int, int], ...]:
    """Return the tour after reversals of its parts, until none shortens it."""
    ends = (REST, *range(len(sizes)))
    legs = {(a, b): leg(a, b) for a in ends for b in ends if a != b}

    def known(a: int, b: int) -> FloatArray:
        return legs[a, b]

    best, tour = _in_order(order, known)
    shorter = True
    while shorter:
        shorter = False
        for first, last in combinations(range(len(order) + 1), 2):
            changed = [*order[:first], *reversed(order[first:last]), *order[last:]]
            cost, found = _in_order(changed, known)
            if cost < best - LEAST_GAIN:
                best, tour, order, shorter = cost, found, changed, True
    return tour
