"""How often a map is right: its answers beside those of inverse kinematics itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tcs.capability.grid import GRASPS, MapGrid, yaw_rotation
from tcs.capability.map import CapabilityMap
from tcs.capability.reach import Reach
from tcs.errors import UnknownNameError
from tcs.kernel.arrays import BoolArray, FloatArray

HALF_WIDTH = 1.0
"""Half the side of the cube about the shoulder that queries come from [m]: 2 m, as the thesis's."""


@dataclass(frozen=True, slots=True)
class MapCheck:
    """A map's verdicts on random tool poses, in shares of all of them."""

    queries: int
    reachable: float
    """Truly reachable: inverse kinematics at the very pose finds a collision-free posture."""
    accuracy: float
    """Judged right."""
    false_positives: float
    """Called reachable, and not."""
    false_negatives: float
    """Reachable, and not called so."""
    recall: float
    """Of the truly reachable, the share called so."""
    precision: float
    """Of those called so, the share truly reachable."""

    @classmethod
    def of(cls, says: BoolArray, true: BoolArray) -> MapCheck:
        """Return the shares of verdicts beside the truth, both of shape (n,)."""
        both, n = int((says & true).sum()), len(true)
        return cls(
            queries=n,
            reachable=float(true.mean()),
            accuracy=float((says == true).mean()),
            false_positives=float((says & ~true).mean()),
            false_negatives=float((~says & true).mean()),
            recall=both / max(int(true.sum()), 1),
            precision=both / max(int(says.sum()), 1),
        )

    def to_json(self) -> dict[str, Any]:
        """Return it as plain containers."""
        return {name: getattr(self, name) for name in self.__slots__}


def check_map(
    reach: Reach, grid: MapGrid, grasps: str, *, radius: float | None = None, queries: int = 20_000,
    seed: int = 0, jobs: int = 2,
) -> MapCheck:  # fmt: skip
    """Return how often a whole map of this grid would be right, without making all of it.

    Only the cells that queries fall into are solved for; a map that holds all cells gives the same
    answers.

    Args:
        reach: The robot.
        grid: The cells.
        grasps: Which tool poses are asked for: "side", "top", or "all" orientations.
        radius: That of the map [m]; None is the arm's length.
        queries: How many poses.
        seed: Of the poses.
        jobs: Number of threads.

    Raises:
        UnknownNameError: If there is no such choice of grasps.
    """
    R_BT, p_BT = random_poses(reach, grasps, queries, seed)
    cells, of_query = np.unique(grid.nearest(R_BT, p_BT).cells, axis=0, return_inverse=True)
    R_BC, p_BC = grid.tool_in_base(cells)
    most = reach.length if radius is None else radius
    near = np.linalg.norm(p_BC - reach.shoulder, axis=1) <= most
    held = near & reach.solve(R_BC, p_BC, jobs=jobs).reached
    return MapCheck.of(held[of_query.ravel()], reach.solve(R_BT, p_BT, jobs=jobs).reached)


def check_stored(
    reach: Reach, capability: CapabilityMap, grasps: str, *, queries: int = 20_000, seed: int = 0,
    jobs: int = 2,
) -> MapCheck:  # fmt: skip
    """Return how often a map is right.

    Args:
        reach: The robot, at the map's lift.
        capability: The map.
        grasps: Which tool poses are asked for: "side", "top", or "all" orientations.
        queries: How many poses.
        seed: Of the poses.
        jobs: Number of threads.

    Raises:
        UnknownNameError: If there is no such choice of grasps.
    """
    R_BT, p_BT = random_poses(reach, grasps, queries, seed)
    says = capability.look_up(R_BT, p_BT) >= 0
    return MapCheck.of(says, reach.solve(R_BT, p_BT, jobs=jobs).reached)


def random_poses(reach: Reach, grasps: str, count: int, seed: int) -> tuple[FloatArray, FloatArray]:
    """Return tool poses in B, uniform in a cube about the shoulder and over their orientations.

    Args:
        reach: The robot.
        grasps: "side" and "top" turn about the vertical alone, "all" every way.
        count: How many.
        seed: Of the draws.

    Raises:
        UnknownNameError: If there is no such choice.
    """
    known = tuple(name for name in GRASPS if "+" not in name)
    if grasps not in known:
        raise UnknownNameError("choice of grasps", grasps, known)
    rng = np.random.default_rng(seed)
    p_BT = reach.shoulder + rng.uniform(-HALF_WIDTH, HALF_WIDTH, (count, 3))
    if grasps == "all":
        return Rotation.random(count, rng=rng).as_matrix(), p_BT
    R_ET = MapGrid.of(grasps=grasps).R_ET[0]
    return yaw_rotation(rng.uniform(-np.pi, np.pi, count)) @ R_ET, p_BT
