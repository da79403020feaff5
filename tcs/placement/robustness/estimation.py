"""Success under error as a criterion: estimate it for the sets that are worth choosing."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from importlib.metadata import version
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import TcsError
from tcs.model.grid import Grid
from tcs.placement.robustness.error_model import check_draws
from tcs.placement.robustness.pairs import AS_GOOD, Pairs, kept_pairs
from tcs.placement.robustness.successive_halving import Estimates, round_sizes, successive_halving
from tcs.placement.robustness.trials import Errors, Progress, Trials
from tcs.placement.store import ScoreFile, state_to_json
from tcs.placement.tables import SetTable, SuccessTable, tc_reachability
from tcs.placement.tables.rules import SHARE_TOLERANCE
from tcs.placement.tables.success import NO_MEMBER

IntArray = NDArray[np.int64]

SETS = 2000
"""Sets of two that get an estimate; of one, a quarter as many."""
FEW = 200
"""Where fewer sets than this reach as much as the best, the next best join them."""
SCREENED = 32
"""Samples by which the sets to race are picked, where there are more; the race does not use
them again, so luck in the picking does not flatter its estimates."""
MOST_SCREENED = 800
"""Configurations that are tried in those samples, the ones with the best scores."""


def robustify(
    file: ScoreFile,
    *,
    sets: int = SETS,
    samples: int = 1024,
    seed: int = 0,
    errors: Errors = None,
    check_base: bool = False,
    tables: Sequence[int] | None = None,
    jobs: int = 2,
    on_progress: Progress = None,
    on_compile: Callable[[], None] | None = None,
) -> ScoreFile:
    """Return a score file with estimates of success under error for its best sets.

    Of each size, one and two, those sets count that reach at least 98 % of what the best of them
    does. Where they are too many, those that do best in a few samples of their own are taken, and
    among them always the sets with the best scores. They race: all meet the same samples, and the
    better half of those that may still be the best meets more of them (see `race`).

    Args:
        file: A score file; it stays as it is.
        sets: How many sets of two at most; of one, a quarter as many.
        samples: Samples for the sets that stay to the end.
        seed: Seed of the samples; results are the same for any number of jobs.
        errors: Path of an error file, or errors by joint, in place of the environment's own.
        check_base: Whether the base must be free in every sample.
        tables: Numbers of the tables; all by default. The others keep what estimates they have.
        jobs: Number of threads.
        on_progress: Called with rounds done and in all.
        on_compile: Called first, when the kernel has to be compiled.

    Raises:
        StoreMismatchError: If the models are not those the file was made from.
        DataFileError: If the error file cannot be used.
        UnknownNameError: If a joint has no such name.
        SelectionError: If there is no such table.
        TcsError: If a number is out of range.
    """
    check_draws(samples, seed)
    if not 1 <= sets <= 100_000:
        raise TcsError(f"sets is {sets}; must be 1 to 100,000.")
    trials = Trials.of(file, errors=errors, check_base=check_base, on_compile=on_compile)
    chosen = range(len(file.tables)) if tables is None else tables
    rounds = 1 + len(round_sizes(samples))
    done, total = 0, 2 * rounds * len(chosen)

    def step() -> None:
        nonlocal done
        done += 1
        if on_progress is not None:
            on_progress(done, total)

    scored = list(file.tables)
    for number in chosen:
        here = trials.at_table(number)
        success = success_of(here, sets=sets, samples=samples, seed=seed, jobs=jobs, step=step)
        scored[number] = dataclasses.replace(here.scored, success=success)
    made = {
        "program_version": version("tcs"),
        "samples": samples,
        "seed": seed,
        "sets": sets,
        "errors": trials.errors.to_json(),
        "errors_of_environment": errors is None,
        "check_base": check_base,
    }
    # Each table has a record of its own: others may have been estimated at another time.
    records = list(file.metadata.get("robustness", [None] * len(scored)))
    for number in chosen:
        records[number] = made
    metadata = {**file.metadata, "robustness": records}
    return dataclasses.replace(file, metadata=metadata, tables=tuple(scored))


def success_summary(file: ScoreFile) -> dict[str, Any]:
    """Return what was estimated, as plain containers: what `tcs robustify --json` prints."""
    grid = Grid.from_dict(file.grid)
    tables = []
    records = file.metadata.get("robustness", [None] * len(file.tables))
    for scored, state, made in zip(file.tables, file.observed_states, records, strict=True):
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
        tables.append({"observed": observed, "best": best, "made": made})
    return {"tables": tables}


def success_of(
    trials: Trials,
    *,
    sets: int = SETS,
    samples: int = 1024,
    seed: int = 0,
    jobs: int = 2,
    step: Callable[[], None] = lambda: None,
) -> SuccessTable:
    """Return estimates for the best sets of one table; see `robustify`.

    Args:
        trials: Trials of the table.
        sets: How many sets of two at most; of one, a quarter as many.
        samples: Samples for the sets that stay to the end.
        seed: Seed of the samples.
        jobs: Number of threads.
        step: Called once for the screening and once for each round, of each size.
    """
    table = trials.scored.sets
    offsets = trials.errors.draw(samples, seed, stream="race")

    def attempt(rows: IntArray, start: int, stop: int) -> NDArray[np.bool_]:
        some = {name: values[start:stop] for name, values in offsets.items()}
        return trials.reached(table.candidates[rows], some, jobs=jobs)

    found: list[tuple[IntArray, Estimates]] = []
    for pool, most in ((_singles(table), -(-sets // 4)), (_pairs(table), sets)):
        raced = _screened(trials, pool, most, seed, jobs)
        step()
        found.append((raced, successive_halving(raced, table.weights, samples, attempt, step)))
    return _as_table(table, found)


def _as_table(table: SetTable, found: list[tuple[IntArray, Estimates]]) -> SuccessTable:
    """Return the estimates of sets of several sizes, in order."""
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
    mean, low, high, had = (np.concatenate(parts) for parts in zip(*columns, strict=True))
    return SuccessTable(
        members=np.concatenate(members),
        success=mean,
        low=low,
        high=high,
        samples=had.astype(np.int32),
    )


def _singles(table: SetTable) -> IntArray:
    """Return the singles in question, best scores first, shape (K, 1)."""
    reachability = table.single_reachability
    rows = np.arange(len(table.candidates))
    return _in_question(rows[:, None], reachability, table.single_manipulability)


def _pairs(table: SetTable) -> IntArray:
    """Return the kept pairs in question, best scores first, shape (K, 2)."""
    greatest = float(table.pair_reachability.max(initial=0.0))
    least = AS_GOOD * greatest - SHARE_TOLERANCE
    pairs = Pairs.joined(kept_pairs(table, least_reachability=least))
    if pairs.first.size < FEW:
        pairs = Pairs.joined(kept_pairs(table))
    rows = np.stack([pairs.first, pairs.second], axis=1)
    return _in_question(rows, pairs.reachability, pairs.manipulability)


def _in_question(
    rows: IntArray, reachability: NDArray[np.float64], manipulability: NDArray[np.float64]
) -> IntArray:
    """Return the sets that reach as much as the best, or the FEW best; best scores first."""
    order = np.argsort(-(reachability + manipulability), kind="stable")
    greatest = float(reachability.max(initial=0.0))
    as_good = reachability[order] >= AS_GOOD * greatest - SHARE_TOLERANCE
    as_good[: max(0, FEW)] |= np.count_nonzero(as_good) < FEW
    return np.asarray(rows[order][as_good])


def _screened(trials: Trials, pool: IntArray, most: int, seed: int, jobs: int) -> IntArray:
    """Return the sets to race, at most so many."""
    if len(pool) <= most:
        return pool
    members, first = np.unique(pool, return_index=True)
    # The earlier a candidate comes up, the better the best set that it is in.
    early = members[np.argsort(first, kind="stable")[:MOST_SCREENED]]
    able = pool[np.isin(pool, early).all(axis=1)]
    offsets = trials.errors.draw(SCREENED, seed, stream="screening")
    tried = np.unique(able)
    found = trials.reached(trials.scored.sets.candidates[tried], offsets, jobs=jobs)
    number = np.searchsorted(tried, able)
    mean = np.empty(len(able))
    for start in range(0, len(able), 4096):
        part = number[start : start + 4096]
        reached = np.logical_or.reduce([found[column] for column in part.T], axis=0)
        mean[start : start + 4096] = tc_reachability(reached, trials.weights).mean(axis=1)
    # A tenth of the places is for the best scores, whatever their luck in these samples.
    mean[: max(1, most // 10)] = np.inf
    return np.asarray(able[np.sort(np.argsort(-mean, kind="stable")[:most])])
