"""Check of one solution with Drake: tool at the goal, joints within limits, no contact."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform

from tcs.kernel.verification.plain_dexterity import measured, prescribed
from tcs.model.scene import (
    Contact,
    NeighbourList,
    Scene,
    alternative_poses,
    arm_chain,
    axis_of_turn,
)
from tcs.model.tasks import Freedom
from tcs.placement.scoring.job import Job

POSITION_BAR = 1e-6
"""Greatest distance [m] of the tool from its goal. Joints are stored as float32: rounding moves
the tool by up to 1.2e-7 rad x 1 m for each of seven joints, 4e-7 m in practice."""
ROTATION_BAR = 2e-6
"""Greatest rotation [rad] of the tool from its goal: seven roundings of 1.2e-7 rad add up to
8.4e-7, and the angle of a rotation matrix near the identity loses as much again."""
DEXTERITY_BAR = 1e-6
"""Greatest difference of a stored dexterity from that of Drake's Jacobian. Float32 keeps 6e-8; a
least singular value from the eigenvalues of J J^T is good to 1e-7 next to a singularity."""
CLEARANCE_ROUNDING = 2e-6
"""Tolerance of a clearance measured by Drake [m]: rounding of the joints
moves a far corner of a link by 1e-6 m, and Drake's distance between boxes is accurate to 1e-6 m."""


@dataclass(frozen=True)
class Finding:
    """Drake's finding on one solution."""

    position_error: float
    """Distance of the tool from its goal, or from the nearest pose that serves as well [m]."""
    rotation_error: float
    """Rotation of the tool from its goal [rad]."""
    dexterity: float
    """Dexterity by Drake's Jacobian."""
    dexterity_error: float
    """Absolute difference of the stored dexterity from that."""
    limit_violations: int
    """Number of joints beyond their limits."""
    contacts: int
    """Number of pairs of bodies closer than required, in the posture at the goal and at rest."""

    @property
    def is_true(self) -> bool:
        """Whether the solution is at its goal, within its limits and free of contact."""
        return (
            self.position_error <= POSITION_BAR
            and self.rotation_error <= ROTATION_BAR
            and self.limit_violations == 0
            and self.contacts == 0
        )


def pose_errors(X_TG: RigidTransform, free: Freedom | None) -> tuple[float, float]:
    """Return how far the tool T is from a pose G, or from the nearest one that serves as well.

    Args:
        X_TG: The pose, as the tool sees it.
        free: What is free about it.

    Returns:
        Distance [m] and angle [rad].
    """
    if free is not None:
        X_GT = X_TG.inverse()
        return free.errors(X_GT.rotation().matrix(), X_GT.translation())
    angle = float(X_TG.rotation().ToAngleAxis().angle())
    return float(np.linalg.norm(X_TG.translation())), angle


def of_both(first: Finding, second: Finding, value: float) -> Finding:
    """Return the finding on two arms at once, whose stored dexterity is that of the lesser."""
    exact = min(first.dexterity, second.dexterity)
    return Finding(
        position_error=max(first.position_error, second.position_error),
        rotation_error=max(first.rotation_error, second.rotation_error),
        dexterity=exact,
        dexterity_error=abs(exact - float(value)),
        limit_violations=first.limit_violations + second.limit_violations,
        contacts=first.contacts + second.contacts,
    )


class DrakeChecker:
    """Checks solutions of one job with Drake."""

    def __init__(self, job: Job, scene: Scene, measure: str) -> None:
        """Take a job, its scene, and the name of its dexterity measure."""
        self._job, self._scene, self._measure = job, scene, measure
        self._neighbours = NeighbourList(scene)
        self._lower, self._upper = scene.arm_limits
        self._turn = _axis_of_turn(job, scene)
        self._grid = job.scored_grid
        self._axes = [axis.name for axis in self._grid.environment_axes]

    def pose_other_arm(self, q: NDArray[np.float64]) -> None:
        """Pose the arm that works at the same time, at joint angles q [rad], for what follows."""
        self._scene.set_robot_joints(self._job.other_joints, q)

    def values(self, h: int, off_grid: NDArray[np.float64] | None = None) -> dict[str, float]:
        """Return the values of all axes at configuration h [m or rad].

        Args:
            h: Index in the scored grid.
            off_grid: Values of the axes that can be chosen, the last ones, in place of those of h.
        """
        at = {name: float(value) for name, value in self._grid.values(h).items()}
        if off_grid is not None:
            names = [axis.name for axis in self._job.grid.axes]
            at |= dict(zip(names, map(float, off_grid), strict=True))
        return at

    def check_at(
        self, at: Mapping[str, float], g: int, q: NDArray[np.float64], value: float
    ) -> Finding:
        """Return the finding at values of all axes [m or rad], for goal g and joint angles q."""
        scene = self._scene
        scene.place_base(at["base_x"], at["base_y"], at["base_yaw"])
        scene.set_torso(at["torso"])
        for name in self._axes:
            scene.set_joint(name, at[name])
        q = q[-len(self._lower) :]
        scene.set_arm(q)
        X_WT, task = scene.tool_pose(), self._job.task
        errors = [
            pose_errors(X_WT.inverse() @ X_WG, pose.free)
            for pose, X_WG in zip(
                task.goals[g].poses, alternative_poses(scene, task)[g], strict=True
            )
        ]
        # The pose that serves is the one nearest to where the joints take the tool.
        position, rotation = min(
            errors, key=lambda e: max(e[0] / POSITION_BAR, e[1] / ROTATION_BAR)
        )
        contacts = self._contacts()
        J = scene.tool_jacobian()
        if self._turn is not None:
            J = prescribed(J, X_WT.rotation().matrix() @ self._turn)
        exact = measured(J, q, self._lower, self._upper, self._measure)
        return Finding(
            position_error=position,
            rotation_error=rotation,
            dexterity=exact,
            dexterity_error=abs(exact - float(value)),
            limit_violations=int(np.sum((q < self._lower) | (q > self._upper))),
            contacts=len(contacts) + self._contacts_at_rest(),
        )

    def _contacts(self) -> list[Contact]:
        """Return the contacts in the present state, those of rounding left out."""
        return [
            (first, second, distance)
            for first, second, distance in self._neighbours.violations()
            if distance < self._scene.required_clearance(first, second) - CLEARANCE_ROUNDING
        ]

    def _contacts_at_rest(self) -> int:
        """Return the fewest contacts with the environment in a rest posture; moves the arm."""
        least = None
        for q in self._scene.spec.robot.rest_postures().values():
            self._scene.set_arm(q)
            count = len(self._scene.of_environment(self._contacts()))
            least = count if least is None else min(least, count)
            if not least:
                break
        return least or 0


def _axis_of_turn(job: Job, scene: Scene) -> NDArray[np.float64] | None:
    """Return the axis about which goals leave an arm of five joints free; None for other arms."""
    before = scene.positions()
    try:
        scene.set_arm(np.zeros(len(scene.arm_limits[0])))
        chain, _ = arm_chain(scene)
    finally:
        scene.restore(before)
    axis = axis_of_turn(job.task, chain, scene.spec.robot.name)
    return None if axis is None else np.array(axis)
