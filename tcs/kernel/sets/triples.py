"""Sets of three configurations: all kept triples, found by branch and bound.

TC-manipulability f is monotone and submodular in the set: a member adds no more to a larger set.
So, for any order of the members, f(i, j, k) <= f(i, j) + f(i, k) - f(i), and
f(i, j, k) <= (f(i, j) + f(i, k) + f(j, k)) / 2. With the P_M of all pairs these bounds leave a few
percent of the triples to be summed goal by goal.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner, jit
from tcs.kernel.sets.pairs import BestPairs, MemberPairs, SetArrays, pair_manipulability

ROUNDING = 1e-6
"""Allowance for rounding in the bounds: P_M of pairs is stored in single precision, 6e-8."""


class KeptTriples(NamedTuple):
    """Buffer for kept triples."""

    cells: IntArray
    """Base cells of each triple, ascending, shape (B, 3)."""
    reachability: FloatArray
    """P_R of each triple, shape (B,)."""
    manipulability: FloatArray
    """P_M of each triple, shape (B,)."""


@jit
def fill_pairs(
    arrays: SetArrays, cell: IntArray, begin: int, end: int, pairs: NDArray[np.float32]
) -> None:
    """Fill rows begin .. end - 1 of `pairs`, shape (C, C), with P_M of each pair of candidates.

    The entry is -1 where two candidates cannot be in one set.
    """
    xy = arrays.xy
    for i in range(begin, end):
        for j in range(arrays.number.size):
            dx, dy = xy[cell[j], 0] - xy[cell[i], 0], xy[cell[j], 1] - xy[cell[i], 1]
            apart = np.sqrt(dx * dx + dy * dy) >= arrays.least_distance
            if i != j and apart and arrays.state[i] == arrays.state[j]:
                pairs[i, j] = pair_manipulability(
                    arrays.dexterity, i, arrays.dexterity, j, arrays.weights
                )
            else:
                pairs[i, j] = -1.0


@inner
def triple_scores(arrays: SetArrays, i: int, j: int, k: int) -> tuple[float, float]:
    """Return P_R and P_M of the triple of rows i, j and k, TCS eq. (1) and (4)."""
    reachability = manipulability = 0.0
    dexterity, reached = arrays.dexterity, arrays.reached
    for g in range(arrays.weights.size):
        weight = arrays.weights[g]
        manipulability += weight * max(dexterity[i, g], dexterity[j, g], dexterity[k, g])
        if reached[i, g] or reached[j, g] or reached[k, g]:
            reachability += weight
    return reachability, manipulability


@inner
def in_order(a: int, b: int, c: int) -> tuple[int, int, int]:
    """Return three numbers in ascending order."""
    if a > b:
        a, b = b, a
    if b > c:
        b, c = c, b
    if a > b:
        a, b = b, a
    return a, b, c


@inner
def note_triple(
    arrays: SetArrays,
    rows: tuple[int, int, int],
    reachability: float,
    manipulability: float,
    members: MemberPairs,
    best: BestPairs,
) -> None:
    """Update the best scores of the members of a kept triple, and the best triple of all."""
    total = reachability + manipulability
    for row in rows:
        members.reachability[row] = max(members.reachability[row], reachability)
        members.manipulability[row] = max(members.manipulability[row], manipulability)
        members.total[row] = max(members.total[row], total)
    if total < best.keys[0, 0]:
        return
    number = arrays.number
    a, b, c = in_order(number[rows[0]], number[rows[1]], number[rows[2]])
    old = best.members[0]
    later = a > old[0] or (a == old[0] and (b > old[1] or (b == old[1] and c > old[2])))
    if total == best.keys[0, 0] and later:
        return
    best.keys[0, 0] = total
    old[0], old[1], old[2] = a, b, c


@inner
def partners_of(
    arrays: SetArrays, pairs: NDArray[np.float32], i: int, least: float
) -> tuple[IntArray, FloatArray]:
    """Return the rows that may form a kept triple with row i, and P_M of each pair, descending.

    Rows whose own P_M is greater are left out: each triple is found from its member of greatest
    P_M.
    """
    count = arrays.number.size
    single = arrays.single
    most = single[i]
    for j in range(count):
        most = max(most, pairs[i, j])
    rows = np.empty(count, dtype=np.int64)
    values = np.empty(count)
    found = 0
    # A third member adds at most what the best partner of row i adds.
    for j in range(count):
        if pairs[i, j] + most - single[i] + ROUNDING < least or pairs[i, j] < 0.0:
            continue
        if single[j] < single[i] or (single[j] == single[i] and j > i):
            rows[found] = j
            values[found] = -pairs[i, j]
            found += 1
    order = np.argsort(values[:found])
    return rows[:found][order], -values[:found][order]


@jit
def find_triples(
    arrays: SetArrays,
    cell: IntArray,
    pairs: NDArray[np.float32],
    least: float,
    i: int,
    p: int,
    out: KeptTriples,
    members: MemberPairs,
    best: BestPairs,
) -> tuple[int, int]:
    """Find the kept triples in which row i is the member with the greatest P_M.

    Args:
        arrays: The candidates.
        cell: Cell of each row, shape (C,).
        pairs: P_M of all pairs of rows, -1 where they cannot be in one set, shape (C, C).
        least: Least P_M of a kept triple.
        i: The row.
        p: First partner to try: 0, or the second return value of the previous call.
        out: Filled from its start; its capacity is at least the number of rows.
        members: Best scores of each row, updated.
        best: Best kept triple, one row of three members, updated.

    Returns:
        Number of triples found, and the partner to continue from, -1 if there are no more.
    """
    rows, values = partners_of(arrays, pairs, i, least)
    single = arrays.single
    found = 0
    while p < rows.size - 1:
        if out.reachability.size - found < rows.size:
            return found, p
        j, first = rows[p], values[p]
        of_i = least + single[i] - first - ROUNDING
        of_j = least + single[j] - first - ROUNDING
        of_both = 2.0 * least - first - ROUNDING
        of_j_pairs = pairs[j]
        for q in range(p + 1, rows.size):
            second = values[q]
            if second < of_i:
                break
            k = rows[q]
            third = of_j_pairs[k]
            if third < of_j or third < 0.0 or second + third < of_both:
                continue
            if second + third < least + single[k] - ROUNDING:
                continue
            reachability, manipulability = triple_scores(arrays, i, j, k)
            if manipulability < least:
                continue
            a, b, c = in_order(cell[i], cell[j], cell[k])
            out.cells[found, 0], out.cells[found, 1], out.cells[found, 2] = a, b, c
            out.reachability[found] = reachability
            out.manipulability[found] = manipulability
            note_triple(arrays, (i, j, k), reachability, manipulability, members, best)
            found += 1
        p += 1
    return found, -1
