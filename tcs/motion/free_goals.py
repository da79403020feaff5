"""Where in its freedom a goal is reached: motions lead to that pose."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from tcs.kernel.approach.sweep import ApproachLines
from tcs.kernel.arrays import FloatArray, GridArrays, IntArray
from tcs.kernel.motion.scene import goal_from_arm_base
from tcs.kernel.postures import tool_poses
from tcs.kernel.problem import Problem
from tcs.kernel.rows import rows_at
from tcs.kernel.scores import REACHED
from tcs.kernel.sweep import gripper_contacts, score
from tcs.placement.scoring.approaches import ApproachScorer

Pose = tuple[FloatArray, FloatArray]
"""Orientation, shape (3, 3), and position [m], shape (3,)."""


class FreeGoalPoses:
    """The pose at which each goal of a scene is reached from its initial configurations.

    It is that of the most dexterous posture that scoring finds, of those that can be approached if
    there are any. Of a goal that is not reached, or
    not free, it is the nominal pose, the first one of a goal that has several.
    """

    def __init__(
        self, problem: Problem, grid: GridArrays, free: Sequence[bool], lines: ApproachLines
    ) -> None:
        """Take a scene, its configurations, whether each goal is free, and their approaches."""
        self._problem, self._grid, self._free = problem, grid, free
        self._approaches = ApproachScorer(problem, lines)
        self._known: dict[int, list[Pose]] = {}

    def at(self, configuration: int) -> list[Pose]:
        """Return X_GT of every goal, the pose of the tool in the frame of the goal.

        Args:
            configuration: Flat index of the initial configuration.
        """
        if configuration not in self._known:
            self._known[configuration] = self._scored(configuration)
        return self._known[configuration]

    @cached_property
    def _grippers(self) -> IntArray:
        return gripper_contacts(self._problem)

    def _scored(self, configuration: int) -> list[Pose]:
        problem, row = self._problem, rows_at(self._grid, [configuration])
        goals = problem.goals.number
        scores = score(problem, row, self._grippers)
        led = copy.deepcopy(scores)
        self._approaches.score_rows(problem, row, led)
        is_led = (led.reason[0] == REACHED)[:, None]
        q = np.where(is_led, led.joints[0], scores.joints[0]).astype(np.float64)
        R_AT, p_AT = np.empty((goals, 3, 3)), np.empty((goals, 3))
        tool_poses(problem.chain.R, problem.chain.p, q, R_AT, p_AT)
        poses = []
        for goal, reason in enumerate(scores.reason[0]):
            R_GT, p_GT = np.eye(3), np.zeros(3)
            if self._free[goal] and reason == REACHED:
                R_AG, p_AG = goal_from_arm_base(problem, row, goal)
                R_GT, p_GT = R_AG.T @ R_AT[goal], R_AG.T @ (p_AT[goal] - p_AG)
            poses.append((R_GT, p_GT))
        return poses
