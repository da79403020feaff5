"""What the members of a refined set reach, and its success under errors of the environment."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tcs.errors import SelectionError
from tcs.model.grid import InitialConfiguration
from tcs.model.random_streams import check_draws
from tcs.placement.refinement.points import PointScorer
from tcs.placement.robustness import Evaluation, PerturbedPoints, Trials
from tcs.placement.robustness.error_model import displaced
from tcs.placement.robustness.trials import Errors
from tcs.placement.store import ScoreFile, state_to_json
from tcs.placement.tables import RefinedSet, RefinedTable, ScoreTable


class RefinedMembers(NamedTuple):
    """The members of a refined set, in the order of the visits."""

    members: tuple[InitialConfiguration, ...]
    """The configurations."""
    scores: ScoreTable
    """Their scores, a row for each."""


def refined_table(file: ScoreFile, table: int) -> RefinedTable:
    """Return the refined sets of a table.

    Raises:
        SelectionError: If there are none.
    """
    refined = file.tables[table].refined
    if refined is None:
        raise SelectionError("No sets of this table were refined. Refine them: tcs refine FILE.")
    return refined


def score_members(file: ScoreFile, chosen: RefinedSet, jobs: int = 2) -> RefinedMembers:
    """Return the members of a refined set with their scores, computed by the kernel.

    The file holds what the members reach; this has the reasons, and the bodies in contact, too.

    Args:
        file: A score file with refined sets.
        chosen: The set.
        jobs: Number of threads.

    Raises:
        StoreMismatchError: If the file was made from other models.
        SelectionError: If the table was not refined.
    """
    refined = refined_table(file, chosen.table)
    at = chosen.row, list(chosen.order)
    scorer = PointScorer.of(file, chosen.table, jobs)
    scores = scorer.score_table(refined.values[at], refined.weights)
    members = refined.members(file.configurations, chosen.row)
    return RefinedMembers(tuple(members[i] for i in chosen.order), scores)


def evaluate_refined(
    file: ScoreFile,
    *,
    row: int = 0,
    samples: int = 1000,
    seed: int = 0,
    errors: Errors = None,
    table: int | None = None,
    body_collisions: str = "paper",
    jobs: int = 2,
    on_compile: Callable[[], None] | None = None,
) -> Evaluation:
    """Return which goals a refined set reaches in perturbed environments.

    The samples are those of `tcs.evaluate` for sets of the grid, given the same seed.

    Args:
        file: A score file with refined sets.
        row: Number of the refined set, the best first.
        samples: Number of samples.
        seed: Seed of the samples.
        errors: Path of an error file, or errors by joint, in place of those of the environment.
        table: Number of the file's table; by default the nominal one.
        body_collisions: Collisions of the robot's body that count, one of `BODY_COLLISIONS`.
        jobs: Number of threads; the result does not depend on it.
        on_compile: Called first if the kernel has to be compiled.

    Raises:
        StoreMismatchError: If the file was made from other models.
        UnknownNameError: If a joint or a choice of collisions has no such name.
        DataFileError: If the error file cannot be used.
        SelectionError: If there is no such refined set.
        TcsError: If a number is out of range.
    """
    check_draws(samples, seed)
    begun = time.perf_counter()
    number = file.nominal_index if table is None else table
    refined = refined_table(file, number)
    if not 0 <= row < len(refined.origin):
        raise SelectionError(
            f"There is no refined set {row}; the table has {len(refined.origin)}, counted from 0."
        )
    trials = Trials.of(
        file, errors=errors, table=number, body_collisions=body_collisions, on_compile=on_compile
    )
    offsets = trials.errors.draw(samples, seed)
    size = int(refined.sizes[row])
    origin = refined.origin[row, :size].astype(np.int64)
    values = refined.values[row, :size]
    reached = np.logical_or.reduce(PerturbedPoints(trials, offsets, jobs).reached(values), axis=0)
    limited = np.zeros(samples, dtype=np.bool_)
    axes = file.configurations.environment_axes
    for member in values:
        at = {axis.name: float(v) for axis, v in zip(axes, member, strict=False)}
        limited |= displaced(trials.job, trials.scene, {**trials.observed, **at}, offsets)[1]
    for array in (reached, *offsets.values()):
        array.flags.writeable = False
    return Evaluation(
        select="refined",
        sets=origin[None],
        offsets=offsets,
        reached=reached,
        weights=trials.weights,
        reachability=float(refined.reachability[row]),
        manipulability=float(refined.manipulability[row]),
        choices=1,
        clipped=int(np.count_nonzero(limited)),
        errors=trials.errors,
        body_collisions=trials.body_collisions,
        approach=trials.with_approach,
        seed=seed,
        seconds=time.perf_counter() - begun - trials.compile_seconds,
        observed=state_to_json(file.observed_axes, trials.observed),
        about={
            "task": trials.job.task.name,
            "environment": trials.job.spec.environment.name,
            "robot": file.robot["name"],
        },
        members=tuple(member.to_json() for member in refined.members(file.configurations, row)),
    )
