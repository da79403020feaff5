"""The check-up of a robot: everything that scoring relies on, looked at once."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tcs.model.checkup.arm import ArmClass, RoundTrip, arm_class, round_trip
from tcs.model.robots import RobotFile
from tcs.model.robots.fitting import BodyEnclosure, enclosure
from tcs.model.robots.urdf.pose import pose_in_root
from tcs.model.robots.urdf.surfaces import body_triangles
from tcs.model.scene import EMPTY_ENVIRONMENT, Contact, Scene, SceneSpec, arm_chain

MOST_EXCESS = 2.0
"""Shapes of the arm and hand that take more than so many times the volume of the hull deserve a
look: they block goals that the real arm reaches."""

MOST_LOST = 0.05
"""Share of tool poses that a numeric solver may find nothing for: more would show in the scores."""

SUNK = 0.02
"""Surfaces that reach farther below the floor than this [m] mean that the root does not lie on it;
models of wheels sink in by millimetres."""


@dataclass(frozen=True, slots=True)
class JointLimits:
    """Limits of one joint that scoring moves [rad or m]; infinite where it turns on and on.

    Attributes:
        name: The joint.
        soft: Of the URDF's `safety_controller`; the hard ones where it says none.
        hard: Of the URDF's `limit`.
        in_force: Those of the two that the robot file chooses.
    """

    name: str
    soft: tuple[float, float]
    hard: tuple[float, float]
    in_force: tuple[float, float]

    @property
    def is_continuous(self) -> bool:
        """Whether the joint turns on and on."""
        return math.isinf(self.in_force[0])

    def to_json(self) -> dict[str, Any]:
        """Return it as plain containers; no limits are null, for JSON knows no infinity."""
        pairs = {"in_force": self.in_force, "soft": self.soft, "hard": self.hard}
        plain = {k: None if self.is_continuous else list(pair) for k, pair in pairs.items()}
        return {"continuous": self.is_continuous, **plain}


@dataclass(frozen=True)
class RobotCheck:
    """What a check-up found.

    Attributes:
        robot: The robot that was looked at.
        arm: Its arm's class.
        limits: Limits of the arm's joints, and of the torso if there is one, last.
        bodies: How the primitives enclose each body with a surface.
        rest: Where the arm was for self-collision, by joint [rad]: at rest, as the file says.
        margin: Contacts closer than this count [m].
        lowest: Height of the lowest point of any surface above the root, the arm at rest [m].
        contacts: Pairs that scoring checks and that are closer than that at rest.
        trip: The IK round trip.
        seed: Seed of the round trip's postures.
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

    @property
    def unseen(self) -> tuple[str, ...]:
        """Bodies that the robot file adds: there is no mesh to hold their primitives against."""
        return tuple(body.name for body in self.robot.bodies)

    @property
    def is_sound(self) -> bool:
        """Whether nothing is wrong."""
        return not self.problems

    @property
    def problems(self) -> tuple[str, ...]:
        """What keeps the robot from being scored, or its scores from being right."""
        found = []
        found += [
            f"joint '{joint.name}' cannot move: its limits in force are both {joint.in_force[0]:g}."
            for joint in self.limits
            if joint.in_force[0] == joint.in_force[1]
        ]
        found += [_stands_out(body) for body in self.bodies if body.outside]
        found += [
            f"'{first}' and '{second}' are {distance * 1e3:.1f} mm apart with the arm at rest, "
            f"less than the margin of {self.margin * 1e3:g} mm: mend their primitives, or name the "
            "pair under disabled_groups if it may touch."
            for first, second, distance in self.contacts
        ]
        if self.lowest < -SUNK:
            found.append(
                f"its surface reaches {-self.lowest:.3f} m below '{self.robot.root_body}', but the "
                "root has to lie on the floor: give the URDF a link there that carries the rest."
            )
        lost = self.trip.samples - self.trip.recovered
        if lost and self.arm.solver is not None:
            found.append(
                f"{lost} of {self.trip.samples} random postures are not among the kernel's "
                "solutions for their own tool pose."
            )
        if lost > MOST_LOST * self.trip.samples and self.arm.solver is None:
            found.append(
                f"no solution for {lost} of {self.trip.samples} tool poses of random postures: "
                "what scoring reaches would be too little to go by."
            )
        return tuple(found)

    @property
    def notes(self) -> tuple[str, ...]:
        """What is not wrong, but worth knowing."""
        found = []
        if self.arm.solver is None:
            found.append(f"{self.arm.reason} So it is solved numerically, which takes longer.")
        bulky = [b for b in self.bodies if b.body in self._moved and b.excess > MOST_EXCESS]
        found += [
            f"the primitives of '{body.body}' take {body.excess:.2f} times the volume of its hull: "
            "goals may count as blocked that the real arm reaches."
            for body in bulky
        ]
        if self.unseen:
            found.append(
                f"no mesh to hold the primitives against: {', '.join(self.unseen)} "
                "(bodies of the robot file)."
            )
        if self.robot.limits == "soft" and all(j.soft == j.hard for j in self.limits):
            found.append("limits: soft, but the URDF has no safety_controller: the hard ones hold.")
        return tuple(found)

    @property
    def _moved(self) -> frozenset[str]:
        """Bodies of the URDF that the arm moves."""
        return self.robot.model().links_moved_by(self.robot.arm_joints[0])

    def to_json(self) -> dict[str, Any]:
        """Return everything as plain containers."""
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
                "without_mesh": list(self.unseen),
            },
            "excess_volume": {body.body: body.excess for body in self.bodies},
            "lowest_point_m": self.lowest,
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
    """Return what a look at everything that scoring relies on finds.

    Args:
        robot: The robot, as `load_robot` returns it.
        samples: Random postures of the IK round trip.
        seed: Seed of their draws.

    Raises:
        RobotError: If a model or mesh of the robot cannot be used.
        OutputError: If the kernel's cache cannot be written.
    """
    scene = Scene(SceneSpec(robot, EMPTY_ENVIRONMENT))
    scene.set_arm(np.zeros(len(robot.arm_joints)))
    arm = arm_class(arm_chain(scene)[0])
    positions = robot.with_mimics({**robot.joint_positions(), **robot.rest})
    rest = {name: positions[name] for name in robot.arm_joints}
    scene.set_arm(list(rest.values()))
    contacts = scene.violations()
    return RobotCheck(
        robot=robot,
        arm=arm,
        limits=_limits(robot),
        bodies=enclosure(robot),
        rest=rest,
        margin=EMPTY_ENVIRONMENT.contact_margin,
        lowest=_lowest(robot, positions),
        contacts=contacts,
        trip=round_trip(scene, arm.solver, samples, seed),
        seed=seed,
    )


def _limits(robot: RobotFile) -> tuple[JointLimits, ...]:
    joints, in_force = robot.model().joints, robot.joint_limits()
    torso = () if robot.torso_joint is None else (robot.torso_joint,)
    return tuple(
        JointLimits(name, joints[name].soft, joints[name].hard, in_force[name])
        for name in (*robot.arm_joints, *torso)
    )


def _lowest(robot: RobotFile, positions: Mapping[str, float]) -> float:
    """Return the height of the lowest point of any surface above the root [m]."""
    model, lows = robot.model(), [0.0]
    for body, triangles in body_triangles(model).items():
        R, p = pose_in_root(model, body, positions)
        lows.append(float((triangles @ R[2] + p[2]).min()))
    return min(lows)


def _stands_out(body: BodyEnclosure) -> str:
    if math.isinf(body.farthest):
        return f"'{body.body}' has a surface, but no primitive: fit one."
    return (
        f"'{body.body}': {body.outside} of {body.triangles} triangles lie wholly in none of its "
        f"primitives, up to {body.farthest * 1e3:.1f} mm out: fit them anew."
    )
