"""The sets of configurations to choose from, tau in the TCS paper."""

from __future__ import annotations

import hashlib
import json
import math
from typing import TypedDict, Unpack

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from tcs.errors import TcsError
from tcs.files.blocks import BlockFolder
from tcs.files.mapped import chunks
from tcs.kernel.arrays import IntArray
from tcs.kernel.sets.pairs import BestPairs, CellPairs, MemberPairs, SetArrays, bound_cells
from tcs.model.grid import ROBOT_AXES, Grid
from tcs.model.program import program_digest
from tcs.placement.scoring.thinning import (
    MOST_CANDIDATES,
    TILE,
    Candidates,
    best_pair,
    representatives,
    tiles_of,
    undominated,
)
from tcs.placement.scoring.triples import kept_triples
from tcs.placement.store.encoding import decode_sets, encode_sets
from tcs.placement.tables import (
    BaseLattice,
    ScoreTable,
    SetTable,
    tc_manipulability,
    tc_reachability,
)
from tcs.placement.tables.equations import float32_above
from tcs.placement.tables.sets import (
    DISTANCE_TOLERANCE,
    MOST_MEMBERS,
    MOVES,
    Groups,
    candidates_of,
    check_rule,
    order_keys,
    pair_limits,
    spaced_places,
)

BORDER = 0.6
"""Distance by which obstacles at the border of the grid are extended beyond it [m]. The grid has
no data there, and the paper's grid ends at the foot end of the bed: half a PR2 and the end of the
bed are 0.6 m."""

STEP = 0.1
"""Distance of neighbours along an axis on which the grid has a single value [m]."""


def lattice_of(scores: ScoreTable, grid: Grid) -> BaseLattice:
    """Return the lattice of the base positions of a grid and its surroundings.

    The base can move to a neighbour if, in some state of the environment and with some heading and
    torso height, its body is free of contact at both positions; diagonally if also at the two
    positions beside the diagonal. At each position the robot may turn, move its torso and have the
    environment set. Positions are checked, not the path between them. Configurations that a
    constraint excluded count as in contact.

    Args:
        scores: Scores of every configuration of the grid.
        grid: The grid.
    """
    # Nothing is known about the body where a configuration was not scored.
    blocked = scores.has_no_free_body
    names = list(ROBOT_AXES)
    x, y = names.index("base_x") - len(names), names.index("base_y") - len(names)
    free = np.moveaxis(~blocked.reshape(grid.shape), (x, y), (-2, -1))
    free = free.reshape(-1, *free.shape[-2:])
    axes = [grid.axis(name) for name in ("base_x", "base_y")]
    known = [axis.step for axis in axes if axis.count > 1] or [STEP]
    step = [axis.step if axis.count > 1 else known[0] for axis in axes]
    border = [math.ceil(BORDER / s - 1e-9) for s in step]  # 0.6 / 0.1 rounds to less than 6
    free = np.pad(free, ((0, 0), (border[0],) * 2, (border[1],) * 2), mode="edge")
    # Beyond that everything is free, which one ring of positions represents.
    free = np.pad(free, ((0, 0), (1, 1), (1, 1)), constant_values=True)
    shape = free.shape[-2:]
    moves = np.zeros((len(MOVES), *shape), dtype=np.bool_)
    for along, (dx, dy) in zip(moves, MOVES, strict=True):
        low, high = max(0, -dy), shape[1] - max(0, dy)
        rows, columns = {0, dx}, {0, dy}
        possible = np.ones((len(free), shape[0] - dx, high - low), dtype=np.bool_)
        for i in rows:
            for j in columns:
                possible &= free[:, i : shape[0] - dx + i, low + j : high + j]
        along[: shape[0] - dx, low:high] = possible.any(axis=0)
    return BaseLattice(
        start=(
            axes[0].start - (border[0] + 1) * step[0],
            axes[1].start - (border[1] + 1) * step[1],
        ),
        step=(step[0], step[1]),
        moves=moves,
    )


CELLS_PER_SLICE = 16
"""Small enough for an even load (early cells have more partners than late ones) and small buffers;
large enough that a slice takes much longer than its scheduling."""


class SetOptions(TypedDict, total=False):
    """Options of the kept sets, for every function with `**sets`."""

    rule: str
    """One of `tcs.placement.tables.sets.RULES`. "paper", the default: singles that reach a goal,
    pairs whose P_M is greater than the best P_M of a single, and triples whose P_M is greater than
    the best P_M of a pair and of a single. "code2015": the rules of hrl_base_selection,
    without triples."""
    same_environment: bool
    """Whether the members of a set must share the state of the environment; False by default."""
    max_members: int
    """1 for singles only, 2, the default, for pairs too, 3 for triples too. For 5,000 candidates,
    triples take some ten seconds and 100 MB."""
    min_distance: float
    """Least base x-y distance between two members of a set [m], 0.40 by default. The paper gives
    no value; this is the one of hrl_base_selection in gt-ros-pkg/hrl-assistive."""


def build_sets(
    scores: ScoreTable, grid: Grid, *, jobs: int = 2, **options: Unpack[SetOptions]
) -> SetTable:
    """Return every set of one, two or three configurations that a rule keeps.

    The search is exact over all sets; the result does not depend on `jobs`. Of more than
    `MOST_CANDIDATES` candidates, those are kept that stand for all others (`representatives`), and
    the best single and the best pair of all (`best_pair`).

    Args:
        scores: Scores of every configuration of the grid.
        grid: The grid.
        jobs: Number of threads.
        **options: Options of the kept sets, see `SetOptions`.

    Returns:
        The sets; empty if no configuration reaches a goal.

    Raises:
        UnknownNameError: If there is no such rule.
        TcsError: If the scores are not those of the grid, an argument is out of range, or there
            are too many candidates for triples.

    Source:
        TCS section IV-A, eq. (1) and (4).
    """
    checked = checked_options(**options)
    rule, max_members = checked["rule"], checked["max_members"]
    same_environment, min_distance = checked["same_environment"], checked["min_distance"]
    if scores.configurations != grid.size:
        raise TcsError(
            f"Sets: the score table has {scores.configurations} configurations, the grid "
            f"{grid.size}. Score this grid first."
        )
    if jobs < 1:
        raise TcsError(f"Sets: {jobs} jobs; must be at least 1.")
    candidates = candidates_of(scores.reached, scores.weights, rule)
    if rule == "code2015" or len(candidates) <= MOST_CANDIDATES:
        return _sets_of(scores, grid, candidates, checked, jobs)
    few, undominated = _representatives(scores, grid, candidates, same_environment)
    sets = _sets_of(scores, grid, few, checked, jobs, tile=TILE)
    if max_members == 1:
        return sets
    best = best_pair(
        undominated,
        scores.weights,
        least_distance=min_distance - DISTANCE_TOLERANCE,
        least_manipulability=sets.limits.manipulability,
        to_beat=sum(sets.scores_of(sets.best)),
    )
    if best is None:
        return sets
    members = undominated.number[list(best)]
    return _sets_of(scores, grid, np.union1d(few, members), checked, jobs, tile=TILE)


def _representatives(
    scores: ScoreTable, grid: Grid, candidates: NDArray[np.int32], same_environment: bool
) -> tuple[NDArray[np.int32], Candidates]:
    """Return candidates that stand for all, and those that are as good as all where they stand.

    The first are the singles with the greatest P_M and with the greatest P_R + P_M, and others.
    """
    place, xy = base_cells(grid, candidates)
    state = grid.state_of(candidates)
    every = Candidates(
        number=candidates,
        reached=scores.reached[candidates],
        dexterity=scores.dexterity[candidates].astype(np.float64),
        xy=xy[place],
        place=place.astype(np.int64),
        tile=tiles_of(xy)[place],
        state=state if same_environment else np.zeros_like(state),
        kind=state,
    )
    single = tc_manipulability(every.dexterity, scores.weights)
    total = tc_reachability(every.reached, scores.weights) + single
    best = candidates[[np.argmax(single), np.argmax(total)]]
    left = every.some(undominated(every))
    few = left.number[representatives(left)]
    return np.union1d(few, best).astype(np.int32), left


def _sets_of(
    scores: ScoreTable,
    grid: Grid,
    candidates: NDArray[np.int32],
    options: SetOptions,
    jobs: int,
    *,
    tile: float = 0.0,
) -> SetTable:
    """Return every set of some candidates that the rule keeps.

    Args:
        scores: Scores of every configuration of the grid.
        grid: The grid.
        candidates: Flat indices of the candidates, ascending.
        options: All options of the kept sets.
        jobs: Number of threads.
        tile: See `SetTable.tile`.
    """
    rule, max_members = options["rule"], options["max_members"]
    same_environment, min_distance = options["same_environment"], options["min_distance"]
    state = grid.state_of(candidates)
    cell, cell_xy = base_cells(grid, candidates)
    arrays = _grouped(
        scores,
        candidates,
        cell,
        state if same_environment else np.zeros_like(state),
        cell_xy,
        rule=rule,
        min_distance=min_distance,
    )
    pair_cells, between, members, best_pairs = _kept_pairs(arrays, jobs if max_members > 1 else 0)
    best_single, best = _best_sets(scores, candidates, best_pairs, rule)
    triples = None
    if max_members > 2:
        smaller = max(arrays.single.max(initial=0.0), between.manipulability.max(initial=0.0))
        triples, best = _with_triples(scores, arrays, cell, float(smaller), candidates, best, jobs)
    return SetTable(
        rule=rule,
        max_members=max_members,
        min_distance=float(min_distance),
        same_environment=same_environment,
        state_size=grid.state_size,
        weights=scores.weights,
        candidates=candidates,
        reached=scores.reached[candidates],
        dexterity=scores.dexterity[candidates],
        hand=None if scores.hand is None else scores.hand[candidates],
        cell=cell,
        cell_xy=cell_xy,
        pairs=Groups(
            cells=pair_cells.astype(np.int32),
            count=between.kept,
            reachability=between.reachability,
            manipulability=float32_above(between.manipulability),
            total=float32_above(between.total),
            member_reachability=members.reachability,
            member_manipulability=float32_above(members.manipulability),
            member_total=float32_above(members.total),
        ),
        triples=triples,
        best=best,
        best_single=best_single,
        lattice=lattice_of(scores, grid),
        tile=tile,
    )


def checked_options(
    *,
    rule: str = "paper",
    same_environment: bool = False,
    max_members: int = 2,
    min_distance: float = 0.40,
) -> SetOptions:
    """Return all options, checked, with defaults for those not given.

    Raises:
        UnknownNameError: If there is no such rule.
        TcsError: If a number is out of range, or the rule has no sets of `max_members`.
    """
    check_rule(rule)
    if not 1 <= max_members <= MOST_MEMBERS:
        raise TcsError(f"Sets: max_members is {max_members}; must be 1 to {MOST_MEMBERS}.")
    if rule == "code2015" and max_members > 2:
        raise TcsError("Sets: rule 'code2015' keeps sets of one and two; for three use 'paper'.")
    if not 0.0 <= min_distance < math.inf:
        raise TcsError(f"Sets: min_distance is {min_distance} m; must be finite and >= 0.")
    return {
        "rule": rule,
        "same_environment": same_environment,
        "max_members": max_members,
        "min_distance": min_distance,
    }


def base_cells(
    grid: Grid, candidates: NDArray[np.int32]
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Return the base cell of each candidate, shape (C,), and the cells' x, y, shape (N, 2).

    Only cells with a candidate are included, in the order of base x, then base y.
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
    state: NDArray[np.int64],
    cell_xy: NDArray[np.float64],
    *,
    rule: str,
    min_distance: float,
) -> SetArrays:
    """Return the kernel's arrays, with the candidates sorted by cell."""
    number = np.argsort(cell, kind="stable").astype(np.int64)
    start = np.searchsorted(cell[number], np.arange(len(cell_xy) + 1)).astype(np.int64)
    dexterity = scores.dexterity[candidates[number]].astype(np.float64)
    reached = scores.reached[candidates[number]]
    single = tc_manipulability(dexterity, scores.weights)
    limits = pair_limits(rule, tc_reachability(reached, scores.weights), single)
    return SetArrays(
        number=number,
        start=start,
        state=state[number],
        xy=spaced_places(rule, cell_xy),
        dexterity=dexterity,
        reached=reached,
        single=single,
        peak=np.maximum.reduceat(dexterity, start[:-1], axis=0) if len(number) else dexterity,
        weights=scores.weights,
        least_distance=min_distance - DISTANCE_TOLERANCE,
        least_reachability=limits.reachability,
        least_manipulability=limits.manipulability,
        least_gain=limits.gain,
        by_sum=rule != "code2015",
    )


def _kept_pairs(arrays: SetArrays, jobs: int) -> tuple[IntArray, CellPairs, MemberPairs, BestPairs]:
    """Return the kept pairs between all cells, found by `jobs` threads; none for 0.

    Returns:
        The pairs of cells with a kept pair, lexicographic, shape (K, 2); counts and bounds of
        their kept pairs, shape (K,); the kept pairs of each candidate, by its number; and the
        best pair of each cell.
    """
    cells = arrays.start.size - 1 if jobs else 0
    slices = [
        (begin, min(begin + CELLS_PER_SLICE, cells))
        for begin in range(0, max(cells, 1), CELLS_PER_SLICE)
    ]
    found = Parallel(n_jobs=max(jobs, 1), prefer="threads")(
        delayed(_bound_slice)(arrays, begin, end) for begin, end in slices
    )
    # Slices come in lexicographic order.
    pair_cells, between, members, best = zip(*found, strict=True)
    # Sorted by number: the inverse of how the candidates were sorted by cell.
    rows = np.argsort(arrays.number)
    return (
        np.concatenate(pair_cells),
        CellPairs(*(np.concatenate(parts) for parts in zip(*between, strict=True))),
        MemberPairs(*(np.max(parts, axis=0)[rows] for parts in zip(*members, strict=True))),
        BestPairs(*(np.concatenate(parts) for parts in zip(*best, strict=True))),
    )


def _bound_slice(
    arrays: SetArrays, begin: int, end: int
) -> tuple[IntArray, CellPairs, MemberPairs, BestPairs]:
    """Return the kept pairs between cells begin..end-1 and every cell from there on.

    Returns:
        The pairs of cells with a kept pair, lexicographic, shape (k, 2); counts and bounds of
        their kept pairs, shape (k,); the kept pairs of each candidate; and the best pair of each
        cell of the slice.
    """
    shape = (end - begin, arrays.start.size - 1)
    out = CellPairs(
        np.zeros(shape, dtype=np.int64), np.zeros(shape), np.zeros(shape), np.zeros(shape)
    )
    members = MemberPairs(*(np.zeros(arrays.number.size) for _ in range(3)))
    size = (end - begin, 2)
    best = BestPairs(np.full(size, -1.0), np.full(size, -1, dtype=np.int64))
    bound_cells(arrays, begin, end, out, members, best)
    row, second = np.nonzero(out.kept)
    found = CellPairs(
        kept=out.kept[row, second],
        reachability=out.reachability[row, second],
        manipulability=out.manipulability[row, second],
        total=out.total[row, second],
    )
    return np.stack([row + begin, second], axis=1), found, members, best


def _best_sets(
    scores: ScoreTable, candidates: NDArray[np.int32], pairs: BestPairs, rule: str
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the best single and the best set in the order of the rule; ties go to the first."""
    if not len(candidates):
        return (), ()
    keys = order_keys(
        rule,
        tc_reachability(scores.reached[candidates], scores.weights),
        tc_manipulability(scores.dexterity[candidates], scores.weights),
    )
    single = np.lexsort((-keys[1], -keys[0]))[0]
    best_single: tuple[int, ...] = (int(candidates[single]),)
    if not len(pairs.keys):
        return best_single, best_single
    a, b = pairs.members.T
    pair = np.lexsort((b, a, -pairs.keys[:, 1], -pairs.keys[:, 0]))[0]
    # Singles come before pairs, so an equally good pair does not replace one.
    if tuple(pairs.keys[pair]) > (keys[0][single], keys[1][single]):
        return best_single, tuple(int(h) for h in candidates[pairs.members[pair]])
    return best_single, best_single


def _with_triples(
    scores: ScoreTable,
    arrays: SetArrays,
    cell: NDArray[np.int32],
    smaller: float,
    candidates: NDArray[np.int32],
    best: tuple[int, ...],
    jobs: int,
) -> tuple[Groups, tuple[int, ...]]:
    """Return the triples with a greater P_M than `smaller`, and the best set with them."""
    rows = cell[arrays.number].astype(np.int64)
    triples, (total, members) = kept_triples(arrays, rows, float(np.nextafter(smaller, 1.0)), jobs)
    if not members:
        return triples, best
    reached = np.logical_or.reduce(scores.reached[list(best)], axis=0)
    dexterity = np.maximum.reduce(scores.dexterity[list(best)], axis=0)
    so_far = tc_reachability(reached, scores.weights) + tc_manipulability(dexterity, scores.weights)
    # Smaller sets come first, so an equally good triple does not replace one.
    if total > so_far:
        best = tuple(int(h) for h in candidates[list(members)])
    return triples, best


_NAME = "sets"


def kept_sets(
    blocks: BlockFolder | None,
    scores: ScoreTable,
    grid: Grid,
    *,
    jobs: int,
    **options: Unpack[SetOptions],
) -> SetTable:
    """Return the sets of scores as `build_sets` does, from a folder of blocks if they are there.

    Args:
        blocks: The folder; None to build the sets and keep nothing.
        scores: Scores of every configuration of the grid.
        grid: The grid.
        jobs: Number of threads.
        **options: Options of the kept sets, all of them.

    Raises:
        OutputError: If the block cannot be written, or another process builds the same sets.
        TcsError: As `build_sets`.
    """
    if blocks is None:
        return build_sets(scores, grid, jobs=jobs, **options)
    with blocks.opened(_key(scores, grid, options)) as opened:
        found = opened.load(_NAME, lambda content: decode_sets(content, grid))
        if found is None:
            found = build_sets(scores, grid, jobs=jobs, **options)
            opened.save(_NAME, encode_sets(found))
        return found


def _key(scores: ScoreTable, grid: Grid, options: SetOptions) -> str:
    """Return the hash of everything that sets follow from."""
    plain = json.dumps([grid.to_dict(), options], sort_keys=True)
    sha = hashlib.sha256(f"sets\0{program_digest()}\0{plain}\0".encode())
    sha.update(scores.weights.tobytes())
    for rows in chunks(scores.reason, scores.dexterity):
        sha.update(scores.reason[rows].tobytes())
        sha.update(scores.dexterity[rows].tobytes())
    return sha.hexdigest()
