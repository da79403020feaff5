"""Maps from inverse kinematics: every cell around the tool is solved for (ICM and IHCM)."""

from __future__ import annotations

from importlib.metadata import version
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.capability.grid import CellArray, MapGrid, yaw_rotation
from tcs.capability.head import View, head_names, head_view
from tcs.capability.map import ICM, IHCM, MAX_LIFTS, CapabilityMap
from tcs.capability.reach import OnProgress, Reach
from tcs.capability.visibility import CORRECTED, VISIBILITIES, visibility
from tcs.errors import GridError, UnknownNameError
from tcs.kernel.arrays import FloatArray

MAX_CELLS = 60_000_000
"""More would take hours and more memory than a common machine has."""

_SCALE_POSTURES = 1 << 15
"""Random postures among which the arm's best is looked for."""


def map_from_ik(
    reach: Reach,
    grid: MapGrid,
    *,
    kind: str = IHCM,
    radius: float | None = None,
    view_rule: str = CORRECTED,
    jobs: int = 2,
    on_progress: OnProgress | None = None,
) -> CapabilityMap:
    """Return the map of all cells whose base pose reaches the tool.

    Args:
        reach: The robot.
        grid: The cells.
        kind: "ICM", or "IHCM" to count visibility as well.
        radius: Farthest that the tool may be from the shoulder [m]; None is the arm's length. The
            thesis takes 0.9 m for an arm of 0.87 m.
        view_rule: How visibility is scored.
        jobs: Number of threads.
        on_progress: Called with cells done and in all.

    Raises:
        RobotError: If the robot has no head file and an IHCM is asked for.
        UnknownNameError: If there is no such rule.
        GridError: If there are far too many cells or lifts.

    Source:
        ITCM thesis, Appendix B. There TRAC-IK solves for the cells; here it is the closed form,
        which does not miss solutions at random.
    """
    seen_from(reach, grid, kind, view_rule)
    radius = reach.length if radius is None else radius
    cells = cells_around(grid, reach.shoulder, radius)
    R_BT, p_BT = grid.tool_in_base(cells)
    solved = reach.solve(R_BT, p_BT, jobs=jobs, on_progress=on_progress)
    rows = np.flatnonzero(solved.reached)
    joints = solved.joints[rows]
    return finished_map(
        reach, grid, kind, cells[rows], p_BT[rows], solved.manipulability[rows], joints,
        view_rule, {"radius": float(radius), "cells_asked": len(cells)},
    )  # fmt: skip


def finished_map(
    reach: Reach,
    grid: MapGrid,
    kind: str,
    cells: CellArray,
    p_BT: FloatArray,
    manipulability: NDArray[np.float32] | FloatArray,
    joints: NDArray[np.float32] | FloatArray,
    view_rule: str,
    metadata: dict[str, Any],
) -> CapabilityMap:
    """Return a map of cells whose postures are known, in any order.

    Args:
        reach: The robot.
        grid: The cells' grid.
        kind: Kind of map.
        cells: Each once, shape (n, 5).
        p_BT: Tool positions in B at the map's lift [m], shape (n, 3).
        manipulability: Shape (n,).
        joints: Arm joints [rad], shape (n, 7).
        view_rule: How visibility is scored.
        metadata: What else is to be remembered.

    Raises:
        RobotError: If the robot has no head file and the kind counts visibility.
        UnknownNameError: If there is no such rule.
        GridError: If there are more lifts than a map holds.
    """
    order = np.argsort(grid.keys(cells))
    view = seen_from(reach, grid, kind, view_rule)
    seen = np.zeros(len(cells)) if view is None else visibility(view, p_BT, view_rule)
    return CapabilityMap(
        kind=kind,
        grid=grid,
        cells=cells[order],
        manipulability=manipulability[order].astype(np.float32),
        visibility=seen[order].astype(np.float32),
        lifts=np.array(reach.lifts, dtype=np.float64),
        lift=float(reach.lift),
        free_lifts=reach.free_lifts(np.asarray(joints[order], dtype=np.float64)),
        manipulability_scale=manipulability_scale(reach),
        metadata={
            "robot": reach.found_as,
            "tool": reach.robot.tool_frame,
            "arm_joints": list(reach.robot.arm_joints),
            "measure": reach.measure,
            "view_rule": view_rule,
            "scene_digest": reach.lowered.digest(),
            "program_version": version("tcs"),
            **metadata,
        },
        joints=joints[order].astype(np.float32),
    )


def seen_from(reach: Reach, grid: MapGrid, kind: str, view_rule: str) -> View | None:
    """Return what the robot's camera sees, None for an ICM of a robot without a head file.

    Also refuses what no map can be made of, before the work.

    Raises:
        RobotError: If there is no head file where one is needed.
        UnknownNameError: If there is no such rule.
        GridError: If there are more lifts than a map holds.
    """
    if view_rule not in VISIBILITIES:
        raise UnknownNameError("visibility", view_rule, VISIBILITIES)
    if len(reach.lifts) > MAX_LIFTS:
        raise GridError(
            f"the lift has {len(reach.lifts)} levels of {grid.step:g} m; a map holds {MAX_LIFTS} "
            "at most. Take a larger step."
        )
    if kind == ICM and reach.head is None and reach.robot.name not in head_names():
        return None
    return head_view(reach.scene, reach.lift, reach.head)


def manipulability_scale(reach: Reach) -> float:
    """Return the best measure among random postures of the arm, the same in every run."""
    lower, upper = reach.limits
    first = np.where(np.isfinite(lower), lower, -np.pi)
    last = np.where(np.isfinite(upper), upper, np.pi)
    postures = np.random.default_rng(0).uniform(first, last, size=(_SCALE_POSTURES, len(first)))
    return float(reach.manipulability(postures).max())


def cells_around(grid: MapGrid, shoulder: FloatArray, radius: float) -> CellArray:
    """Return the cells whose base has its shoulder within a radius of the tool, shape (n, 5).

    Args:
        grid: The grid.
        shoulder: The shoulder in B [m], shape (3,).
        radius: [m].

    Raises:
        GridError: If there are none, or far too many.
    """
    ball = 4.0 / 3.0 * np.pi * (radius / grid.step) ** 3 * grid.turns * len(grid.tilts)
    if not 1.0 <= ball <= MAX_CELLS:
        raise GridError(
            f"a radius of {radius:g} m at steps of {grid.step:g} m, {grid.turns} headings and "
            f"{len(grid.tilts)} tilts has {ball:.3g} cells; must be 1 to {MAX_CELLS:,}."
        )
    far = int(np.ceil((radius + np.linalg.norm(shoulder)) / grid.step))
    line = np.arange(-far, far + 1, dtype=np.int32)
    x, y = np.meshgrid(line, line, indexing="ij")
    z = line * grid.step + shoulder[2]
    found = []
    for yaw in range(grid.turns):
        across = yaw_rotation(np.array([yaw * grid.turn]))[0] @ shoulder
        square = (x * grid.step + across[0]) ** 2 + (y * grid.step + across[1]) ** 2
        inside = square[..., None] + z**2 <= radius**2
        i, j, k = np.nonzero(inside)
        rows = np.empty((len(i), 5), np.int32)
        rows[:, 1], rows[:, 2], rows[:, 3], rows[:, 4] = line[i], line[j], line[k], yaw
        found.append(rows)
    one = np.concatenate(found)
    cells = np.tile(one, (len(grid.tilts), 1))
    cells[:, 0] = np.repeat(np.arange(len(grid.tilts)), len(one))
    return cells
