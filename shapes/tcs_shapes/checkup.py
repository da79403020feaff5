"""The check-up of a robot: properties that scoring relies on, and the problems found in them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping
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
from tcs.model.robot_check import fingers_off_axis, flange_note, tool_axes_problem
from tcs.model.robots import RobotFile
from tcs.model.robots.tool_frame import ToolPlace, hand_axes, tool_place
from tcs.model.robots.urdf.pose import pose_in_root
from tcs.model.robots.urdf.surfaces import body_triangles
from tcs.model.scene import EMPTY_ENVIRONMENT, Contact, Scene, SceneSpec, arm_chain
from tcs_shapes.bodies import BodyEnclosure, enclosure
from tcs_shapes.doubts import doubts

MOST_EXCESS = 2.0
"""Volume of the primitives of a body over that of its hull above which the check-up adds a note: on
arm and hand the excess blocks goals that the real arm reaches."""

MOST_LOST = 0.05
"""Fraction of tool poses without a numeric solution above which scores would be affected."""

SUNK = 0.02
"""Greatest depth of a surface below a root that is on the floor [m]; models of wheels reach
millimetres below the floor."""
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
class JointLimits:
    """Limits of one joint that scoring moves [rad or m]; infinite for a continuous joint.

    Attributes:
        name: The joint.
        soft: Limits of the `safety_controller` of the URDF; the hard ones if there is none.
        hard: Limits of the `limit` element of the URDF.
        in_force: The pair that the robot file selects.
    """

    name: str
    soft: tuple[float, float]
    hard: tuple[float, float]
    in_force: tuple[float, float]

    @property
    def is_continuous(self) -> bool:
        """Whether the joint has no limits."""
        return math.isinf(self.in_force[0])

    def to_json(self) -> dict[str, Any]:
        """Return the limits as plain containers; those of a continuous joint are None."""
        pairs = {"in_force": self.in_force, "soft": self.soft, "hard": self.hard}
        plain = {k: None if self.is_continuous else list(pair) for k, pair in pairs.items()}
        return {"continuous": self.is_continuous, **plain}


@dataclass(frozen=True)
class RobotCheck:
    """Result of a check-up.

    Attributes:
        robot: The robot.
        arm: The class of its arm.
        limits: Limits of the joints of the arm, and of the torso last, if there is one.
        bodies: Enclosure of each body with a surface.
        rest: Rest posture of the arm, by joint [rad], in which self-collision was checked.
        margin: Distance below which bodies of the robot are in contact [m].
        lowest: Height above the root of the lowest point of all surfaces but the arm's [m].
        contacts: Pairs that scoring checks and that are in contact at rest.
        trip: Result of the IK round trip.
        seed: Seed of the postures of the round trip.
        fingers_along: Axis of the tool frame along which the fingers point, None if it is x or
            there are none.
        flange: What to review in the tool frame of a hand without fingers, None if nothing.
        place: Where the tool frame lies, seen from the hand; None if the hand has no shapes.
        doubts: What is doubtful in the URDF and the choice of the arm, one sentence each.
    """

    robot: RobotFile
    arm: ArmClass
    limits: tuple[JointLimits, ...]
    bodies: tuple[BodyEnclosure, ...]
    rest: Mapping[str, float]
    margin: float
    lowest: float
    contacts: tuple[Contact, ...]
    trip: RoundTrip
    seed: int
    fingers_along: str | None = None
    flange: str | None = None
    place: ToolPlace | None = None
    doubts: tuple[str, ...] = ()

    @property
    def bodies_without_mesh(self) -> tuple[str, ...]:
        """Bodies that the robot file adds, without a mesh to compare their primitives with."""
        return tuple(body.name for body in self.robot.bodies)

    @property
    def is_sound(self) -> bool:
        """Whether there are no problems."""
        return not self.problems

    @property
    def problems(self) -> tuple[str, ...]:
        """Faults that prevent scoring or make its results wrong, one sentence each."""
        found = []
        found += [
            f"joint '{joint.name}' cannot move: its limits in force are both {joint.in_force[0]:g}."
            for joint in self.limits
            if joint.in_force[0] == joint.in_force[1]
        ]
        found += [_protrusion(body) for body in self.bodies if body.outside]
        found += [
            f"'{first}' and '{second}' are {distance * 1e3:.1f} mm apart with the arm at rest, "
            f"less than the margin of {self.margin * 1e3:g} mm: correct their primitives, or list "
            "the pair under disabled_groups if it may touch."
            for first, second, distance in self.contacts
        ]
        if self.lowest < -SUNK:
            found.append(
                f"its surface reaches {-self.lowest:.3f} m below '{self.robot.root_body}', but the "
                "root must be on the floor: add a root link on the floor to the URDF."
            )
        if self.fingers_along is not None:
            found.append(tool_axes_problem(self.robot, self.fingers_along))
        if self.arm.joints < 7 and self.arm.solver is None:
            return (*found, self.arm.reason)
        lost = self.trip.samples - self.trip.recovered
        if lost and self.arm.solver is not None:
            found.append(
                f"{lost} of {self.trip.samples} random postures are not among the kernel's "
                "solutions for their tool pose."
            )
        if lost > MOST_LOST * self.trip.samples and self.arm.solver is None:
            found.append(
                f"no solution for {lost} of {self.trip.samples} tool poses of random postures: "
                "scoring would miss too many goals."
            )
        return tuple(found)

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on properties that are not problems, one sentence each."""
        found = list(self.doubts)
        if self.arm.solver is None and self.arm.joints == 7:
            found.append(f"{self.arm.reason} It is solved numerically, which takes longer.")
        if self.arm.joints == 5:
            found.append(
                "the arm has five joints: goals must leave a rotation of the tool free, as with "
                "'free: {rotation_about: [0, 0, 1]}' or 'free: orientation' in a task."
            )
        bulky = [b for b in self.bodies if b.body in self._moved and b.excess > MOST_EXCESS]
        found += [
            f"the primitives of '{body.body}' have {body.excess:.2f} times the volume of its hull: "
            "goals may count as blocked that the real arm reaches."
            for body in bulky
        ]
        if self.bodies_without_mesh:
            found.append(
                f"no mesh to compare the primitives with: {', '.join(self.bodies_without_mesh)} "
                "(bodies of the robot file)."
            )
        if self.flange is not None:
            found.append(self.flange)
        if self.robot.ignored_links:
            found.append(
                f"nothing is checked against {', '.join(self.robot.ignored_links)} "
                "('ignored_links' of the robot file)."
            )
        if self.robot.surfaces != "all":
            other = "visual" if self.robot.surfaces == "collision" else "collision"
            found.append(
                f"surfaces: {self.robot.surfaces}, so parts of the {other} meshes may protrude "
                "from the primitives unchecked."
            )
        if self.robot.limits == "soft" and all(j.soft == j.hard for j in self.limits):
            found.append(
                "limits: soft, but the URDF has no safety_controller: the hard limits are in force."
            )
        return tuple(found)

    @property
    def _moved(self) -> frozenset[str]:
        """Bodies of the URDF that the arm moves."""
        return self.robot.model().links_moved_by(self.robot.arm_joints[0])

    def to_json(self) -> dict[str, Any]:
        """Return the result as plain containers."""
        return {
            "robot": self.robot.name,
            "sound": self.is_sound,
            "problems": list(self.problems),
            "notes": list(self.notes),
            "arm_class": self.arm.to_json(),
            "limits": {
                "in_force": self.robot.limits,
                "joints": {joint.name: joint.to_json() for joint in self.limits},
            },
            "enclosed": {
                "enclosed": not any(body.outside for body in self.bodies),
                "triangles": sum(body.triangles for body in self.bodies),
                "outside": sum(body.outside for body in self.bodies),
                "bodies": {
                    body.body: {
                        "triangles": body.triangles,
                        "outside": body.outside,
                        "farthest_m": body.farthest if math.isfinite(body.farthest) else None,
                    }
                    for body in self.bodies
                },
                "without_mesh": list(self.bodies_without_mesh),
            },
            "excess_volume": {body.body: body.excess for body in self.bodies},
            "lowest_point_m": self.lowest,
            "fingers_along": self.fingers_along,
            "hand_beyond_tool_m": None if self.place is None else self.place.beyond,
            "self_collision": {
                "rest_rad": dict(self.rest),
                "margin_m": self.margin,
                "pairs": [
                    {"bodies": [first, second], "distance_m": distance}
                    for first, second, distance in self.contacts
                ],
            },
            "ik_round_trip": {**self.trip.to_json(), "seed": self.seed},
        }


def check_up(robot: RobotFile, *, samples: int = 1000, seed: int = 0) -> RobotCheck:
    """Check every property of a robot that scoring relies on.

    Args:
        robot: The robot, as `load_robot` returns it.
        samples: Number of random postures of the IK round trip.
        seed: Seed of the draws.

    Raises:
        RobotError: If a model or mesh of the robot cannot be used.
        OutputError: If the kernel's cache cannot be written.
    """
    scene = Scene(SceneSpec(robot, EMPTY_ENVIRONMENT))
    scene.set_arm(np.zeros(len(robot.arm_joints)))
    arm = arm_class(arm_chain(scene)[0])
    positions = robot.with_mimics({**robot.joint_positions(), **robot.rest})
    rest = {name: positions[name] for name in robot.arm_joints}
    contacts: dict[Contact, None] = {}
    for posture in robot.rest_postures().values():
        scene.set_arm(posture)
        contacts |= dict.fromkeys(scene.violations())
    return RobotCheck(
        robot=robot,
        arm=arm,
        limits=_limits(robot),
        bodies=enclosure(robot),
        rest=rest,
        margin=robot.self_margin,
        lowest=_lowest(robot, positions),
        contacts=tuple(contacts),
        trip=round_trip(scene, arm.solver, samples, seed),
        seed=seed,
        fingers_along=fingers_off_axis(robot),
        flange=flange_note(robot, hand_axes(robot)),
        place=tool_place(robot),
        doubts=doubts(robot),
    )


def _limits(robot: RobotFile) -> tuple[JointLimits, ...]:
    joints, in_force = robot.model().joints, robot.joint_limits()
    torso = () if robot.torso_joint is None else (robot.torso_joint,)
    return tuple(
        JointLimits(name, joints[name].soft, joints[name].hard, in_force[name])
        for name in (*robot.arm_joints, *torso)
    )


def _lowest(robot: RobotFile, positions: Mapping[str, float]) -> float:
    """Return the height above the root of the lowest point of all but the arm, at most 0 [m]."""
    model, lows = robot.model(), [0.0]
    arm = model.links_moved_by(robot.arm_joints[0])
    for body, triangles in body_triangles(model).items():
        if body in arm:
            continue
        R, p = pose_in_root(model, body, positions)
        lows.append(float((triangles @ R[2] + p[2]).min()))
    return min(lows)


def _protrusion(body: BodyEnclosure) -> str:
    if math.isinf(body.farthest):
        return f"'{body.body}' has a surface, but no primitive: fit one."
    return (
        f"'{body.body}': {body.outside} of {body.triangles} triangles do not lie in one of its "
        f"primitives, by up to {body.farthest * 1e3:.1f} mm: fit them again."
    )


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
