"""Capability maps and task maps as pictures or interactive pages."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
from pydrake.geometry import Box, Meshcat, Rgba, Sphere
from pydrake.math import RigidTransform, RotationMatrix

from tcs.capability.map import CapabilityMap
from tcs.capability.merge import TaskMap
from tcs.files.writing import whole_file
from tcs.kernel.arrays import FloatArray
from tcs.output.draw import save_figure
from tcs.output.draw.base_poses import COLOURS
from tcs.output.draw.capability_maps import LINE_STEPS, layer, map_figure, task_figure
from tcs.output.view.live import open_meshcat

_SHADES = 16
"""Number of colours: Meshcat draws line segments of one colour at a time."""
_ABOVE_FLOOR = 0.005
"""Height of the lines [m]."""
_EYE = np.array([-1.3, -1.3, 1.5])
"""Initial camera position relative to the centre of the base poses [m]."""
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
    """Write an interactive page: base poses as lines on the floor, tools as grippers.

    Args:
        path: The page to write.
        poses: x, y [m], yaw [rad] and score, shape (n, 4).
        length: Length of the lines [m].
        tools: Orientation (3, 3) and position (3,) [m] of each tool.
        best: x, y, yaw of a base pose to highlight, or None.

    Raises:
        OutputError: If Meshcat finds no free port, or the page cannot be written.
    """
    meshcat = open_meshcat()
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
        R_WB = RotationMatrix.MakeZRotation(yaw)
        centre = np.array([x, y, 0.02]) + R_WB.matrix() @ [0.08, 0.0, 0.0]
        meshcat.SetTransform("best", RigidTransform(R_WB, centre))
    with whole_file(path, "Page") as stream:
        stream.write(meshcat.StaticHtml().encode())


def save_task_map(path: Path, task_map: TaskMap) -> None:
    """Draw a task map: an interactive page if the path ends in .html, else a figure.

    Args:
        path: File to write.
        task_map: The task map.

    Raises:
        OutputError: If the format is unknown, or the file cannot be written.
    """
    if path.suffix != ".html":
        save_figure(path, task_figure(task_map))
        return
    tools = [
        (grasp.R_FT, np.array([p.x, p.y, p.height]))
        for p in task_map.task.positions
        for grasp in p.grasps
    ]
    best = task_map.best()
    write_page(
        path,
        task_map.base_poses[:, [0, 1, 2, 4]],
        length=LINE_STEPS * task_map.grid.step,
        tools=tools,
        best=np.array([best.x, best.y, best.yaw]),
    )


def save_map_layer(
    path: Path, capability: CapabilityMap, *, tilt: int = 0, height: float | None = None
) -> None:
    """Draw one layer of a map: an interactive page if the path ends in .html, else a figure.

    Args:
        path: File to write.
        capability: The map.
        tilt: Number of the tilt.
        height: Height of the tool above the floor [m]; None is the height with most cells.

    Raises:
        UnknownNameError: If the grid has no such tilt.
        SelectionError: If the map has no base pose there, or the height is not finite.
        OutputError: If the format is unknown, or the file cannot be written.
    """
    if path.suffix != ".html":
        save_figure(path, map_figure(capability, tilt=tilt, height=height))
        return
    poses, drawn = layer(capability, tilt=tilt, height=height)
    tools = [(capability.grid.R_ET[tilt], np.array([0.0, 0.0, drawn]))]
    write_page(path, poses, length=LINE_STEPS * capability.grid.step, tools=tools)


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
