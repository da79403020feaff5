"""Estimates of success under error for the best sets, as a criterion of selection."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import TcsError
from tcs.files.blocks import BlockFolder
from tcs.model.grid import Grid
from tcs.model.random_streams import check_draws
from tcs.placement.robustness.kept_pairs import EQUAL_REACHABILITY, Pairs, kept_pairs
from tcs.placement.robustness.perturbed_points import PerturbedPoints
from tcs.placement.robustness.statistics import CONFIDENCE, intervals_of
from tcs.placement.robustness.trials import Errors, Progress, Trials
from tcs.placement.store import ScoreFile, state_to_json
from tcs.placement.tables import (
    Estimates,
    RefinedTable,
    SetTable,
    SuccessTable,
    tc_reachability,
)
from tcs.placement.tables.sets import FRACTION_TOLERANCE
from tcs.placement.tables.success import NO_MEMBER

IntArray = NDArray[np.int64]

SETS = 2000
"""Greatest number of pairs that get an estimate; a quarter as many singles."""
MIN_CONTENDERS = 200
"""If fewer sets than this are equal in P_R to the best, the next best are added."""
SCREENED = 32
"""Samples that select the sets for successive halving if there are more; halving does not use them
again, so that the selection does not bias its estimates."""
MOST_SCREENED = 800
"""Greatest number of configurations evaluated on these samples, those with the best scores."""
ESTIMATION_STREAM = "race"
"""Name of the random stream of the estimates. Another name would give other numbers."""


def robustify(
    file: ScoreFile,
    *,
    sets: int = SETS,
    samples: int = 1024,
    seed: int = 0,
    errors: Errors = None,
    body_collisions: str | None = None,
    tables: Sequence[int] | None = None,
    jobs: int = 2,
    blocks: BlockFolder | None = None,
    on_progress: Progress = None,
    on_compile: Callable[[], None] | None = None,
) -> ScoreFile:
    """Return a score file with estimates of success under error for its best sets.

    Of each size, one and two, the contenders are the sets with P_R of at least 98 % of the greatest
    of that size. If there are too many, those that succeed most often in a few separate samples are
    selected; the sets with the best scores always are. Successive halving evaluates them all on the
    same samples and gives more samples to the better half of those that may still be the best.

    Args:
        file: A score file, which is not modified.
        sets: Greatest number of pairs; a quarter as many singles.
        samples: Number of samples of the sets that remain to the end.
        seed: Seed of the samples; results are the same for any number of jobs.
        errors: Path of an error file, or errors by joint, in place of those of the environment.
        body_collisions: Collisions of the robot's body that count, one of `BODY_COLLISIONS`.
        tables: Numbers of the tables; all by default. The others keep their estimates.
        jobs: Number of threads.
        blocks: Folder in which finished blocks are kept, so that the same call continues after an
            interrupt; None to keep none.
        on_progress: Called with the number of rounds done and of all rounds.
        on_compile: Called first if the kernel has to be compiled.

    Raises:
        StoreMismatchError: If the file was made from other models.
        DataFileError: If the error file cannot be used.
        UnknownNameError: If a joint or a choice of collisions has no such name.
        SelectionError: If there is no such table.
        OutputError: If blocks cannot be kept in their folder, or another process is at work there.
        TcsError: If a number is out of range.
    """
    check_draws(samples, seed)
    if not 1 <= sets <= 100_000:
        raise TcsError(f"sets is {sets}; must be 1 to 100,000.")
    trials = Trials.of(file, errors=errors, body_collisions=body_collisions, on_compile=on_compile)
    chosen = range(len(file.tables)) if tables is None else tables
    rounds = 1 + len(round_sizes(samples))
    done, total = 0, 2 * rounds * len(chosen)

    def step() -> None:
        nonlocal done
        done += 1
        if on_progress is not None:
            on_progress(done, total)

    scored = list(file.tables)
    with trials.kept_in(blocks) as kept:
        for number in chosen:
            here = kept.at_table(number)
            success = success_of(here, sets=sets, samples=samples, seed=seed, jobs=jobs, step=step)
            refined = here.scored.refined
            if refined is not None:
                refined = with_success(here, refined, samples=samples, seed=seed, jobs=jobs)
            scored[number] = dataclasses.replace(here.scored, success=success, refined=refined)
    settings = {
        "program_version": version("tcs"),
        "samples": samples,
        "seed": seed,
        "sets": sets,
        "errors": trials.errors.to_json(),
        "environment_errors": errors is None,
        "body_collisions": trials.body_collisions,
    }
    # One record for each table, because tables may be estimated at different times.
    records = list(file.metadata.get("robustness", [None] * len(scored)))
    for number in chosen:
        records[number] = settings
    metadata = {**file.metadata, "robustness": records}
    return dataclasses.replace(file, metadata=metadata, tables=tuple(scored))


def success_summary(file: ScoreFile) -> dict[str, Any]:
    """Return the most robust sets as plain containers, as printed by `tcs robustify --json`."""
    grid = Grid.from_dict(file.grid)
    tables = []
    records = file.metadata.get("robustness", [None] * len(file.tables))
    for scored, state, settings in zip(file.tables, file.observed_states, records, strict=True):
        success = scored.success
        if success is None:
            continue
        best = []
        for size in (1, 2):
            members = success.most_robust(scored.sets, max_members=size)
            row = success.row_of(members)
            if row is None or len(members) < size:
                continue
            best.append(
                {
                    "members": [grid.configuration(h).to_json() for h in members],
                    "success": float(success.success[row]),
                    "ci95": [float(success.low[row]), float(success.high[row])],
                    "samples": int(success.samples[row]),
                    "sets": int(success.of_size(size).size),
                }
            )
        observed = state_to_json(file.observed_axes, state)
        tables.append(
            {
                "observed": observed,
                "best": best,
                "refined": _surest_refined(grid, scored.refined),
                "settings": settings,
            }
        )
    return {"tables": tables}


def _surest_refined(grid: Grid, refined: RefinedTable | None) -> dict[str, Any] | None:
    """Return the refined set with the greatest lower bound of its success; None without one."""
    if refined is None or refined.success is None:
        return None
    success = refined.success
    row = int(np.argmax(success.low))
    return {
        "row": row,
        "members": [member.to_json() for member in refined.members(grid, row)],
        "success": float(success.success[row]),
        "ci95": [float(success.low[row]), float(success.high[row])],
        "samples": int(success.samples[row]),
        "sets": len(refined.origin),
    }


def success_of(
    trials: Trials,
    *,
    sets: int = SETS,
    samples: int = 1024,
    seed: int = 0,
    jobs: int = 2,
    step: Callable[[], None] = lambda: None,
) -> SuccessTable:
    """Return the estimates for the best sets of one table; see `robustify`.

    Args:
        trials: Trials of the table.
        sets: Greatest number of pairs; a quarter as many singles.
        samples: Number of samples of the sets that remain to the end.
        seed: Seed of the samples.
        jobs: Number of threads.
        step: Called after the screening and after each round, for each size.
    """
    table = trials.scored.sets
    offsets = trials.errors.draw(samples, seed, stream=ESTIMATION_STREAM)

    def attempt(rows: IntArray, start: int, stop: int) -> NDArray[np.bool_]:
        part = {name: values[start:stop] for name, values in offsets.items()}
        return trials.reached(table.candidates[rows], part, jobs=jobs)

    found: list[tuple[IntArray, HalvingEstimates]] = []
    for pool, most in ((_singles(table), -(-sets // 4)), (_pairs(table), sets)):
        contenders = _screened(trials, pool, most, seed, jobs)
        step()
        found.append(
            (contenders, successive_halving(contenders, table.weights, samples, attempt, step))
        )
    return _as_table(table, found)


def with_success(
    trials: Trials, refined: RefinedTable, *, samples: int, seed: int, jobs: int = 2
) -> RefinedTable:
    """Return refined sets with their success in the samples that the surest sets of the grid get.

    Args:
        trials: Trials of the table that they were refined from.
        refined: The sets.
        samples: Number of samples.
        seed: Seed of the samples.
        jobs: Number of threads.
    """
    offsets = trials.errors.draw(samples, seed, stream=ESTIMATION_STREAM)
    rows, columns = np.nonzero(refined.origin != NO_MEMBER)
    found = PerturbedPoints(trials, offsets, jobs).reached(refined.values[rows, columns])
    fractions = [
        tc_reachability(np.logical_or.reduce(found[rows == row]), refined.weights)
        for row in range(len(refined.origin))
    ]
    mean, low, high = intervals_of(np.array(fractions))
    every = np.full(len(mean), samples, dtype=np.int32)
    success = Estimates(success=mean, low=low, high=high, samples=every)
    return dataclasses.replace(refined, success=success)


def _as_table(table: SetTable, found: list[tuple[IntArray, HalvingEstimates]]) -> SuccessTable:
    """Return the estimates of sets of several sizes as one table, in order."""
    width = max((rows.shape[1] for rows, _ in found if len(rows)), default=1)
    members, columns = [], []
    for rows, estimates in found:
        order = np.lexsort(rows.T[::-1])
        flat = np.full((len(rows), width), NO_MEMBER, dtype=np.int32)
        if len(rows):
            flat[:, : rows.shape[1]] = table.candidates[rows[order]]
        members.append(flat)
        parts = (estimates.mean, estimates.low, estimates.high, estimates.samples)
        columns.append([part[order] for part in parts])
    mean, low, high, samples = (np.concatenate(parts) for parts in zip(*columns, strict=True))
    return SuccessTable(
        members=np.concatenate(members),
        success=mean,
        low=low,
        high=high,
        samples=samples.astype(np.int32),
    )


def _singles(table: SetTable) -> IntArray:
    """Return the contending singles, best scores first, shape (K, 1)."""
    reachability = table.single_reachability
    rows = np.arange(len(table.candidates))
    return _contenders(rows[:, None], reachability, table.single_manipulability)


def _pairs(table: SetTable) -> IntArray:
    """Return the contending pairs, best scores first, shape (K, 2)."""
    greatest = float(table.pairs.reachability.max(initial=0.0))
    least = EQUAL_REACHABILITY * greatest - FRACTION_TOLERANCE
    pairs = Pairs.joined(kept_pairs(table, least_reachability=least))
    if pairs.first.size < MIN_CONTENDERS:
        pairs = Pairs.joined(kept_pairs(table))
    rows = np.stack([pairs.first, pairs.second], axis=1)
    return _contenders(rows, pairs.reachability, pairs.manipulability)


def _contenders(
    rows: IntArray, reachability: NDArray[np.float64], manipulability: NDArray[np.float64]
) -> IntArray:
    """Return the sets equal in P_R to the best, or the MIN_CONTENDERS best; best scores first."""
    order = np.argsort(-(reachability + manipulability), kind="stable")
    greatest = float(reachability.max(initial=0.0))
    contends = reachability[order] >= EQUAL_REACHABILITY * greatest - FRACTION_TOLERANCE
    contends[:MIN_CONTENDERS] |= np.count_nonzero(contends) < MIN_CONTENDERS
    return np.asarray(rows[order][contends])


def _screened(trials: Trials, pool: IntArray, most: int, seed: int, jobs: int) -> IntArray:
    """Return the sets for successive halving, at most `most`."""
    if len(pool) <= most:
        return pool
    members, first = np.unique(pool, return_index=True)
    # The earlier a candidate occurs, the better the best set that contains it.
    early = members[np.argsort(first, kind="stable")[:MOST_SCREENED]]
    screened = pool[np.isin(pool, early).all(axis=1)]
    offsets = trials.errors.draw(SCREENED, seed, stream="screening")
    tried = np.unique(screened)
    found = trials.reached(trials.scored.sets.candidates[tried], offsets, jobs=jobs)
    number = np.searchsorted(tried, screened)
    mean = np.empty(len(screened))
    for start in range(0, len(screened), 4096):
        part = number[start : start + 4096]
        reached = np.logical_or.reduce([found[column] for column in part.T], axis=0)
        mean[start : start + 4096] = tc_reachability(reached, trials.weights).mean(axis=1)
    # A tenth of the selection has the best scores, regardless of these few samples.
    mean[: max(1, most // 10)] = np.inf
    return np.asarray(screened[np.sort(np.argsort(-mean, kind="stable")[:most])])


FloatArray = NDArray[np.float64]

FIRST_ROUND = 64
"""Samples of the first round; each round doubles their number."""
CHUNK = 256
"""Sets evaluated together: some ten megabytes."""

Attempt = Callable[[IntArray, int, int], NDArray[np.bool_]]
"""Function of numbers of members and a range of samples, start <= s < stop. It returns which goals
they reach, shape (members, stop - start, goals)."""


@dataclass(frozen=True, eq=False)
class HalvingEstimates:
    """Estimated success of K sets, shapes (K,)."""

    mean: FloatArray
    """Mean over the samples of each set."""
    low: FloatArray
    """Lower end of its 95 % interval."""
    high: FloatArray
    """Upper end."""
    samples: IntArray
    """Number of samples of each set."""
    survivors: IntArray
    """Numbers of the sets that no round rejected."""


def round_sizes(samples: int) -> tuple[int, ...]:
    """Return the number of samples after each round.

    >>> round_sizes(1000)
    (64, 128, 256, 512, 1000)
    """
    sizes = []
    size = FIRST_ROUND
    while size < samples:
        sizes.append(size)
        size *= 2
    return (*sizes, samples)


def successive_halving(
    sets: IntArray,
    weights: FloatArray,
    samples: int,
    attempt: Attempt,
    on_round: Callable[[], None] = lambda: None,
) -> HalvingEstimates:
    """Return estimates of the success of sets, with the most samples for the best of them.

    All sets are evaluated on the same samples, so that the variance of their differences is much
    smaller than that of their means. Each round rejects the sets that are significantly worse than
    the leader: the upper confidence bound of their mean paired difference is negative. The bounds
    hold for all sets and rounds jointly with 95 % confidence (Bonferroni), as far as means of that
    many differences are normally distributed. The better half of the others continues; ties go to
    the first.

    Args:
        sets: Numbers of the members of each set, shape (K, m).
        weights: Weights of the goals, sum 1, shape (goals,).
        samples: Number of samples of the sets that are never rejected.
        attempt: Evaluates members.
        on_round: Called after each round.
    """
    # Imported here because it takes a second.
    from scipy.special import ndtri

    sizes = round_sizes(samples)
    count = len(sets)
    # float32 keeps seven digits of the fraction of goals reached.
    fractions = np.zeros((count, samples), dtype=np.float32)
    counts = np.zeros(count, dtype=np.int64)
    alive = np.arange(count)
    bound = float(ndtri(1.0 - (1.0 - CONFIDENCE) / max(1, count * len(sizes))))
    done = 0
    for size in sizes:
        if alive.size:
            _fill(fractions, sets, alive, weights, attempt, done, size)
            counts[alive] = size
            alive = _best_half(alive, fractions[alive, :size], bound)
        done = size
        on_round()
    mean, low, high = np.zeros(count), np.zeros(count), np.ones(count)
    for size in sizes:
        rows = np.flatnonzero(counts == size)
        if rows.size:
            mean[rows], low[rows], high[rows] = intervals_of(fractions[rows, :size])
    return HalvingEstimates(mean, low, high, counts, alive)


def _fill(
    fractions: NDArray[np.float32],
    sets: IntArray,
    rows: IntArray,
    weights: FloatArray,
    attempt: Attempt,
    start: int,
    stop: int,
) -> None:
    """Compute the fractions of some sets in samples start <= s < stop."""
    members, number = np.unique(sets[rows], return_inverse=True)
    number = number.reshape(rows.size, -1)
    found = attempt(members, start, stop)
    for first in range(0, rows.size, CHUNK):
        part = slice(first, first + CHUNK)
        reached = found[number[part, 0]]
        for column in number[part, 1:].T:
            reached = reached | found[column]
        fractions[rows[part], start:stop] = tc_reachability(reached, weights)


def _best_half(alive: IntArray, fractions: NDArray[np.float32], bound: float) -> IntArray:
    """Return the sets that may be the best, at most half of them, in order."""
    mean = fractions.mean(axis=1, dtype=np.float64)
    difference = fractions.astype(np.float64) - fractions[int(np.argmax(mean))]
    n = difference.shape[1]
    error = np.full(len(difference), np.inf)
    if n > 1:
        error = difference.std(axis=1, ddof=1) / np.sqrt(n)
    mean[difference.mean(axis=1) + bound * error < 0.0] = -1.0
    half = np.argsort(-mean, kind="stable")[: (len(mean) + 1) // 2]
    return np.sort(alive[half[mean[half] >= 0.0]])
