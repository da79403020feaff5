"""Refinement of a score file: its best sets, moved to the best place between the grid points."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Sequence
from functools import partial
from importlib.metadata import version
from typing import Any

import numpy as np

from tcs.errors import SelectionError, TcsError, UnknownNameError
from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.model.random_streams import check_draws, named_generator
from tcs.placement.refinement.local_search import (
    LocalSearch,
    Samples,
    ScoreObjective,
    Space,
    Walk,
    without_idle_members,
)
from tcs.placement.refinement.points import PointScorer
from tcs.placement.refinement.success_under_error import (
    HARDEST,
    DisplacedBases,
    RememberedSamples,
    SuccessFloor,
    at_surest,
    settled,
    successes,
)
from tcs.placement.refinement.surest import (
    StagedSamples,
    SurestSearch,
    surest_pairs,
    surest_triples,
)
from tcs.placement.robustness import PerturbedPoints, Trials, with_success
from tcs.placement.robustness.body_collisions import check_body_collisions, default_collisions
from tcs.placement.robustness.evaluation import Judge
from tcs.placement.selection import Top, UtilityWeights, select
from tcs.placement.selection.choice import SelectionTables
from tcs.placement.store import ScoreFile
from tcs.placement.tables import RefinedTable, SetTable, tc_reachability
from tcs.placement.tables.success import NO_MEMBER

OBJECTIVES = ("score", "success")
"""What a refinement maximises: P_R + P_M, or the success under the errors of the environment."""
MOST_STARTS = 50
"""Greatest number of sets to start from."""
MOST_ROUNDS = 1000
"""Greatest number of rounds."""
APART = 0.3
"""Distance of base positions [m] at which sets count as different basins."""
SINGLES = 3
"""Most single configurations to start from."""
STREAM = "refinement"
"""Name of the random stream of the search."""
SAMPLES_STREAM = "refinement samples"
"""Name of the random stream of the samples of the success."""
SAMPLES = 64
"""Samples of the success that a set must keep."""
SURE_SAMPLES = 2000
"""Samples of an objective that is a success: fewer are soon satisfied by sets next to a loss."""
FRESH_SAMPLES = 500
"""Samples on which the refined set is judged; as many as the objective has if those are more."""
CHECK_STREAM = "refinement check"
"""Name of their random stream."""
CHOICE_STREAM = "refinement choice"
"""Name of the random stream of as many samples, in which the surest place of a search is chosen."""
_SCORE_ONLY = UtilityWeights(travel=0.0, places=0.0, environment=0.0)


def refine(
    file: ScoreFile,
    *,
    objective: str = "score",
    starts: int = 6,
    rounds: int = 40,
    samples: int | None = None,
    keep_success: bool = True,
    body_collisions: str | None = None,
    judge: Judge | None = None,
    seed: int = 0,
    table: int | None = None,
    jobs: int = 2,
    on_progress: Callable[[int, int], None] | None = None,
    on_compile: Callable[[], None] | None = None,
) -> ScoreFile:
    """Return a score file with its best sets refined between the grid points.

    The sets with the greatest P_R + P_M that differ by their base positions or their environment
    start a local search over all axes of the grid, all members of a set jointly: configurations
    around the members are scored by the kernel, the best combination is taken, and where none is
    better the cells are halved. The range of an axis is that of the grid.

    Args:
        file: A score file, which is not modified.
        objective: "score", P_R + P_M; or "success", the mean of P_R under the errors of the
            environment. The samples are the same for all configurations. Where the environment
            has no errors, they displace the base by up to 5 cm and 5 deg.
        starts: Number of sets to start from; up to three single configurations come on top.
        rounds: Greatest number of rounds of the search.
        samples: Number of samples of the success; by default 2,000 for the objective "success",
            64 for the other.
        keep_success: Whether, with the objective "score", a set must be at least as sure under
            the errors of the environment (of the base, if it has none) as the best set of the
            grid, in the hardest of the samples and in others that judge the result.
        body_collisions: Collisions of the robot's body that count under the errors of the
            environment, one of `BODY_COLLISIONS`; by default all, in a file scored as the paper
            does `paper`. Without errors all count, as when scoring.
        judge: Judges motions where the success of the file's sets was estimated by them, as for
            `tcs.placement.robustness.robustify`; `tcs.refine` passes it.
        seed: Seed of the search and of the samples; the result is the same for any number of
            jobs.
        table: Number of the table; by default the nominal one. The others keep what they have.
        jobs: Number of threads.
        on_progress: Called with the number of rounds done and their greatest number.
        on_compile: Called first if the kernel has to be compiled.

    Returns:
        The file with a table of refined sets beside the sets of the grid, the best first.

    Raises:
        StoreMismatchError: If the file was made from other models.
        UnknownNameError: If there is no such objective or choice of collisions.
        SelectionError: If no configuration reaches a goal, or there is no such table.
        TcsError: If a number is out of range.
    """
    by_success = objective == "success"
    if samples is None:
        samples = SURE_SAMPLES if by_success else SAMPLES
    check_draws(samples, seed)
    if objective not in OBJECTIVES:
        raise UnknownNameError("objective", objective, OBJECTIVES, where="refine")
    if body_collisions is None:
        body_collisions = default_collisions(file.metadata)
    check_body_collisions(body_collisions)
    if not 1 <= starts <= MOST_STARTS:
        raise TcsError(f"starts is {starts}; must be 1 to {MOST_STARTS}.")
    if not 1 <= rounds <= MOST_ROUNDS:
        raise TcsError(f"rounds is {rounds}; must be 1 to {MOST_ROUNDS:,}.")
    number = file.nominal_index if table is None else table
    if not 0 <= number < len(file.tables):
        raise SelectionError(
            f"There is no table {table}; the file has {len(file.tables)}, counted from 0."
        )
    begun = time.perf_counter()
    scorer = PointScorer.of(file, number, jobs)
    scorer.warm_up(on_compile)
    sets = file.tables[number].sets
    trials = Trials.built(file, number, scorer.built, body_collisions=body_collisions)
    draw = _samples(trials, scorer, seed)
    drawn = draw(samples, SAMPLES_STREAM)
    # Rails run along x of the mount; beside them there is nothing to bolt a robot to.
    rails = ("base_y",) if file.environment.get("mount") else ()
    space = Space.of(file.configurations, sets, fixed=rails)
    rng = named_generator(seed, STREAM)
    if by_success:
        staged = StagedSamples.of(drawn, sets.weights)
        search: LocalSearch = SurestSearch.of(scorer, space, staged, rng)
        pairs = surest_pairs(staged, search, sets, starts, APART)
        triples = surest_triples(staged, search, sets, pairs)
        starts_at = list(dict.fromkeys([*starting_sets(file, number, 1), *pairs, *triples]))
    else:
        search = LocalSearch(scorer, space, ScoreObjective(sets.weights), rng)
        starts_at = starting_sets(file, number, starts)
    keep = keep_success and not by_success
    if keep:
        hardest = _floor(search, drawn.hardest(-(-samples // HARDEST)), sets)
        search = dataclasses.replace(search, keeps=hardest.keeps)
    walks, scored = search.run(starts_at, rounds, on_progress or (lambda done, total: None))
    judges = max(FRESH_SAMPLES, samples) if by_success else FRESH_SAMPLES
    judging = draw(judges, CHECK_STREAM)
    fresh = RememberedSamples(judging)
    needed = None
    if keep:
        screen, floor = (
            _floor(search, of, sets) for of in (fresh.hardest(judges // HARDEST), fresh)
        )
        walks = settled(walks, screen, floor)
        needed = floor.keeps_of_sets
    elif by_success:
        choosing = RememberedSamples(draw(judges, CHOICE_STREAM))
        walks = at_surest(walks, choosing, sets.weights)
        needed = partial(_as_sure_as, walks[0].present.values, choosing, sets)
    first = without_idle_members(walks[0], search.objective, needed)
    walks = [first, *walks[1:]]
    made = as_table(walks, sets.weights, has_hands=bool(file.hands))
    refined = with_estimates(file, number, scorer, made, judge)
    success = _success(search, walks[0], fresh, sets) if keep or by_success else None
    settings = {
        "program_version": version("tcs"),
        "objective": objective,
        "starts": starts,
        "rounds": rounds,
        "samples": None if success is None else samples,
        "keep_success": keep,
        "displaced": success is not None and isinstance(judging, DisplacedBases),
        "body_collisions": body_collisions,
        "seed": seed,
        "scored": scored,
        "success": success,
        "seconds": time.perf_counter() - begun,
    }
    return with_refined(file, number, refined, settings)


def starting_sets(file: ScoreFile, table: int, count: int) -> list[tuple[int, ...]]:
    """Return the best sets of a table that differ, and the best singles, by flat grid indices.

    Raises:
        SelectionError: If no configuration reaches a goal.
    """
    sets = file.tables[table].sets
    if not sets.best:
        raise SelectionError(
            "Nothing to refine: no initial configuration reaches a goal. See the reasons with "
            "`tcs explain`."
        )
    tables = SelectionTables.of(file, table)
    here = tables.grid.configuration(sets.best[0])

    def best(count: int, max_members: int) -> list[tuple[int, ...]]:
        top = Top(count=count, min_apart=APART)
        choice = select(
            tables, here, weights=_SCORE_ONLY, top=top, max_members=max_members, refined=False
        )
        return [choice.indices, *(other.indices for other in choice.alternatives)]

    found = [*dict.fromkeys([sets.best, *best(count, sets.max_members)])][:count]
    found += [sets.best_single, *best(min(count, SINGLES), 1)]
    robust = file.tables[table].success
    if robust is not None:
        found.append(robust.most_robust(sets))
    return [start for start in dict.fromkeys(found) if start]


def _samples(trials: Trials, scorer: PointScorer, seed: int) -> Callable[[int, str], Samples]:
    """Return a function that draws samples, given their number and the name of the stream.

    They are errors of the environment; displacements of the base where no joint of the environment
    has an error.
    """

    def drawn(samples: int, stream: str) -> Samples:
        if not trials.errors.errors:
            return DisplacedBases.drawn(scorer, samples, named_generator(seed, stream))
        offsets = trials.errors.draw(samples, seed, stream=stream)
        return PerturbedPoints(trials, offsets, scorer.jobs)

    return drawn


def _floor(search: LocalSearch, samples: Samples, sets: SetTable) -> SuccessFloor:
    """Return the success of the best sets of the grid in some samples."""
    single, best = search.points_of(sets.best_single), search.points_of(sets.best)
    return SuccessFloor.of(samples, sets.weights, single, best)


def _as_sure_as(
    least: FloatArray, samples: Samples, sets: SetTable, others: Sequence[FloatArray]
) -> BoolArray:
    """Return which sets have at least the success of one set in some samples, shape (n,)."""
    first, *found = successes(samples, sets.weights, [least, *others])
    return np.asarray(np.array(found) >= first)


def _success(
    search: LocalSearch, walk: Walk, fresh: Samples, sets: SetTable
) -> dict[str, float | int]:
    """Return the success of the best set of the grid and of a refined set in fresh samples."""
    of_sets = []
    for points in (search.points_of(sets.best), walk.present.values):
        reached = np.logical_or.reduce(fresh.reached(points), axis=0)
        of_sets.append(float(tc_reachability(reached, sets.weights).mean()))
    return {"before": of_sets[0], "after": of_sets[1], "samples": fresh.samples}


KEY = "refinement"
"""Entry of the metadata: for each table, None or the settings and figures of its refinement."""


def as_table(
    walks: Sequence[Walk], weights: np.ndarray[Any, Any], *, has_hands: bool
) -> RefinedTable:
    """Return refined sets as one table, in their order.

    Args:
        walks: The refined sets.
        weights: Weights of the goals, sum 1, shape (G,).
        has_hands: Whether the file is of several hands.
    """
    width = max(walk.members for walk in walks)

    def filled(arrays: Sequence[np.ndarray[Any, Any]], fill: float) -> np.ndarray[Any, Any]:
        first = arrays[0]
        out = np.full((len(arrays), width, *first.shape[1:]), fill, dtype=first.dtype)
        for row, array in zip(out, arrays, strict=True):
            row[: len(array)] = array
        return out

    return RefinedTable(
        origin=filled([np.array(walk.origin, dtype=np.int32) for walk in walks], NO_MEMBER),
        values=filled([walk.present.values for walk in walks], 0.0),
        reached=filled([walk.present.reached for walk in walks], False),
        dexterity=filled([walk.present.dexterity for walk in walks], 0.0),
        arm_joints=filled([walk.present.joints for walk in walks], 0.0),
        hand=filled([walk.present.hand for walk in walks], 0) if has_hands else None,
        objective=np.array([walk.value for walk in walks]),
        weights=weights,
    )


def with_estimates(
    file: ScoreFile,
    table: int,
    scorer: PointScorer,
    refined: RefinedTable,
    judge: Judge | None = None,
) -> RefinedTable:
    """Return refined sets with their success if that of the table's sets was estimated.

    Errors that were given in place of those of the environment are not in the file: `tcs robustify`
    estimates both kinds of sets then.
    """
    record = file.metadata.get("robustness", [None] * len(file.tables))[table]
    if file.tables[table].success is None or record is None or not record["environment_errors"]:
        return refined
    trials = Trials.built(file, table, scorer.built, body_collisions=record["body_collisions"])
    if record.get("done_by") != "motion":
        judge = None
    drawn = {"samples": record["samples"], "seed": record["seed"], "jobs": scorer.jobs}
    return with_success(trials, refined, judge=judge, **drawn)


def with_refined(
    file: ScoreFile, table: int, refined: RefinedTable, settings: dict[str, Any]
) -> ScoreFile:
    """Return the file with the refined sets of one table."""
    tables = list(file.tables)
    tables[table] = dataclasses.replace(tables[table], refined=refined)
    records = list(file.metadata.get(KEY, [None] * len(tables)))
    records[table] = settings
    return dataclasses.replace(file, metadata={**file.metadata, KEY: records}, tables=tuple(tables))


def refinement_summary(file: ScoreFile, table: int | None = None) -> dict[str, Any]:
    """Return what a refinement gained, as printed by `tcs refine --json`.

    Args:
        file: A score file with refined sets.
        table: Number of the refined table; by default the nominal one.

    Raises:
        SelectionError: If the table was not refined.
    """
    number = file.nominal_index if table is None else table
    scored = file.tables[number]
    settings = file.metadata.get(KEY, [None] * len(file.tables))[number]
    if scored.refined is None or settings is None:
        raise SelectionError("No sets of this table were refined. Refine them: tcs refine FILE.")
    reachability, manipulability = scored.sets.scores_of(scored.sets.best)
    refined = scored.refined
    return {
        "measure": file.metadata["measure"],
        **settings,
        "before": {
            "reachability": round(reachability, 12),
            "manipulability": round(manipulability, 12),
            "members": [file.configurations.configuration(h).to_json() for h in scored.sets.best],
        },
        "after": {
            "reachability": round(float(refined.reachability[0]), 12),
            "manipulability": round(float(refined.manipulability[0]), 12),
            "members": [member.to_json() for member in refined.members(file.configurations, 0)],
        },
        "sets": len(refined.origin),
    }
