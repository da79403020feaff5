"""Scores of base poses for tool poses that are given as arrays, without files."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from joblib import Parallel, delayed

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.problem import Problem, build_problem
from tcs.kernel.scores import Scores
from tcs.kernel.sweep import gripper_contacts, score_slice
from tcs.model.grid import Grid
from tcs.model.robots import RobotFile
from tcs.model.scene import EMPTY_ENVIRONMENT, Scene, SceneSpec, lower
from tcs.placement.constraints import Obstacle
from tcs.placement.refinement.points import PointScores
from tcs.placement.scoring.kernel_start import warm_up
from tcs.placement.scoring.obstacles import with_obstacles
from tcs.placement.tables import Points, Reason

BATCH = 64
"""Most base poses that a thread scores at a time."""
SINGLE = {"start": 0.0, "step": 0.0, "count": 1}


@dataclass(frozen=True, eq=False)
class PoseScorer:
    """Scores base poses of a robot among boxes for poses of its tool, at one torso height."""

    problem: Problem
    """The scene, with the tool poses as goals and a single base pose."""
    grippers: IntArray
    """Contacts of the gripper with the boxes at each goal, shape (1, G)."""
    grid: Grid
    """The base poses that the search starts from."""
    jobs: int
    """Number of threads; the scores do not depend on it."""

    @classmethod
    def of(cls, scene: PoseScene, poses: FloatArray, grid: Grid, jobs: int) -> Self:
        """Return the scorer of tool poses in W, shape (G, 4, 4)."""
        problem = scene.problem._replace(
            goal_R=np.ascontiguousarray(poses[None, :, :3, :3]),
            goal_p=np.ascontiguousarray(poses[None, :, :3, 3]),
        )
        return cls(problem, gripper_contacts(problem), grid, jobs)

    def of_goals(self, goals: Sequence[int] | IntArray) -> Self:
        """Return the scorer of some of the goals."""
        chosen = np.asarray(goals, dtype=np.int64)
        problem = self.problem._replace(
            goal_R=np.ascontiguousarray(self.problem.goal_R[:, chosen]),
            goal_p=np.ascontiguousarray(self.problem.goal_p[:, chosen]),
        )
        grippers = np.ascontiguousarray(self.grippers[:, chosen])
        return type(self)(problem, grippers, self.grid, self.jobs)

    def at(self, base: FloatArray) -> Problem:
        """Return the problem at base poses that differ in x alone, shape (n, 3): x, y, yaw."""
        return self.problem._replace(
            base_x=base[:, 0].copy(), base_y=base[:1, 1].copy(), base_yaw=base[:1, 2].copy()
        )

    def score(self, points: Points) -> PointScores:
        """Return the scores of base poses."""
        shape = (len(points.values), self.problem.goal_p.shape[1])
        found = Scores(
            reason=np.empty(shape, np.uint8),
            contact=np.empty(shape, np.int32),
            dexterity=np.zeros(shape, np.float32),
            joints=np.zeros((*shape, 7), np.float32),
        )

        # Base poses that differ in x alone are configurations of one problem: sorted by the others,
        # they follow each other.
        base = points.values[:, :3]
        order = np.lexsort(base.T)
        apart = np.any(np.diff(base[order, 1:], axis=0) != 0.0, axis=1)
        first = np.union1d(np.flatnonzero(np.r_[True, apart]), np.arange(0, shape[0], BATCH))

        def score_batch(start: int, stop: int) -> None:
            rows = order[start:stop]
            part = Scores(
                found.reason[start:stop],
                found.contact[start:stop],
                found.dexterity[start:stop],
                found.joints[start:stop],
            )
            score_slice(self.at(base[rows]), self.grippers, 0, len(rows), part)

        Parallel(n_jobs=self.jobs, prefer="threads")(
            delayed(score_batch)(*ends) for ends in itertools.pairwise([*first, shape[0]])
        )
        reached = found.reason == Reason.REACHED
        found.dexterity[~reached], found.joints[~reached] = 0.0, 0.0
        back = np.argsort(order)
        return PointScores(reached[back], found.dexterity[back], found.joints[back])


@dataclass(frozen=True, eq=False)
class PoseScene:
    """A robot among boxes, prepared for any tool poses; building it takes half a second."""

    problem: Problem
    """The scene without goals."""
    reach: float
    """Greatest distance of the tool from the arm's first joint [m]."""
    arm_base: FloatArray
    """Origin of the arm base A in B [m], shape (3,)."""

    @classmethod
    def of(
        cls, robot: RobotFile, obstacles: Sequence[Obstacle], torso: float, measure: str
    ) -> Self:
        """Return the scene of a robot at a torso height [m], the kernel compiled."""
        scene = Scene(SceneSpec(robot, with_obstacles(EMPTY_ENVIRONMENT, obstacles)))
        grid = Grid.from_spec(
            {
                "base_x": {"unit": "m", **SINGLE},
                "base_y": {"unit": "m", **SINGLE},
                "base_yaw": {"unit": "deg", **SINGLE},
                "torso": {"unit": "m", **SINGLE, "start": torso},
            }
        )
        lowered = lower(scene, None, grid)
        problem = build_problem(lowered.arrays, lowered.grid, measure)
        warm_up(problem)
        reach = float(np.linalg.norm(problem.chain_p[1:], axis=1).sum())
        offset = float(np.linalg.norm(problem.chain_p[0]))
        return cls(problem, reach + offset, problem.base_p[0])
