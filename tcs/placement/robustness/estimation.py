"""Estimates of success under error for the best sets, as a criterion of selection."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import TcsError
from tcs.files.blocks import BlockFolder
from tcs.model.grid import Grid
from tcs.model.random_streams import check_draws
from tcs.placement.robustness.evaluation import Judge, done_by
from tcs.placement.robustness.kept_pairs import EQUAL_REACHABILITY, Pairs, kept_pairs
from tcs.placement.robustness.perturbed_points import PerturbedPoints
from tcs.placement.robustness.pool import best_sets, pool_of
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
"""Greatest number of pairs that get an estimate; a quarter as many of other sets."""
MIN_CONTENDERS = 200
"""If fewer sets than this are equal in P_R to the best, the next best are added."""
SCREENED = 32
"""Samples that select the sets for successive halving if there are more; halving does not use them
again, so that the selection does not bias its estimates."""
MOST_SCREENED = 800
"""Greatest number of configurations evaluated on these samples, those with the best scores."""
FINALISTS, FINALISTS_OF_ONE, LAST = 4, 2, 2
"""Number of sets, and of single configurations, whose motions are judged, those with the greatest
lower bounds; and of these the better ones, judged in more samples."""
FIRST_JUDGED, MOST_JUDGED = 128, 512
"""Number of samples in which motions are judged: each takes some tens of milliseconds for a set."""
LEAST_COMPARED = 0.5
"""Least success by approaches of a set that shows what motions lose: of few samples it is noise."""
REFINED_JUDGED = 128
"""Samples in which the motions of refined sets are judged at most: of many, each takes seconds."""
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
    judge: Judge | None = None,
    tables: Sequence[int] | None = None,
    jobs: int = 2,
    blocks: BlockFolder | None = None,
    on_progress: Progress = None,
    on_compile: Callable[[], None] | None = None,
) -> ScoreFile:
    """Return a score file with estimates of success under error for its best sets.

    The success of a set is the fraction of the samples in which all goals are done from it, as
    `tcs.evaluate` counts it. Which sets are estimated does not follow from their scores alone: of a
    pool of configurations all sets are compared in a few samples (`tcs.placement.robustness.pool`),
    by postures with their approaches. Successive halving evaluates the best of them on the same
    samples and gives more samples to the better half of those that may still be the best. Motions
    are judged for the last few. What motions lose is taken to be as much for the others as for the
    one of these that loses most, and none of the others is ranked before them.

    By the rules of the paper (`body_collisions` is `paper`), success is the mean of P_R under
    error. Of each size, one and two, the contenders are then the sets with P_R of at least 98 % of
    the greatest of that size, and those that succeed most often in a few separate samples if there
    are too many.

    Args:
        file: A score file, which is not modified.
        sets: Greatest number of pairs; a quarter as many of other sets.
        samples: Number of samples of the sets that remain to the end.
        seed: Seed of the samples; results are the same for any number of jobs.
        errors: Path of an error file, or errors by joint, in place of those of the environment.
        body_collisions: Collisions of the robot's body that count, one of `BODY_COLLISIONS`; by
            default all, in a file scored as the paper does `paper`.
        judge: Judges motions, as for `evaluate`; `tcs.robustify` passes it.
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
    sizes = 2 if trials.is_paper else file.nominal.sets.max_members
    done, total = 0, (2 + sizes * len(round_sizes(samples))) * len(chosen)

    def step() -> None:
        nonlocal done
        done += 1
        if on_progress is not None:
            on_progress(done, total)

    scored = list(file.tables)
    with trials.kept_in(blocks) as kept:
        for number in chosen:
            here = kept.at_table(number)
            drawn = {"samples": samples, "seed": seed, "jobs": jobs}
            success = success_of(here, sets=sets, judge=judge, step=step, **drawn)
            refined = here.scored.refined
            if refined is not None:
                refined = with_success(here, refined, judge=judge, **drawn)
            scored[number] = dataclasses.replace(here.scored, success=success, refined=refined)
    settings = {
        "program_version": version("tcs"),
        "samples": samples,
        "seed": seed,
        "sets": sets,
        "errors": trials.errors.to_json(),
        "environment_errors": errors is None,
        "body_collisions": trials.body_collisions,
        "done_by": done_by(trials, judge),
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
        for size in range(1, scored.sets.max_members + 1):
            members = success.most_robust(scored.sets, max_members=size)
            row = success.row_of(members)
            if row is None or len(members) < size:
                continue
            best.append(
                {
                    "members": [grid.configuration(h).to_json() for h in members],
                    "success": float(success.success[row]),
                    "ci95": [float(success.low[row]), float(success.high[row])],
                    "rooms_done": success.rooms_at(row),
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
        "rooms_done": success.rooms_at(row),
        "samples": int(success.samples[row]),
        "sets": len(refined.origin),
    }


def success_of(
    trials: Trials,
    *,
    sets: int = SETS,
    samples: int = 1024,
    seed: int = 0,
    judge: Judge | None = None,
    jobs: int = 2,
    step: Callable[[], None] = lambda: None,
) -> SuccessTable:
    """Return the estimates for the best sets of one table; see `robustify`.

    Args:
        trials: Trials of the table.
        sets: Greatest number of pairs; a quarter as many of other sets.
        samples: Number of samples of the sets that remain to the end.
        seed: Seed of the samples.
        judge: Judges motions; None for none.
        jobs: Number of threads.
        step: Called after the screening, after each round for each size, and at the end.
    """
    table = trials.scored.sets
    offsets = trials.errors.draw(samples, seed, stream=ESTIMATION_STREAM)

    def attempt(rows: IntArray, start: int, stop: int) -> NDArray[np.bool_]:
        part = {name: values[start:stop] for name, values in offsets.items()}
        return trials.reached(table.candidates[rows], part, jobs=jobs)

    contenders = _contending(trials, sets, seed, jobs)
    step()
    found: list[tuple[IntArray, HalvingEstimates]] = []
    for rows in contenders:
        estimates = successive_halving(
            rows, table.weights, samples, attempt, step, whole=not trials.is_paper
        )
        found.append((rows, estimates))
    estimated = _as_table(table, found)
    if judge is not None and done_by(trials, judge) == "motion" and len(estimated.low):
        every = PerturbedPoints(trials, offsets, jobs)
        estimated = _judged_by_motions(trials, every, estimated, judge, seed)
    step()
    return estimated


def _contending(trials: Trials, most: int, seed: int, jobs: int) -> list[IntArray]:
    """Return the sets for successive halving, of each size, as rows of candidates."""
    table, few = trials.scored.sets, -(-most // 4)
    if trials.is_paper:
        contending = (_singles(table), few), (_pairs(table), most)
        return [_screened(trials, pool, count, seed, jobs) for pool, count in contending]
    pool = pool_of(trials.scored, trials.grid)
    offsets = trials.errors.draw(SCREENED, seed, stream="screening")
    reached = trials.reached(table.candidates[pool], offsets, jobs=jobs)
    return list(best_sets(table, pool, reached, most).values())


def _judged_by_motions(
    trials: Trials, samples: PerturbedPoints, estimated: SuccessTable, judge: Judge, seed: int
) -> SuccessTable:
    """Return estimates of the success by approaches with those by motions of the best sets."""
    done = JudgedSets(samples, judge, seed)
    order = np.argsort(-estimated.low, kind="stable")
    single = order[estimated.sizes[order] == 1][:FINALISTS_OF_ONE]
    finalists = np.unique(np.concatenate([order[:FINALISTS], single])).tolist()

    def judged(row: int, count: int) -> NDArray[np.bool_]:
        return done.rooms(trials.points(estimated.set_at(row)), count)

    first, most = (min(count, samples.samples) for count in (FIRST_JUDGED, MOST_JUDGED))
    rooms = {row: judged(row, first) for row in finalists}
    for row in sorted(finalists, key=lambda row: -float(rooms[row].mean()))[:LAST]:
        rooms[row] = judged(row, most)
    approached = {row: float(estimated.success[row]) for row in finalists}
    kept = [rooms[row].mean() / one for row, one in approached.items() if one > LEAST_COMPARED]
    factor = min(1.0, *kept, 1.0)
    mean, low, high = (factor * part for part in (estimated.success, estimated.low, estimated.high))
    counts = estimated.samples.copy()
    for row in finalists:
        counts[row] = len(rooms[row])
        found = intervals_of(rooms[row][None].astype(np.float64))
        mean[row], low[row], high[row] = (float(part[0]) for part in found)
    # Of what no motion is known is never ranked before what is done by as few stops.
    judged_low = np.where(np.isin(np.arange(len(low)), finalists), low, -np.inf)
    for row in np.setdiff1d(np.arange(len(low)), finalists):
        below = float(judged_low[estimated.sizes <= estimated.sizes[row]].max())
        low[row] = min(low[row], max(below, 0.0) * (1.0 - FRACTION_TOLERANCE))
    return dataclasses.replace(
        estimated, success=mean, low=low, high=high, samples=counts, rooms_done=mean.copy()
    )


@dataclass(frozen=True, eq=False)
class JudgedSets:
    """In which samples all goals are done from sets, by motions; what was found once is kept."""

    samples: PerturbedPoints
    judge: Judge
    seed: int
    known: dict[bytes, NDArray[np.bool_]] = field(default_factory=dict)
    """Whether all goals are done in the first samples, by the points of a set."""
    parts: dict[tuple[int, int], PerturbedPoints] = field(default_factory=dict)
    """Ranges of the samples, with their environments."""

    def rooms(self, points: FloatArray, count: int) -> NDArray[np.bool_]:
        """Return in which of the first samples all goals are done, shape (count,).

        Args:
            points: The members, as values of the axes [m or rad], shape (m, axes).
            count: Number of samples.
        """
        before = self.known.get(points.tobytes(), np.zeros(0, dtype=np.bool_))
        if count > len(before):
            window = len(before), count
            if window not in self.parts:
                self.parts[window] = self.samples.only(np.arange(*window))
            part = self.parts[window]
            found = part.scores(points)
            complete = np.flatnonzero(np.logical_or.reduce(found.reached).all(axis=1))
            whole = np.zeros(part.samples, dtype=np.bool_)
            verdict = self.judge(part, points, found, complete, seed=self.seed)
            whole[complete] = verdict.all(axis=1)
            before = self.known[points.tobytes()] = np.concatenate([before, whole])
        return before[:count]


def with_success(
    trials: Trials,
    refined: RefinedTable,
    *,
    samples: int,
    seed: int,
    judge: Judge | None = None,
    jobs: int = 2,
) -> RefinedTable:
    """Return refined sets with their success in the samples that the surest sets of the grid get.

    Args:
        trials: Trials of the table that they were refined from.
        refined: The sets.
        samples: Number of samples.
        seed: Seed of the samples.
        judge: Judges motions; None for none. It judges some samples only.
        jobs: Number of threads.
    """
    offsets = trials.errors.draw(samples, seed, stream=ESTIMATION_STREAM)
    points = PerturbedPoints(trials, offsets, jobs)
    sets = [
        values[origin != NO_MEMBER]
        for values, origin in zip(refined.values, refined.origin, strict=True)
    ]
    if judge is not None and done_by(trials, judge) == "motion":
        samples = min(samples, REFINED_JUDGED)
        of_sets = JudgedSets(points, judge, seed)
        whole = fractions = np.array([of_sets.rooms(values, samples) for values in sets])
    else:
        found = points.reached(np.concatenate(sets))
        ends = np.cumsum([len(values) for values in sets])
        reached = np.array([np.logical_or.reduce(part) for part in np.split(found, ends[:-1])])
        whole = np.asarray(reached.all(axis=2))
        fractions = tc_reachability(reached, refined.weights) if trials.is_paper else whole
    mean, low, high = intervals_of(fractions.astype(np.float64))
    success = Estimates(
        success=mean,
        low=low,
        high=high,
        samples=np.full(len(mean), samples, dtype=np.int32),
        rooms_done=whole.mean(axis=1),
    )
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
        parts = (estimates.mean, estimates.low, estimates.high, estimates.rooms, estimates.samples)
        columns.append([part[order] for part in parts])
    joined = (np.concatenate(parts) for parts in zip(*columns, strict=True))
    mean, low, high, rooms, samples = joined
    return SuccessTable(
        members=np.concatenate(members),
        success=mean,
        low=low,
        high=high,
        samples=samples.astype(np.int32),
        rooms_done=rooms,
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
    rooms: FloatArray
    """Fraction of its samples in which all goals are reached."""
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
    *,
    whole: bool = False,
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
        whole: Whether a sample counts only if all goals are reached in it, not by their weights.
    """
    # Imported here because it takes a second.
    from scipy.special import ndtri

    sizes = round_sizes(samples)
    count = len(sets)
    # float32 keeps seven digits of the fraction of goals reached.
    fractions = np.zeros((count, samples), dtype=np.float32)
    complete = np.zeros((count, samples), dtype=np.bool_)
    counts = np.zeros(count, dtype=np.int64)
    alive = np.arange(count)
    bound = float(ndtri(1.0 - (1.0 - CONFIDENCE) / max(1, count * len(sizes))))
    done = 0
    for size in sizes:
        if alive.size:
            _fill(fractions, complete, sets, alive, weights, attempt, done, size)
            if whole:
                fractions[alive, done:size] = complete[alive, done:size]
            counts[alive] = size
            alive = _best_half(alive, fractions[alive, :size], bound)
        done = size
        on_round()
    mean, low, high, rooms = np.zeros(count), np.zeros(count), np.ones(count), np.zeros(count)
    for size in sizes:
        rows = np.flatnonzero(counts == size)
        if rows.size:
            mean[rows], low[rows], high[rows] = intervals_of(fractions[rows, :size])
            rooms[rows] = complete[rows, :size].mean(axis=1)
    return HalvingEstimates(mean, low, high, rooms, counts, alive)


def _fill(
    fractions: NDArray[np.float32],
    complete: NDArray[np.bool_],
    sets: IntArray,
    rows: IntArray,
    weights: FloatArray,
    attempt: Attempt,
    start: int,
    stop: int,
) -> None:
    """Compute the fractions of some sets in samples start <= s < stop, and whether they are 1."""
    members, number = np.unique(sets[rows], return_inverse=True)
    number = number.reshape(rows.size, -1)
    found = attempt(members, start, stop)
    for first in range(0, rows.size, CHUNK):
        part = slice(first, first + CHUNK)
        reached = found[number[part, 0]]
        for column in number[part, 1:].T:
            reached = reached | found[column]
        fractions[rows[part], start:stop] = tc_reachability(reached, weights)
        complete[rows[part], start:stop] = reached.all(axis=2)


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
