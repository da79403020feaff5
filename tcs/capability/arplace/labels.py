"""Labels: the base positions from which the kernel reaches each grasp."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from joblib import Parallel, delayed

from tcs.capability.arplace.task import TableTask
from tcs.capability.reach import OnProgress
from tcs.capability.tasks import Grasp
from tcs.errors import GridError
from tcs.kernel.arrays import (
    CAPSULE,
    SPHERE,
    BoolArray,
    FloatArray,
    GridArrays,
    SceneArrays,
    Shapes,
)
from tcs.kernel.contacts import BASE_FIXED
from tcs.kernel.problem import Problem, build_problem
from tcs.kernel.rows import grid_rows
from tcs.kernel.scores import REACHED
from tcs.kernel.sweep import gripper_contacts, score
from tcs.model.grid import Axis, Grid
from tcs.model.robots import RobotFile
from tcs.model.scene import EnvironmentFile, LoweredScene, Scene, SceneSpec, lower

TABLE = "table"
_BEYOND = 2.0
"""Extent of the table beyond the base positions along y [m], more than the reach of the arms."""
_SLICE = 256
"""Base positions per task of a thread."""


@dataclass(frozen=True, eq=False)
class Labels:
    """The base positions from which each grasp is reached."""

    reached: BoolArray
    """Shape (grasps, x, y), in the order of `TableTask.parameters`."""
    torso_height: float
    """Torso height [m]."""
    base_radius: float
    """Radius about the base's origin that encloses what is fixed to the base [m]."""
    scene_digest: str
    """Digest of the scene, see `LoweredScene.digest`."""


def label(
    robot: RobotFile, task: TableTask, *, jobs: int = 2, on_progress: OnProgress | None = None
) -> Labels:
    """Return the labels of all grasps and base positions of a task.

    A label is true if a posture within the joint limits reaches the grasp without contact of the
    robot with itself, the table and the floor. The object itself is not an obstacle.

    Args:
        robot: The robot.
        task: The grasps and base positions.
        jobs: Number of threads; the labels do not depend on it.
        on_progress: Called with the number of labels done and of all.

    Raises:
        RobotError: If the model of the robot cannot be used.
        GridError: If the torso height is out of range.
    """
    scene, torso_height = table_scene(robot, task)
    lowered = lower(scene, None, _grid(task, torso_height))
    arrays = _with_heights(lowered, task)
    grid = lowered.grid._replace(environment_states=task.height.count)
    problem = build_problem(arrays)
    states, x, y = task.height.count, task.base_x.count, task.base_y.count
    goals = problem.goals.number
    found = np.empty((states * x * y, goals), np.bool_)
    grippers = gripper_contacts(problem)
    done = 0
    runs = (
        delayed(_label_slice)(problem, grippers, grid, start, found[start : start + _SLICE])
        for start in range(0, len(found), _SLICE)
    )
    # Threads suffice, as the kernel releases the interpreter lock.
    for size in Parallel(jobs, "threading", return_as="generator_unordered")(runs):
        done += size
        if on_progress is not None:
            on_progress(done, found.size)
    # From (height, x, y, distance, angle) to (distance, height, angle, x, y).
    by_state = found.reshape(states, x, y, task.distance.count, task.angle.count)
    reached = np.ascontiguousarray(by_state.transpose(3, 0, 4, 1, 2)).reshape(len(task), x, y)
    radius = base_radius(lowered.arrays.body)
    return Labels(reached, torso_height, radius, lowered.digest())


def table_scene(robot: RobotFile, task: TableTask) -> tuple[Scene, float]:
    """Return the scene with the table at the first height of a task, and the torso height [m].

    Raises:
        RobotError: If the model of the robot cannot be used.
        GridError: If the torso height is out of range.
    """
    top = task.height.values - task.below_tool
    thickness = float(top[-1]) if task.thickness is None else task.thickness
    width = 2.0 * (float(np.abs(task.base_y.values).max()) + _BEYOND)
    box: Any = {
        "name": TABLE,
        "box": [task.depth, width, thickness],
        "xyz": [0.5 * task.depth, 0.0, float(top[0]) - 0.5 * thickness],
    }
    axes = {
        name: {"unit": unit, "start": 0.0, "step": 0.0, "count": 1}
        for name, unit in (("base_x", "m"), ("base_y", "m"), ("base_yaw", "deg"), ("torso", "m"))
    }
    environment = EnvironmentFile(
        name=TABLE, title="A table", origin="On the floor, below its front edge",
        source="ITCM thesis, Appendix D", grid=axes, obstacles=(box,),
    )  # fmt: skip
    scene = Scene(SceneSpec(robot, environment))
    low, high = scene.built.torso_limits
    torso_height = 0.5 * (low + high) if task.torso_height is None else task.torso_height
    if not low <= torso_height <= high:
        raise GridError(
            f"robot '{robot.name}': torso height {torso_height:g} m is out of range; must be "
            f"{low:g} to {high:g} m."
        )
    return scene, float(torso_height)


def grasp_rotation(task: TableTask, angle: float) -> FloatArray:
    """Return R_FT of a grasp at an angle [rad], shape (3, 3)."""
    return Grasp(angle, task.approach).R_FT


def base_radius(body: Shapes) -> float:
    """Return the radius about the base's vertical axis that encloses what is fixed to the base [m].

    Args:
        body: Shapes of the robot but for the arm, in B.
    """
    farthest = 0.0
    corners = np.array([(i, j, k) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
    for n in np.flatnonzero(body.frame == BASE_FIXED):
        size = body.size[n]
        if body.type[n] == SPHERE:
            points, around = np.zeros((1, 3)), size[0]
        elif body.type[n] == CAPSULE:
            points, around = np.array([[0, 0, -1], [0, 0, 1]]) * size[1], size[0]
        else:
            points, around = corners * size, 0.0
        at = body.p[0, n] + points @ body.R[0, n].T
        farthest = max(farthest, float(np.hypot(at[:, 0], at[:, 1]).max() + around))
    return farthest


def _grid(task: TableTask, torso_height: float) -> Grid:
    """Return the grid of base positions at one torso height."""
    yaw = Axis("base_yaw", "deg", task.base_yaw_deg, 0.0, 1)
    return Grid((task.base_x, task.base_y, yaw, Axis("torso", "m", torso_height, 0.0, 1)))


def _with_heights(lowered: LoweredScene, task: TableTask) -> SceneArrays:
    """Return the arrays with one state of the environment for each height of the task."""
    arrays, heights = lowered.arrays, task.height.values
    names = np.array(lowered.environment_bodies)[arrays.environment.body]
    R = np.repeat(arrays.environment.R, len(heights), axis=0)
    p = np.repeat(arrays.environment.p, len(heights), axis=0)
    is_table = np.array([name.split("::")[0] == TABLE for name in names])
    p[:, is_table, 2] += (heights - heights[0])[:, None]
    distances, angles = task.distance.values, task.angle.values
    goals = len(distances) * len(angles)
    goal_R = np.array([grasp_rotation(task, float(angle)) for angle in angles])
    goal_p = np.zeros((len(heights), goals, 3))
    goal_p[..., 0], goal_p[..., 2] = np.repeat(distances, len(angles)), heights[:, None]
    return arrays._replace(
        environment=arrays.environment._replace(R=R, p=p),
        goal_R=np.tile(goal_R, (len(heights), len(distances), 1, 1)),
        goal_p=goal_p,
    )


def _label_slice(
    problem: Problem, grippers: Any, grid: GridArrays, start: int, found: BoolArray
) -> int:
    """Fill the labels of consecutive base positions from `start` on; return their number."""
    scores = score(problem, grid_rows(grid, start, start + len(found)), grippers)
    found[:] = scores.reason == REACHED
    return found.size
