"""The trajectory-following experiment of the null-space paper, with scripted operators.

Every operator uses every controller, for four training trials and three counted trials. The means
over the counted trials are the samples that the tests compare (paper, section II.C).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed

from tcs.errors import TcsError
from tcs.kernel.arrays import FloatArray
from tcs.teleop.arm import Arm
from tcs.teleop.control.latency import NO_LATENCY, Latency
from tcs.teleop.line import Course
from tcs.teleop.runs.run import Run
from tcs.teleop.runs.run_files import SUFFIX, save_run
from tcs_studies.experiment.comparison import Comparison
from tcs_studies.experiment.order import counterbalanced_orders
from tcs_studies.experiment.phases import WorkOverTime, work_over_time
from tcs_studies.experiment.statistics import RepeatedMeasures, SignedRankTest
from tcs_studies.experiment.trial import (
    CONDITIONS,
    END_EFFECTOR,
    MEASURES,
    NOVEL,
    TIME_LIMIT,
    Condition,
    TrialMeasures,
    mean_measures,
    measure,
    run_trial,
    sampled_path,
)
from tcs_studies.operators import Experience, OperatorTraits

OPERATORS = 26
"""Number of participants in the paper."""
TRAINING = 4
"""Number of training trials of an operator with a controller."""
TRIALS = 3
"""Number of counted trials of an operator with a controller."""
SCRIPTED = "scripted operators, not people"
"""Note of every table."""
LEARNING = ("accuracy", "time")
"""Measures that are reported from trial to trial."""

OnProgress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class ExperimentPlan:
    """Size and seed of an experiment.

    Attributes:
        operators: Number of operators.
        training: Number of training trials of an operator with a controller.
        trials: Number of counted trials of an operator with a controller.
        seed: Seed of the operators and their noise.
        conditions: Controllers to compare.
        time_limit: Time limit of a trial [s].
        latency: Latency between operator and arm.
    """

    operators: int = OPERATORS
    training: int = TRAINING
    trials: int = TRIALS
    seed: int = 0
    conditions: tuple[Condition, ...] = CONDITIONS
    time_limit: float = TIME_LIMIT
    latency: Latency = NO_LATENCY

    def __post_init__(self) -> None:
        """Check the plan.

        Raises:
            TcsError: If there are fewer than three operators, no counted trial, fewer than two
                conditions or one of them twice, or the time limit is below 1 s.
        """
        if self.operators < 3 or self.trials < 1 or self.training < 0:
            raise TcsError(
                f"experiment with {self.operators} operators, {self.training} training trials and "
                f"{self.trials} trials: at least 3 operators and 1 trial are needed."
            )
        if not (math.isfinite(self.time_limit) and self.time_limit >= 1.0):
            raise TcsError(f"experiment: time limit {self.time_limit:g} s; must be at least 1 s.")
        names = [condition.name for condition in self.conditions]
        if len({*names}) != len(names) or len(names) < 2:
            raise TcsError(f"experiment: conditions {names} must be two or more, each once.")

    def order(self, operator: int) -> tuple[Condition, ...]:
        """Return the order of the conditions for an operator, counted from 0.

        Operators take all orders in turn; with two conditions this is the paper's Table I.
        """
        orders = counterbalanced_orders(self.conditions)
        return orders[operator % len(orders)]


@dataclass(frozen=True, eq=False)
class ControllerTrials:
    """Trials of one operator with one controller."""

    operator: int
    condition: str
    training: tuple[TrialMeasures, ...]
    trials: tuple[TrialMeasures, ...]
    paths: tuple[FloatArray, ...]
    """Path of the tool in each counted trial [m], shapes (k, 3)."""
    postures: tuple[FloatArray, ...]
    """Postures of the arm in each counted trial, ten per second [rad], shapes (k, 7)."""
    work: tuple[WorkOverTime, ...]
    """Work on the device over time in each counted trial."""

    @property
    def mean(self) -> TrialMeasures:
        """Mean of each measure over the counted trials."""
        return mean_measures(list(self.trials))

    def every(self, measure: str) -> list[float]:
        """Return a measure of all trials, training first."""
        return [getattr(trial, measure) for trial in (*self.training, *self.trials)]


@dataclass(frozen=True, eq=False)
class Experiment:
    """Plan, operators and trials of an experiment."""

    arm: Arm
    course: Course
    plan: ExperimentPlan
    traits: tuple[OperatorTraits, ...]
    drives: dict[str, tuple[ControllerTrials, ...]]
    """Trials by condition, in the order of operators."""

    def sample(self, condition: str, measure: str) -> FloatArray:
        """Return the mean of a measure over the counted trials of each operator, shape (n,)."""
        return np.array([getattr(drive.mean, measure) for drive in self.drives[condition]])

    def comparison(self) -> Comparison:
        """Return all measures by condition, for the tables and tests of the papers."""
        return Comparison(
            titles={condition.name: condition.title for condition in self.plan.conditions},
            values={
                name: {condition: self.sample(condition, name) for condition in self.drives}
                for name in MEASURES
            },
            operators=SCRIPTED,
            learning={
                name: {
                    condition: np.array([drive.every(name) for drive in drives])
                    for condition, drives in self.drives.items()
                }
                for name in LEARNING
            },
            training=self.plan.training,
        )

    def tested(self) -> dict[str, SignedRankTest]:
        """Return the paper's tests of end-effector control against the novel controller."""
        comparison = self.comparison()
        found = {
            name: comparison.compared(name, END_EFFECTOR.name, NOVEL.name)
            for name in comparison.hypotheses
        }
        return {name: test for name, test in found.items() if test is not None}

    def varied(self) -> dict[str, RepeatedMeasures]:
        """Return the thesis's analyses of variance over all conditions."""
        comparison = self.comparison()
        found = {name: comparison.varied(name) for name in comparison.anova_measures}
        return {name: analysis for name, analysis in found.items() if analysis is not None}


def run_experiment(
    arm: Arm,
    course: Course,
    plan: ExperimentPlan | None = None,
    *,
    runs: Path | None = None,
    jobs: int = 1,
    on_progress: OnProgress | None = None,
) -> Experiment:
    """Return the trials of all operators with all controllers.

    Args:
        arm: The arm.
        course: The line and the start posture.
        plan: Size and seed of the experiment; None for those of the paper.
        runs: Existing folder to save each counted trial to; None saves none.
        jobs: Number of processes; the results do not depend on it.
        on_progress: Called with the number of pairs (operator, condition) done and of all.

    Raises:
        TcsError: If the course does not fit the arm.
        OutputError: If a run cannot be saved.
    """
    plan = plan or ExperimentPlan()
    traits = tuple(
        OperatorTraits.drawn(_rng(plan.seed, operator)) for operator in range(plan.operators)
    )
    work = [
        (operator, condition)
        for operator in range(plan.operators)
        for condition in plan.order(operator)
    ]
    calls = (
        delayed(_drive)(arm, course, plan, operator, condition, traits[operator], runs)
        for operator, condition in work
    )
    found: list[ControllerTrials] = []
    for drive in Parallel(jobs, return_as="generator_unordered")(calls):
        found.append(drive)
        if on_progress is not None:
            on_progress(len(found), len(work))
    found.sort(key=lambda drive: drive.operator)
    drives = {
        condition.name: tuple(drive for drive in found if drive.condition == condition.name)
        for condition in plan.conditions
    }
    return Experiment(arm, course, plan, traits, drives)


def _drive(
    arm: Arm,
    course: Course,
    plan: ExperimentPlan,
    operator: int,
    condition: Condition,
    traits: OperatorTraits,
    runs: Path | None,
) -> ControllerTrials:
    """Return the trials of one operator with one controller."""
    habits = Experience()
    measured, paths, postures, work = [], [], [], []
    number = plan.conditions.index(condition)
    for trial in range(plan.training + plan.trials):
        counts = trial >= plan.training
        run = run_trial(
            arm, course, condition, traits, habits, _rng(plan.seed, operator, number, trial),
            time_limit=plan.time_limit,
            latency=plan.latency,
            metadata={
                "operator": operator + 1,
                "trial": trial - plan.training + 1 if counts else trial + 1,
                "training": not counts,
                "seed": plan.seed,
                "order": plan.order(operator).index(condition) + 1,
            },
        )  # fmt: skip
        measured.append(measure(run, course, time_limit=plan.time_limit))
        if counts:
            paths.append(sampled_path(run))
            work.append(work_over_time(run, course.line))
            postures.append(run.joints[:: max(1, round(0.1 / run.step))].copy())
            if runs is not None:
                save_run(runs / run_name(run), run)
    return ControllerTrials(
        operator,
        condition.name,
        tuple(measured[: plan.training]),
        tuple(measured[plan.training :]),
        tuple(paths),
        tuple(postures),
        tuple(work),
    )


def run_name(run: Run) -> str:
    """Return the name of a trial's file, e.g. "novel-operator-03-trial-1.csv"."""
    metadata = run.metadata
    operator, trial = metadata["operator"], metadata["trial"]
    return f"{metadata['condition']}-operator-{operator:02d}-trial-{trial}{SUFFIX}"


def _rng(seed: int, *place: int) -> np.random.Generator:
    """Return the random generator of one operator or trial, independent of the order of calls."""
    # The length is part of the key, so that keys of operators and trials differ.
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(len(place), *place)))


def median_ratio(experiment: Experiment, measure: str) -> float:
    """Return the novel controller's median of a measure over that of end-effector control."""
    novel, there = (experiment.sample(one.name, measure) for one in (NOVEL, END_EFFECTOR))
    return float(np.median(novel) / np.median(there))


def median_operator(experiment: Experiment, condition: str, measure: str) -> int:
    """Return the operator, from 0, whose measure is the median, or the next above it."""
    sample = experiment.sample(condition, measure)
    return int(np.argsort(sample, kind="stable")[len(sample) // 2])


def trial_rows(experiment: Experiment, names: Sequence[str]) -> list[list[object]]:
    """Return every trial as a row.

    Columns are operator, condition, its position in the operator's order, whether the trial is for
    training, number of the trial, and the measures in `names`.
    """
    rows: list[list[object]] = []
    for condition, drives in experiment.drives.items():
        for drive in drives:
            order = [one.name for one in experiment.plan.order(drive.operator)]
            place = order.index(condition) + 1
            for training, trials in ((True, drive.training), (False, drive.trials)):
                for number, trial in enumerate(trials, start=1):
                    values = [getattr(trial, name) for name in names]
                    rows.append([drive.operator + 1, condition, place, training, number, *values])
    return rows
