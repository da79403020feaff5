"""Base poses as a page that turns in the browser: Meshcat, everything inside one file."""

from __future__ import annotations

import logging
from pathlib import Path

import matplotlib
import numpy as np
from pydrake.geometry import Box, Meshcat, Rgba, Sphere
from pydrake.math import RigidTransform, RotationMatrix

from tcs.capability.merge import TaskMap
from tcs.files.writing import whole_file
from tcs.kernel.arrays import FloatArray
from tcs.output.draw.base_poses import COLOURS

_SHADES = 16
"""Meshcat takes lines of one colour at a time."""
_ABOVE_FLOOR = 0.005
_EYE = np.array([-1.3, -1.3, 1.5])
"""From the middle of what there is to the eye, when the page opens [m]."""
_GREY = Rgba(0.92, 0.92, 0.9, 1.0)
_PURPLE = Rgba(0.48, 0.25, 0.63, 1.0)


def write_page(
    path: Path,
    poses: FloatArray,
    *,
    length: float,
    tools: list[tuple[FloatArray, FloatArray]],
    best: FloatArray | None = None,
) -> None:
    """Write base poses as lines on the floor, and tools as grippers in the air.

    Args:
        path: The page to write.
        poses: x, y [m], yaw [rad] and score, shape (n, 4).
        length: Of the lines [m].
        tools: Orientation (3, 3) and place (3,) [m] of each tool.
        best: x, y, yaw of a base pose to point out, None for none.

    Raises:
        OutputError: If it cannot be written there.
    """
    # It also serves the page while it is made, and says where: nobody is to look there.
    log = logging.getLogger("drake")
    level = log.level
    log.setLevel(logging.WARNING)
    meshcat = Meshcat()
    log.setLevel(level)
    meshcat.SetProperty("/Grid", "visible", False)
    middle = np.append(0.5 * (poses[:, :2].min(axis=0) + poses[:, :2].max(axis=0)), 0.2)
    meshcat.SetCameraPose(middle + _EYE, middle)
    meshcat.SetObject("floor", Box(6.0, 6.0, 0.01), _GREY)
    meshcat.SetTransform("floor", RigidTransform([0.0, 0.0, -0.01]))
    start = np.column_stack([poses[:, :2], np.full(len(poses), _ABOVE_FLOOR)])
    ahead = np.column_stack([np.cos(poses[:, 2]), np.sin(poses[:, 2]), np.zeros(len(poses))])
    shade = np.clip((poses[:, 3] * _SHADES).astype(int), 0, _SHADES - 1)
    colours = matplotlib.colormaps[COLOURS]
    for k in np.unique(shade):
        rows = shade == k
        colour = Rgba(*(float(c) for c in colours((k + 0.5) / _SHADES)))
        end = start[rows] + length * ahead[rows]
        meshcat.SetLineSegments(f"base poses/{k}", start[rows].T, end.T, 2.0, colour)
    for i, (R, p) in enumerate(tools):
        _add_gripper(meshcat, f"tools/{i}", RigidTransform(RotationMatrix(R), p))
    if best is not None:
        x, y, yaw = best
        meshcat.SetObject("best", Box(0.16, 0.03, 0.03), Rgba(0.75, 0.0, 0.48, 1.0))
        turn = RotationMatrix.MakeZRotation(yaw)
        centre = np.array([x, y, 0.02]) + turn.matrix() @ [0.08, 0.0, 0.0]
        meshcat.SetTransform("best", RigidTransform(turn, centre))
    with whole_file(path, "Page") as stream:
        stream.write(meshcat.StaticHtml().encode())


def task_page(path: Path, found: TaskMap) -> None:
    """Write a task map as a page.

    Raises:
        OutputError: If it cannot be written there.
    """
    tools = [
        (grasp.R_FT, np.array([p.x, p.y, p.height]))
        for p in found.task.positions
        for grasp in p.grasps
    ]
    best = found.best()
    write_page(
        path,
        found.base_poses[:, [0, 1, 2, 4]],
        length=0.42 * found.grid.step,
        tools=tools,
        best=np.array([best.x, best.y, best.yaw]),
    )


def _add_gripper(meshcat: Meshcat, name: str, X_FT: RigidTransform) -> None:
    """Add two fingers, a palm and a dot between the fingers."""
    parts = {
        "left": (Box(0.07, 0.008, 0.02), [-0.015, 0.04, 0.0]),
        "right": (Box(0.07, 0.008, 0.02), [-0.015, -0.04, 0.0]),
        "palm": (Box(0.02, 0.088, 0.02), [-0.06, 0.0, 0.0]),
        "middle": (Sphere(0.008), [0.0, 0.0, 0.0]),
    }
    for part, (shape, p_TPo) in parts.items():
        meshcat.SetObject(f"{name}/{part}", shape, _PURPLE)
        meshcat.SetTransform(f"{name}/{part}", X_FT @ RigidTransform(p_TPo))
