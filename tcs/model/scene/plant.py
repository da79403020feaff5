"""The Drake plant of a scene: robot on planar base joints, environment, collision shapes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.geometry import (
    Box,
    Capsule,
    GeometryId,
    GeometryInstance,
    SceneGraph,
    SceneGraphInspector,
    Shape,
    Sphere,
)
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from pydrake.multibody.tree import (
    Frame,
    Joint,
    ModelInstanceIndex,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
)
from pydrake.systems.framework import Diagram

from tcs.errors import EnvironmentFileError, RobotError
from tcs.kernel.arrays import FloatArray
from tcs.model.diagrams import diagram_builder
from tcs.model.robots import Primitive, RobotFile, robot_urdf
from tcs.model.scene.contacts import ContactRule, Group, Part, shape_of
from tcs.model.scene.drake_contacts import DrakeContacts
from tcs.model.scene.environment.environment_file import FLOOR, WORLD
from tcs.model.scene.environment.joints import EnvironmentJoints
from tcs.model.scene.environment.plant import add_environment, environment_parts
from tcs.model.scene.spec import SceneSpec

BASE_JOINTS = ("base_x", "base_y", "base_yaw")
"""The planar joints that carry the robot's base, in their order from the world outward."""


@dataclass(frozen=True, slots=True)
class ScenePlant:
    """A finalized plant and the roles of its elements.

    Attributes:
        diagram: Plant and scene graph together.
        plant: The plant.
        scene_graph: The scene graph.
        base_joints: base_x, base_y, base_yaw.
        arm_joints: The scored arm's joints, in the robot file's order.
        coupled_joints: The joints that follow each of these, in the order of the chain.
        arm_lower: Their lower limits [rad], -inf where continuous.
        arm_upper: Their upper limits [rad], +inf where continuous.
        torso_joint: The prismatic joint of the torso, None for a robot without one.
        torso_limits: Limits of the torso height [m], zeros without a torso joint.
        mount_frame: M, the frame in which base poses are given: W, or a frame on furniture.
        base_frame: B, the robot's base.
        arm_base_frame: A, the parent link of joint 1.
        tool_frame: T.
        environment_joints: Joints of the environment.
        body_frames: Frames that goals may be fixed to.
        parts: Every collision shape: arm, body, environment.
        rule: The contact rule, which selects the pairs of parts to check.
        contacts: Drake's search for contacts of these pairs.
    """

    diagram: Diagram
    plant: MultibodyPlant
    scene_graph: SceneGraph
    base_joints: tuple[Joint, ...]
    arm_joints: tuple[RevoluteJoint | PrismaticJoint, ...]
    coupled_joints: tuple[tuple[Joint, ...], ...]
    arm_lower: FloatArray
    arm_upper: FloatArray
    torso_joint: Joint | None
    torso_limits: tuple[float, float]
    mount_frame: Frame
    base_frame: Frame
    arm_base_frame: Frame
    tool_frame: Frame
    environment_joints: EnvironmentJoints
    body_frames: dict[str, Frame]
    parts: tuple[Part, ...]
    rule: ContactRule
    contacts: DrakeContacts


def build_plant(
    spec: SceneSpec,
    allowed_contacts: Iterable[tuple[str, str]] = (),
    *,
    meshes: bool = False,
) -> ScenePlant:
    """Return the finalized plant of a scene; `Scene` documents the arguments and errors."""
    robot, environment = spec.robot, spec.environment
    builder = diagram_builder()
    # A continuous plant: nothing is simulated, and a time step would only add discrete state.
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    instance = _add_robot(plant, robot, meshes)
    root = plant.GetBodyByName(robot.root_body, instance)
    on_floor = environment.mount is None
    base_joints = _add_base(plant, root, plant.world_frame()) if on_floor else ()
    primitives = _add_primitives(plant, scene_graph, robot, instance)
    added = add_environment(plant, environment)
    base_joints = base_joints or _add_base(plant, root, added.mount)
    for name, value in robot.joint_positions().items():
        plant.GetJointByName(name, instance).set_default_positions([value])
    plant.Finalize()

    torso = plant.GetJointByName(robot.torso_joint, instance) if robot.torso_joint else None
    arm_joints = tuple(plant.GetJointByName(name, instance) for name in robot.arm_joints)
    followers = robot.followers()
    coupled_joints = tuple(
        tuple(plant.GetJointByName(name, instance) for name in followers.get(leader, ()))
        for leader in robot.arm_joints
    )
    inspector = scene_graph.model_inspector()
    parts = (
        *_robot_parts(plant, inspector, primitives, arm_joints, coupled_joints, torso),
        *environment_parts(plant, inspector, added, environment),
    )
    for part in parts:
        shape_of(inspector, part)
    _check_names(parts, environment.name)
    where = f"environment '{environment.name}', allowed contacts"
    allowed_contacts = (*allowed_contacts, *standing_contacts(spec, parts))
    rule = ContactRule.of(
        parts, robot.disabled_pairs, allowed_contacts, where=where, on_floor=on_floor
    )
    limits = robot.joint_limits()
    diagram = builder.Build()
    return ScenePlant(
        diagram=diagram,
        plant=plant,
        scene_graph=scene_graph,
        base_joints=base_joints,
        arm_joints=arm_joints,
        coupled_joints=coupled_joints,
        arm_lower=np.array([limits[name][0] for name in robot.arm_joints]),
        arm_upper=np.array([limits[name][1] for name in robot.arm_joints]),
        torso_joint=torso,
        torso_limits=limits[robot.torso_joint] if robot.torso_joint else (0.0, 0.0),
        mount_frame=added.mount,
        base_frame=plant.GetFrameByName(robot.root_body, instance),
        arm_base_frame=plant.GetFrameByName(robot.arm_base, instance),
        tool_frame=plant.GetFrameByName(robot.tool_frame, instance),
        environment_joints=added.joints,
        body_frames={
            name: plant.world_frame() if link == WORLD else added.links[link].body_frame()
            for name, link in environment.body_frames.items()
        },
        parts=parts,
        rule=rule,
        contacts=DrakeContacts(diagram, plant, scene_graph, parts, rule),
    )


def _check_names(parts: Iterable[Part], environment: str) -> None:
    """Refuse a body of the environment with a name of the robot's: contacts are told by name."""
    of_robot = {part.name for part in parts if part.group is not Group.ENVIRONMENT}
    for part in parts:
        if part.group is Group.ENVIRONMENT and part.name in of_robot:
            raise EnvironmentFileError(
                f"environment '{environment}': '{part.name}' is also a body of the robot. Choose "
                "another name for the one in the environment."
            )


def _add_base(plant: MultibodyPlant, root: RigidBody, mount: Frame) -> tuple[Joint, ...]:
    """Attach the robot's root to the world or its mount by planar joints: x, y and yaw."""
    instance = plant.AddModelInstance("base")
    axes = (np.eye(3)[0], np.eye(3)[1], np.eye(3)[2])
    parent = mount
    joints = []
    for name, axis in zip(BASE_JOINTS, axes, strict=True):
        joint = RevoluteJoint if name == "base_yaw" else PrismaticJoint
        child = root if name == "base_yaw" else plant.AddRigidBody(f"{name}_link", instance)
        joints.append(plant.AddJoint(joint(name, parent, child.body_frame(), axis)))
        parent = child.body_frame()
    return tuple(joints)


def _shape(primitive: Primitive) -> Shape:
    if primitive.kind == "sphere":
        return Sphere(*primitive.size)
    if primitive.kind == "capsule":
        return Capsule(*primitive.size)
    return Box(*primitive.size)


def _add_robot(plant: MultibodyPlant, robot: RobotFile, meshes: bool) -> ModelInstanceIndex:
    text = robot_urdf(robot, meshes)
    try:
        instances = Parser(plant).AddModelsFromString(text, "urdf")
    except RuntimeError as error:
        reason = " ".join(str(error).split())
        raise RobotError(f"robot '{robot.name}': its URDF cannot be used: {reason}") from error
    instance: ModelInstanceIndex = instances[0]
    return instance


def _add_primitives(
    plant: MultibodyPlant, scene_graph: SceneGraph, robot: RobotFile, instance: ModelInstanceIndex
) -> tuple[GeometryId, ...]:
    """Register the collision shapes of the robot's links, without a role: see `DrakeContacts`."""
    source, added = plant.get_source_id(), []
    for i, primitive in enumerate(robot.load_primitives()):
        X_BG = RigidTransform(Quaternion(primitive.quaternion), primitive.xyz)
        body = plant.GetBodyByName(primitive.body, instance)
        frame = plant.GetBodyFrameIdOrThrow(body.index())
        shape = GeometryInstance(X_BG, _shape(primitive), f"{primitive.body} {i}")
        added.append(scene_graph.RegisterGeometry(source, frame, shape))
    return tuple(added)


def _robot_parts(
    plant: MultibodyPlant,
    inspector: SceneGraphInspector,
    geometries: Iterable[GeometryId],
    arm_joints: tuple[Joint, ...],
    coupled_joints: tuple[tuple[Joint, ...], ...],
    torso: Joint | None,
) -> tuple[Part, ...]:
    """Return the robot's shapes as parts, with the arm link or the mount of each."""
    above = {joint.child_body().index(): joint for joint in _joints(plant)}
    # The last joint carries link 7, whatever the number of joints.
    arm_link = {joint.index(): 7 - i for i, joint in enumerate(reversed(arm_joints))}
    between = 8
    for leader, followers in zip(arm_joints, coupled_joints, strict=True):
        # The last one of coupled joints carries the link of their joint, the others carry links
        # with frames of their own.
        *others, last = _along(plant, (leader, *followers))
        arm_link[last.index()] = arm_link[leader.index()]
        for joint in others:
            arm_link[joint.index()] = between
            between += 1
    parts = []
    for geometry in geometries:
        body = plant.GetBodyFromFrameId(inspector.GetFrameId(geometry))
        group, carrier = Group.BODY, 0
        link = body
        while link.index() in above:
            joint = above[link.index()]
            if joint.index() in arm_link:
                group, carrier = Group.ARM, arm_link[joint.index()]
                break
            if torso is not None and joint.index() == torso.index():
                carrier = 1
            link = joint.parent_body()
        parts.append(Part(geometry, body.index(), group, carrier, body.name(), 0.0))
    return tuple(parts)


def _along(plant: MultibodyPlant, joints: Iterable[Joint]) -> list[Joint]:
    """Return coupled joints in the order of the chain."""
    above = {joint.child_body().index(): joint for joint in _joints(plant)}

    def depth(joint: Joint) -> int:
        link, steps = joint.parent_body().index(), 0
        while link in above:
            link, steps = above[link].parent_body().index(), steps + 1
        return steps

    return sorted(joints, key=depth)


def coupled_frames(joints: Iterable[tuple[Joint, ...]], first: int) -> FloatArray:
    """Return `Chain.coupled` of the joints that follow each joint of an arm.

    Args:
        joints: The followers of each joint.
        first: Index in the chain of the first joint.
    """
    return np.array(
        [
            (first + i, (k + 1) / (len(followers) + 1))
            for i, followers in enumerate(joints)
            for k in range(len(followers))
        ]
    ).reshape(-1, 2)


def standing_contacts(spec: SceneSpec, parts: Iterable[Part]) -> tuple[tuple[str, str], ...]:
    """Return the contacts of the base with what it stands on.

    They are those of a base that drives with the arm, as part of it, with the floor, and those of a
    mounted one with what it is bolted to.
    """
    robot, mount = spec.robot, spec.environment.mount
    if mount is not None:
        base = dict.fromkeys(part.name for part in parts if part.group is Group.BODY)
        return tuple((body, other) for body in base for other in mount.touches)
    if robot.mount is None or robot.mount.drive is None:
        return ()
    names = {part.name for part in parts}
    return tuple((body, FLOOR) for body in robot.standing_bodies if {body, FLOOR} <= names)


def _joints(plant: MultibodyPlant) -> Iterable[Joint]:
    return (plant.get_joint(index) for index in plant.GetJointIndices())
