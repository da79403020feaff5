"""Goals that configurations off the grid reach in perturbed environments."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Self

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from tcs.kernel.arrays import BoolArray
from tcs.kernel.problem import Problem, build_problem, with_environment
from tcs.kernel.rows import Rows
from tcs.kernel.sweep import blocked_grippers, gripper_contacts
from tcs.model.grid import ROBOT_AXES
from tcs.model.scene import environment_at, torso_at
from tcs.placement.robustness.displacements import displaced, samples_of
from tcs.placement.robustness.error_model import Offsets
from tcs.placement.robustness.perturbed_scenes import PerturbedScenes, Run
from tcs.placement.robustness.trials import ArmTrials, Trials
from tcs.placement.scoring.approaches import ApproachScorer
from tcs.placement.tables import Points, Reason

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
    environments: dict[tuple[Any, ...], PerturbedScenes] = field(default_factory=dict, repr=False)
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

    def reached(self, points: Points) -> BoolArray:
        """Return which goals each configuration reaches in each sample, shape (n, samples, G)."""
        return np.asarray(self.reasons(points) == Reason.REACHED)

    def reasons(self, points: Points) -> NDArray[np.uint8]:
        """Return why each configuration reaches a goal in a sample or not, shape (n, samples, G).

        Values are those of `Reason`.
        """
        out = np.zeros((len(points.values), self.samples, self.trials.weights.size), dtype=np.uint8)
        parts = [
            part
            for arm in np.unique(points.arm)
            for part in self._parts(points, np.flatnonzero(points.arm == arm))
        ]

        def fill(part: _Part) -> None:
            found = part.scenes.reasons(part.poses, part.run)
            out[part.row, part.run.start : part.run.stop] = found

        Parallel(n_jobs=self.jobs, prefer="threads")(delayed(fill)(part) for part in parts)
        return out

    def free_grippers(self, state: Mapping[str, float]) -> BoolArray:
        """Return at which goals some arm's gripper touches nothing, whatever the base pose.

        Args:
            state: Positions of the environment's axes without error, by name [m or rad].

        Returns:
            Shape (samples, G). A goal at which no gripper is free is reached from nowhere.
        """
        free = np.zeros((self.samples, self.trials.weights.size), dtype=np.bool_)
        for arm in self.trials.arms:
            problem = build_problem(arm.lowered.arrays, str(self.trials.file.metadata["measure"]))
            free |= ~blocked_grippers(self._scenes(arm, problem, dict(state)).problem)
        return free

    def _parts(self, points: Points, rows: NDArray[np.intp]) -> Iterator[_Part]:
        """Yield the work for configurations with one arm."""
        trials = self.trials
        arm = trials.arms[int(points.arm[rows[0]])]
        values = points.values[rows]
        x, y, yaw, torso = (np.ascontiguousarray(c) for c in values[:, -len(ROBOT_AXES) :].T)
        levels, level = np.unique(torso, return_inverse=True)
        arrays = torso_at(arm.lowered, arm.scene, levels)
        arrays = arrays._replace(body_vs_environment=arm.body_pairs)
        robot = build_problem(arrays, str(trials.file.metadata["measure"]))
        approaches = None if arm.lines is None else ApproachScorer(robot, arm.lines)
        poses = Rows(np.zeros(rows.size, dtype=np.int64), x, y, yaw, level)
        axes = trials.grid.environment_axes
        states, state = np.unique(values[:, : len(axes)], axis=0, return_inverse=True)
        for number, at in enumerate(states):
            nominal = {axis.name: v for axis, v in zip(axes, at.tolist(), strict=True)}
            scenes = self._scenes(arm, robot, nominal)._replace(approaches=approaches)
            for i in np.flatnonzero(state.ravel() == number):
                for start in range(0, self.samples, BATCH):
                    run = Run(int(i), start, min(start + BATCH, self.samples))
                    yield _Part(scenes, poses, run, int(rows[i]))

    def _scenes(self, arm: ArmTrials, robot: Problem, state: dict[str, float]) -> PerturbedScenes:
        """Return one state of the environment in all samples.

        Its arrays take a call of Drake for each sample: the last states are kept.
        """
        self.trials.start.ensure()
        key = (id(arm), *state.items())
        known = self.environments.pop(key, None)
        if known is None:
            nominal = {**self.trials.observed, **state}
            positions, _ = displaced(arm.job, arm.scene, nominal, self.offsets)
            samples = (
                {name: float(values[i]) for name, values in positions.items()}
                for i in range(self.samples)
            )
            problem = with_environment(
                robot, environment_at(arm.lowered, arm.scene, arm.job.task, samples)
            )
            known = PerturbedScenes(problem, gripper_contacts(problem))
            while self.environments and len(self.environments) * self.samples >= KEPT_SAMPLES:
                self.environments.pop(next(iter(self.environments)))
        self.environments[key] = known
        of = known.problem
        problem = robot._replace(environment=of.environment, goal_R=of.goal_R, goal_p=of.goal_p)
        return PerturbedScenes(problem, known.grippers)


class _Part(NamedTuple):
    """One configuration in some of the samples."""

    scenes: PerturbedScenes
    poses: Rows
    run: Run
    row: int
    """Number of the configuration."""
