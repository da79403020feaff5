"""Task maps: the maps of the tool poses of a task merged into one."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.capability.grid import MapGrid
from tcs.capability.map import FIXED, CapabilityMap
from tcs.capability.tasks import GraspPosition, GraspTask
from tcs.capability.volume import Box, MapVolume, Nearness, check_volume
from tcs.errors import SelectionError
from tcs.kernel.arrays import FloatArray

_SAME = 1e-6
"""Torso heights closer than this are equal [steps]; the same tolerance applies to angles [rad]."""


@dataclass(frozen=True, slots=True)
class BasePose:
    """A base pose, its torso height and its score."""

    x: float
    """x of the base in the task frame F [m]."""
    y: float
    """y of the base in F [m]."""
    yaw: float
    """Yaw of the base in F [rad], in (-pi, pi]."""
    torso_height: float
    """Torso height [m]."""
    score: float
    """Score of the task map."""

    def to_json(self) -> dict[str, float]:
        """Return the pose as plain numbers."""
        return {
            "x": round(self.x, 9),
            "y": round(self.y, 9),
            "yaw_deg": round(math.degrees(self.yaw), 9),
            "torso_height": round(self.torso_height, 9),
            "score": self.score,
        }


@dataclass(frozen=True, eq=False)
class TaskMap:
    """The base poses from which a whole task is feasible: TS-ICM, TS-IHCM or TS-ITCM."""

    name: str
    """Type of the map, e.g. "TS-ITCM"."""
    task: GraspTask
    grid: MapGrid
    box: Box
    """Base positions of `score`."""
    torso_heights: FloatArray
    """Torso heights considered [m], shape (levels,)."""
    score: NDArray[np.float32]
    """Score of each base pose, NaN where the task is infeasible, shape (levels, x, y, yaws)."""
    nearness: Nearness
    """Greatest distances of the tool poses from their cells, 0 for poses on the grid."""

    @cached_property
    def base_poses(self) -> FloatArray:
        """Feasible base poses, each at its best torso height, shape (n, 5).

        Columns are x, y [m], yaw [rad], torso height [m] and score.
        """
        score = np.where(np.isnan(self.score), -1.0, self.score)
        level = score.argmax(axis=0)
        best = np.take_along_axis(score, level[None], axis=0)[0]
        i, j, k = np.nonzero(best >= 0.0)
        x, y = (i + self.box.x) * self.grid.step, (j + self.box.y) * self.grid.step
        yaw = _wrapped(k.astype(np.float64) * self.grid.yaw_step)
        return np.column_stack([x, y, yaw, self.torso_heights[level[i, j, k]], best[i, j, k]])

    def best(self) -> BasePose:
        """Return the base pose of the highest score, the first one if several are equal."""
        return BasePose(*map(float, self.base_poses[np.argmax(self.base_poses[:, 4])]))

    def worst(self) -> BasePose:
        """Return the base pose of the lowest score, each base pose at its best torso height."""
        return BasePose(*map(float, self.base_poses[np.argmin(self.base_poses[:, 4])]))


def merge(
    capability: CapabilityMap | MapVolume,
    task: GraspTask,
    *,
    scale: str = FIXED,
    torso_height: float | None = None,
) -> TaskMap:
    """Return the task-specific map.

    The score of a grasp and its pre-grasps is the lowest of them, that of a position the highest of
    its grasps, that of the task the lowest of its positions. Tool poses on the grid with headings
    in multiples of 90 deg coincide with cells; others take the nearest cell, and
    `TaskMap.nearness` reports the distance.

    Args:
        capability: The map; a `MapVolume` of it saves time when merging for several tasks.
        task: The tool poses.
        scale: Scale of the scores, see `CapabilityMap.score`; a `MapVolume` keeps its own.
        torso_height: Consider this torso height only [m], to half a step; None is the whole range.

    Raises:
        SelectionError: If no base pose reaches all positions; the message names the best subset.
            Also if the base poses would fill the memory.

    Source:
        ITCM thesis eqs. (7) to (9) and Appendix A.2.
    """
    volume = capability if isinstance(capability, MapVolume) else MapVolume(capability, scale)
    torso_heights = usable_torso_heights(volume.capability, task.positions[0].height, torso_height)
    box = Box.shared([volume.box_about(p.x, p.y) for p in task.positions])
    if box is None or not len(torso_heights):
        raise SelectionError(_best_subset(volume, task, torso_heights))
    parts = [position_scores(volume, position, box, torso_heights) for position in task.positions]
    score = parts[0][0]
    for part, _ in parts[1:]:
        # The minimum propagates NaN (not reached): the result is the intersection.
        score = np.minimum(score, part)
    if np.isnan(score).all():
        raise SelectionError(_best_subset(volume, task, torso_heights))
    nearness = Nearness.worst([near for _, near in parts])
    name = f"TS-{volume.capability.map_type}"
    return TaskMap(name, task, volume.capability.grid, box, torso_heights, score, nearness)


def usable_torso_heights(
    capability: CapabilityMap, height: float, torso_height: float | None = None
) -> FloatArray:
    """Return the torso heights that bring the tool to a height with the base on the floor.

    Cells are whole steps apart, and so are these heights; with a movable torso they match the tool
    height exactly. Without one, the nearest cell is used.

    Args:
        capability: The map.
        height: Height of the tool above the floor [m].
        torso_height: Consider this torso height only, to half a step [m].
    """
    step = capability.grid.step
    if len(capability.torso_heights) == 1:
        return np.array([capability.torso_height])
    # A cell with its base at z above the floor needs the torso raised by z.
    first, last = (
        (float(end) - capability.torso_height - height) / step
        for end in capability.torso_heights[[0, -1]]
    )
    cells = np.arange(math.ceil(first - _SAME), math.floor(last + _SAME) + 1)
    torso_heights = capability.torso_height + height + step * cells
    if torso_height is not None:
        torso_heights = torso_heights[np.abs(torso_heights - torso_height) <= (0.5 + _SAME) * step]
    return np.asarray(torso_heights)


def position_scores(
    volume: MapVolume, position: GraspPosition, box: Box, torso_heights: FloatArray
) -> tuple[NDArray[np.float32], Nearness]:
    """Return the scores of base poses for one position, shape (torso heights, x, y, yaws).

    Args:
        volume: The map.
        position: Position and grasps.
        box: Base positions.
        torso_heights: Torso heights [m].
    """
    shape = (len(torso_heights), box.width, box.depth, volume.capability.grid.yaw_bins)
    check_volume(shape)
    best = np.full(shape, np.nan, np.float32)
    nearness = []
    for grasp in position.grasps:
        R_FT = grasp.R_FT
        p_FT = np.array([position.x, position.y, position.height])
        score, near = volume.scores(R_FT, p_FT, box, torso_heights)
        nearness.append(near)
        for back in grasp.pre_grasps:
            before, near = volume.scores(R_FT, p_FT - back * R_FT[:, 0], box, torso_heights)
            score = np.minimum(score, before)
            nearness.append(near)
        # fmax ignores NaN: the result is the union.
        best = np.fmax(best, score)
    return best, Nearness.worst(nearness)


def _best_subset(volume: MapVolume, task: GraspTask, torso_heights: FloatArray) -> str:
    """Return a message that names the largest set of positions reached from one base pose."""
    count, grid = len(task.positions), volume.capability.grid
    failure = f"task '{task.name}': no base pose reaches all {count} positions"
    if not len(torso_heights):
        low, high = volume.capability.torso_heights[[0, -1]]
        return (
            f"{failure}: no torso height of this map, {low:g} to {high:g} m, puts the base on the "
            "floor at this tool height. Change the tool height or the torso height."
        )
    box = Box.union([volume.box_about(p.x, p.y) for p in task.positions])
    parts = [position_scores(volume, p, box, torso_heights)[0] for p in task.positions]
    reached: Any = sum((~np.isnan(part)).astype(np.int32) for part in parts)
    most = int(reached.max())
    if not most:
        return f"{failure}, nor any one of them. Check heights, grasps and the tilts of the map."
    lowest = np.fmin.reduce(parts)
    at = np.unravel_index(np.argmax(np.where(reached == most, lowest, -1.0)), reached.shape)
    subset = ", ".join(str(i) for i, part in enumerate(parts) if not np.isnan(part[at]))
    x, y = (int(at[1]) + box.x) * grid.step, (int(at[2]) + box.y) * grid.step
    yaw = math.degrees(float(_wrapped(np.array([at[3] * grid.yaw_step]))[0]))
    return (
        f"{failure}; best subset: {most} of {count} (number {subset}) from x {x:.2f}, y {y:.2f}, "
        f"yaw {yaw:g} deg, torso height {torso_heights[at[0]]:.3f} m. Move the positions closer "
        "together, allow more grasps, or split the task."
    )


def _wrapped(yaw: FloatArray) -> FloatArray:
    """Return angles wrapped to (-pi, pi]; rounding does not change pi to -pi."""
    wrapped = (yaw + math.pi - _SAME) % (2.0 * math.pi) - math.pi + _SAME
    return np.where(np.abs(wrapped) < _SAME, 0.0, wrapped)
