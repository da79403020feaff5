"""Examination of a score file: which goals can be done from which configurations.

A goal can be done from a configuration if a motion leads from rest to its approach, straight in,
straight out and back to rest. The goals that can be done one by one can be done on one tour, as
every motion between two of them may lead past the rest posture.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from typing import Any, NamedTuple

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from tcs.errors import TcsError
from tcs.files.blocks import BlockFolder, opened_if
from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import announced
from tcs.kernel.motion.connect import connect
from tcs.kernel.motion.search_trees import Trees, new_trees, random_state
from tcs.motion.approach import Access, accesses, first_accesses
from tcs.motion.kept_outcomes import KeptOutcomes, Outcomes, outcomes_key, table_of
from tcs.motion.stops import BodyPair, Stop, StopGrid
from tcs.placement.scoring.rebuild import rebuild_scenes
from tcs.placement.store import MotionFile, ScoreFile
from tcs.placement.tables import MotionOutcome, MotionTable, SetTable

FIRST_SAMPLES = 24
"""Number of angles of the free joint at which postures are solved first: most goals that can be
approached at all can be so from one of these."""
FIRST_ACCESSES = 3
"""Number of postures with which paths are tried before all postures are searched."""
FIRST_ITERATIONS = 200
"""Greatest number of random postures that the planner grows towards with each of these."""
ITERATIONS = 5000
"""The same with all postures."""
SLICE = 16
"""Number of configurations that a thread examines at a time."""


def examine(
    file: ScoreFile,
    *,
    within: float | None = 0.05,
    most: int | None = None,
    sample: int | None = None,
    table: int | None = None,
    seed: int = 0,
    jobs: int = 2,
    blocks: BlockFolder | None = None,
    on_progress: Callable[[int, int], None] | None = None,
    on_compile: Callable[[], None] | None = None,
) -> MotionFile:
    """Return which goals can be done from the candidates of a score file.

    Args:
        file: A score file.
        within: Examine the candidates that are in a set whose P_R + P_M is at most this fraction
            below the best one; None for all candidates.
        most: Greatest number of candidates, those of the best sets first; None for no bound.
        sample: Examine this many of these candidates, drawn at random; None for all.
        table: Number of the table, by default the nominal one.
        seed: Seed of the planner.
        jobs: Number of threads; the outcomes do not depend on it.
        blocks: Folder in which finished blocks are kept, so that the same call continues after an
            interrupt; None to keep none.
        on_progress: Called with the number of examined configurations and their total.
        on_compile: Called before the planner compiles, if it has to.

    Raises:
        StoreMismatchError: If the models differ from those the file was made from.
        RobotError: If a velocity limit of the arm is unknown.
        OutputError: If blocks cannot be kept in their folder, or another process is at work there.
        TcsError: If `within`, `most`, `sample` or `jobs` is out of range.
    """
    if jobs < 1:
        raise TcsError(f"jobs is {jobs}; must be 1 or more threads.")
    begun, processor = time.perf_counter(), time.process_time()
    number = file.nominal_index if table is None else table
    built = rebuild_scenes(file)
    sets = file.tables[number].sets
    rows = drawn(worth_examining(sets, within, most), sample, seed)
    hands = [
        _Hand(StopGrid.of(job, scene, job.scored_grid, lowered), goals)
        for (job, scene, lowered), goals in zip(built, file.goals_of_hands, strict=True)
    ]
    with opened_if(blocks, lambda: outcomes_key([h.stops for h in hands], seed)) as opened:
        kept = None if opened is None else KeptOutcomes(opened, number)
        with announced(on_compile):
            outcomes = _examined(hands, sets, rows, number, seed, jobs, kept, on_progress)
    examined = table_of(sets.candidates[rows], outcomes, sets.weights.size)
    tables: list[MotionTable | None] = [None] * len(file.tables)
    tables[number] = examined
    metadata = {
        "program_version": version("tcs"),
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "scene_digest": file.metadata["scene_digest"],
        "seed": seed,
        "within": within,
        "most": most,
        "sample": sample,
        "seconds": time.perf_counter() - begun,
        "processor_seconds": time.process_time() - processor,
    }
    return MotionFile(metadata=metadata, tables=tuple(tables))


def examination(file: ScoreFile, motions: MotionFile, table: int) -> dict[str, Any]:
    """Return what was found for a table as plain containers, as `tcs motions --json` prints it.

    Args:
        file: The score file.
        motions: Its motions.
        table: Number of an examined table.

    Raises:
        TcsError: If the table was not examined.
    """
    examined = motions.tables[table]
    if examined is None:
        raise TcsError(f"No motions were planned for table {table}.")
    sets = file.tables[table].sets
    reached = sets.reached[np.searchsorted(sets.candidates, examined.configurations)]
    counts = examined.counts(reached)
    done, pairs = counts.pop("done"), int(np.count_nonzero(reached))
    return {
        "within": motions.metadata["within"],
        "configurations": len(reached),
        "candidates": len(sets.candidates),
        "pairs": pairs,
        "done": done,
        "not_done": counts,
        "fraction_not_done": round(1.0 - done / pairs, 6) if pairs else 0.0,
        "goals": [
            {"goal": goal, "pairs": int(of_goal.sum()), "done": int(able.sum())}
            for goal, (of_goal, able) in enumerate(zip(reached.T, examined.done.T, strict=True))
        ],
        "results": [
            _result(examined, row, reached[row]) for row in range(len(examined.configurations))
        ],
        "seed": motions.metadata["seed"],
        **{key: motions.metadata[key] for key in ("seconds", "processor_seconds")},
    }


def _result(examined: MotionTable, row: int, reached: NDArray[np.bool_]) -> dict[str, Any]:
    """Return what can be done from one configuration as plain containers."""
    not_done = []
    for goal in np.flatnonzero(reached & ~examined.done[row]):
        pair = int(examined.pair[row, goal])
        reason = MotionOutcome(int(examined.outcome[row, goal])).name.lower()
        names = None if pair < 0 else list(examined.pair_names[pair])
        not_done.append({"goal": int(goal), "reason": reason, "pair": names})
    return {
        "configuration": int(examined.configurations[row]),
        "done": np.flatnonzero(examined.done[row]).tolist(),
        "not_done": not_done,
    }


def worth_examining(sets: SetTable, within: float | None, most: int | None) -> NDArray[np.intp]:
    """Return the rows of the candidates that are in one of the best sets, ascending, shape (n,).

    Args:
        sets: The sets.
        within: Greatest fraction of the best P_R + P_M by which that of a candidate's best set may
            be less; None for all candidates.
        most: Greatest number of candidates, those of the best sets first; None for no bound.

    Raises:
        TcsError: If the fraction is not in [0, 1], or the number is less than 1.
    """
    if within is not None and not 0.0 <= within <= 1.0:
        raise TcsError(f"within is {within:g}; must be a fraction from 0 to 1.")
    if most is not None and most < 1:
        raise TcsError(f"most is {most}; must be 1 or more configurations.")
    best = np.maximum(
        sets.single_reachability + sets.single_manipulability, sets.pairs.member_total
    )
    if sets.triples is not None:
        best = np.maximum(best, sets.triples.member_total)
    order = np.argsort(-best, kind="stable")
    if within is not None and len(order):
        order = order[best[order] >= (1.0 - within) * best[order[0]]]
    return np.sort(order[:most])


def drawn(rows: NDArray[np.intp], sample: int | None, seed: int) -> NDArray[np.intp]:
    """Return some rows drawn at random, ascending; all of them if there are not more.

    Args:
        rows: Rows, ascending.
        sample: How many to draw; None for all.
        seed: Seed of the draw.

    Raises:
        TcsError: If the number is less than 1.

    >>> len(drawn(np.arange(100), 7, seed=0))
    7
    """
    if sample is not None and sample < 1:
        raise TcsError(f"sample is {sample}; must be 1 or more configurations.")
    if sample is None or sample >= len(rows):
        return rows
    return np.sort(np.random.default_rng(seed).choice(rows, sample, replace=False))


class _Hand(NamedTuple):
    """The robot with one hand."""

    stops: StopGrid
    goals: tuple[int, ...]
    """Numbers of the goals that the hand may serve."""


def _examined(
    hands: Sequence[_Hand],
    sets: SetTable,
    rows: NDArray[np.intp],
    table: int,
    seed: int,
    jobs: int,
    kept: KeptOutcomes | None,
    on_progress: Callable[[int, int], None] | None,
) -> list[Outcomes]:
    """Return the outcomes at some candidates of a table, kept ones and new ones."""
    slices = [rows[start : start + SLICE] for start in range(0, len(rows), SLICE)]
    found: dict[int, list[Outcomes]] = {}
    done = 0

    def add(number: int, outcomes: list[Outcomes]) -> None:
        nonlocal done
        found[number] = outcomes
        done += len(outcomes)
        if on_progress is not None:
            on_progress(done, len(rows))

    for number, slice_ in enumerate(slices):
        if kept is None:
            break
        before = kept.load(sets.candidates[slice_], sets.served[slice_])
        if before is not None:
            add(number, before)
    missing = [number for number in range(len(slices)) if number not in found]
    work = (delayed(_examine_slice)(hands, sets, slices[number], table, seed) for number in missing)
    parallel = Parallel(jobs, prefer="threads", return_as="generator")
    for number, outcomes in zip(missing, parallel(work), strict=True):
        slice_ = slices[number]
        if kept is not None:
            kept.save(sets.candidates[slice_], sets.served[slice_], outcomes)
        add(number, outcomes)
    return list(itertools.chain.from_iterable(found[number] for number in range(len(slices))))


def _examine_slice(
    hands: Sequence[_Hand], sets: SetTable, rows: NDArray[np.intp], table: int, seed: int
) -> list[Outcomes]:
    """Examine some candidates of a table, given by its number, each goal by the hand that serves.

    The other arms are parked meanwhile.
    """
    trees = new_trees(seed)
    found = []
    for row in rows:
        outcomes: Outcomes = [(MotionOutcome.UNREACHED, None)] * sets.weights.size
        for number, hand in enumerate(hands):
            served = sets.served[row, list(hand.goals)] == number + 1
            if not served.any():
                continue
            configuration = table * hand.stops.job.grid.size + int(sets.candidates[row])
            of_hand = _examine_stop(hand.stops, configuration, served, trees, seed)
            for place in np.flatnonzero(served):
                outcomes[hand.goals[place]] = of_hand[place]
        found.append(outcomes)
    return found


def _examine_stop(
    stops: StopGrid, configuration: int, reached: NDArray[np.bool_], trees: Trees, seed: int
) -> Outcomes:
    """Return the outcome at each goal from one configuration.

    Its body, torso and other arm are free of contact, as scoring checked.
    """
    trees.random[:] = random_state(seed)
    stop = stops.stop(configuration, trees)
    goals = [int(goal) for goal in np.flatnonzero(reached)]
    outcomes: Outcomes = [(MotionOutcome.UNREACHED, None)] * len(reached)
    blocked = stop.contact_at(stop.rest)
    if blocked is not None:
        for goal in goals:
            outcomes[goal] = MotionOutcome.REST_BLOCKED, blocked
        return outcomes
    reachable = ReachableGoals(stop)
    left = [goal for goal in goals if not reachable.has_quickly(goal)]
    for goal in goals:
        outcomes[goal] = MotionOutcome.DONE, None
    for goal in left:
        outcomes[goal] = reachable.outcome(goal)
    return outcomes


class ReachableGoals:
    """The postures of one stop to which paths from rest were found, so that goals can be done.

    A path leads back as well, so any of them may begin a path to another goal.
    """

    def __init__(self, stop: Stop) -> None:
        """Take a stop whose arm touches nothing at rest."""
        self.stop = stop
        self.postures = [stop.rest]

    def has_quickly(self, goal: int) -> bool:
        """Return whether a goal can be done with one of the first postures found."""
        found = first_accesses(self.stop, goal, FIRST_SAMPLES)
        return any(
            self._includes([access], FIRST_ITERATIONS)
            for access in itertools.islice(found, FIRST_ACCESSES)
        )

    def outcome(self, goal: int) -> tuple[MotionOutcome, BodyPair | None]:
        """Return whether a goal can be done with any posture; if not, why."""
        found = accesses(self.stop, goal)
        if not found.found:
            return MotionOutcome[found.reason.upper()], found.pair
        self.stop.forget_contacts()
        if self._includes(found.found, ITERATIONS):
            return MotionOutcome.DONE, None
        return MotionOutcome.NO_PATH, self.stop.most_frequent_contact()

    def _includes(self, found: Sequence[Access], iterations: int) -> bool:
        """Return whether a path leads to one of several approaches, and back from its retreat."""
        left = list(found)
        while left:
            number = self._connected([access.begin for access in left], iterations)
            if number is None:
                return False
            access = left.pop(number)
            self.postures.append(access.begin)
            # A retreat along the approach ends where that began.
            if np.array_equal(access.begin, access.end):
                return True
            if self._connected([access.end], iterations) is not None:
                self.postures.append(access.end)
                return True
        return False

    def _connected(self, ends: Sequence[FloatArray], iterations: int) -> int | None:
        """Return the number of the posture to which a path was found, None if there is none."""
        stop, starts = self.stop, np.array(self.postures)
        count = connect(stop.motion, stop.work, stop.trees, starts, np.array(ends), iterations, 0)
        return int(stop.trees.ends[1]) if count else None
