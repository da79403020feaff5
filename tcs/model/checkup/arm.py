"""Which class of arms the kernel takes an arm for, and whether its solutions come back."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from pydrake.math import RigidTransform

from tcs.errors import ArmClassError
from tcs.kernel.analytic.ik import lane_joints, wrist_goal
from tcs.kernel.analytic.solver import FIRST, ArmSolver, arm_solver
from tcs.kernel.arrays import Chain, FloatArray
from tcs.kernel.numeric.solutions import numeric_solutions
from tcs.model.scene import Scene, arm_chain

RECOVERED = 1e-4
"""A posture counts as found again when every joint agrees to this [rad]. Figures of a URDF let axes
miss each other by up to a nanometre; where two solutions fall together, joints feel its root."""
ON_GOAL = 1e-6
"""A solution whose tool is farther off its goal than this [m or rad] is none: a branch without a
solution comes out clipped to the nearest pose there is."""

_MEETING = (("2-3", (2, 3)), ("5-6-7", (5, 6, 7)), ("1-2-3", (1, 2, 3)), ("5-6", (5, 6)))
"""Axes that have to meet in one point: the first two in one class, the others in its mirror
image."""


@dataclass(frozen=True, slots=True)
class ArmClass:
    """The class of arms that an arm belongs to.

    Attributes:
        name: "closed form": axes 2 and 3 meet, and 5, 6 and 7, joint 1 is free. "reversed": its
            mirror image, axes 1, 2 and 3 meet, and 5 and 6, joint 7 is free. None: outside both.
        reason: Why it is outside, else empty.
        distances: How far axes are from meeting in one point [m], by their numbers; None where two
            neighbours are parallel.
        solver: The closed form's constants, None outside.
    """

    name: Literal["closed form", "reversed"] | None
    reason: str
    distances: dict[str, float | None]
    solver: ArmSolver | None

    def to_json(self) -> dict[str, Any]:
        """Return it as plain containers."""
        return {
            "class": self.name,
            "reason": self.reason,
            "metres_from_meeting": self.distances,
        }


@dataclass(frozen=True, slots=True)
class RoundTrip:
    """Random postures, brought to a tool pose by Drake and back by the kernel.

    Attributes:
        method: "closed form", which has to give every posture back, or "numeric", which looks for
            any posture with the same tool pose, and may fail.
        samples: How many postures were drawn, uniformly within the limits.
        recovered: How many of them are among the kernel's solutions; numeric: for how many there
            is a solution at all.
        solutions: How many solutions the kernel gave in all.
        joint_error: The worst joint of the recovered postures [rad]; None where solutions are
            other postures.
        position_error: How far the worst solution's tool is off its goal [m].
        rotation_error: The same for its orientation [rad].
    """

    method: Literal["closed form", "numeric"]
    samples: int
    recovered: int
    solutions: int
    joint_error: float | None
    position_error: float
    rotation_error: float

    def to_json(self) -> dict[str, Any]:
        """Return it as plain containers."""
        return {
            "method": self.method,
            "samples": self.samples,
            "recovered": self.recovered,
            "success_rate": self.recovered / self.samples,
            "solutions": self.solutions,
            "max_joint_error_rad": self.joint_error,
            "max_position_error_m": self.position_error,
            "max_rotation_error_rad": self.rotation_error,
        }


def arm_class(chain: Chain) -> ArmClass:
    """Return the class of an arm."""
    distances = {name: _distance_from_meeting(chain, axes) for name, axes in _MEETING}
    try:
        solver = arm_solver(chain)
    except ArmClassError as error:
        return ArmClass(None, str(error), distances, None)
    return ArmClass("closed form" if solver.free == FIRST else "reversed", "", distances, solver)


def round_trip(scene: Scene, solver: ArmSolver | None, samples: int, seed: int) -> RoundTrip:
    """Return what becomes of random postures on the way to their tool pose and back.

    Drake says where the tool is; the kernel solves for that pose, in closed form with the free
    joint where it was drawn, on every branch; Drake says where each solution puts the tool.

    Args:
        scene: The robot, anywhere; its state is changed.
        solver: The arm's closed form; None has the arm solved numerically.
        samples: Number of postures.
        seed: Seed of the draws.
    """
    # The chain is read off the scene with the arm at zero.
    scene.set_arm(np.zeros(len(scene.arm_limits[0])))
    chain, _ = arm_chain(scene)
    lower, upper = scene.arm_limits
    first, last = (np.where(np.isfinite(x), x, s * np.pi) for x, s in ((lower, -1), (upper, 1)))
    recovered = solutions = 0
    joint_error = position_error = rotation_error = 0.0
    for drawn in np.random.default_rng(seed).uniform(first, last, size=(samples, len(first))):
        X_AG = _tool_in_arm_base(scene, drawn)
        closest = np.inf
        for q in _solved(chain, solver, X_AG, drawn):
            X_GT = X_AG.inverse() @ _tool_in_arm_base(scene, q)
            off = float(np.linalg.norm(X_GT.translation()))
            turned = abs(float(X_GT.rotation().ToAngleAxis().angle()))
            if max(off, turned) > ON_GOAL:
                continue
            solutions += 1
            position_error = max(position_error, off)
            rotation_error = max(rotation_error, turned)
            apart = (q - drawn + np.pi) % (2 * np.pi) - np.pi
            closest = min(closest, float(np.abs(apart).max()))
        # Any solution will do where the posture itself is one of a continuum.
        if closest <= (np.pi if solver is None else RECOVERED):
            recovered += 1
            joint_error = max(joint_error, closest)
    return RoundTrip(
        method="numeric" if solver is None else "closed form",
        samples=samples,
        recovered=recovered,
        solutions=solutions,
        joint_error=None if solver is None else joint_error,
        position_error=position_error,
        rotation_error=rotation_error,
    )


def _solved(
    chain: Chain, solver: ArmSolver | None, X_AG: RigidTransform, drawn: FloatArray
) -> Iterable[FloatArray]:
    """Return the kernel's solutions for a tool pose [rad], each of shape (7,)."""
    if solver is None:
        return numeric_solutions(chain, X_AG.rotation().matrix(), X_AG.translation())
    return _branches(solver, X_AG, float(drawn[solver.free]))


def _branches(solver: ArmSolver, X_AG: RigidTransform, free: float) -> list[FloatArray]:
    """Return what the closed form gives on every branch [rad], each of shape (7,)."""
    goal, found = np.zeros((4, 3)), []
    R_AG = np.ascontiguousarray(X_AG.rotation().matrix())
    wrist_goal(solver, R_AG, np.array(X_AG.translation()), goal)
    for branch in solver.branches:
        q = np.zeros(7)
        lane_joints(solver, goal, branch, free, q)
        found.append(q)
    return found


def _tool_in_arm_base(scene: Scene, q: FloatArray) -> RigidTransform:
    """Return X_AT with the arm at q [rad]."""
    scene.set_arm(q)
    built = scene.built
    X_AT: RigidTransform = built.tool_frame.CalcPose(scene.plant_context, built.arm_base_frame)
    return X_AT


def _distance_from_meeting(chain: Chain, axes: tuple[int, ...]) -> float | None:
    """Return how far neighbouring axes are from meeting in one point [m].

    For two axes that is their distance. For three it is the largest of the distances of
    neighbours, and of that between the two places where the outer ones come closest to the middle
    one. Joint angles do not matter.
    """
    passes = [_closest(chain.R[i], chain.p[i]) for i in axes[:-1]]
    known = [passing for passing in passes if passing is not None]
    if len(known) < len(passes):
        return None
    slips = (abs(after[1] - before[2]) for before, after in itertools.pairwise(known))
    return max(max(passing[0] for passing in known), *slips, 0.0)


def _closest(R: FloatArray, p: FloatArray) -> tuple[float, float, float] | None:
    """Return how the z axis of a frame passes that of another one at the pose (R, p) in it.

    Returns:
        Their distance, and where they come closest, on each axis from its origin [m]; None where
        they are parallel.
    """
    directions = np.column_stack([[0.0, 0.0, 1.0], -R[:, 2]])
    # Sines below a millionth are the rounding of a URDF's figures.
    along, _, rank, _ = np.linalg.lstsq(directions, p, rcond=1e-6)
    if rank < 2:
        return None
    return float(np.linalg.norm(directions @ along - p)), float(along[0]), float(along[1])
