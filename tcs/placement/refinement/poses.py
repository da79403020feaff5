"""Scores of base poses for tool poses that are given as arrays, without files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.problem import Goals, Problem, build_problem
from tcs.kernel.rows import Rows
from tcs.model.grid import Grid
from tcs.model.robots import RobotFile
from tcs.model.scene import EMPTY_ENVIRONMENT, Scene, SceneSpec, lower
from tcs.placement.constraints import Obstacle
from tcs.placement.refinement.points import PointScores
from tcs.placement.scoring.kernel_start import warm_up
from tcs.placement.scoring.obstacles import with_obstacles
from tcs.placement.scoring.scorer import Scorer
from tcs.placement.tables import Reason

SINGLE = {"start": 0.0, "step": 0.0, "count": 1}


@dataclass(frozen=True, eq=False)
class PoseScorer:
    """Scores base poses of a robot among boxes for poses of its tool, at one torso height."""

    scorer: Scorer
    """The scene, with the tool poses as goals."""
    grid: Grid
    """The base poses that the search starts from."""
    jobs: int
    """Number of threads; the scores do not depend on it."""

    @classmethod
    def of(cls, scene: PoseScene, poses: FloatArray, grid: Grid, jobs: int) -> Self:
        """Return the scorer of tool poses in W, shape (G, 4, 4)."""
        problem = scene.problem.at_poses(poses[None, :, :3, :3], poses[None, :, :3, 3])
        return cls(Scorer.of(problem), grid, jobs)

    @property
    def goals(self) -> Goals:
        """The tool poses."""
        return self.scorer.problem.goals

    def of_goals(self, goals: Sequence[int] | IntArray) -> Self:
        """Return the scorer of some of the goals."""
        chosen = np.asarray(goals, dtype=np.int64)
        R, p = self.goals.R[:, chosen], self.goals.p[:, chosen]
        problem = self.scorer.problem.at_poses(R, p)
        grippers = np.ascontiguousarray(self.scorer.grippers[:, chosen])
        return type(self)(Scorer(problem, grippers), self.grid, self.jobs)

    def score(self, points: FloatArray) -> PointScores:
        """Return the scores of base poses."""
        x, y, yaw = points[:, :3].T
        one = np.zeros(len(points), np.int64)
        found = self.scorer.score(Rows(one, x, y, yaw, one), self.jobs)
        reached = found.reason == Reason.REACHED
        hand = np.zeros(reached.shape, np.uint8)
        return PointScores(reached, found.dexterity, found.joints, hand)


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
        problem = build_problem(lowered.arrays, measure)
        warm_up(problem)
        reach = float(np.linalg.norm(problem.chain.p[1:], axis=1).sum())
        offset = float(np.linalg.norm(problem.chain.p[0]))
        return cls(problem, reach + offset, problem.arm_base.p[0])
