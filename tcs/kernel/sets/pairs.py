"""Pairs of configurations: how many are kept between two base cells, and how good they get.

Every sum runs over the goals in order, as in `tcs.placement.tables.equations`, so that a pair has
the same score here and online, to the last bit. Rounding is monotone: a score computed from
greater isotropies is never smaller, so bounds computed by the same sum need no slack.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import BoolArray, FloatArray, IntArray
from tcs.kernel.cache import inner, jit


class SetArrays(NamedTuple):
    """The candidates, grouped by base cell; those of cell c are rows start[c] to start[c + 1]."""

    number: IntArray
    """Number of each candidate in the order that breaks ties, shape (C,)."""
    start: IntArray
    """First row of each cell, shape (N + 1,)."""
    state: IntArray
    """Members of a set share this number, shape (C,); all 0 where they need not."""
    xy: FloatArray
    """Places of the cells [m], shape (N, 2)."""
    dexterity: FloatArray
    """Isotropy at each goal, 0 where not reached, shape (C, G)."""
    reached: BoolArray
    """Whether each goal is reached, shape (C, G)."""
    single: FloatArray
    """P_M of each candidate by itself, shape (C,)."""
    peak: FloatArray
    """Greatest isotropy in each cell at each goal, shape (N, G)."""
    weights: FloatArray
    """Weights of the goals, shape (G,)."""
    least_distance: float
    """Pairs of cells closer than this are left out [m]."""
    least_reachability: float
    """Kept pairs have at least this P_R."""
    least_manipulability: float
    """Kept pairs have at least this P_M."""
    least_gain: float
    """The P_M of a kept pair is at least this much of that of either member."""
    by_sum: bool
    """Whether the best pair is that of the greatest P_R + P_M; else P_R counts before P_M."""


class CellPairs(NamedTuple):
    """What is kept between each cell of a slice (rows) and every cell (columns)."""

    kept: IntArray
    """How many pairs are kept, shape (rows, N); 0 where the second cell comes before the first."""
    reachability: FloatArray
    """Their greatest P_R, shape (rows, N)."""
    manipulability: FloatArray
    """Their greatest P_M, shape (rows, N)."""
    total: FloatArray
    """Their greatest P_R + P_M, shape (rows, N)."""


class MemberPairs(NamedTuple):
    """The kept pairs that each candidate is in; 0 where it is in none."""

    reachability: FloatArray
    """Their greatest P_R, shape (C,)."""
    manipulability: FloatArray
    """Their greatest P_M, shape (C,)."""
    total: FloatArray
    """Their greatest P_R + P_M, shape (C,)."""


class BestPairs(NamedTuple):
    """The best pair in each cell of a slice."""

    keys: FloatArray
    """What pairs are ordered by: P_R + P_M and 0, or P_R and P_M; -1 where no pair is kept,
    shape (rows, 2)."""
    members: IntArray
    """Candidate numbers a < b, shape (rows, 2)."""


@jit
def pair_reachability(reached: BoolArray, i: int, j: int, weights: FloatArray) -> float:
    """Return P_R of the rows i and j together, TCS eq. (1)."""
    total = 0.0
    for g in range(weights.size):
        if reached[i, g] or reached[j, g]:
            total += weights[g]
    return total


@jit
def pair_manipulability(a: FloatArray, i: int, b: FloatArray, j: int, weights: FloatArray) -> float:
    """Return P_M of row i of `a` and row j of `b` together, TCS eq. (4)."""
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
    """Write the pair of the rows i and j to `row` of `best` where it comes before what is there."""
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
    """Go through the pairs between two cells, and write what is kept to `row` of `out`."""
    dexterity, peak, weights = arrays.dexterity, arrays.peak, arrays.weights
    least = arrays.least_manipulability
    # No pair can beat the cells' peaks, at every goal, taken together.
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
    """Go through the pairs between cells begin..end-1 and every cell not before them.

    Args:
        arrays: The candidates.
        begin: First cell of the slice.
        end: Cell after the last.
        out: Filled with zeros, `end - begin` rows.
        members: Filled with zeros.
        best: Filled with -1, `end - begin` rows.
    """
    for first in range(begin, end):
        for second in range(first, arrays.start.size - 1):
            dx = arrays.xy[second, 0] - arrays.xy[first, 0]
            dy = arrays.xy[second, 1] - arrays.xy[first, 1]
            if np.sqrt(dx * dx + dy * dy) >= arrays.least_distance:
                bound_cell_pair(arrays, first, second, first - begin, out, members, best)
