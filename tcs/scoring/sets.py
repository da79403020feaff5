"""Build the sets of one and two configurations worth choosing from, tau in the TCS paper."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from tcs.errors import TcsError
from tcs.kernel.arrays import IntArray
from tcs.kernel.sets import BestPairs, CellPairs, SetArrays, bound_cells
from tcs.space import ROBOT_AXES, Grid
from tcs.tables import ScoreTable, SetTable, tc_manipulability, tc_reachability
from tcs.tables.sets import DISTANCE_TOLERANCE, candidates_of

CELLS_PER_SLICE = 16
"""Small enough to share the work evenly (early cells have more partners than late ones) and to
keep the buffers of a slice small; large enough that a slice takes much longer than its hand-out."""


def build_sets(
    scores: ScoreTable, grid: Grid, *, min_distance: float = 0.40, jobs: int = 2
) -> SetTable:
    """Return every set of one or two configurations kept by the paper's rule.

    Singles are kept when they reach a goal. Pairs are kept when their members stand at least
    `min_distance` apart and their P_M is greater than the best P_M of a single. The search is
    exact over all pairs; the result does not depend on `jobs`.

    Args:
        scores: Scores of every configuration of the grid.
        grid: The grid.
        min_distance: Least base x-y distance between the members of a pair [m]. The paper
            gives no figure; 0.40 is that of hrl_base_selection in gt-ros-pkg/hrl-assistive.
        jobs: Number of threads.

    Returns:
        The sets; without any candidate when no goal is reached anywhere.

    Raises:
        TcsError: If the scores are not those of the grid, or an argument is out of range.

    Source:
        TCS section IV-A, eq. (1) and (4).
    """
    if scores.configurations != grid.size:
        raise TcsError(
            f"Sets: the score table has {scores.configurations} configurations, the grid "
            f"{grid.size}. Score this grid first."
        )
    if not 0.0 <= min_distance < math.inf:
        raise TcsError(f"Sets: min_distance is {min_distance} m; must be finite and >= 0.")
    if jobs < 1:
        raise TcsError(f"Sets: {jobs} jobs; must be at least 1.")
    candidates = candidates_of(scores.reached)
    cell, cell_xy = base_cells(grid, candidates)
    arrays = _grouped(scores, candidates, cell, cell_xy, min_distance)
    cells = len(cell_xy)
    slices = [
        (begin, min(begin + CELLS_PER_SLICE, cells))
        for begin in range(0, max(cells, 1), CELLS_PER_SLICE)
    ]
    found = Parallel(n_jobs=jobs, prefer="threads")(
        delayed(_bound_slice)(arrays, begin, end) for begin, end in slices
    )
    pair_cells, between, best_pairs = zip(*found, strict=True)
    best_single, best = _best_sets(scores, candidates, best_pairs)
    return SetTable(
        rule="paper",
        min_distance=float(min_distance),
        weights=scores.weights,
        candidates=candidates,
        reached=scores.reached[candidates],
        isotropy=scores.isotropy[candidates],
        cell=cell,
        cell_xy=cell_xy,
        # Slices one after the other are in lexicographic order.
        pair_cells=np.concatenate(pair_cells).astype(np.int32),
        pair_count=np.concatenate([part.kept for part in between]),
        pair_reachability=np.concatenate([part.reachability for part in between]),
        pair_manipulability=_float32_above(
            np.concatenate([part.manipulability for part in between])
        ),
        pair_sum=_float32_above(np.concatenate([part.total for part in between])),
        best=best,
        best_single=best_single,
    )


def base_cells(
    grid: Grid, candidates: NDArray[np.int32]
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Return the base cell of each candidate, shape (C,), and the cells' x, y, shape (N, 2).

    Only cells with a candidate are counted, in the order of base x, then base y.
    """
    names = list(ROBOT_AXES)
    along = grid.indices(candidates)[:, -len(names) :]
    x, y = along[:, names.index("base_x")], along[:, names.index("base_y")]
    columns = grid.axis("base_y").count
    place, cell = np.unique(x * columns + y, return_inverse=True)
    xy = np.stack(
        [grid.axis("base_x").values[place // columns], grid.axis("base_y").values[place % columns]],
        axis=1,
    )
    return cell.astype(np.int32), xy


def _grouped(
    scores: ScoreTable,
    candidates: NDArray[np.int32],
    cell: NDArray[np.int32],
    cell_xy: NDArray[np.float64],
    min_distance: float,
) -> SetArrays:
    """Return what the kernel needs, candidates sorted by cell."""
    number = np.argsort(cell, kind="stable").astype(np.int64)
    start = np.searchsorted(cell[number], np.arange(len(cell_xy) + 1)).astype(np.int64)
    isotropy = scores.isotropy[candidates[number]].astype(np.float64)
    single = tc_manipulability(isotropy, scores.weights)
    return SetArrays(
        number=number,
        start=start,
        xy=cell_xy,
        isotropy=isotropy,
        reached=scores.reached[candidates[number]],
        peak=np.maximum.reduceat(isotropy, start[:-1], axis=0) if len(number) else isotropy,
        weights=scores.weights,
        least_distance=min_distance - DISTANCE_TOLERANCE,
        threshold=float(single.max(initial=0.0)),
    )


def _bound_slice(arrays: SetArrays, begin: int, end: int) -> tuple[IntArray, CellPairs, BestPairs]:
    """Return what is kept between cells begin..end-1 and every cell not before them.

    Returns:
        The pairs of cells with a kept pair, lexicographic, shape (k, 2); what is kept between
        them, arrays of shape (k,); and the best pair of each cell of the slice.
    """
    shape = (end - begin, arrays.start.size - 1)
    out = CellPairs(
        np.zeros(shape, dtype=np.int64), np.zeros(shape), np.zeros(shape), np.zeros(shape)
    )
    best = BestPairs(np.full(end - begin, -1.0), np.full((end - begin, 2), -1, dtype=np.int64))
    bound_cells(arrays, begin, end, out, best)
    row, second = np.nonzero(out.kept)
    found = CellPairs(
        kept=out.kept[row, second],
        reachability=out.reachability[row, second],
        manipulability=out.manipulability[row, second],
        total=out.total[row, second],
    )
    return np.stack([row + begin, second], axis=1), found, best


def _best_sets(
    scores: ScoreTable, candidates: NDArray[np.int32], parts: Sequence[BestPairs]
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the best single and the best set by P_R + P_M; ties go to the first."""
    if not len(candidates):
        return (), ()
    single = tc_reachability(scores.reached[candidates], scores.weights) + tc_manipulability(
        scores.isotropy[candidates], scores.weights
    )
    best_single: tuple[int, ...] = (int(candidates[np.argmax(single)]),)
    total = np.concatenate([part.total for part in parts])
    members = np.concatenate([part.members for part in parts])
    first = np.lexsort((members[:, 1], members[:, 0], -total))[0]
    # Singles come before pairs, so a pair has to be better, not as good.
    if total[first] > single.max():
        return best_single, tuple(int(h) for h in candidates[members[first]])
    return best_single, best_single


def _float32_above(values: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return the least float32 not below each value: a bound must not round down."""
    near = values.astype(np.float32)
    return np.where(near < values, np.nextafter(near, np.float32(np.inf)), near)
