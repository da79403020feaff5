"""A task map's base poses among furniture: which of them the room leaves possible."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from tcs.capability.merge import BasePose, TaskMap
from tcs.capability.tasks import GraspTask
from tcs.errors import SelectionError
from tcs.kernel.analytic.pairs import BODY_BLOCKED, REACHED
from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.kernel.problem import build_problem
from tcs.kernel.sweep import Scores, gripper_contacts, score_slice
from tcs.model.grid import Axis, Grid
from tcs.model.robots import RobotFile
from tcs.model.scene import EnvironmentFile, Scene, SceneSpec, lower

MOST_TRIED = 2000
"""Base poses that are looked at, best first, before the search gives up."""


@dataclass(frozen=True, slots=True)
class Judged:
    """What the room leaves of one base pose."""

    body_blocked: bool
    """Whether the robot cannot stand there at all."""
    reached: tuple[bool, ...]
    """For each position whether a grasp with all its pre-grasps is reached, touching nothing."""

    @property
    def possible(self) -> bool:
        """Whether the whole task can be done."""
        return not self.body_blocked and all(self.reached)


class Surroundings:
    """A room with a task in it."""

    def __init__(
        self,
        robot: RobotFile,
        environment: EnvironmentFile,
        at: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> None:
        """Build the scene.

        Args:
            robot: The robot.
            environment: What surrounds it, in the state that its file says.
            at: Where the task frame F is in W: x, y [m] and heading [rad].

        Raises:
            RobotError: If the robot's model cannot be used.
            EnvironmentFileError: If a model of the environment cannot be used.
        """
        self._scene = Scene(SceneSpec(robot, environment))
        self._at = at

    def judge(self, task: GraspTask, base: BasePose) -> Judged:
        """Return what a base pose is good for, by the kernel, at the very poses of the tool.

        Args:
            task: The tool poses, in F.
            base: The base pose, in F.
        """
        poses = [
            (i, k, grasp.R_FT, np.array([p.x, p.y, p.height]) - back * grasp.R_FT[:, 0])
            for i, p in enumerate(task.positions)
            for k, grasp in enumerate(p.grasps)
            for back in (0.0, *grasp.pre_grasps)
        ]
        x, y, yaw = self._at
        c, s = math.cos(yaw), math.sin(yaw)
        R_WF = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        R_WT = np.stack([R_WF @ R for _, _, R, _ in poses])
        p_WT = np.stack([R_WF @ p + [x, y, 0.0] for _, _, _, p in poses])
        place = (x + c * base.x - s * base.y, y + s * base.x + c * base.y, yaw + base.yaw)
        blocked, free = self._solve(place, base.lift, R_WT, p_WT)
        grasped: dict[tuple[int, int], bool] = {}
        for (i, k, _, _), reached in zip(poses, free, strict=True):
            grasped[i, k] = grasped.get((i, k), True) and bool(reached)
        positions = range(len(task.positions))
        return Judged(
            blocked, tuple(any(v for (i, _), v in grasped.items() if i == n) for n in positions)
        )

    def best(self, found: TaskMap) -> tuple[BasePose, int]:
        """Return the best base pose that the room leaves, and how many better ones it takes away.

        Args:
            found: The task map.

        Raises:
            SelectionError: If none of the best `MOST_TRIED` is left.
        """
        order = np.argsort(-found.base_poses[:, 4], kind="stable")[:MOST_TRIED]
        for tried, row in enumerate(order):
            base = BasePose(*map(float, found.base_poses[row]))
            if self.judge(found.task, base).possible:
                return base, tried
        raise SelectionError(
            f"task '{found.task.name}': the room leaves none of the best {len(order)} base poses. "
            "Move the task, or what stands around it."
        )

    def _solve(
        self, place: tuple[float, float, float], lift: float, R_WT: FloatArray, p_WT: FloatArray
    ) -> tuple[bool, BoolArray]:
        """Return whether the body is blocked at a place in W, and which tool poses are reached."""
        x, y, yaw = place
        axes = (
            Axis("base_x", "m", x, 0.0, 1), Axis("base_y", "m", y, 0.0, 1),
            Axis("base_yaw", "deg", math.degrees(yaw), 0.0, 1), Axis("torso", "m", lift, 0.0, 1),
        )  # fmt: skip
        lowered = lower(self._scene, None, Grid(axes))
        arrays = lowered.arrays._replace(goal_R=R_WT[None], goal_p=p_WT[None])
        problem = build_problem(arrays, lowered.grid)
        count = len(p_WT)
        scores: Any = Scores(
            np.empty((1, count), np.uint8),
            np.empty((1, count), np.int32),
            np.zeros((1, count), np.float32),
            np.zeros((1, count, 7), np.float32),
        )
        score_slice(problem, gripper_contacts(problem), 0, 1, scores)
        return bool(np.any(scores.reason == BODY_BLOCKED)), scores.reason[0] == REACHED
