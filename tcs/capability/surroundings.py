"""Feasibility of the base poses of a task map among the obstacles of an environment."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tcs.capability.map import CapabilityMap
from tcs.capability.map_files import robot_reference, stored_name
from tcs.capability.merge import BasePose, TaskMap
from tcs.capability.tasks import GraspTask
from tcs.errors import SelectionError, TaskError
from tcs.files.quantities import ANGLE, POSITION
from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.kernel.problem import build_problem
from tcs.kernel.rows import single_row
from tcs.kernel.scores import BODY_BLOCKED, REACHED
from tcs.kernel.sweep import score
from tcs.model.grid import Axis, Grid
from tcs.model.robots import RobotFile, load_robot
from tcs.model.scene import EnvironmentFile, LoweredScene, Scene, SceneSpec, load_environment, lower

MOST_TRIED = 2000
"""Greatest number of base poses that are checked, best first."""


@dataclass(frozen=True, slots=True)
class Feasibility:
    """Feasibility of a task from one base pose in an environment."""

    body_blocked: bool
    """Whether the body of the robot is in contact."""
    reached: tuple[bool, ...]
    """For each position, whether a grasp and all its pre-grasps are reached without contact."""

    @property
    def feasible(self) -> bool:
        """Whether the whole task is feasible."""
        return not self.body_blocked and all(self.reached)


class Surroundings:
    """An environment with a task in it."""

    def __init__(
        self,
        robot: RobotFile,
        environment: EnvironmentFile,
        task_pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> None:
        """Build the scene.

        Args:
            robot: The robot.
            environment: The environment, in the state of its file.
            task_pose: Pose of the task frame F in W: x, y [m] and heading [rad].

        Raises:
            RobotError: If the model of the robot cannot be used.
            EnvironmentFileError: If a model of the environment cannot be used.
            TaskError: If the pose is out of its physical range.
        """
        POSITION.check(task_pose[:2], "the task: a coordinate of its frame", TaskError)
        ANGLE.check(task_pose[2], "the task: the heading of its frame", TaskError)
        self._scene = Scene(SceneSpec(robot, environment))
        self._task_pose = task_pose
        self._arrays: tuple[float, LoweredScene] | None = None
        """The torso height that was used last [m], and the arrays at it."""

    @classmethod
    def load(
        cls,
        path: Path,
        capability: CapabilityMap,
        environment: str | Path,
        task_pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
        *,
        robot: str | None = None,
    ) -> Surroundings:
        """Return the environment for the robot of a map.

        Args:
            path: File of the map, for messages.
            capability: The map.
            environment: Name or file of the environment.
            task_pose: As in the constructor.
            robot: Name or file of the robot; None is the one stored in the map.

        Raises:
            StoreError: If the file of the robot is missing.
            UnknownNameError: If there is no such environment or robot.
        """
        file = load_robot(robot_reference(path, capability, robot))
        file = file.model_copy(update={"tool_frame": stored_name(capability, "tool")})
        return cls(file, load_environment(environment), task_pose)

    def feasibility(self, task: GraspTask, base: BasePose) -> Feasibility:
        """Return the feasibility of a task, solved by the kernel at the exact tool poses.

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
        x, y, yaw = self._task_pose
        c, s = math.cos(yaw), math.sin(yaw)
        R_WF = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        R_WT = np.stack([R_WF @ R for _, _, R, _ in poses])
        p_WT = np.stack([R_WF @ p + [x, y, 0.0] for _, _, _, p in poses])
        base_pose = (x + c * base.x - s * base.y, y + s * base.x + c * base.y, yaw + base.yaw)
        blocked, free = self._solve(base_pose, base.torso_height, R_WT, p_WT)
        grasped: dict[tuple[int, int], bool] = {}
        for (i, k, _, _), reached in zip(poses, free, strict=True):
            grasped[i, k] = grasped.get((i, k), True) and bool(reached)
        positions = range(len(task.positions))
        return Feasibility(
            blocked, tuple(any(v for (i, _), v in grasped.items() if i == n) for n in positions)
        )

    def best(self, found: TaskMap) -> tuple[BasePose, int]:
        """Return the best feasible base pose, and the number of better ones that are infeasible.

        Args:
            found: The task map.

        Raises:
            SelectionError: If none of the best `MOST_TRIED` is feasible.
        """
        order = np.argsort(-found.base_poses[:, 4], kind="stable")[:MOST_TRIED]
        for rejected, row in enumerate(order):
            base = BasePose(*map(float, found.base_poses[row]))
            if self.feasibility(found.task, base).feasible:
                return base, rejected
        raise SelectionError(
            f"task '{found.task.name}': none of the best {len(order)} base poses is feasible in "
            "the environment. Move the task or the obstacles."
        )

    def _lowered(self, torso_height: float) -> LoweredScene:
        """Return the scene as arrays, which the base pose does not affect."""
        if self._arrays is None or self._arrays[0] != torso_height:
            fixed = (("base_x", "m"), ("base_y", "m"), ("base_yaw", "deg"))
            axes = (Axis(name, unit, 0.0, 0.0, 1) for name, unit in fixed)
            grid = Grid((*axes, Axis("torso", "m", torso_height, 0.0, 1)))
            self._arrays = torso_height, lower(self._scene, None, grid)
        return self._arrays[1]

    def _solve(
        self,
        base_pose: tuple[float, float, float],
        torso_height: float,
        R_WT: FloatArray,
        p_WT: FloatArray,
    ) -> tuple[bool, BoolArray]:
        """Return whether the body is in contact at a base pose in W, and the reached tool poses."""
        lowered = self._lowered(torso_height)
        arrays = lowered.arrays._replace(goal_R=R_WT[None], goal_p=p_WT[None])
        scores = score(build_problem(arrays), single_row(*base_pose))
        return bool(np.any(scores.reason == BODY_BLOCKED)), scores.reason[0] == REACHED
