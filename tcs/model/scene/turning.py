"""The freedom that the goals of an arm of five joints need, and its axis."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tcs.errors import ArmClassError, TaskError
from tcs.kernel.arrays import Chain
from tcs.kernel.five_joints.turned import turned_arm
from tcs.kernel.freedom.forms import COLUMNS
from tcs.kernel.kinematics import jacobian, tool_pose
from tcs.kernel.problem import with_slides
from tcs.model.tasks import Task
from tcs.model.tasks.freedom import Vector, axis_name

PARALLEL = 1e-9
"""Sine of the angle between axes that are the same but for rounding."""
CHOICES: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
"""Axes of which one is taken where any orientation serves at every goal."""
POSTURES = 50
"""Number of random postures at which they are compared."""


def freedom_rows(task: Task | None, chain: Chain, robot: str) -> NDArray[np.float64]:
    """Return what is free about each pose of the goals of a task, as the kernel reads it.

    Args:
        task: The task, None for none.
        chain: The arm.
        robot: Name of the robot, for messages.

    Returns:
        Shape (poses, COLUMNS), without rows if nothing is free. With an arm of five joints, goals
        with any orientation name the axis that the others leave free.

    Raises:
        TaskError: If an arm of five joints lacks the freedom that it needs.
    """
    if task is None:
        return np.empty((0, COLUMNS))
    turn = axis_of_turn(task, chain, robot)
    if turn is None and all(pose.free is None for pose in task.poses):
        return np.empty((0, COLUMNS))
    rows = np.zeros((len(task.poses), COLUMNS))
    for row, pose in zip(rows, task.poses, strict=True):
        if pose.free is not None:
            row[:] = pose.free.row()
        if turn is not None:
            row[:3] = turn
    return rows


def axis_of_turn(task: Task, chain: Chain, robot: str) -> Vector | None:
    """Return the axis about which all goals leave the tool free, for an arm of five joints.

    Args:
        task: The task.
        chain: The arm.
        robot: Name of the robot, for messages.

    Returns:
        A unit vector in the tool frame; None for an arm of more joints.

    Raises:
        TaskError: If a goal leaves no rotation free, goals name different axes, or the rotation
            adds nothing to what the joints can do.
    """
    if chain.joints != 5:
        return None
    named: list[tuple[int, Vector]] = []
    numbered = [(i, pose.free) for i, goal in enumerate(task.goals) for pose in goal.poses]
    for i, free in numbered:
        if free is None or not free.rotates:
            raise TaskError(
                f"task '{task.name}', goal {i + 1}: the arm of robot '{robot}' has five joints and "
                "cannot take every tool pose, so the goal must leave a rotation of the tool free. "
                "Add 'free: {rotation_about: [x, y, z]}' or 'free: orientation' to the goal."
            )
        if not free.is_any_orientation:
            named.append((i, free.axis))
    for i, axis in named[1:]:
        first, of_first = named[0]
        if np.linalg.norm(np.cross(axis, of_first)) > PARALLEL:
            raise TaskError(
                f"task '{task.name}': goal {first + 1} leaves the rotation about "
                f"{axis_name(of_first)} free and goal {i + 1} that about "
                f"{axis_name(axis)}, but an "
                f"arm of five joints, as of robot '{robot}', needs the same axis at all goals. "
                "Score them as two tasks."
            )
    axis = named[0][1] if named else _least_like_a_joint(chain)
    try:
        turned_arm(chain, np.array(axis))
    except ArmClassError as error:
        raise TaskError(
            f"task '{task.name}', robot '{robot}': about {axis_name(axis)}, {error}"
        ) from None
    return axis


def _least_like_a_joint(chain: Chain) -> Vector:
    """Return the axis about which a rotation adds most to what the joints of an arm can do."""
    rng = np.random.default_rng(0)
    lower, upper = np.maximum(chain.lower, -np.pi), np.minimum(chain.upper, np.pi)
    postures = rng.uniform(lower, upper, (POSTURES, 7)) * (np.arange(7) > 1)
    volumes = np.zeros((POSTURES, len(CHOICES)))
    R_chain, p_chain = np.array(chain.R, order="C"), with_slides(chain)
    J, link_R, link_p = np.empty((6, 7)), np.empty((8, 3, 3)), np.empty((8, 3))
    R, p = np.empty((3, 3)), np.empty(3)
    for n, q in enumerate(postures):
        jacobian(R_chain, p_chain, q, J)
        tool_pose(R_chain, p_chain, q, link_R, link_p, R, p)
        for k, axis in enumerate(CHOICES):
            J[:, 1] = [*(R @ axis), 0.0, 0.0, 0.0]
            volumes[n, k] = abs(np.linalg.det(J[:, 1:]))
    return CHOICES[int(np.argmax(np.median(volumes, axis=0)))]
