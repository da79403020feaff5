"""Where the robot's shapes are: its body at the candidates, its arm in the stored solutions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tcs.model.grid import Grid
from tcs.placement.store.robot_shapes import RobotShapes
from tcs.placement.tables import ScoreTable, SetTable

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

ROUNDING = 1e-5
"""Added to radii and clearances [m]: joints stored as float32 move a link by up to 4e-6 m, and
centres kept as float32 are rounded by 2e-7 m."""


@dataclass(frozen=True, eq=False)
class Postures:
    """The robot at each candidate, and its arm in each stored solution of a hand.

    They are independent of a query.
    """

    shapes: RobotShapes
    """The robot's shapes."""
    sets: SetTable
    """The candidates."""
    grid: Grid
    """Their grid."""
    scores: ScoreTable
    """The stored solutions."""
    hand: int = 0
    """Number of the hand of the shapes, whose solutions count."""

    @cached_property
    def base(self) -> FloatArray:
        """x, y [m] and heading [rad] of the base of each candidate in W, shape (C, 3)."""
        values = self.grid.values(self.sets.candidates)
        return np.stack([values[name] for name in ("base_x", "base_y", "base_yaw")], axis=1)

    @cached_property
    def level(self) -> IntArray:
        """Torso level of each candidate, shape (C,)."""
        return self.grid.indices(self.sets.candidates)[:, -1]

    @cached_property
    def body_poses(self) -> tuple[IntArray, IntArray]:
        """A candidate for each distinct pose of the body, and the pose of each candidate.

        Shapes (U,) and (C,). The body is the same in all states of the environment.
        """
        _, first, inverse = np.unique(
            self.sets.candidates % self.grid.state_size, return_index=True, return_inverse=True
        )
        return first.astype(np.int64), inverse.astype(np.int64)

    @cached_property
    def pairs(self) -> tuple[IntArray, IntArray]:
        """Candidate and goal of each stored solution of a candidate, shapes (R,)."""
        candidate, goal = np.nonzero(self.sets.served == self.hand + 1)
        return candidate.astype(np.int64), goal.astype(np.int64)

    @cached_property
    def joints(self) -> FloatArray:
        """Arm joints of these solutions [rad], shape (R, 7)."""
        candidate, goal = self.pairs
        stored = np.flatnonzero(self.scores.reached)
        flat = self.sets.candidates[candidate].astype(np.int64) * self.scores.goals + goal
        return self.scores.arm_joints[np.searchsorted(stored, flat)].astype(np.float64)

    @cached_property
    def centres(self) -> NDArray[np.float32]:
        """Centre of each arm shape in B in each solution [m], by coordinate, shape (3, R, n).

        Float32, which is enough to find the shapes near an obstacle.
        """
        links_R, links_p = self.link_poses
        arm = self.shapes.arm
        centres = np.empty((3, len(links_p), len(arm.type)), dtype=np.float32)
        for shape, link in enumerate(arm.frame - 1):
            centres[:, :, shape] = (links_p[:, link] + links_R[:, link] @ arm.p[shape]).T
        return centres

    @cached_property
    def spheres(self) -> tuple[FloatArray, FloatArray]:
        """Centre in B and radius of a sphere about the arm in each solution, (R, 3) and (R,)."""
        bound = self.shapes.arm.bound + self.shapes.arm.pad
        low = (self.centres - bound).min(axis=2, initial=np.inf)
        high = (self.centres + bound).max(axis=2, initial=-np.inf)
        middle = (low + high) / 2.0 if len(bound) else np.zeros((3, len(self.joints)))
        out = np.linalg.norm(self.centres - middle[:, :, None], axis=0) + bound
        return middle.T.copy(), out.max(axis=1, initial=0.0) + ROUNDING

    @cached_property
    def reach(self) -> FloatArray:
        """Radius of a vertical cylinder about the base that holds the arm of a candidate, (C,)."""
        middle, radius = self.spheres
        reach = np.zeros(len(self.sets.candidates))
        np.maximum.at(reach, self.pairs[0], np.hypot(middle[:, 0], middle[:, 1]) + radius)
        return reach + ROUNDING

    @cached_property
    def link_poses(self) -> tuple[FloatArray, FloatArray]:
        """Poses of the arm's links in B in each solution, (R, links, 3, 3) and (R, links, 3)."""
        return self.shapes.link_poses(self.joints, self.level[self.pairs[0]])
