"""Pairs of configurations: number and best scores of those kept between two base cells.

Every sum runs over the goals in order, as in `tcs.placement.tables.equations`, so that a pair has
the same score here and online, to the last bit. Rounding is monotone: a score computed from
greater measures is never smaller, so bounds computed by the same sum need no tolerance.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import BoolArray, FloatArray, IntArray
from tcs.kernel.cache import inner, jit


class SetArrays(NamedTuple):
    """Candidates grouped by base cell; those of cell c are rows start[c] to start[c + 1] - 1."""

    number: IntArray
    """Number of each candidate in the order that breaks ties, shape (C,)."""
    start: IntArray
    """First row of each cell, shape (N + 1,)."""
    state: IntArray
    """Number that the members of a set must share, shape (C,); all 0 if they need not."""
    xy: FloatArray
    """Positions of the cells [m], shape (N, 2)."""
    dexterity: FloatArray
    """Dexterity at each goal, 0 where not reached, shape (C, G)."""
    reached: BoolArray
    """Whether each goal is reached, shape (C, G)."""
    single: FloatArray
    """P_M of each candidate alone, shape (C,)."""
    peak: FloatArray
    """Greatest dexterity in each cell at each goal, shape (N, G)."""
    weights: FloatArray
    """Weights of the goals, shape (G,)."""
    least_distance: float
    """Least distance of the cells of a pair [m]."""
    least_reachability: float
    """Least P_R of a kept pair."""
    least_manipulability: float
    """Least P_M of a kept pair."""
    least_gain: float
    """Least ratio of the P_M of a kept pair to the P_M of either member alone."""
    by_sum: bool
    """Whether pairs are ranked by P_R + P_M; else by P_R, then by P_M."""


class CellPairs(NamedTuple):
    """Kept pairs between each cell of a slice (rows) and every cell (columns)."""

    kept: IntArray
    """Number of kept pairs, shape (rows, N); 0 where the second cell precedes the first."""
    reachability: FloatArray
    """Greatest P_R of the kept pairs, shape (rows, N)."""
    manipulability: FloatArray
    """Greatest P_M of the kept pairs, shape (rows, N)."""
    total: FloatArray
    """Greatest P_R + P_M of the kept pairs, shape (rows, N)."""


class MemberPairs(NamedTuple):
    """Best scores of the kept pairs (or triples) of each candidate; 0 for one in no kept pair."""

    reachability: FloatArray
    """Greatest P_R, shape (C,)."""
    manipulability: FloatArray
    """Greatest P_M, shape (C,)."""
    total: FloatArray
    """Greatest P_R + P_M, shape (C,)."""


class BestPairs(NamedTuple):
    """Best kept pair of each cell of a slice."""

    keys: FloatArray
    """Sort keys of the pairs: P_R + P_M and 0, or P_R and P_M; -1 where no pair is kept, shape
    (rows, 2)."""
    members: IntArray
    """Candidate numbers a < b, shape (rows, 2)."""


@jit
def pair_reachability(reached: BoolArray, i: int, j: int, weights: FloatArray) -> float:
    """Return P_R of the pair of rows i and j, TCS eq. (1)."""
    total = 0.0
    for g in range(weights.size):
        if reached[i, g] or reached[j, g]:
            total += weights[g]
    return total


@jit
def pair_manipulability(a: FloatArray, i: int, b: FloatArray, j: int, weights: FloatArray) -> float:
    """Return P_M of the pair of row i of `a` and row j of `b`, TCS eq. (4)."""
    total = 0.0
    for g in range(weights.size):
        total += weights[g] * max(a[i, g], b[j, g])
    return total


@inner
def keep_best(
    arrays: SetArrays,
    i: int,
    j: int,
    reachability: float,
    manipulability: float,
    row: int,
    best: BestPairs,
) -> None:
    """Store the pair of rows i and j in `row` of `best` if it precedes the pair stored there.

    Of pairs with equal keys, the one with the smaller candidate numbers comes first.
    """
    first, second = reachability, manipulability
    if arrays.by_sum:
        first, second = reachability + manipulability, 0.0
    keys, members = best.keys[row], best.members[row]
    if first < keys[0] or (first == keys[0] and second < keys[1]):
        return
    a, b = min(arrays.number[i], arrays.number[j]), max(arrays.number[i], arrays.number[j])
    tied = first == keys[0] and second == keys[1]
    if tied and (a > members[0] or (a == members[0] and b > members[1])):
        return
    keys[0], keys[1] = first, second
    members[0], members[1] = a, b


@inner
def bound_cell_pair(
    arrays: SetArrays,
    first: int,
    second: int,
    row: int,
    out: CellPairs,
    members: MemberPairs,
    best: BestPairs,
) -> None:
    """Enumerate the pairs between two cells and add the kept ones to `row` of `out`."""
    dexterity, peak, weights = arrays.dexterity, arrays.peak, arrays.weights
    least = arrays.least_manipulability
    # The peaks of the two cells at every goal bound every pair from above.
    if pair_manipulability(peak, first, peak, second, weights) < least:
        return
    for i in range(arrays.start[first], arrays.start[first + 1]):
        if pair_manipulability(dexterity, i, peak, second, weights) < least:
            continue
        begin = i + 1 if first == second else arrays.start[second]
        for j in range(begin, arrays.start[second + 1]):
            if arrays.state[i] != arrays.state[j]:
                continue
            manipulability = pair_manipulability(dexterity, i, dexterity, j, weights)
            larger = max(arrays.single[i], arrays.single[j])
            if manipulability < least or manipulability < arrays.least_gain * larger:
                continue
            reachability = pair_reachability(arrays.reached, i, j, weights)
            if reachability < arrays.least_reachability:
                continue
            total = reachability + manipulability
            out.kept[row, second] += 1
            out.reachability[row, second] = max(out.reachability[row, second], reachability)
            out.manipulability[row, second] = max(out.manipulability[row, second], manipulability)
            out.total[row, second] = max(out.total[row, second], total)
            for k in (i, j):
                members.reachability[k] = max(members.reachability[k], reachability)
                members.manipulability[k] = max(members.manipulability[k], manipulability)
                members.total[k] = max(members.total[k], total)
            keep_best(arrays, i, j, reachability, manipulability, row, best)


@jit
def bound_cells(
    arrays: SetArrays,
    begin: int,
    end: int,
    out: CellPairs,
    members: MemberPairs,
    best: BestPairs,
) -> None:
    """Enumerate the pairs between each of the cells begin .. end - 1 and every cell from it on.

    Args:
        arrays: The candidates.
        begin: First cell of the slice.
        end: One after the last cell of the slice.
        out: Initially zeros, `end - begin` rows; updated.
        members: Initially zeros; updated.
        best: Initially -1, `end - begin` rows; updated.
    """
    for first in range(begin, end):
        for second in range(first, arrays.start.size - 1):
            dx = arrays.xy[second, 0] - arrays.xy[first, 0]
            dy = arrays.xy[second, 1] - arrays.xy[first, 1]
            if np.sqrt(dx * dx + dy * dy) >= arrays.least_distance:
                bound_cell_pair(arrays, first, second, first - begin, out, members, best)
