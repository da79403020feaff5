"""The pool: configurations of which sets are formed and tried under error.

Which set does all goals in most rooms cannot be told from its dexterity. Errors displace the person
by some centimetres, much as if the base stood elsewhere: what a configuration still reaches then is
estimated from what its neighbours on the grid reach, without a trial. The pool holds those of the
best pairs by this estimate, from different base poses, and those of the best sets. All pairs of the
pool are compared in a few rooms.
"""

from __future__ import annotations

import itertools

import numpy as np

from tcs.kernel.arrays import BoolArray, FloatArray, IntArray
from tcs.model.grid import Grid
from tcs.placement.robustness.kept_pairs import allowed_pairs
from tcs.placement.store import StateTables
from tcs.placement.tables import SetTable
from tcs.placement.tables.equations import tc_reachability

SPREAD = 0.05
"""Standard deviation of the displacement that neighbours on the grid stand for [m]: that of a
person in bed or chair in Table II of the TCS paper. Other errors are tried as they are: this
decides only which configurations are."""
NEIGHBOURS = 2.0
"""Greatest displacement of a neighbour, in standard deviations."""
POOL = 240
"""Number of configurations in the pool: all of them are tried in `SCREENED` rooms."""
OF_BEST = 40
"""Number of these that are taken from the sets with the greatest P_R + P_M."""
PLACE, OF_PLACE = 0.15, 4
"""Side of a square of the floor [m], and the most configurations of one heading that are taken from
it: neighbours do much the same goals in the same rooms."""
MOST_COMPARED = 6000
"""Greatest number of configurations whose pairs are compared without trials."""
CHUNK = 256
"""Configurations whose pairs are compared at a time: some ten megabytes."""
MEMBERS = {1: 16, 2: 60, 3: 40}
"""Greatest number of configurations in the sets of a size that remain: each is tried in hundreds of
rooms."""
THIRDS = 30
"""Number of the best pairs to which a third member is sought."""


def pool_of(scored: StateTables, grid: Grid, most: int = POOL) -> IntArray:
    """Return the candidates of the pool, as rows of the set table, ascending.

    Args:
        scored: Scores and sets.
        grid: Their grid.
        most: Greatest number of candidates.
    """
    sets = scored.sets
    count = len(sets.candidates)
    if count <= most:
        return np.arange(count)
    best = sets.single_reachability + sets.single_manipulability
    best = np.maximum(best, sets.pairs.member_total)
    if sets.triples is not None:
        best = np.maximum(best, sets.triples.member_total)
    for members in (sets.best, sets.best_single):
        best[np.searchsorted(sets.candidates, members)] = np.inf
    chosen = np.argsort(-best, kind="stable")[: most * OF_BEST // POOL]
    value = _pair_values(sets, kept_by_neighbours(scored, grid))
    at = grid.values(sets.candidates.astype(np.int64))
    place = np.stack(
        [
            np.floor(at["base_x"] / PLACE).astype(np.int64),
            np.floor(at["base_y"] / PLACE).astype(np.int64),
            np.unique(at["base_yaw"], return_inverse=True)[1],
            sets.state,
        ]
    )
    group = np.unique(place, axis=1, return_inverse=True)[1].ravel()
    taken = np.zeros(group.max() + 1, dtype=np.int64)
    found = list(dict.fromkeys(chosen.tolist()))
    known = set(found)
    for row in np.argsort(-value, kind="stable").tolist():
        if len(found) >= most:
            break
        if row not in known and taken[group[row]] < OF_PLACE:
            taken[group[row]] += 1
            found.append(row)
    return np.sort(np.array(found, dtype=np.int64))


def kept_by_neighbours(scored: StateTables, grid: Grid) -> FloatArray:
    """Return how much of each goal the neighbours of each candidate reach, shape (C, G).

    Args:
        scored: Scores and sets.
        grid: Their grid.

    Returns:
        The fraction of the neighbours within `NEIGHBOURS` standard deviations on the floor, with
        the weights of a normal distribution; those beyond the edge of the grid are left out.
    """
    candidates, reached = scored.sets.candidates.astype(np.int64), scored.scores.reached
    names = [axis.name for axis in grid.axes]
    index = np.array(np.unravel_index(candidates, grid.shape))
    ix, iy = names.index("base_x"), names.index("base_y")
    steps = [grid.axes[i].step if grid.axes[i].count > 1 else np.inf for i in (ix, iy)]
    reach = [int(NEIGHBOURS * SPREAD / abs(step)) for step in steps]
    total, found = np.zeros(len(candidates)), np.zeros((len(candidates), reached.shape[1]))
    for dx, dy in itertools.product(*(range(-n, n + 1) for n in reach)):
        away = np.array([d * s if d else 0.0 for d, s in zip((dx, dy), steps, strict=True)])
        distance = float(np.linalg.norm(away)) / SPREAD
        if distance > NEIGHBOURS + 1e-9:
            continue
        there = index.copy()
        there[ix] += dx
        there[iy] += dy
        inside = np.all((there >= 0) & (there < np.array(grid.shape)[:, None]), axis=0)
        weight = np.exp(-0.5 * distance**2)
        flat = np.ravel_multi_index(tuple(there[:, inside]), grid.shape)
        total[inside] += weight
        found[inside] += weight * reached[flat]
    return np.asarray(found / total[:, None])


def _pair_values(sets: SetTable, kept: FloatArray) -> FloatArray:
    """Return the best estimate of all goals with any other candidate, or alone, shape (C,).

    Goals are taken to be lost independently.
    """
    value = np.prod(kept, axis=1)
    # Where no pair keeps all goals, more of them are better.
    some = np.sort(np.argsort(-kept.sum(axis=1), kind="stable")[:MOST_COMPARED])
    lost = (1.0 - kept[some]).astype(np.float32)
    for start in range(0, len(some), CHUNK):
        rows = some[start : start + CHUNK]
        both = np.ones((len(rows), len(some)), dtype=np.float32)
        for of_goal in lost.T:
            both *= 1.0 - of_goal[start : start + CHUNK, None] * of_goal
        both[~allowed_pairs(sets, rows, some)] = 0.0
        value[rows] = np.maximum(value[rows], both.max(axis=1))
    return np.asarray(value + 1e-3 * kept.mean(axis=1))


def best_sets(sets: SetTable, pool: IntArray, reached: BoolArray, most: int) -> dict[int, IntArray]:
    """Return the sets of a pool that do all goals in most rooms, by their size, the best first.

    All singles and pairs are compared, and of three those that extend the best pairs. Sets that do
    all goals in as many rooms are ordered by the goals that they do, then by their scores.

    Args:
        sets: The table.
        pool: Rows of the candidates, ascending, shape (P,).
        reached: Whether each reaches a goal in a room, shape (P, rooms, G).
        most: Greatest number of pairs; a quarter as many of the others.

    Returns:
        Rows of the members, shapes (K, size), of no more candidates than `MEMBERS` says, and the
        best sets of the table.
    """
    weights, scores = sets.weights, sets.single_reachability + sets.single_manipulability
    few = -(-most // 4)

    def ordered(members: IntArray, count: int) -> IntArray:
        rooms, goals = np.zeros(len(members)), np.zeros(len(members))
        for start in range(0, len(members), 4096):
            part = members[start : start + 4096]
            found = np.logical_or.reduce([reached[column] for column in part.T], axis=0)
            rooms[start : start + 4096] = found.all(axis=2).mean(axis=1)
            goals[start : start + 4096] = tc_reachability(found, weights).mean(axis=1)
        of_members = scores[pool[members]].mean(axis=1)
        return np.asarray(members[np.lexsort((-of_members, -goals, -rooms))[:count]])

    numbers = np.arange(len(pool))
    found = {1: _of_few(ordered(numbers[:, None], few), few)}
    if sets.max_members > 1:
        allowed = np.triu(allowed_pairs(sets, pool, pool), 1)
        pairs = np.argwhere(allowed)
        found[2] = _of_few(ordered(_promising(pairs, reached, 4 * most), most), most)
    if sets.max_members > 2:
        allowed |= allowed.T
        triples = [
            np.sort([*pair, third])
            for pair in found[2][:THIRDS].tolist()
            for third in np.flatnonzero(allowed[pair].all(axis=0)).tolist()
        ]
        members = np.unique(np.reshape(triples, (-1, 3)).astype(np.int64), axis=0)
        found[3] = _of_few(ordered(members, few), few)
    rows = {size: pool[members] for size, members in found.items()}
    return {size: _with_best(sets, members) for size, members in rows.items()}


def _promising(pairs: IntArray, reached: BoolArray, count: int) -> IntArray:
    """Return the pairs that do all goals in most rooms, shape (n, 2); of all of them, by bits."""
    missing = np.packbits(~reached, axis=2)
    rooms = np.empty(len(pairs), dtype=np.int64)
    for start in range(0, len(pairs), 65536):
        first, second = pairs[start : start + 65536].T
        both = missing[first] & missing[second]
        rooms[start : start + 65536] = np.count_nonzero(~both.any(axis=2), axis=1)
    return np.asarray(pairs[np.argsort(-rooms, kind="stable")[:count]])


def _of_few(members: IntArray, most: int) -> IntArray:
    """Return the first sets of few different members, at most `most`."""
    known: set[int] = set()
    kept, size = [], members.shape[1]
    for number, row in enumerate(members.tolist()):
        if len(known.union(row)) <= MEMBERS[size]:
            known.update(row)
            kept.append(number)
    return np.asarray(members[kept[:most]].reshape(-1, size))


def _with_best(sets: SetTable, rows: IntArray) -> IntArray:
    """Return sets with the best one of their size by its scores, for comparison."""
    size = rows.shape[1]
    for best in (sets.best, sets.best_single):
        wanted = np.searchsorted(sets.candidates, sorted(best))
        if len(wanted) == size and not np.any(np.all(rows == wanted, axis=1)):
            rows = np.concatenate([rows, wanted[None]])
    return rows
