"""Goals that configurations off the grid reach in perturbed environments."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Self

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.kernel.problem import Problem, build_problem, with_environment
from tcs.kernel.rows import Rows
from tcs.kernel.sweep import blocked_grippers
from tcs.model.grid import ROBOT_AXES
from tcs.model.scene import environment_at, torso_at
from tcs.placement.robustness.error_model import Offsets, displaced, samples_of
from tcs.placement.robustness.perturbed_scenes import HandScenes, PerturbedScenes, Run
from tcs.placement.robustness.trials import HandTrials, Trials
from tcs.placement.scoring.approaches import ApproachScorer
from tcs.placement.scoring.scorer import Scorer
from tcs.placement.tables import Reason

BATCH = 50
"""Samples of a configuration that a thread evaluates at a time: some ten milliseconds of work."""
KEPT_SAMPLES = 10_000
"""Samples of environments that are kept: some hundred megabytes."""


@dataclass(frozen=True, eq=False)
class PerturbedPoints:
    """The same samples of the error model for every configuration (common random numbers)."""

    trials: Trials
    """The table of the score file, prepared for trials."""
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
        out = np.zeros((len(points), self.samples, self.trials.weights.size), dtype=np.uint8)
        parts = list(self._parts(points))

        def fill(part: _Part) -> None:
            found = part.scenes.reasons(part.poses, part.run)
            out[part.run.row, part.run.start : part.run.stop] = found

        Parallel(n_jobs=self.jobs, prefer="threads")(delayed(fill)(part) for part in parts)
        return out

    def free_grippers(self, state: Mapping[str, float]) -> BoolArray:
        """Return at which goals some hand's gripper touches nothing, whatever the base pose.

        Args:
            state: Positions of the environment's axes without error, by name [m or rad].

        Returns:
            Shape (samples, G). A goal at which no gripper is free is reached from nowhere.
        """
        free = np.zeros((self.samples, self.trials.weights.size), dtype=np.bool_)
        measure = str(self.trials.file.metadata["measure"])
        for hand in self.trials.hands:
            problem = build_problem(hand.lowered.arrays, measure)
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
        axes = trials.grid.environment_axes
        states, state = np.unique(points[:, : len(axes)], axis=0, return_inverse=True)
        for number, at in enumerate(states):
            nominal = {axis.name: v for axis, v in zip(axes, at.tolist(), strict=True)}
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
            nominal = {**self.trials.observed, **state}
            positions, _ = displaced(hand.job, hand.scene, nominal, self.offsets)
            samples = (
                {name: float(values[i]) for name, values in positions.items()}
                for i in range(self.samples)
            )
            problem = with_environment(
                robot, environment_at(hand.lowered, hand.scene, hand.job.task, samples)
            )
            known = Scorer.of(problem)
            while self.environments and len(self.environments) * self.samples >= KEPT_SAMPLES:
                self.environments.pop(next(iter(self.environments)))
        self.environments[key] = known
        of = known.problem
        goals = robot.goals._replace(R=of.goals.R, p=of.goals.p)
        problem = robot._replace(environment=of.environment, goals=goals)
        return Scorer(problem, known.grippers, approaches)


def _robot_at(
    hand: HandTrials, levels: FloatArray, trials: Trials
) -> tuple[Problem, ApproachScorer | None]:
    """Return the robot with a hand at torso heights [m], and who scores its approaches."""
    arrays = torso_at(hand.lowered, hand.scene, levels)
    arrays = arrays._replace(body_vs_environment=hand.body_pairs)
    robot = build_problem(arrays, str(trials.file.metadata["measure"]))
    return robot, None if hand.lines is None else ApproachScorer(robot, hand.lines)


class _Part(NamedTuple):
    """One configuration in some of the samples."""

    scenes: PerturbedScenes
    poses: Rows
    run: Run
