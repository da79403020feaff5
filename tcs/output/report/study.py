"""The study behind the robustness report: every row tried with the room a little off."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed

from tcs.errors import StoreMismatchError
from tcs.kernel.cache import is_compiled
from tcs.output.draw import as_png
from tcs.output.report.paper import load_paper
from tcs.output.report.pictures import Shown, map_figure, scene_figure
from tcs.placement.robustness import (
    Evaluation,
    Gain,
    MethodTable,
    Prediction,
    Trials,
    compare_methods,
    evaluate,
    losses,
    predictions,
    robust_gains,
)
from tcs.placement.robustness.losses import Losses
from tcs.placement.store import ScoreFile, load_scores


@dataclass(frozen=True, slots=True)
class Plan:
    """How much is tried."""

    samples: int = 1000
    """Samples of each method."""
    seed: int = 0
    sets: int = 60
    """How many sets of each size and kind to try, to see how well P_M predicts success."""
    set_samples: int = 50
    """Samples of each of them, the same for all."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RowStudy:
    """All that was found about one row."""

    task: str
    environment: str
    robot: str
    titles: tuple[str, str, str]
    """Of task, environment and robot, for a person."""
    made_by: dict[str, str]
    """Program version, date and scene of the score file, and the file's own hash."""
    best: Evaluation
    """The set with the best scores."""
    single: Evaluation
    """The best single configuration."""
    methods: MethodTable | None
    """One or two, with and without TC-manipulability; None where not asked for."""
    gains: tuple[Gain, ...]
    """What choosing by estimated success gains, for sets of one and of up to two; () where the
    file holds no estimates."""
    losses: Losses
    """What the best set loses, and why."""
    single_losses: Losses | None
    """The same of the best single; None where it is not compared."""
    predictions: tuple[Prediction, ...]
    """How well P_M predicts success, among sets of one and two, of any and of equal reach."""
    map: bytes
    """The chosen set from above, PNG."""
    scene: bytes
    """The chosen set in space, PNG."""
    seconds: float
    """Wall clock [s]."""
    cpu_seconds: float

    @property
    def gain(self) -> Gain | None:
        """What choosing by success gains among all sets; None where there are no estimates."""
        return self.gains[-1] if self.gains else None

    @property
    def name(self) -> str:
        """Task and environment in words."""
        return f"{self.task.replace('_', ' ')}, {self.environment}"


def check_row(path: Path, file: ScoreFile, task: str, environment: str, robot: str) -> None:
    """Refuse a score file that holds another row than its name says.

    Args:
        path: Where it was found.
        file: What it holds.
        task: Name of the task that is wanted.
        environment: Name of the environment.
        robot: Name of the robot.

    Raises:
        StoreMismatchError: If it is of another task, environment or robot.
    """
    wanted = {"task": task, "environment": environment, "robot": robot}
    for key, name in wanted.items():
        found = file.metadata[key]
        if found != name:
            raise StoreMismatchError(
                f"Score file '{path}' is of {key} '{found}', not '{name}' as its name says. Name "
                "another folder of score files, or take this one out of it to have the row scored."
            )


def study_row(path: Path, plan: Plan, jobs: int = 1) -> RowStudy:
    """Return what a score file is worth when the room is off.

    Args:
        path: A score file.
        plan: How much to try.
        jobs: Number of threads; the result does not depend on it.

    Raises:
        StoreError: If the file cannot be used, or is not of today's models.
        SelectionError: If it holds no set.
    """
    begun, cpu = time.perf_counter(), time.process_time()
    file = load_scores(path)
    trials = Trials.of(file)
    names = (trials.job.task.name, trials.job.spec.environment.name, trials.job.spec.robot.name)
    tries: dict[str, Any] = {"samples": plan.samples, "seed": plan.seed, "jobs": jobs}
    methods = None
    if names[:2] in load_paper().compared_rows():
        methods = compare_methods(trials, **tries)
    known = methods.cells if methods is not None else {}
    best = known.get((2, True)) or evaluate(trials, select="best", **tries)
    single = known.get((1, True)) or evaluate(trials, select="single", **tries)
    gains = robust_gains(trials, **tries) if trials.scored.success is not None else ()
    shown = Shown.of(file, None)
    pictures = [as_png(figure(file, shown)) for figure in (map_figure, scene_figure)]
    return RowStudy(
        task=names[0],
        environment=names[1],
        robot=names[2],
        titles=(
            trials.job.task.title,
            trials.job.spec.environment.title,
            trials.job.spec.robot.title,
        ),
        made_by={
            "version": file.metadata["program_version"],
            "created": file.metadata["created"],
            "scene": file.metadata["scene_digest"],
            "measure": file.metadata["measure"],
            "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
        },
        best=best,
        single=single,
        methods=methods,
        gains=gains,
        losses=losses(trials, best),
        single_losses=losses(trials, single) if methods is not None else None,
        predictions=predictions(
            trials, sets=plan.sets, samples=plan.set_samples, seed=plan.seed, jobs=jobs
        ),
        map=pictures[0],
        scene=pictures[1],
        seconds=time.perf_counter() - begun,
        cpu_seconds=time.process_time() - cpu,
    )


def study_rows(
    paths: Sequence[Path],
    plan: Plan,
    *,
    jobs: int = 2,
    on_progress: Callable[[int, int], None] | None = None,
    on_compile: Callable[[], None] | None = None,
) -> tuple[RowStudy, ...]:
    """Return the studies of several score files, in their order.

    Args:
        paths: The score files.
        plan: How much to try.
        jobs: Number of processes; the result does not depend on it.
        on_progress: Called with rows done and in all.
        on_compile: Called first, when the kernel has to be compiled.

    Raises:
        TcsError: Whatever `study_row` raises.
    """
    if not is_compiled():
        # Once, and not by every process for itself.
        Trials.of(load_scores(paths[0]), on_compile=on_compile)
    done = []
    # Processes: a good part of the work is Python's and Drake's own, which threads share badly.
    work = Parallel(n_jobs=min(jobs, len(paths)), return_as="generator")
    for row in work(delayed(study_row)(path, plan) for path in paths):
        done.append(row)
        if on_progress is not None:
            on_progress(len(done), len(paths))
    return tuple(done)
