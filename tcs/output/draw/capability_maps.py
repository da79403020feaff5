"""Figures of capability maps and task maps."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from tcs.capability.grid import TILT, Z
from tcs.capability.map import CapabilityMap
from tcs.capability.merge import BasePose, TaskMap
from tcs.errors import SelectionError, UnknownNameError
from tcs.kernel.arrays import FloatArray
from tcs.output.draw.base_poses import BasePoseView, draw_base_poses

_BEST, _WORST = "#c0007a", "#404040"
_BEYOND = 1e6
"""Cell coordinates of this magnitude are beyond every map."""


def task_figure(*maps: TaskMap) -> Figure:
    """Return a figure of task maps side by side, as in the ITCM thesis, Figures 3, 5 and 37."""
    views = [task_view(found) for found in maps]
    return draw_base_poses(views, title=maps[0].task.name, score="score at the best torso height")


def task_view(found: TaskMap) -> BasePoseView:
    """Return the panel of a task map, with its best and its worst base pose highlighted."""
    poses = found.base_poses[:, [0, 1, 2, 4]]
    best, worst = found.best(), found.worst()
    grasps = [
        (p.x, p.y, grasp.heading)
        for p in found.task.positions
        for grasp in p.grasps
        if grasp.approach != "top"
    ]
    caption = (
        f"{found.name}: {len(poses):,} base poses\nbest x {best.x:.2f} m, y {best.y:.2f} m, "
        f"{math.degrees(best.yaw):g} deg, "
        f"torso height {best.torso_height:.2f} m, score {best.score:.2f}"
    )
    return BasePoseView(
        poses=poses,
        step=found.grid.step,
        positions=np.array([(p.x, p.y) for p in found.task.positions]),
        grasps=np.array(grasps, dtype=np.float64).reshape(-1, 3),
        caption=caption,
        marked=(("worst", _pose(worst), _WORST), ("best", _pose(best), _BEST)),
    )


def map_figure(capability: CapabilityMap, *, tilt: int = 0, height: float | None = None) -> Figure:
    """Return a figure of the base poses of one tilt and height, relative to the tool (Figure 34).

    Args:
        capability: The map.
        tilt: Number of the tilt.
        height: Height of the tool above the floor [m]; None is the height with most cells.

    Raises:
        UnknownNameError: If the grid has no such tilt.
        SelectionError: If the map has no base pose there, or the height is not finite.
    """
    view = map_view(capability, tilt=tilt, height=height)
    return draw_base_poses([view], title=map_title(capability))


def map_title(capability: CapabilityMap) -> str:
    """Return the title of a map: its type and its robot."""
    # A robot of the user's own is stored by the path of its file.
    robot = Path(str(capability.metadata.get("robot", ""))).stem
    return f"{capability.map_type} of {robot}, relative to the tool"


def map_view(
    capability: CapabilityMap, *, tilt: int = 0, height: float | None = None
) -> BasePoseView:
    """Return the panel of the base poses of one tilt and height, relative to the tool.

    Args:
        capability: The map.
        tilt: Number of the tilt.
        height: Height of the tool above the floor [m]; None is the height with most cells.

    Raises:
        UnknownNameError: If the grid has no such tilt.
        SelectionError: If the map has no base pose there, or the height is not finite.
    """
    poses, drawn = layer(capability, tilt=tilt, height=height)
    pitch, roll = (math.degrees(n * capability.grid.yaw_step) for n in capability.grid.tilts[tilt])
    tool = f"tool at {drawn:.2f} m, pitch {pitch:g} deg, roll {roll:g} deg"
    conditions = f"{tool}, torso height {capability.torso_height:.2f} m"
    return BasePoseView(
        poses=poses,
        step=capability.grid.step,
        positions=np.zeros((1, 2)),
        grasps=np.zeros((1, 3)) if pitch == 0.0 else np.zeros((0, 3)),
        caption=f"{len(poses):,} base poses\n{conditions}",
    )


def layer(
    capability: CapabilityMap, *, tilt: int = 0, height: float | None = None
) -> tuple[FloatArray, float]:
    """Return x, y [m], yaw [rad] and score of one tilt and height, shape (n, 4), and the height.

    Args:
        capability: The map.
        tilt: Number of the tilt.
        height: Height of the tool above the floor [m]; None is the height with most cells.

    Raises:
        UnknownNameError: If the grid has no such tilt.
        SelectionError: If the map has no base pose there, or the height is not finite.
    """
    tilts = len(capability.grid.tilts)
    if not 0 <= tilt < tilts:
        raise UnknownNameError("tilt", str(tilt), map(str, range(tilts)))
    step = capability.grid.step
    cells = capability.cells
    rows = np.flatnonzero(cells[:, TILT] == tilt)
    levels, count = np.unique(cells[rows, Z], return_counts=True)
    if not len(levels):
        raise SelectionError(f"the map has no base pose of tilt {tilt}.")
    level = levels[np.argmax(count)] if height is None else _level(height, step)
    rows = rows[cells[rows, Z] == level]
    if not len(rows):
        raise SelectionError(
            f"the map has no base pose for a tool at {height:g} m; its heights are "
            f"{-levels[-1] * step:.2f} to {-levels[0] * step:.2f} m."
        )
    p_EB, yaw = capability.grid.base_in_level_frame(cells[rows])
    return np.column_stack([p_EB[:, :2], yaw, capability.score()[rows]]), float(-level * step)


def _level(height: float, step: float) -> int:
    """Return the cell coordinate z of a tool height.

    Raises:
        SelectionError: If the height is not finite.
    """
    if not math.isfinite(height):
        raise SelectionError(f"tool height {height} m: must be a finite number.")
    return math.floor(float(np.clip(-height / step + 0.5, -_BEYOND, _BEYOND)))


def _pose(base: BasePose) -> FloatArray:
    return np.array([base.x, base.y, base.yaw])
