"""Success of a refined set under the errors of the environment."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from tcs.errors import SelectionError
from tcs.model.random_streams import check_draws
from tcs.placement.refinement.members import refined_table
from tcs.placement.robustness import Evaluation, PerturbedPoints, Trials
from tcs.placement.robustness.displacements import displaced
from tcs.placement.robustness.trials import Errors
from tcs.placement.store import ScoreFile, state_to_json


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
