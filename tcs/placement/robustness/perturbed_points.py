"""Goals that configurations off the grid reach in perturbed environments."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol, Self

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.kernel.problem import Problem, build_problem, with_environment
from tcs.kernel.rows import Rows
from tcs.kernel.scores import JOINTS
from tcs.kernel.sweep import blocked_grippers
from tcs.model.grid import ROBOT_AXES
from tcs.model.scene import environment_at, torso_at
from tcs.placement.robustness.error_model import Offsets, displaced, samples_of
from tcs.placement.robustness.perturbed_scenes import (
    HandScenes,
    PerturbedScenes,
    Run,
    grippers_of,
)
from tcs.placement.robustness.trials import HandTrials, Progress, counter
from tcs.placement.scoring.approaches import ApproachScorer
from tcs.placement.scoring.kernel_start import KernelStart
from tcs.placement.scoring.scorer import Scorer
from tcs.placement.scoring.together import Hands
from tcs.placement.tables import Reason

BATCH = 50
"""Samples of a configuration that a thread evaluates at a time: some ten milliseconds of work."""
KEPT_SAMPLES = 10_000
"""Samples of environments that are kept: some hundred megabytes."""


class Tried(Protocol):
    """What is tried under error: the table of a score file, or the stops of a plan."""

    @property
    def hands(self) -> tuple[HandTrials, ...]:
        """The robot with each hand."""

    @property
    def start(self) -> KernelStart:
        """The start of the kernel."""

    @property
    def measure(self) -> str:
        """Name of the dexterity measure."""

    @property
    def goals(self) -> int:
        """Number of goals of the task."""

    @property
    def environment_axes(self) -> tuple[str, ...]:
        """Names of the axes that come before those of the robot in a configuration."""

    @property
    def observed(self) -> Mapping[str, float]:
        """Observed state, by joint [m or rad]."""

    @property
    def together(self) -> Hands | None:
        """The hands, to check arms that work at the same time against each other."""


class PointScores(NamedTuple):
    """What configurations reach in samples, and how."""

    reason: NDArray[np.uint8]
    """Why a goal is reached or not, values of `Reason`, shape (n, samples, G)."""
    joints: NDArray[np.float32]
    """Arm joints where it is reached [rad], shape (n, samples, G, 7)."""
    hand: NDArray[np.uint8]
    """Number of the hand, shape (n, samples, G)."""

    @property
    def reached(self) -> BoolArray:
        """Whether a goal is reached, shape (n, samples, G)."""
        return np.asarray(self.reason == Reason.REACHED)


@dataclass(frozen=True, eq=False)
class PerturbedPoints:
    """The same samples of the error model for every configuration (common random numbers)."""

    trials: Tried
    """What is tried."""
    offsets: Offsets
    """Errors of the joints, shapes (samples,)."""
    jobs: int
    """Number of threads; the result does not depend on it."""
    environments: dict[tuple[Any, ...], Scorer] = field(default_factory=dict, repr=False)
    """The states of the environment that were evaluated last, in all samples; the robot in them is
    in some state."""

    @property
    def samples(self) -> int:
        """Number of samples."""
        return samples_of(self.offsets)

    def hardest(self, count: int) -> Self:
        """Return the samples with the largest errors, each in units of its joint's spread."""
        return self.only(np.sort(self.order[:count]))

    @property
    def order(self) -> NDArray[np.intp]:
        """Numbers of the samples, the largest errors first, shape (samples,)."""
        spread = {name: values.std() or 1.0 for name, values in self.offsets.items()}
        size = np.sum([(v / spread[name]) ** 2 for name, v in self.offsets.items()], axis=0)
        return np.argsort(-size, kind="stable")

    def only(self, rows: NDArray[np.intp]) -> Self:
        """Return some of the samples."""
        of_rows = {name: values[rows] for name, values in self.offsets.items()}
        return dataclasses.replace(self, offsets=of_rows, environments={})

    def reached(self, points: FloatArray) -> BoolArray:
        """Return which goals each configuration reaches in each sample, shape (n, samples, G)."""
        return np.asarray(self.reasons(points) == Reason.REACHED)

    def reasons(self, points: FloatArray) -> NDArray[np.uint8]:
        """Return why each configuration reaches a goal in a sample or not, shape (n, samples, G).

        Values are those of `Reason`.
        """
        out = np.zeros((len(points), self.samples, self.trials.goals), dtype=np.uint8)
        parts = list(self._parts(points))

        def fill(part: _Part) -> None:
            found = part.scenes.reasons(part.poses, part.run)
            out[part.run.row, part.run.start : part.run.stop] = found

        Parallel(n_jobs=self.jobs, prefer="threads")(delayed(fill)(part) for part in parts)
        return out

    def scores(self, points: FloatArray, on_progress: Progress = None) -> PointScores:
        """Return what each configuration reaches in each sample, and how.

        Args:
            points: Values of the axes of the configurations [m or rad], shape (n, axes).
            on_progress: Called with the number of pairs of configuration and sample done, and of
                all such pairs.
        """
        shape = len(points), self.samples, self.trials.goals
        reason, hand = np.zeros((2, *shape), dtype=np.uint8)
        joints = np.zeros((*shape, JOINTS), dtype=np.float32)
        step = counter(len(points) * self.samples, on_progress)

        def fill(part: _Part) -> int:
            found = part.scenes.scores(part.poses, part.run)
            to = part.run.row, slice(part.run.start, part.run.stop)
            reason[to], hand[to] = found.scores.reason, found.hand
            joints[to] = found.scores.joints
            return part.run.stop - part.run.start

        parts = Parallel(n_jobs=self.jobs, prefer="threads", return_as="generator")
        for done in parts(delayed(fill)(part) for part in list(self._parts(points))):
            step(done)
        return PointScores(reason, joints, hand)

    def positions(self, hand: HandTrials, state: Mapping[str, float]) -> dict[str, FloatArray]:
        """Return the positions of the environment's joints in each sample [m or rad].

        Args:
            hand: One of the hands.
            state: Positions of the environment's axes without error, by name [m or rad].
        """
        nominal = {**self.trials.observed, **state}
        return displaced(hand.job, hand.scene, nominal, self.offsets)[0]

    def free_grippers(self, state: Mapping[str, float]) -> BoolArray:
        """Return at which goals some hand's gripper touches nothing, whatever the base pose.

        Args:
            state: Positions of the environment's axes without error, by name [m or rad].

        Returns:
            Shape (samples, G). A goal at which no gripper is free is reached from nowhere.
        """
        free = np.zeros((self.samples, self.trials.goals), dtype=np.bool_)
        for hand in self.trials.hands:
            problem = build_problem(hand.lowered.arrays, self.trials.measure)
            blocked = blocked_grippers(self._scorer(hand, problem, dict(state)).problem)
            free[:, list(hand.goals)] |= ~blocked
        return free

    def _parts(self, points: FloatArray) -> Iterator[_Part]:
        """Yield the work for configurations."""
        trials = self.trials
        x, y, yaw, torso = (np.ascontiguousarray(c) for c in points[:, -len(ROBOT_AXES) :].T)
        levels, level = np.unique(torso, return_inverse=True)
        robots = [_robot_at(hand, levels, trials) for hand in trials.hands]
        poses = Rows(np.zeros(len(points), dtype=np.int64), x, y, yaw, level)
        axes = trials.environment_axes
        states, state = np.unique(points[:, : len(axes)], axis=0, return_inverse=True)
        for number, at in enumerate(states):
            nominal = dict(zip(axes, at.tolist(), strict=True))
            scenes = PerturbedScenes(
                tuple(
                    HandScenes(self._scorer(hand, robot, nominal, approaches), hand.goals)
                    for hand, (robot, approaches) in zip(trials.hands, robots, strict=True)
                ),
                trials.together,
            )
            for i in np.flatnonzero(state.ravel() == number):
                for start in range(0, self.samples, BATCH):
                    run = Run(int(i), start, min(start + BATCH, self.samples))
                    yield _Part(scenes, poses, run)

    def _scorer(
        self,
        hand: HandTrials,
        robot: Problem,
        state: dict[str, float],
        approaches: ApproachScorer | None = None,
    ) -> Scorer:
        """Return the scorer of one state of the environment in all samples, for one hand.

        Its arrays take a call of Drake for each sample: the last states are kept.
        """
        self.trials.start.ensure()
        key = (id(hand), *state.items())
        known = self.environments.pop(key, None)
        if known is None:
            positions = self.positions(hand, state)
            samples = (
                {name: float(values[i]) for name, values in positions.items()}
                for i in range(self.samples)
            )
            problem = with_environment(
                robot, environment_at(hand.lowered, hand.scene, hand.job.task, samples)
            )
            known = Scorer(problem, grippers_of(problem, self.jobs))
            while self.environments and len(self.environments) * self.samples >= KEPT_SAMPLES:
                self.environments.pop(next(iter(self.environments)))
        self.environments[key] = known
        of = known.problem
        goals = robot.goals._replace(R=of.goals.R, p=of.goals.p)
        problem = robot._replace(environment=of.environment, goals=goals)
        return Scorer(problem, known.grippers, approaches)


def _robot_at(
    hand: HandTrials, levels: FloatArray, trials: Tried
) -> tuple[Problem, ApproachScorer | None]:
    """Return the robot with a hand at torso heights [m], and who scores its approaches."""
    arrays = torso_at(hand.lowered, hand.scene, levels)
    arrays = arrays._replace(body_vs_environment=hand.body_pairs)
    robot = build_problem(arrays, trials.measure)
    return robot, None if hand.lines is None else ApproachScorer(robot, hand.lines)


class _Part(NamedTuple):
    """One configuration in some of the samples."""

    scenes: PerturbedScenes
    poses: Rows
    run: Run
