"""The sets of three configurations: all whose P_M is greater than that of every smaller set."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from tcs.errors import TcsError
from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.sets.pairs import BestPairs, MemberPairs, SetArrays
from tcs.kernel.sets.triples import KeptTriples, fill_pairs, find_triples
from tcs.placement.tables.equations import float32_above
from tcs.placement.tables.sets import Groups

MOST_CANDIDATES = 16_000
"""Greatest number of candidates: the search keeps the P_M of all pairs, 1 GB for this many."""

MOST_GROUPS = 2_000_000
"""Greatest number of triples of base cells with a kept set; each takes some 8 bytes in a file."""

BUFFER = 1 << 20
"""Number of triples that a thread collects before it reduces them by their cells."""

ROWS_PER_SLICE = 64
"""Small enough for an even load, large enough for a small overhead."""


def kept_triples(
    arrays: SetArrays, cell: IntArray, least: float, jobs: int
) -> tuple[Groups, tuple[float, tuple[int, ...]]]:
    """Return every set of three whose P_M is at least `least`, and the best of them.

    The search is exact; the result does not depend on `jobs`.

    Args:
        arrays: The candidates, sorted by cell.
        cell: Cell of each row of `arrays`.
        least: Least P_M.
        jobs: Number of threads.

    Returns:
        The sets; and P_R + P_M and candidate numbers of the best one, -1 and () if there is none.

    Raises:
        TcsError: If there are too many candidates, or too many triples of base cells.
    """
    count = arrays.number.size
    if count > MOST_CANDIDATES:
        raise TcsError(
            f"Sets of three: {count:,} candidates, but at most {MOST_CANDIDATES:,} are allowed. "
            "Use a coarser grid, or sets of two."
        )
    pairs = np.empty((count, count), dtype=np.float32)
    slices = [(b, min(b + ROWS_PER_SLICE, count)) for b in range(0, count, ROWS_PER_SLICE)]
    pool = Parallel(n_jobs=jobs, prefer="threads")
    pool(delayed(fill_pairs)(arrays, cell, begin, end, pairs) for begin, end in slices)
    # Interleaved rows balance the load: rows with a great P_M of their own take longest.
    found = pool(
        delayed(_triples_of)(arrays, cell, pairs, least, range(worker, count, jobs))
        for worker in range(jobs)
    )
    parts, members, best = zip(*found, strict=True)
    groups = _merged([part for of_one in parts for part in of_one], arrays.start.size - 1)
    numbers = np.argsort(arrays.number)
    of_member = [np.max(part, axis=0)[numbers] for part in zip(*members, strict=True)]
    first = min(best, key=lambda one: (-one.keys[0, 0], tuple(one.members[0])), default=None)
    top: tuple[float, tuple[int, ...]] = (-1.0, ())
    if first is not None and first.keys[0, 0] > 0.0:
        top = (float(first.keys[0, 0]), tuple(int(m) for m in first.members[0]))
    number, kept, reachability, manipulability, total = groups
    cells = arrays.start.size - 1
    return (
        Groups(
            least=least,
            cells=np.stack(np.unravel_index(number, (cells,) * 3), axis=1).astype(np.int32),
            count=kept,
            reachability=reachability,
            manipulability=float32_above(manipulability),
            total=float32_above(total),
            member_reachability=of_member[0],
            member_manipulability=float32_above(of_member[1]),
            member_total=float32_above(of_member[2]),
        ),
        top,
    )


_Reduced = tuple[IntArray, IntArray, FloatArray, FloatArray, FloatArray]
"""Number of each triple of cells, ascending; number of its sets; their greatest P_R, P_M and
P_R + P_M."""


def _triples_of(
    arrays: SetArrays, cell: IntArray, pairs: NDArray[np.float32], least: float, rows: range
) -> tuple[list[_Reduced], MemberPairs, BestPairs]:
    """Return the kept triples whose member of greatest P_M is in these rows."""
    count, cells = arrays.number.size, arrays.start.size - 1
    members = MemberPairs(np.zeros(count), np.zeros(count), np.zeros(count))
    best = BestPairs(np.zeros((1, 2)), np.full((1, 3), count, dtype=np.int64))
    parts: list[_Reduced] = []
    for batch in _batches(arrays, cell, pairs, least, rows, members, best):
        number = np.ravel_multi_index(tuple(batch.cells.T), (cells,) * 3)
        ones = np.ones(number.size, dtype=np.int64)
        total = batch.reachability + batch.manipulability
        parts.append(_reduced((number, ones, batch.reachability, batch.manipulability, total)))
        if sum(part[0].size for part in parts) > MOST_GROUPS:
            parts = [_merged(parts, cells)]
    return parts, members, best


def _batches(
    arrays: SetArrays,
    cell: IntArray,
    pairs: NDArray[np.float32],
    least: float,
    rows: range,
    members: MemberPairs,
    best: BestPairs,
) -> Iterator[KeptTriples]:
    """Yield kept triples in batches of at most one buffer."""
    size = BUFFER + arrays.number.size
    out = KeptTriples(np.empty((size, 3), dtype=np.int64), np.empty(size), np.empty(size))
    filled = 0
    for row in rows:
        at = 0
        while at >= 0:
            rest = _part(out, filled, size)
            found, at = find_triples(arrays, cell, pairs, least, row, at, rest, members, best)
            filled += found
            if filled > BUFFER // 2 or at >= 0:
                yield _part(out, 0, filled)
                filled = 0
    if filled:
        yield _part(out, 0, filled)


def _part(triples: KeptTriples, begin: int, end: int) -> KeptTriples:
    """Return a view of a range of triples."""
    return KeptTriples(
        triples.cells[begin:end], triples.reachability[begin:end], triples.manipulability[begin:end]
    )


def _merged(parts: list[_Reduced], cells: int) -> _Reduced:
    """Return the reductions of several parts as one.

    Raises:
        TcsError: If there are too many triples of cells.
    """
    if not parts:
        nothing = np.zeros(0, dtype=np.int64)
        return nothing, nothing, np.zeros(0), np.zeros(0), np.zeros(0)
    number, kept, reachability, manipulability, total = (
        np.concatenate(columns) for columns in zip(*parts, strict=True)
    )
    merged = _reduced((number, kept, reachability, manipulability, total))
    if merged[0].size > MOST_GROUPS:
        raise TcsError(
            f"Sets of three: kept at more than {MOST_GROUPS:,} triples of base cells (of "
            f"{cells:,} cells). Use a greater min_distance, one state of the environment, or sets "
            "of two."
        )
    return merged


def _reduced(triples: _Reduced) -> _Reduced:
    """Return one entry for all triples of the same number."""
    number, kept, *scores = triples
    order = np.argsort(number, kind="stable")
    number = number[order]
    begin = np.flatnonzero(np.diff(number, prepend=-1))
    reachability, manipulability, total = (
        np.maximum.reduceat(score[order], begin) if begin.size else score for score in scores
    )
    count = np.add.reduceat(kept[order], begin) if begin.size else kept
    return number[begin], count, reachability, manipulability, total
