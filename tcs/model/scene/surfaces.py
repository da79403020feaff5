"""Contacts between shapes of the robot, judged by its surfaces where there is a table of distances.

The kernel takes the word of a table. Here the distance of the surfaces, triangle by triangle at
Drake's poses, has to confirm it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Joint
from pydrake.systems.framework import Context

from tcs.model.robots import RobotFile
from tcs.model.robots.distances import (
    DistanceTable,
    body_surface,
    surface_distance,
    tables_in_force,
)
from tcs.model.scene.contacts import Group, Part

FloatArray = NDArray[np.float64]

ROUNDING = 1e-6
"""What rounding may change of joint angles [rad]: score files keep seven digits of them."""
FARTHEST = 0.002
"""Distance that surfaces are compared up to beyond the required one [m]."""


class SurfaceContacts:
    """The pairs of bodies of a robot that have a table of distances."""

    def __init__(self, robot: RobotFile, parts: Iterable[Part], arm: Sequence[Joint]) -> None:
        """Read the tables that hold for the meshes at hand.

        Args:
            robot: The robot.
            parts: The shapes of the scene.
            arm: The joints of the scored arm in Drake's plant, in its order.

        Raises:
            RobotError: If the file of the tables cannot be read.
        """
        self._robot = robot
        self._tables = {frozenset(table.pair): table for table in tables_in_force(robot)}
        # Bodies of the environment may have the same names.
        self._bodies = {p.name: p.body for p in parts if p.group is not Group.ENVIRONMENT}
        self._joints = dict(zip(robot.arm_joints, arm, strict=True))
        self._surfaces: dict[str, FloatArray] = {}

    def distance(
        self, plant: MultibodyPlant, state: Context, first: str, second: str, required: float
    ) -> float | None:
        """Return the distance of the surfaces of two bodies whose shapes touch [m].

        Args:
            plant: The plant.
            state: Its state.
            first: Name of a body.
            second: Name of another.
            required: Distance that the bodies must keep [m].

        Returns:
            At most `FARTHEST` beyond the required distance; None where the shapes decide: the
            pair has no table, or the table does not show that the bodies keep the distance.
        """
        table = self._tables.get(frozenset((first, second)))
        if table is None or not self._shows(table, state, required):
            return None
        X_AB = self._pose(plant, state, first).inverse() @ self._pose(plant, state, second)
        there = self._surface(second)
        moved = there @ X_AB.rotation().matrix().T + X_AB.translation()
        here = self._surface(first)
        return surface_distance(here, np.asarray(moved), required + FARTHEST)

    def _surface(self, body: str) -> FloatArray:
        """Return the surface of a body in its frame [m], shape (n, 3, 3)."""
        if body not in self._surfaces:
            self._surfaces[body] = body_surface(self._robot, body)
        return self._surfaces[body]

    def _pose(self, plant: MultibodyPlant, state: Context, body: str) -> RigidTransform:
        return plant.EvalBodyPoseInWorld(state, plant.get_body(self._bodies[body]))

    def _shows(self, table: DistanceTable, state: Context, required: float) -> bool:
        """Return whether a table shows that its bodies keep a distance [m]."""
        positions = {name: self._joints[name].GetOnePosition(state) for name in table.joints}
        return table.bound(positions, ROUNDING) >= required
