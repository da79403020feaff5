"""Perturbed scenes: the environment in several samples as kernel arrays, scored from base poses."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from tcs.errors import TcsError
from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.dexterity import ANY_SOLUTION
from tcs.kernel.problem import Problem
from tcs.kernel.scores import Scores
from tcs.kernel.sweep import score_slice
from tcs.placement.scoring.approaches import ApproachScorer
from tcs.placement.tables import Reason

BATCH = 500
"""Pairs of configuration and sample that a thread evaluates at a time: milliseconds of work."""


class BasePoses(NamedTuple):
    """Configurations by base pose, torso level, arm and environment state, shapes (m,)."""

    state: IntArray
    """Number of the environment's state in the grid; those of a second arm follow."""
    x: FloatArray
    """x of the base in W [m]."""
    y: FloatArray
    """y of the base in W [m]."""
    yaw: FloatArray
    """Heading of the base [rad]."""
    torso: IntArray
    """Number of the torso level in the grid."""


class Run(NamedTuple):
    """One configuration in consecutive samples, start <= s < stop."""

    row: int
    """Row of the configuration in its `BasePoses`."""
    start: int
    stop: int


class PerturbedScenes(NamedTuple):
    """One state of the environment in several samples, as kernel arrays."""

    problem: Problem
    """Each sample is a state of the environment; the grid has a single base pose, still unset."""
    grippers: IntArray
    """Contacts between gripper and environment at each goal."""
    approaches: ApproachScorer | None = None
    """Scores the approaches of the goals; None to score all postures."""

    def at_base(self, poses: BasePoses, row: int) -> Problem:
        """Return the problem with the base pose and torso level of a configuration."""
        problem, level = self.problem, int(poses.torso[row])
        only = slice(level, level + 1)
        return problem._replace(
            base_x=poses.x[row : row + 1],
            base_y=poses.y[row : row + 1],
            base_yaw=poses.yaw[row : row + 1],
            base_R=problem.base_R[only],
            base_p=problem.base_p[only],
            body=problem.body[only],
            body_A=problem.body_A[only],
            body_spheres=problem.body_spheres[only],
            rest=problem.rest[only],
            rest_spheres=problem.rest_spheres[only],
            torso_levels=1,
        )

    def scores(self, poses: BasePoses, run: Run) -> Scores:
        """Return the scores of one run, computed by the code that scores a grid."""
        problem = self.at_base(poses, run.row)
        shape = (run.stop - run.start, problem.goal_p.shape[1])
        scores = Scores(
            reason=np.empty(shape, np.uint8),
            contact=np.empty(shape, np.int32),
            dexterity=np.zeros(shape, np.float32),
            joints=np.zeros((*shape, 7), np.float32),
        )
        score_slice(problem, self.grippers, run.start, run.stop, scores)
        if self.approaches is not None:
            level = int(poses.torso[run.row])
            self.approaches.score_slice(problem, run.start, scores, torso=level)
        return scores

    def reasons(self, poses: BasePoses, run: Run) -> NDArray[np.uint8]:
        """Return the reason of each sample and goal of one run, shape (stop - start, goals).

        They are those of `scores`, whose search goes on for the best solution. With approach it has
        to: from another posture some approaches through narrow windows are not found.
        """
        if self.approaches is not None:
            return self.scores(poses, run).reason
        problem = self.problem._replace(measure=ANY_SOLUTION)
        return self._replace(problem=problem).scores(poses, run).reason

    def reached(
        self, poses: BasePoses, runs: list[Run], jobs: int
    ) -> Iterator[tuple[Run, NDArray[np.bool_]]]:
        """Yield the goals that each run reaches, shape (stop - start, goals), in parallel.

        Raises:
            TcsError: If the number of threads is not positive.
        """
        if jobs < 1:
            raise TcsError(f"jobs is {jobs}; must be 1 or more threads.")
        batches: list[list[Run]] = [[]]
        size = 0
        for run in runs:
            if size >= BATCH:
                batches.append([])
                size = 0
            batches[-1].append(run)
            size += run.stop - run.start
        parallel = Parallel(n_jobs=jobs, prefer="threads", return_as="generator")
        work = (delayed(self._reached)(poses, batch) for batch in batches)
        for batch, found in zip(batches, parallel(work), strict=True):
            yield from zip(batch, found, strict=True)

    def _reached(self, poses: BasePoses, runs: list[Run]) -> list[NDArray[np.bool_]]:
        return [self.reasons(poses, run) == Reason.REACHED for run in runs]
