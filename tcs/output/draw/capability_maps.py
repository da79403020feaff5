"""Capability maps and task maps as pictures: which base poses to draw, and what beside them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from tcs.capability.grid import TILT, Z
from tcs.capability.map import CapabilityMap
from tcs.capability.merge import BasePose, TaskMap
from tcs.errors import SelectionError
from tcs.kernel.arrays import FloatArray
from tcs.output.draw.base_poses import BasePoseView, draw_base_poses

_BEST, _WORST = "#c0007a", "#404040"
_LINE = 0.42
"""Length of a line in steps: those of neighbours do not meet."""


def task_figure(*maps: TaskMap) -> Figure:
    """Return task maps side by side, as in the thesis's Figures 3, 5 and 37."""
    views = [task_view(found) for found in maps]
    return draw_base_poses(views, title=maps[0].task.name, score="score, the best lift of each")


def task_view(found: TaskMap) -> BasePoseView:
    """Return one task map, its best and its worst base pose pointed out."""
    poses = found.base_poses[:, [0, 1, 2, 4]]
    best, worst = found.best(), found.worst()
    grasps = [
        (p.x, p.y, grasp.heading)
        for p in found.task.positions
        for grasp in p.grasps
        if grasp.approach != "top"
    ]
    said = (
        f"{found.name}: {len(poses):,} base poses\nbest x {best.x:.2f} m, y {best.y:.2f} m, "
        f"{math.degrees(best.yaw):g} deg, lift {best.lift:.2f} m, score {best.score:.2f}"
    )
    return BasePoseView(
        poses=poses,
        length=_LINE * found.grid.step,
        places=np.array([(p.x, p.y) for p in found.task.positions]),
        grasps=np.array(grasps, dtype=np.float64).reshape(-1, 3),
        caption=said,
        marked=(("worst", _pose(worst), _WORST), ("best", _pose(best), _BEST)),
    )


def map_figure(capability: CapabilityMap, *, tilt: int = 0, height: float | None = None) -> Figure:
    """Return the base poses of one tilt at one height, seen from the tool, as in Figure 34.

    Args:
        capability: The map.
        tilt: Which tilt.
        height: Of the tool above the floor at the map's lift [m]; None is that of most cells.

    Raises:
        SelectionError: If the map holds nothing there.
    """
    poses, shown = layer(capability, tilt=tilt, height=height)
    pitch, roll = (math.degrees(n * capability.grid.turn) for n in capability.grid.tilts[tilt])
    tool = f"tool at {shown:.2f} m, pitch {pitch:g} deg, roll {roll:g} deg"
    said = f"{tool}, lift {capability.lift:.2f} m"
    view = BasePoseView(
        poses=poses,
        length=_LINE * capability.grid.step,
        places=np.zeros((1, 2)),
        grasps=np.zeros((1, 3)) if pitch == 0.0 else np.zeros((0, 3)),
        caption=f"{len(poses):,} base poses\n{said}",
    )
    # A robot of the user's own is remembered by the path of its file.
    robot = Path(str(capability.metadata.get("robot", ""))).stem
    return draw_base_poses([view], title=f"{capability.kind} of {robot}, seen from the tool")


def layer(
    capability: CapabilityMap, *, tilt: int = 0, height: float | None = None
) -> tuple[FloatArray, float]:
    """Return x, y [m], yaw [rad] and score of one tilt at one height, shape (n, 4), and the height.

    Args:
        capability: The map.
        tilt: Which tilt.
        height: Of the tool above the floor at the map's lift [m]; None is that of most cells.

    Raises:
        SelectionError: If the map holds nothing there.
    """
    step = capability.grid.step
    cells = capability.cells
    rows = np.flatnonzero(cells[:, TILT] == tilt)
    levels, count = np.unique(cells[rows, Z], return_counts=True)
    if not len(levels):
        raise SelectionError(f"the map holds no base pose of tilt {tilt}.")
    level = levels[np.argmax(count)] if height is None else math.floor(-height / step + 0.5)
    rows = rows[cells[rows, Z] == level]
    if not len(rows):
        raise SelectionError(
            f"the map holds no base pose for a tool at {height:g} m; it holds heights from "
            f"{-levels[-1] * step:.2f} to {-levels[0] * step:.2f} m."
        )
    p_EB, yaw = capability.grid.base_in_level_frame(cells[rows])
    return np.column_stack([p_EB[:, :2], yaw, capability.score()[rows]]), float(-level * step)


def _pose(base: BasePose) -> FloatArray:
    return np.array([base.x, base.y, base.yaw])
