"""The class of an arm in the kernel, and an IK round trip between Drake and the kernel."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from pydrake.math import RigidTransform

from tcs.errors import ArmClassError
from tcs.kernel.analytic.ik import sample_joints, wrist_goal
from tcs.kernel.analytic.solver import FIRST, ArmSolver, arm_solver
from tcs.kernel.arrays import Chain, FloatArray
from tcs.kernel.five_joints.turned import turned_arm
from tcs.kernel.lines import axis_distance
from tcs.kernel.numeric.solutions import numeric_solutions
from tcs.kernel.six_joints.arm import (
    SixJointArm,
    has_spherical_wrist,
    is_general,
    is_sliding,
    six_joint_arm,
)
from tcs.kernel.six_joints.solutions import six_joint_solutions
from tcs.model.scene import Scene, arm_chain

RECOVERED = 1e-4
"""Largest joint error of a recovered posture [rad]. With the rounded numbers of a URDF, axes that
should meet are up to a nanometre apart; where two solutions coincide, the joint error grows with
the square root of that."""
ON_GOAL = 1e-6
"""Largest pose error of a solution [m or rad]: a branch without a solution returns the nearest
pose, which does not count."""

ClassName = Literal[
    "spherical-wrist",
    "spherical-shoulder",
    "six-joint spherical-wrist",
    "six-joint parallel-axes",
    "three prismatic joints",
    "six-joint elimination",
    "five joints",
]

_MEETING = (("2-3", (2, 3)), ("5-6-7", (5, 6, 7)), ("1-2-3", (1, 2, 3)), ("5-6", (5, 6)))
"""Axes that must meet in one point: the first two entries for a spherical-wrist arm, the others for
a spherical-shoulder arm."""


@dataclass(frozen=True, slots=True)
class ArmClass:
    """The class of an arm, which decides how inverse kinematics is solved.

    Attributes:
        name: "spherical-wrist": axes 2 and 3 meet in a point, and so do axes 5, 6 and 7; joint 1 is
            the free joint. "spherical-shoulder": axes 1, 2 and 3 meet, and axes 5 and 6; joint 7 is
            the free joint. "six-joint spherical-wrist": of six joints, axes 1 and 2 meet, and so do
            axes 4, 5 and 6; "six-joint parallel-axes": axes 2, 3 and 4 are parallel, and axes 5 and
            6 meet. "three prismatic joints": three more are revolute. "six-joint elimination": any
            other six revolute joints, whose solutions are all found by elimination. "five joints":
            solved with a rotation of the tool that goals leave free, as an arm of six. None: none
            of these.
        reason: Why the arm is in no class, else empty.
        distances: Distance of axes from meeting in one point [m], by their numbers; None if two
            neighbours are parallel.
        solver: Constants of the closed form, None if there is none.
        joints: Number of joints.
    """

    name: ClassName | None
    reason: str
    distances: dict[str, float | None]
    solver: ArmSolver | SixJointArm | None
    joints: int = 7

    def to_json(self) -> dict[str, Any]:
        """Return the class as plain containers."""
        return {
            "class": self.name,
            "reason": self.reason,
            "metres_from_meeting": self.distances,
        }


@dataclass(frozen=True, slots=True)
class RoundTrip:
    """Result of an IK round trip: tool poses of random postures by Drake, solved by the kernel.

    Attributes:
        method: "closed form" or "elimination", which must recover every posture, or
            "numeric", which searches for any posture with the same tool pose and may fail.
        samples: Number of postures, drawn uniformly within the limits.
        recovered: Number of postures that are among the kernel's solutions; numeric: number of
            postures whose tool pose has a solution.
        solutions: Number of solutions in all.
        joint_error: Largest joint error of the recovered postures [rad]; None for "numeric", where
            solutions are other postures.
        position_error: Largest position error of the tool [m].
        rotation_error: Largest orientation error of the tool [rad].
    """

    method: Literal["closed form", "elimination", "numeric"]
    samples: int
    recovered: int
    solutions: int
    joint_error: float | None
    position_error: float
    rotation_error: float

    def to_json(self) -> dict[str, Any]:
        """Return the result as plain containers."""
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
    if chain.joints == 6:
        return _six_joint_class(chain)
    if chain.joints == 5:
        return _five_joint_class(chain)
    distances = {name: _distance_from_meeting(chain, axes) for name, axes in _MEETING}
    try:
        solver = arm_solver(chain)
    except ArmClassError as error:
        return ArmClass(None, str(error), distances, None)
    name: ClassName = "spherical-wrist" if solver.free == FIRST else "spherical-shoulder"
    return ArmClass(name, "", distances, solver)


def _six_joint_class(chain: Chain) -> ArmClass:
    """Return the class of an arm of six joints."""
    # Its axes are those of the chain from the second one on.
    distances = {
        "1-2": _distance_from_meeting(chain, (2, 3)),
        "4-5-6": _distance_from_meeting(chain, (5, 6, 7)),
        "5-6": _distance_from_meeting(chain, (6, 7)),
    }
    try:
        arm = six_joint_arm(chain)
    except ArmClassError as error:
        return ArmClass(None, str(error), distances, None, joints=6)
    name: ClassName = "six-joint parallel-axes"
    if is_general(arm):
        name = "six-joint elimination"
    elif is_sliding(arm):
        name = "three prismatic joints"
    elif has_spherical_wrist(arm):
        name = "six-joint spherical-wrist"
    return ArmClass(name, "", distances, arm, joints=6)


def _five_joint_class(chain: Chain) -> ArmClass:
    """Return the class of an arm of five joints, solved with the first axis of T that serves."""
    reason = ""
    for axis in np.eye(3):
        try:
            return ArmClass("five joints", "", {}, turned_arm(chain, axis), joints=5)
        except ArmClassError as error:
            reason = f"whatever axis of the tool goals leave free: {error}"
    return ArmClass(None, reason, {}, None, joints=5)


def round_trip(
    scene: Scene, solver: ArmSolver | SixJointArm | None, samples: int, seed: int
) -> RoundTrip:
    """Return the result of an IK round trip over random postures.

    Drake computes the tool pose of a posture, the kernel solves for it, and Drake computes the tool
    pose of each solution. The closed form is solved on every branch, with the free joint as drawn.

    Args:
        scene: A scene of the robot; its state is changed.
        solver: The closed form of the arm; None solves it numerically.
        samples: Number of postures.
        seed: Seed of the draws.
    """
    # The chain is read from the scene with the arm at zero.
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
            q = q[-len(drawn) :]
            X_GT = X_AG.inverse() @ _tool_in_arm_base(scene, q)
            distance = float(np.linalg.norm(X_GT.translation()))
            angle = abs(float(X_GT.rotation().ToAngleAxis().angle()))
            if max(distance, angle) > ON_GOAL:
                continue
            solutions += 1
            position_error = max(position_error, distance)
            rotation_error = max(rotation_error, angle)
            difference = (q - drawn + np.pi) % (2 * np.pi) - np.pi
            closest = min(closest, float(np.abs(difference).max()))
        # The numeric method may return any solution of a continuum.
        if closest <= (np.pi if solver is None else RECOVERED):
            recovered += 1
            joint_error = max(joint_error, closest)
    method: Literal["closed form", "elimination", "numeric"] = "closed form"
    if solver is None:
        method = "numeric"
    elif isinstance(solver, SixJointArm) and is_general(solver):
        method = "elimination"
    return RoundTrip(
        method=method,
        samples=samples,
        recovered=recovered,
        solutions=solutions,
        joint_error=None if solver is None else joint_error,
        position_error=position_error,
        rotation_error=rotation_error,
    )


def _solved(
    chain: Chain,
    solver: ArmSolver | SixJointArm | None,
    X_AG: RigidTransform,
    drawn: FloatArray,
) -> Iterable[FloatArray]:
    """Return the kernel's solutions for a tool pose [rad], each of shape (7,)."""
    if isinstance(solver, SixJointArm):
        found = six_joint_solutions(solver, X_AG.rotation().matrix(), X_AG.translation())
        # Its last joint is the free rotation of an arm of five joints.
        return found if chain.joints == 6 else found[:, :-1]
    if chain.joints < 7:
        return ()
    if solver is None:
        return numeric_solutions(chain, X_AG.rotation().matrix(), X_AG.translation())
    return _branches(solver, X_AG, float(drawn[solver.free]))


def _branches(solver: ArmSolver, X_AG: RigidTransform, free: float) -> list[FloatArray]:
    """Return the solution of the closed form on every branch [rad], each of shape (7,)."""
    goal, found = np.zeros((4, 3)), []
    R_AG = np.ascontiguousarray(X_AG.rotation().matrix())
    wrist_goal(solver, R_AG, np.array(X_AG.translation()), goal)
    for branch in solver.branches:
        q = np.zeros(7)
        sample_joints(solver, goal, branch, free, q)
        found.append(q)
    return found


def _tool_in_arm_base(scene: Scene, q: FloatArray) -> RigidTransform:
    """Return X_AT with the arm at q [rad]."""
    scene.set_arm(q)
    built = scene.built
    X_AT: RigidTransform = built.tool_frame.CalcPose(scene.plant_context, built.arm_base_frame)
    return X_AT


def _distance_from_meeting(chain: Chain, axes: tuple[int, ...]) -> float | None:
    """Return the distance of neighbouring axes from meeting in one point [m].

    For two axes it is their distance. For three it is the largest of the distances of neighbours
    and of the distance, along the middle axis, between the points where the outer ones come
    closest. Joint angles do not matter.
    """
    approaches = [axis_distance(chain.R[i], chain.p[i]) for i in axes[:-1]]
    known = [approach for approach in approaches if approach is not None]
    if len(known) < len(approaches):
        return None
    offsets = (abs(after[1] - before[2]) for before, after in itertools.pairwise(known))
    return max(max(approach[0] for approach in known), *offsets, 0.0)
