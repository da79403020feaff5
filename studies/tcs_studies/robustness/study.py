"""Study of score files under error: success, losses and gains of each row of Table I."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed

from tcs.errors import StoreMismatchError
from tcs.placement.robustness.evaluation import Evaluation, evaluate
from tcs.placement.robustness.trials import Trials
from tcs.placement.store import PAPER, ScoreFile, load_scores
from tcs_studies.robustness.comparison import MethodComparison, compare_methods
from tcs_studies.robustness.gains import Gain, Prediction, predictions, robust_gains
from tcs_studies.robustness.losses import Losses, losses


@dataclass(frozen=True, slots=True)
class StudyPlan:
    """Sample sizes of a study, and the rows on which all four methods are compared."""

    samples: int = 1000
    """Samples of each method."""
    seed: int = 0
    """Seed of all samples."""
    sets: int = 60
    """Sets of each size and class evaluated to see how well P_M predicts success."""
    set_samples: int = 50
    """Samples of each of these sets, the same for all."""
    compared: tuple[tuple[str, str], ...] = ()
    """Task and environment of the rows on which the methods of Table III are compared."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RowStudy:
    """Results of one row: a task in an environment with a robot."""

    path: Path
    """The score file."""
    task: str
    environment: str
    robot: str
    titles: tuple[str, str, str]
    """Titles of task, environment and robot."""
    made_by: dict[str, str]
    """Program version, date, scene and measure of the score file, and its SHA-256."""
    best: Evaluation
    """The set with the greatest P_R + P_M."""
    single: Evaluation
    """The best single configuration."""
    methods: MethodComparison | None
    """One or two configurations, with and without TC-manipulability; None if not compared."""
    gains: tuple[Gain, ...]
    """Gain of selecting by estimated success, for sets of one and of up to two; () if the file
    holds no estimates."""
    losses: Losses
    """Goals that the best set loses under error, and why."""
    single_losses: Losses | None
    """The same for the best single configuration; None if not compared."""
    predictions: tuple[Prediction, ...]
    """How well P_M predicts success among sets of one and two, of any and of equal P_R."""
    seconds: float
    """Wall-clock time [s]."""
    cpu_seconds: float
    """Processor time [s]."""

    @property
    def gain(self) -> Gain | None:
        """Gain of selecting by estimated success among all sets; None without estimates."""
        return self.gains[-1] if self.gains else None

    @property
    def name(self) -> str:
        """Task and environment, for display."""
        return f"{self.task.replace('_', ' ')}, {self.environment}"


def check_row(path: Path, file: ScoreFile, task: str, environment: str, robot: str) -> None:
    """Refuse a score file whose content is not the row that its name states.

    Args:
        path: Path of the score file.
        file: Its content.
        task: Name of the expected task.
        environment: Name of the expected environment.
        robot: Name of the expected robot.

    Raises:
        StoreMismatchError: If task, environment or robot differ, or it was not scored as in the
            papers.
    """
    if PAPER not in file.metadata:
        raise StoreMismatchError(
            f"Score file '{path}' was not scored as the paper scores its rows (--paper). Give "
            "another folder of score files, or remove this file to have the row scored."
        )
    expected = {"task": task, "environment": environment, "robot": robot}
    for key, name in expected.items():
        found = file.metadata[key]
        if found != name:
            raise StoreMismatchError(
                f"Score file '{path}' has {key} '{found}', not '{name}' as its name states. Give "
                "another folder of score files, or remove this file to have the row scored."
            )


def study_row(path: Path, plan: StudyPlan, jobs: int = 1) -> RowStudy:
    """Return the study of one score file.

    Args:
        path: Path of the score file.
        plan: Sample sizes, and the rows on which methods are compared.
        jobs: Number of threads; the result does not depend on it.

    Raises:
        StoreError: If the file cannot be used, or was made from other models.
        SelectionError: If it holds no set.
    """
    begun, cpu = time.perf_counter(), time.process_time()
    file = load_scores(path)
    trials = Trials.of(file, body_collisions="paper")
    task, spec = trials.job.task, trials.job.spec
    sampling: dict[str, Any] = {"samples": plan.samples, "seed": plan.seed, "jobs": jobs}
    methods = None
    if (task.name, spec.environment.name) in plan.compared:
        methods = compare_methods(trials, **sampling)
    known = methods.paired if methods is not None else {}
    best = known.get((2, True)) or evaluate(trials, select="best", **sampling)
    single = known.get((1, True)) or evaluate(trials, select="single", **sampling)
    gains = robust_gains(trials, **sampling) if trials.scored.success is not None else ()
    return RowStudy(
        path=path,
        task=task.name,
        environment=spec.environment.name,
        robot=spec.robot.name,
        titles=(task.title, spec.environment.title, spec.robot.title),
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
        seconds=time.perf_counter() - begun,
        cpu_seconds=time.process_time() - cpu,
    )


def study_rows(
    paths: Sequence[Path],
    plan: StudyPlan,
    *,
    jobs: int = 2,
    on_progress: Callable[[int, int], None] | None = None,
    on_compile: Callable[[], None] | None = None,
) -> tuple[RowStudy, ...]:
    """Return the studies of several score files, in their order.

    Args:
        paths: Paths of the score files.
        plan: Sample sizes, and the rows on which methods are compared.
        jobs: Number of processes; the result does not depend on it.
        on_progress: Called with the number of rows done and of all rows.
        on_compile: Called first if the kernel has to be compiled.

    Raises:
        TcsError: As `study_row`.
    """
    # Compile once, not in every process.
    Trials.of(load_scores(paths[0]), body_collisions="paper", on_compile=on_compile).start.ensure()
    done = []
    # Processes, because much of the work holds the global interpreter lock.
    work = Parallel(n_jobs=min(jobs, len(paths)), return_as="generator")
    for row in work(delayed(study_row)(path, plan) for path in paths):
        done.append(row)
        if on_progress is not None:
            on_progress(len(done), len(paths))
    return tuple(done)
