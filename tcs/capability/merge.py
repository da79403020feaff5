"""Maps of the tool poses of a task merged into one: where to stand for all of it."""

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
from tcs.capability.volume import Box, MapVolume, Nearness
from tcs.errors import SelectionError
from tcs.kernel.arrays import FloatArray

_SAME = 1e-6
"""Lifts this close are one, in steps."""


@dataclass(frozen=True, slots=True)
class BasePose:
    """Where to stand for a task."""

    x: float
    y: float
    yaw: float
    """Of the base in F [rad], in (-pi, pi]."""
    lift: float
    """[m]."""
    score: float

    def to_json(self) -> dict[str, float]:
        """Return it as plain numbers."""
        return {
            "x": round(self.x, 9),
            "y": round(self.y, 9),
            "yaw_deg": round(math.degrees(self.yaw), 9),
            "lift": round(self.lift, 9),
            "score": self.score,
        }


@dataclass(frozen=True, eq=False)
class TaskMap:
    """The base poses from which a whole task can be done: TS-ICM, TS-IHCM or TS-ITCM."""

    name: str
    """E.g. "TS-ITCM"."""
    task: GraspTask
    grid: MapGrid
    box: Box
    lifts: FloatArray
    """Lifts that were considered [m], shape (levels,)."""
    score: NDArray[np.float32]
    """NaN where the task cannot be done, shape (levels, x, y, yaws)."""
    nearness: Nearness
    """How far tool poses were from cells: 0 on the grid."""

    @cached_property
    def base_poses(self) -> FloatArray:
        """x, y [m], yaw [rad], lift [m] and score of every base pose at its best lift, (n, 5)."""
        able = np.where(np.isnan(self.score), -1.0, self.score)
        level = able.argmax(axis=0)
        best = np.take_along_axis(able, level[None], axis=0)[0]
        i, j, k = np.nonzero(best >= 0.0)
        x, y = (i + self.box.x) * self.grid.step, (j + self.box.y) * self.grid.step
        yaw = _upright(k.astype(np.float64) * self.grid.turn)
        return np.column_stack([x, y, yaw, self.lifts[level[i, j, k]], best[i, j, k]])

    def best(self) -> BasePose:
        """Return the base pose of the highest score, the first of equals."""
        return BasePose(*map(float, self.base_poses[np.argmax(self.base_poses[:, 4])]))

    def worst(self) -> BasePose:
        """Return the base pose of the lowest score, each at its best lift; the first of equals."""
        return BasePose(*map(float, self.base_poses[np.argmin(self.base_poses[:, 4])]))


def merge(
    capability: CapabilityMap | MapVolume,
    task: GraspTask,
    *,
    scale: str = FIXED,
    lift: float | None = None,
) -> TaskMap:
    """Return the task-specific map.

    Grasp AND pre-grasp, the lower score; OR over the grasps at a position, the higher one; AND over
    the positions, the lower one. Tool poses on the grid at quarter turns meet cell on cell; others
    take the nearest cell, and `TaskMap.nearness` says how far that is.

    Args:
        capability: The map; a `MapVolume` of it saves time from the second task on.
        task: The tool poses.
        scale: How scores are scaled, see `CapabilityMap.score`; a `MapVolume` keeps its own.
        lift: The only lift that counts [m], to half a step; None is the whole range.

    Raises:
        SelectionError: If no base pose reaches all positions; the message names the best subset.

    Source:
        ITCM thesis eqs. (7) to (9) and Appendix A.2.
    """
    volume = capability if isinstance(capability, MapVolume) else MapVolume(capability, scale)
    lifts = usable_lifts(volume.capability, task.positions[0].height, lift)
    box = Box.shared([volume.box_about(p.x, p.y) for p in task.positions])
    if box is None or not len(lifts):
        raise SelectionError(_best_subset(volume, task, lifts))
    parts = [position_scores(volume, position, box, lifts) for position in task.positions]
    score = parts[0][0]
    for part, _ in parts[1:]:
        # NaN stands for "not there" and wins over every number: the intersection.
        score = np.minimum(score, part)
    if np.isnan(score).all():
        raise SelectionError(_best_subset(volume, task, lifts))
    nearness = Nearness.worst([near for _, near in parts])
    name = f"TS-{volume.capability.kind}"
    return TaskMap(name, task, volume.capability.grid, box, lifts, score, nearness)


def usable_lifts(capability: CapabilityMap, height: float, lift: float | None = None) -> FloatArray:
    """Return the lifts at which the base stands on the floor with the tool at a height.

    Cells are whole steps apart, so these are too; with a lift to move they fit the height exactly.
    A robot without one takes the nearest cell.

    Args:
        capability: The map.
        height: Of the tool above the floor [m].
        lift: The only lift that counts, to half a step [m].
    """
    step = capability.grid.step
    if len(capability.lifts) == 1:
        return np.array([capability.lift])
    # A cell whose base is z above the floor at the map's lift needs the lift raised by z.
    first, last = (
        (float(end) - capability.lift - height) / step for end in capability.lifts[[0, -1]]
    )
    cells = np.arange(math.ceil(first - _SAME), math.floor(last + _SAME) + 1)
    lifts = capability.lift + height + step * cells
    if lift is not None:
        lifts = lifts[np.abs(lifts - lift) <= (0.5 + _SAME) * step]
    return np.asarray(lifts)


def position_scores(
    volume: MapVolume, position: GraspPosition, box: Box, lifts: FloatArray
) -> tuple[NDArray[np.float32], Nearness]:
    """Return the scores of base poses for one position, shape (lifts, x, y, yaws).

    Args:
        volume: The map.
        position: Place and grasps.
        box: Base places to look at.
        lifts: Lifts to look at [m].
    """
    best = np.full((len(lifts), box.width, box.depth, volume.capability.grid.turns), np.nan)
    best = best.astype(np.float32)
    nearness = []
    for grasp in position.grasps:
        R_FT = grasp.R_FT
        p_FT = np.array([position.x, position.y, position.height])
        score, near = volume.scores(R_FT, p_FT, box, lifts)
        nearness.append(near)
        for back in grasp.pre_grasps:
            before, near = volume.scores(R_FT, p_FT - back * R_FT[:, 0], box, lifts)
            score = np.minimum(score, before)
            nearness.append(near)
        # fmax takes the number where the other is NaN: the union.
        best = np.fmax(best, score)
    return best, Nearness.worst(nearness)


def _best_subset(volume: MapVolume, task: GraspTask, lifts: FloatArray) -> str:
    """Return one line that says which positions can be reached from one place."""
    count, grid = len(task.positions), volume.capability.grid
    said = f"task '{task.name}': no base pose reaches all {count} positions"
    if not len(lifts):
        low, high = volume.capability.lifts[[0, -1]]
        return (
            f"{said}: no lift that was asked for is within {low:g} to {high:g} m, the range the "
            "map was made for."
        )
    box = Box.union([volume.box_about(p.x, p.y) for p in task.positions])
    parts = [position_scores(volume, p, box, lifts)[0] for p in task.positions]
    reached: Any = sum((~np.isnan(part)).astype(np.int32) for part in parts)
    most = int(reached.max())
    if not most:
        return f"{said}, nor any one of them. Check heights, grasps and the map's tilts."
    lowest = np.fmin.reduce(parts)
    at = np.unravel_index(np.argmax(np.where(reached == most, lowest, -1.0)), reached.shape)
    subset = ", ".join(str(i) for i, part in enumerate(parts) if not np.isnan(part[at]))
    x, y = (int(at[1]) + box.x) * grid.step, (int(at[2]) + box.y) * grid.step
    yaw = math.degrees(float(_upright(np.array([at[3] * grid.turn]))[0]))
    return (
        f"{said}; best subset: {most} of {count} (number {subset}) from x {x:.2f}, y {y:.2f}, "
        f"yaw {yaw:g} deg, lift {lifts[at[0]]:.3f} m. Move them closer together, allow more "
        "grasps, or split the task."
    )


def _upright(yaw: FloatArray) -> FloatArray:
    """Return angles in (-pi, pi]; half a turn is pi whichever way rounding has it."""
    turned = (yaw + math.pi - _SAME) % (2.0 * math.pi) - math.pi + _SAME
    return np.where(np.abs(turned) < _SAME, 0.0, turned)
