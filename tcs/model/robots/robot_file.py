"""Robot files: arm, torso, tool, postures and collision shapes, which a URDF does not specify."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from tcs.errors import RobotError, UnknownNameError
from tcs.files.documents import Clearance, Document, Entries, JointPosition, Placed, Size, checked
from tcs.files.unchanged import kept_while_unchanged
from tcs.model.robots.primitives import Primitive, quaternion_of_rpy, read_primitives
from tcs.model.robots.urdf import WORLD, Urdf, read_urdf
from tcs.model.robots.urdf.model import Mimic, SurfacesOf
from tcs.model.robots.urdf.packages import resolve_uri

Name = Annotated[str, Field(min_length=1)]
Range = tuple[JointPosition, JointPosition]
Positions = Annotated[Mapping[Name, JointPosition], Entries]

LEAST_JOINTS, MOST_JOINTS = 5, 7
"""Number of joints that an arm may have."""

Rate = Annotated[float, Field(gt=0.0, le=1000.0)]
LEAST_JERK, MOST_JERK = 0.1, 1e5
"""Range of jerk limits [rad/s^3]: an arm takes 40 s to its acceleration at the least one."""
Jerk = Annotated[float, Field(ge=LEAST_JERK, le=MOST_JERK)]
REST = "rest"
"""Name of the first rest posture."""
ACCELERATION = 2.0
"""Acceleration limit of a joint unless the robot file gives one [rad/s^2]: URDFs have none, and
this brings an arm to 1 rad/s in half a second, which suits motions next to a person."""


class _OnLink(Placed):
    """A named entry that is fixed to a link of the robot."""

    name: Name
    parent: Name


class Mount(Placed):
    """Pose of the URDF's root link in a further link on the floor, which carries it."""

    link: Name
    """Name of the further link, the root of the robot."""
    drive: Range | None = None
    """How far the robot drives along the x axis of its root link, back and forth [m], as the joint
    `drive` of the scored arm; None if its base stands still."""

    @model_validator(mode="after")
    def _drive_includes_standing_still(self) -> Self:
        if self.drive is not None and not self.drive[0] <= 0.0 <= self.drive[1]:
            raise ValueError("drive: must be [back, forth] in metres, back <= 0 <= forth")
        return self


class ExtraFrame(_OnLink):
    """A frame to add to the URDF, e.g. the tip of a tool."""


class BodyPrimitive(Placed):
    """One collision shape of an extra body."""

    kind: Literal["sphere", "capsule", "box"]
    size: Annotated[tuple[Size, ...], Field(min_length=1, max_length=3)]
    """Sphere: radius. Capsule: radius, length between cap centres. Box: full sizes [m]."""


class ExtraBody(_OnLink):
    """A body to add to the URDF, e.g. a tool in the hand."""

    primitives: Annotated[tuple[BodyPrimitive, ...], Entries]


class DisabledGroup(Document):
    """Pairs of bodies whose contact is never checked, and the reason."""

    reason: Annotated[str, Field(min_length=10)]
    limits: Literal["soft", "hard"] = "hard"
    """Widest joint limits under which the reason holds; "hard" includes the soft limits."""
    ranges: Annotated[Mapping[Name, Range], Entries] = {}
    """Ranges of arm joints, within their limits, in which the reason holds [rad]: while the group
    is in force, the joints are kept within them."""
    pairs: tuple[tuple[Name, Name], ...]

    @model_validator(mode="after")
    def _ranges_are_ordered(self) -> Self:
        for joint, (lower, upper) in self.ranges.items():
            if not lower < upper:
                raise ValueError(f"ranges: that of '{joint}' must be [lower, upper]")
        return self


class RobotFile(Document):
    """Content of a robot file; `load_robot` checks it against the URDF."""

    name: Name
    title: str
    arms: Annotated[Mapping[Name, Name], Entries] = {}
    """Name or path of the robot file that scores each arm, by name of the arm; this file is one of
    them. Empty for a robot with one arm."""
    urdf: str
    """A `package://` address or a path."""
    packages: tuple[Name, ...] = ()
    """Folders in which packages that the URDF names are searched for first."""
    mount: Mount | None = None
    """The link that carries the root link of a URDF that starts above the floor; None if it is on
    the floor."""
    surfaces: SurfacesOf = "all"
    """What the primitives of a link enclose: its visual and its collision geometry, or one of both
    alone if the URDF has any for it."""
    ignored_links: tuple[Name, ...] = ()
    """Links that nothing is checked against: they have no primitives."""
    root_body: Name
    """B: the root link of URDF or mount, which the planar base joint carries."""
    arm_base: Name
    """A: the link that carries joint 1 of the scored arm."""
    arm_joints: Annotated[tuple[Name, ...], Field(min_length=LEAST_JOINTS, max_length=MOST_JOINTS)]
    """The five to seven joints of the scored arm, from A to the tool; of coupled ones, the one that
    the others follow."""
    coupled: Annotated[Mapping[Name, Name], Entries] = {}
    """Joints that move as another one does, like the segments of a telescope, with the joint that
    they follow; those that the URDF couples need no entry."""
    rest: Mapping[Name, JointPosition] = {}
    """Rest posture of the scored arm [rad]; a joint that is left out is at 0, or at the limit
    nearest to 0."""
    other_rests: Annotated[Mapping[Name, Positions], Entries] = {}
    """Further rest postures by name, for stops where the arm touches something in the one before,
    as `rest`."""
    velocity_limits: Annotated[Mapping[Name, Rate], Entries] = {}
    """Velocity limits of joints of the scored arm [rad/s]; those left out are of the URDF."""
    acceleration_limits: Annotated[Mapping[Name, Rate], Entries] = {}
    """Acceleration limits of joints of the scored arm [rad/s^2]; `ACCELERATION` for those left
    out."""
    jerk_limits: Annotated[Mapping[Name, Jerk], Entries] = {}
    """Jerk limits of joints of the scored arm [rad/s^3]; none for those left out."""
    tool_frame: Name
    """T: the frame that moves to the goals; a link of the URDF, or an extra frame or body."""
    torso_joint: Name | None = None
    limits: Literal["soft", "hard"] = "soft"
    """Joint limits in force: those of `safety_controller` (soft) or of `limit` (hard)."""
    postures: Mapping[Name, Positions] = {}
    """Positions of joints other than arm and torso by posture name [rad or m]; a joint that is
    left out is at 0, or at the limit nearest to 0."""
    posture: Name | None = None
    """Name of the posture in force; None leaves every joint at 0."""
    grippers: Mapping[Name, Positions] = {}
    """Positions of the gripper joints by name of the opening [rad or m]."""
    gripper: Name | None = None
    """Name of the opening in force."""
    frames: Annotated[tuple[ExtraFrame, ...], Entries] = ()
    bodies: Annotated[tuple[ExtraBody, ...], Entries] = ()
    standing_bodies: tuple[Name, ...] = ()
    """Bodies that may touch the floor."""
    primitives: str
    """Path of the CSV file of the collision primitives."""
    distances: str | None = None
    """Path of the file of tables of distances of surfaces; None if shapes alone decide."""
    self_margin: Clearance = 0.001
    """Least clearance between two bodies of the robot: closer ones collide [m]."""
    disabled_groups: tuple[DisabledGroup, ...] = ()
    source: str

    @model_validator(mode="after")
    def _choices_exist(self) -> Self:
        for field, choice, choices in (
            ("posture", self.posture, self.postures),
            ("gripper", self.gripper, self.grippers),
        ):
            if choice is not None and choice not in choices:
                raise UnknownNameError(field, choice, choices, where=f"field '{field}'")
        return self

    def __hash__(self) -> int:
        """Return a hash of the content; pydantic's own hash fails on mappings."""
        return hash(self.model_dump_json())

    @property
    def disabled_pairs(self) -> tuple[tuple[str, str], ...]:
        """All pairs of bodies whose contact is not checked under the limits in force."""
        return tuple(pair for group in self._groups_in_force for pair in group.pairs)

    @property
    def _groups_in_force(self) -> tuple[DisabledGroup, ...]:
        return tuple(g for g in self.disabled_groups if g.limits in ("hard", self.limits))

    @property
    def without_ranges(self) -> RobotFile:
        """The robot with its joint limits alone, as if no disabled group narrowed them."""
        groups = tuple(g.model_copy(update={"ranges": {}}) for g in self.disabled_groups)
        return self.model_copy(update={"disabled_groups": groups})

    def followers(self) -> dict[str, tuple[str, ...]]:
        """Return the joints coupled to each joint of the scored arm that has any.

        Raises:
            RobotError: If the URDF cannot be used.
        """
        joints = self.model().joints.values()
        found = {
            leader: tuple(j.name for j in joints if j.mimic and j.mimic.leader == leader)
            for leader in self.arm_joints
        }
        return {leader: names for leader, names in found.items() if names}

    def require_seven_joints(self, purpose: str) -> None:
        """Refuse an arm of fewer than seven joints.

        Args:
            purpose: What needs seven joints, as the subject of a sentence.

        Raises:
            RobotError: If the arm does not have seven joints.
        """
        if len(self.arm_joints) != MOST_JOINTS:
            raise RobotError(
                f"robot '{self.name}': {purpose} needs an arm of {MOST_JOINTS} joints, and this "
                f"one has {len(self.arm_joints)}. It can be scored, verified and planned for."
            )

    def arm_rates(self) -> tuple[list[float], list[float]]:
        """Return velocity limits [rad/s] and acceleration limits [rad/s^2] of the scored arm.

        Raises:
            RobotError: If the URDF cannot be used, or neither it nor the file limits a velocity.
        """
        joints = self.model().joints
        velocity = [self.velocity_limits.get(n, joints[n].velocity) for n in self.arm_joints]
        for name, value in zip(self.arm_joints, velocity, strict=True):
            if not math.isfinite(value):
                raise RobotError(
                    f"robot '{self.name}': the URDF has no velocity limit of '{name}'. Add it to "
                    "the robot file, field 'velocity_limits' [rad/s]."
                )
        return velocity, [self.acceleration_limits.get(n, ACCELERATION) for n in self.arm_joints]

    def arm_jerks(self) -> list[float]:
        """Return the jerk limits of the scored arm [rad/s^3], inf for joints without one."""
        return [self.jerk_limits.get(name, math.inf) for name in self.arm_joints]

    def arm_rest(self) -> list[float]:
        """Return the first rest posture of the scored arm within the limits in force [rad].

        Raises:
            RobotError: If the URDF cannot be used.
        """
        return self.rest_postures()[REST]

    def rest_postures(self) -> dict[str, list[float]]:
        """Return the rest postures of the scored arm within the limits in force [rad], by name.

        They are in the order in which they are tried at a stop; the first one is REST.

        Raises:
            RobotError: If the URDF cannot be used.
        """
        limits = [self.joint_limits()[name] for name in self.arm_joints]
        found = {}
        for name, given in {REST: self.rest, **self.other_rests}.items():
            angles = [given.get(joint, 0.0) for joint in self.arm_joints]
            both = zip(angles, limits, strict=True)
            found[name] = [min(max(angle, lower), upper) for angle, (lower, upper) in both]
        return found

    def urdf_path(self) -> Path:
        """Return the path of the URDF on this machine.

        Raises:
            RobotError: If there is no such file.
        """
        return resolve_uri(self.urdf, Path(), self.packages)

    def model(self) -> Urdf:
        """Return the content of the URDF, on its mount, with the surfaces that count.

        Raises:
            RobotError: If the URDF cannot be used.
        """
        coupled = tuple(self.coupled.items())
        folders = self.packages
        return _model(
            self.urdf_path(), folders, self.mount, self.surfaces, self.ignored_links, coupled
        )

    def joint_limits(self) -> dict[str, tuple[float, float]]:
        """Return the limits in force of every movable joint [rad or m]; infinite if continuous.

        They are narrowed by the ranges of the disabled groups in force.

        Raises:
            RobotError: If the URDF cannot be used.
        """
        joints = self.model().joints.values()
        limits = {
            j.name: j.soft if self.limits == "soft" else j.hard for j in joints if j.is_movable
        }
        for group in self._groups_in_force:
            for name, (lower, upper) in group.ranges.items():
                limits[name] = max(limits[name][0], lower), min(limits[name][1], upper)
        return limits

    def joint_positions(self) -> dict[str, float]:
        """Return the position of every movable joint except scored arm and torso [rad or m].

        The posture and the gripper opening in force set the joints they name; mimic joints follow
        their leader; all other joints are at 0, or at the limit in force nearest to 0.

        Raises:
            RobotError: If the URDF cannot be used.
        """
        given: dict[str, float] = {}
        if self.posture is not None:
            given |= self.postures[self.posture]
        if self.gripper is not None:
            given |= self.grippers[self.gripper]
        scored = {*self.arm_joints, self.torso_joint}
        return {n: q for n, q in self.with_mimics(given).items() if n not in scored}

    def with_mimics(self, given: Mapping[str, float]) -> dict[str, float]:
        """Return the position of every movable joint, given those of some [rad or m].

        Mimic joints follow their leader; all other joints are at 0, or at the limit in force
        nearest to 0.

        Args:
            given: Known positions by joint.

        Raises:
            RobotError: If the URDF cannot be used.
        """
        joints = self.model().joints
        limits = self.joint_limits()

        def position(name: str) -> float:
            mimic = joints[name].mimic
            if name in given:
                return given[name]
            if mimic is not None:
                return mimic.multiplier * position(mimic.leader) + mimic.offset
            lower, upper = limits[name]
            return min(max(0.0, lower), upper)

        return {name: position(name) for name in limits}

    def load_primitives(self) -> tuple[Primitive, ...]:
        """Return the collision primitives of the CSV file, then those of the extra bodies.

        Raises:
            RobotError: If the file cannot be used.
        """
        extra = tuple(
            Primitive(
                body=body.name,
                kind=shape.kind,
                size=shape.size,
                xyz=shape.xyz,
                quaternion=quaternion_of_rpy(shape.rpy),
            )
            for body in self.bodies
            for shape in body.primitives
        )
        return read_primitives(Path(self.primitives)) + extra

    def with_choices(
        self,
        *,
        posture: str | None = None,
        gripper: str | None = None,
        limits: Literal["soft", "hard"] | None = None,
    ) -> RobotFile:
        """Return the same robot with another posture, gripper opening or type of limits in force.

        Args:
            posture: Name of a posture of the file; None keeps the one in force.
            gripper: Name of a gripper opening of the file; None keeps the one in force.
            limits: "soft" or "hard"; None keeps those in force.

        Raises:
            UnknownNameError: If the file has no posture or opening of that name.
            RobotError: If `limits` is neither "soft" nor "hard".
        """
        chosen = {"posture": posture, "gripper": gripper, "limits": limits}
        given = {key: value for key, value in chosen.items() if value is not None}
        return checked(self.model_dump() | given, RobotFile, f"robot '{self.name}'", RobotError)


@kept_while_unchanged(files=64)
def _model(
    path: Path,
    folders: tuple[str, ...],
    mount: Mount | None,
    surfaces: SurfacesOf,
    ignored: tuple[str, ...],
    coupled: tuple[tuple[str, str], ...],
) -> Urdf:
    """Return a URDF on a mount, with the surfaces that count and its joints coupled.

    Raises:
        RobotError: If the URDF cannot be used, or the name of the mount is taken.
        UnknownNameError: If a coupled joint is unknown.
    """
    model = read_urdf(path, folders)
    for name, leader in coupled:
        model.joint(leader, "field 'coupled'")
        follower = model.joint(name, "field 'coupled'")
        joint = replace(follower, mimic=Mimic(leader=leader, multiplier=1.0, offset=0.0))
        model = Urdf(path=path, links=model.links, joints={**model.joints, name: joint})
    if surfaces != "all" or ignored:
        model = model.with_surfaces(of=surfaces, ignored=ignored)
    model.require_surfaces()
    if mount is None:
        return model
    if mount.link in (*model.links, WORLD):
        raise RobotError(f"link '{mount.link}' of the mount: the name is taken. Choose another.")
    return model.mounted_on(mount.link, mount.xyz, mount.rpy, mount.drive)


def joint_limits(robot: RobotFile) -> dict[str, tuple[float, float]]:
    """Return the limits in force of every movable joint; see `RobotFile.joint_limits`."""
    return robot.joint_limits()
