"""Maps computed by inverse kinematics of every cell around the tool (ICM and IHCM)."""

from __future__ import annotations

from importlib.metadata import version
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.capability.grid import CellArray, MapGrid, yaw_rotation
from tcs.capability.head import View, head_names, head_view
from tcs.capability.kept_cells import solved_in_blocks
from tcs.capability.map import ICM, IHCM, MAX_TORSO_HEIGHTS, CapabilityMap
from tcs.capability.reach import OnProgress, Reach
from tcs.capability.visibility import CORRECTED, VISIBILITIES, visibility
from tcs.errors import GridError, UnknownNameError
from tcs.files.blocks import BlockFolder
from tcs.files.quantities import RADIUS
from tcs.kernel.arrays import FloatArray

MAX_CELLS = 60_000_000
"""Greatest number of cells: more would take hours and too much memory."""

_SCALE_POSTURES = 1 << 15
"""Number of random postures from which the greatest manipulability is taken."""


def map_from_ik(
    reach: Reach,
    grid: MapGrid,
    *,
    map_type: str = IHCM,
    radius: float | None = None,
    view_rule: str = CORRECTED,
    jobs: int = 2,
    blocks: BlockFolder | None = None,
    on_progress: OnProgress | None = None,
) -> CapabilityMap:
    """Return the map of all cells whose base pose reaches the tool.

    Args:
        reach: The robot.
        grid: The cells.
        map_type: "ICM", or "IHCM" to include visibility.
        radius: Greatest distance of the tool from the shoulder [m]; None is the arm's length. The
            thesis uses 0.9 m for an arm of 0.87 m.
        view_rule: Visibility rule.
        jobs: Number of threads.
        blocks: Folder in which finished blocks are kept, so that the same call continues after an
            interrupt; None to keep none.
        on_progress: Called with the number of cells done and of all.

    Raises:
        RobotError: If an IHCM is requested and the robot has no head file.
        UnknownNameError: If there is no such map type or rule.
        GridError: If the radius is not positive, or there are too many cells or torso heights.
        OutputError: If blocks cannot be kept in their folder, or another process is at work there.

    Source:
        ITCM thesis, Appendix B. The thesis solves with TRAC-IK; the solver here does not miss
        solutions at random.
    """
    if map_type not in (ICM, IHCM):
        raise UnknownNameError("map type", map_type, (ICM, IHCM))
    camera_view(reach, grid, map_type, view_rule)
    radius = reach.length if radius is None else radius
    cells = cells_around(grid, reach.shoulder, radius)
    solved = solved_in_blocks(reach, grid, cells, blocks, jobs=jobs, on_progress=on_progress)
    reached = cells[solved.rows]
    _, p_BT = grid.tool_in_base(reached)
    # Scoring found each posture free at this torso height; the joints of the map are in single
    # precision, which moves a posture by 1e-8 m, perhaps to within the contact margin.
    free = solved.free_torso_heights | np.uint32(1) << np.uint32(reach.level)
    return finished_map(
        reach, grid, map_type, reached, p_BT, solved.manipulability, solved.joints, free,
        view_rule, {"radius": float(radius), "cells_considered": len(cells)},
    )  # fmt: skip


def finished_map(
    reach: Reach,
    grid: MapGrid,
    map_type: str,
    cells: CellArray,
    p_BT: FloatArray,
    manipulability: NDArray[np.float32] | FloatArray,
    joints: NDArray[np.float32] | FloatArray,
    free_torso_heights: NDArray[np.uint32],
    view_rule: str,
    metadata: dict[str, Any],
) -> CapabilityMap:
    """Return a map of cells with known postures, in any order.

    Args:
        reach: The robot.
        grid: The cells' grid.
        map_type: Map type.
        cells: Cells without repetitions, shape (n, 5).
        p_BT: Tool positions in B at the map's torso height [m], shape (n, 3).
        manipulability: Manipulability of the postures, shape (n,).
        joints: Arm joints [rad], shape (n, 7).
        free_torso_heights: Torso heights at which each posture is free, bit i for the i-th of
            them, shape (n,).
        view_rule: Visibility rule.
        metadata: Further metadata.

    Raises:
        RobotError: If the map type includes visibility and the robot has no head file.
        UnknownNameError: If there is no such rule.
        GridError: If there are more torso heights than a map can have.
    """
    order = np.argsort(grid.keys(cells))
    view = camera_view(reach, grid, map_type, view_rule)
    visible = np.zeros(len(cells)) if view is None else visibility(view, p_BT, view_rule)
    return CapabilityMap(
        map_type=map_type,
        grid=grid,
        cells=cells[order],
        manipulability=manipulability[order].astype(np.float32),
        visibility=visible[order].astype(np.float32),
        torso_heights=np.array(reach.torso_heights, dtype=np.float64),
        torso_height=float(reach.torso_height),
        free_torso_heights=free_torso_heights[order],
        manipulability_scale=manipulability_scale(reach),
        metadata={
            "robot": reach.robot_reference,
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


def camera_view(reach: Reach, grid: MapGrid, map_type: str, view_rule: str) -> View | None:
    """Return the view of the head camera, None for an ICM of a robot without a head file.

    The function also validates the arguments of a map, so it is called before any computation.

    Raises:
        RobotError: If a head file is needed and there is none.
        UnknownNameError: If there is no such rule.
        GridError: If there are more torso heights than a map can have.
    """
    if view_rule not in VISIBILITIES:
        raise UnknownNameError("visibility", view_rule, VISIBILITIES)
    if len(reach.torso_heights) > MAX_TORSO_HEIGHTS:
        raise GridError(
            f"the torso has {len(reach.torso_heights)} heights {grid.step:g} m apart; a map can "
            f"have at most {MAX_TORSO_HEIGHTS}. Use a larger step."
        )
    if map_type == ICM and reach.head is None and reach.robot.name not in head_names():
        return None
    return head_view(reach.scene, reach.torso_height, reach.head)


def manipulability_scale(reach: Reach) -> float:
    """Return the greatest manipulability of random postures of the arm, with a fixed seed."""
    lower, upper = reach.limits
    first = np.where(np.isfinite(lower), lower, -np.pi)
    last = np.where(np.isfinite(upper), upper, np.pi)
    postures = np.random.default_rng(0).uniform(first, last, size=(_SCALE_POSTURES, len(first)))
    return float(reach.manipulability(postures).max())


def cells_around(grid: MapGrid, shoulder: FloatArray, radius: float) -> CellArray:
    """Return the cells with the shoulder within a radius of the tool, shape (n, 5).

    Args:
        grid: The grid.
        shoulder: The shoulder in B [m], shape (3,).
        radius: Radius [m].

    Raises:
        GridError: If there are no cells, or too many.
    """
    RADIUS.check(radius, "the radius of the map", GridError)
    count = 4.0 / 3.0 * np.pi * (radius / grid.step) ** 3 * grid.yaw_bins * len(grid.tilts)
    if not 1.0 <= count <= MAX_CELLS:
        raise GridError(
            f"a radius of {radius:g} m at steps of {grid.step:g} m, {grid.yaw_bins} yaw bins and "
            f"{len(grid.tilts)} tilts has {count:.3g} cells; must be 1 to {MAX_CELLS:,}."
        )
    far = int(np.ceil((radius + np.linalg.norm(shoulder)) / grid.step))
    line = np.arange(-far, far + 1, dtype=np.int32)
    x, y = np.meshgrid(line, line, indexing="ij")
    z = line * grid.step + shoulder[2]
    found = []
    for yaw in range(grid.yaw_bins):
        across = yaw_rotation(np.array([yaw * grid.yaw_step]))[0] @ shoulder
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
