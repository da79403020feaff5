"""Accuracy of maps, compared with inverse kinematics at random tool poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tcs.capability.grid import GRASPS, SIDE, TOP, MapGrid, yaw_rotation
from tcs.capability.map import ITCM, CapabilityMap
from tcs.capability.map_files import load_map, robot_reference, stored_name
from tcs.capability.reach import Reach
from tcs.errors import GridError, StoreError, UnknownNameError
from tcs.files.quantities import RADIUS
from tcs.kernel.arrays import BoolArray, FloatArray

HALF_WIDTH = 1.0
"""Half the side of the cube about the shoulder, from which queries are drawn [m]."""


@dataclass(frozen=True, slots=True)
class MapCheck:
    """Agreement of a map with inverse kinematics; fractions of all queries unless stated."""

    queries: int
    reachable: float
    """Reachable queries: inverse kinematics at the exact pose finds a collision-free posture."""
    accuracy: float
    """Correctly classified queries."""
    false_positives: float
    """Unreachable queries in the map."""
    false_negatives: float
    """Reachable queries that are not in the map."""
    recall: float
    """Fraction of the reachable queries that are in the map."""
    precision: float
    """Fraction of the queries in the map that are reachable."""

    @classmethod
    def of(cls, predicted: BoolArray, true: BoolArray) -> MapCheck:
        """Return the agreement of predictions with the truth, both of shape (n,)."""
        both, n = int((predicted & true).sum()), len(true)
        return cls(
            queries=n,
            reachable=float(true.mean()),
            accuracy=float((predicted == true).mean()),
            false_positives=float((predicted & ~true).mean()),
            false_negatives=float((~predicted & true).mean()),
            recall=both / max(int(true.sum()), 1),
            precision=both / max(int(predicted.sum()), 1),
        )

    def to_json(self) -> dict[str, Any]:
        """Return the fractions as plain numbers."""
        return {name: getattr(self, name) for name in self.__slots__}


def check_map(
    reach: Reach, grid: MapGrid, grasps: str, *, radius: float | None = None, queries: int = 20_000,
    seed: int = 0, jobs: int = 2,
) -> MapCheck:  # fmt: skip
    """Return the accuracy that a map of a grid would have, without making the map.

    Only the cells nearest to the queries are solved; a complete map gives the same result.

    Args:
        reach: The robot.
        grid: The cells.
        grasps: Orientations of the queries: "side", "top" or "all".
        radius: Radius of the map [m]; None is the arm's length.
        queries: Number of poses.
        seed: Seed of the poses.
        jobs: Number of threads.

    Raises:
        UnknownNameError: If there is no such set of grasps.
        GridError: If the radius is out of its physical range.
    """
    most = reach.length if radius is None else radius
    RADIUS.check((most,), "the radius of the map", GridError)
    R_BT, p_BT = random_poses(reach, grasps, queries, seed)
    cells, of_query = np.unique(grid.nearest(R_BT, p_BT).cells, axis=0, return_inverse=True)
    R_BC, p_BC = grid.tool_in_base(cells)
    near = np.linalg.norm(p_BC - reach.shoulder, axis=1) <= most
    held = near & reach.solve(R_BC, p_BC, jobs=jobs).reached
    return MapCheck.of(held[of_query.ravel()], reach.solve(R_BT, p_BT, jobs=jobs).reached)


def check_stored(
    reach: Reach, capability: CapabilityMap, grasps: str, *, queries: int = 20_000, seed: int = 0,
    jobs: int = 2,
) -> MapCheck:  # fmt: skip
    """Return the accuracy of a map.

    Args:
        reach: The robot, at the map's torso height.
        capability: The map.
        grasps: Orientations of the queries: "side", "top" or "all".
        queries: Number of poses.
        seed: Seed of the poses.
        jobs: Number of threads.

    Raises:
        UnknownNameError: If there is no such set of grasps.
    """
    R_BT, p_BT = random_poses(reach, grasps, queries, seed)
    predicted = capability.look_up(R_BT, p_BT) >= 0
    return MapCheck.of(predicted, reach.solve(R_BT, p_BT, jobs=jobs).reached)


def check_file(
    path: Path, *, robot: str | None = None, grasps: Sequence[str] = (), queries: int = 20_000,
    seed: int = 0, jobs: int = 2,
) -> tuple[MapGrid, dict[str, MapCheck]]:  # fmt: skip
    """Return the grid and the accuracy of a map file, by orientation of the queries.

    Args:
        path: File of a map made by inverse kinematics.
        robot: Name or file of the robot; None is the one stored in the map.
        grasps: "side", "top" or "all"; by default the tilts of the map among the first two.
        queries: Number of poses for each orientation.
        seed: Seed of the poses.
        jobs: Number of threads.

    Raises:
        StoreError: If the map was not made by inverse kinematics, or not with this robot.
        UnknownNameError: If there is no such set of grasps.
    """
    capability = load_map(path)
    if capability.map_type == ITCM or "measure" not in capability.metadata:
        raise StoreError(
            f"Capability map '{path}' was recorded or imported, so poses that inverse kinematics "
            "reaches may be missing from it. Check a map made by `tcs capability from-ik`."
        )
    name = robot_reference(path, capability, robot)
    grid = capability.grid
    reach = Reach.load(
        name, tool=stored_name(capability, "tool"), torso_height=capability.torso_height,
        step=grid.step, measure=str(capability.metadata["measure"]),
    )  # fmt: skip
    if capability.metadata.get("scene_digest") != reach.lowered.digest():
        raise StoreError(
            f"Capability map '{path}' was made with another model of robot '{name}' than the "
            "installed one. Make the map again."
        )
    tilts = {SIDE: (0, 0), TOP: (grid.yaw_bins // 4, 0)}
    names = grasps or [name for name, tilt in tilts.items() if tilt in grid.tilts]
    return grid, {
        name: check_stored(reach, capability, name, queries=queries, seed=seed, jobs=jobs)
        for name in names
    }


def random_poses(reach: Reach, grasps: str, count: int, seed: int) -> tuple[FloatArray, FloatArray]:
    """Return tool poses in B, uniform in a cube about the shoulder and in orientation.

    Args:
        reach: The robot.
        grasps: "side" or "top" for random yaw only, "all" for random orientation.
        count: Number of poses.
        seed: Seed of the poses.

    Raises:
        UnknownNameError: If there is no such set of grasps.
    """
    known = tuple(name for name in GRASPS if "+" not in name)
    if grasps not in known:
        raise UnknownNameError("set of grasps", grasps, known)
    rng = np.random.default_rng(seed)
    p_BT = reach.shoulder + rng.uniform(-HALF_WIDTH, HALF_WIDTH, (count, 3))
    if grasps == "all":
        return Rotation.random(count, rng=rng).as_matrix(), p_BT
    R_ET = MapGrid.of(grasps=grasps).R_ET[0]
    return yaw_rotation(rng.uniform(-np.pi, np.pi, count)) @ R_ET, p_BT
