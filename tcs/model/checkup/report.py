"""The check-up of a robot: properties that scoring relies on, and the problems found in them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tcs.model.checkup.arm import ArmClass, RoundTrip, arm_class, round_trip
from tcs.model.checkup.tool import fingers_off_axis, flange_note, tool_axes_problem
from tcs.model.robots import RobotFile
from tcs.model.robots.doubts import doubts
from tcs.model.robots.fitting import BodyEnclosure, enclosure
from tcs.model.robots.hand import hand_axes
from tcs.model.robots.tool_place import ToolPlace, tool_place
from tcs.model.robots.urdf.pose import pose_in_root
from tcs.model.robots.urdf.surfaces import body_triangles
from tcs.model.scene import EMPTY_ENVIRONMENT, Contact, Scene, SceneSpec, arm_chain

MOST_EXCESS = 2.0
"""Volume of the primitives of a body over that of its hull above which the check-up adds a note: on
arm and hand the excess blocks goals that the real arm reaches."""

MOST_LOST = 0.05
"""Fraction of tool poses without a numeric solution above which scores would be affected."""

SUNK = 0.02
"""Greatest depth of a surface below a root that is on the floor [m]; models of wheels reach
millimetres below the floor."""


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
