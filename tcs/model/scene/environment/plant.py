"""The environment in a Drake plant: models, obstacles, floor, and the joints that move them."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydrake.geometry import Box, Capsule, ProximityProperties, SceneGraphInspector, Sphere
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BodyIndex,
    FixedOffsetFrame,
    Frame,
    Joint,
    ModelInstanceIndex,
    RigidBody,
    WeldJoint,
)

from tcs.errors import EnvironmentFileError, UnknownNameError
from tcs.files.xml_documents import read_xml
from tcs.model.robots.primitives import Primitive
from tcs.model.scene.contacts import Group, Part
from tcs.model.scene.environment.environment_file import (
    FLOOR,
    WORLD,
    EnvironmentFile,
    ModelEntry,
    Obstacle,
)
from tcs.model.scene.environment.furniture import changed_bed, changed_wheelchair, seat_motion
from tcs.model.scene.environment.joints import EnvironmentJoints
from tcs.model.scene.environment.model_files import check_model_file
from tcs.model.scene.environment.obstacle_shapes import obstacle_shapes
from tcs.model.scene.person.joints import articulated_model, person_joints
from tcs.model.scene.person.resized import (
    padding_of,
    resized_model,
    scales_of,
)

_FLOOR_SIZE = (100.0, 100.0, 1.0)
"""Size of the floor [m]: wider than any environment, so that there is a floor at every base pose,
and so thick that nothing lies below it."""
_OBSTACLE_COLOUR = np.array([0.70, 0.66, 0.58, 1.0])
_CLASSES: dict[str, type[Sphere] | type[Capsule] | type[Box]] = {
    "sphere": Sphere,
    "capsule": Capsule,
    "box": Box,
}


@dataclass(frozen=True, slots=True)
class EnvironmentPlant:
    """The elements of an environment in a plant.

    Attributes:
        links: Every link by "model::link", every obstacle of shapes by its name.
        joints: Every movable joint.
        named_by_link: Names of the models whose contacts are reported by link.
        floor: Whether there is a floor.
        mount: M, the frame that carries the robot's base; W for a robot on the floor.
    """

    links: dict[str, RigidBody]
    joints: EnvironmentJoints
    named_by_link: frozenset[str]
    floor: bool
    mount: Frame


def add_environment(plant: MultibodyPlant, environment: EnvironmentFile) -> EnvironmentPlant:
    """Add an environment to a plant that is not finalized.

    Raises:
        EnvironmentFileError: If a model cannot be used, or a joint cannot take its position.
        GridError: If an observed axis does not fit its joint.
        UnknownNameError: If the file names a parent, link or joint that does not exist.
    """
    links: dict[str, RigidBody] = {}
    by_name: dict[str, Joint] = {}
    where = f"environment '{environment.name}'"
    for entry in environment.placed:
        parent = _parent_frame(plant, entry, links, where)
        X_PM = _seated(environment, entry) @ RigidTransform(RollPitchYaw(entry.rpy), entry.xyz)
        here = f"{where}, '{entry.name}'"
        shapes = obstacle_shapes(entry, here) if isinstance(entry, Obstacle) else ()
        if shapes:
            _check_free(plant, entry.name, here)
            links[entry.name] = _add_shapes(plant, entry.name, shapes, X_PM)
            continue
        instance = _add_model(plant, entry, here, of=environment)
        bodies = [plant.get_body(index) for index in plant.GetBodyIndices(instance)]
        solid = any(plant.GetCollisionGeometriesForBody(body) for body in bodies)
        if isinstance(entry, Obstacle) and not solid:
            raise EnvironmentFileError(
                f"{here}: '{entry.file}' has no collision geometry, so nothing would be checked "
                "against it. Give its links 'collision' elements."
            )
        _fix(plant, instance, parent, X_PM, here)
        for index in plant.GetBodyIndices(instance):
            body = plant.get_body(index)
            links[f"{entry.name}::{body.name()}"] = body
        for joint_index in plant.GetJointIndices(instance):
            joint = plant.get_joint(joint_index)
            if joint.num_positions() == 0:
                continue
            if joint.name() in by_name:
                raise EnvironmentFileError(
                    f"{here}: joint '{joint.name()}' exists twice. Rename it in one of the files."
                )
            by_name[joint.name()] = joint
    if environment.floor:
        top = RigidTransform([0.0, 0.0, -_FLOOR_SIZE[2] / 2])
        plant.RegisterCollisionGeometry(
            plant.world_body(), top, Box(*_FLOOR_SIZE), FLOOR, ProximityProperties()
        )
    positions = person_joints(environment)
    joints = EnvironmentJoints(by_name, positions.posture)
    _check_names(environment, links, joints, where)
    joints.set_defaults(positions.joints, where=f"{where}, field 'joints'")
    by_link = {m.name for m in environment.models if m.named_by == "link"}
    by_link |= {o.name for o in environment.obstacles if o.type != "model"}
    mount = _mount_frame(plant, environment, links, where)
    return EnvironmentPlant(links, joints, frozenset(by_link), environment.floor, mount)


def environment_parts(
    plant: MultibodyPlant,
    inspector: SceneGraphInspector,
    added: EnvironmentPlant,
    environment: EnvironmentFile,
) -> tuple[Part, ...]:
    """Return every collision shape of the environment, in the order of the environment file."""
    parts = []
    scales = scales_of(environment)
    for link, body in added.links.items():
        model = link.split("::", maxsplit=1)[0]
        for geometry in plant.GetCollisionGeometriesForBody(body):
            name = link if model in added.named_by_link else inspector.GetName(geometry)
            pad = float(padding_of(environment, link, scales))
            parts.append(Part(geometry, body.index(), Group.ENVIRONMENT, 0, name, pad))
    if added.floor:
        world = plant.world_body()
        (floor,) = plant.GetCollisionGeometriesForBody(world)
        parts.append(Part(floor, world.index(), Group.ENVIRONMENT, 0, FLOOR, 0.0))
    return tuple(parts)


def _parent_frame(
    plant: MultibodyPlant, entry: ModelEntry | Obstacle, links: dict[str, RigidBody], where: str
) -> Frame:
    if isinstance(entry, Obstacle):
        return plant.world_frame()
    return _frame_of(plant, entry.parent, links, f"{where}, '{entry.name}'")


def _frame_of(plant: MultibodyPlant, parent: str, links: dict[str, RigidBody], where: str) -> Frame:
    """Return the frame of a link, an obstacle, or the world."""
    if parent == WORLD:
        return plant.world_frame()
    if parent not in links:
        raise UnknownNameError("parent", parent, (WORLD, *links), where=where)
    return links[parent].body_frame()


def _mount_frame(
    plant: MultibodyPlant,
    environment: EnvironmentFile,
    links: dict[str, RigidBody],
    where: str,
) -> Frame:
    """Return the frame M that carries the robot's base, W without a mount."""
    mount = environment.mount
    if mount is None:
        return plant.world_frame()
    parent = _frame_of(plant, mount.parent, links, f"{where}, field 'mount'")
    X_PM = RigidTransform(RollPitchYaw(mount.pose.rpy), mount.pose.xyz)
    if mount.on_seat:
        X_PM = _on_seat(environment, mount.parent) @ X_PM
    return plant.AddFrame(FixedOffsetFrame("robot_mount", parent, X_PM))


def _add_shapes(
    plant: MultibodyPlant, name: str, shapes: tuple[Primitive, ...], X_WO: RigidTransform
) -> RigidBody:
    # A separate body, not a shape of the world, so that it is named like other obstacles.
    body = plant.AddRigidBody(name, plant.AddModelInstance(name))
    plant.WeldFrames(plant.world_frame(), body.body_frame(), X_WO)
    for i, shape in enumerate(shapes):
        X_OS = RigidTransform(RotationMatrix(shape.rotation), shape.xyz)
        solid = _CLASSES[shape.kind](*shape.size)
        # The first has the name of its type, as it would in a file.
        label = shape.kind if i == 0 else f"{shape.kind} {i}"
        plant.RegisterCollisionGeometry(body, X_OS, solid, label, ProximityProperties())
        plant.RegisterVisualGeometry(body, X_OS, solid, label, _OBSTACLE_COLOUR)
    return body


def _seated(environment: EnvironmentFile, entry: ModelEntry | Obstacle) -> RigidTransform:
    """Return how the person moves with the seat of a wheelchair of other sizes than the papers'."""
    if not environment.is_person(entry.name) or not isinstance(entry, ModelEntry):
        return RigidTransform()
    return _on_seat(environment, entry.parent)


def _on_seat(environment: EnvironmentFile, parent: str) -> RigidTransform:
    """Return how what is on the seat moves in the frame of its parent, if that is a wheelchair."""
    if environment.wheelchair is None or not parent.startswith("wheelchair::"):
        return RigidTransform()
    R, p = seat_motion(environment.wheelchair)
    return RigidTransform(RotationMatrix(R), p)


def _own_model(
    environment: EnvironmentFile, entry: ModelEntry | Obstacle, where: str
) -> str | None:
    """Return the model of the entry as SDFormat, None if it is that of its file.

    The person is resized to their body, and has the joints that the environment names; wheelchair
    and bed have the sizes of the environment.
    """
    file = Path(str(entry.file))
    here = f"{where}: '{file}'"
    if entry.name == "wheelchair" and environment.wheelchair is not None:
        root = read_xml(file, here, EnvironmentFileError)
        changed_wheelchair(environment.wheelchair, root, here)
        return ElementTree.tostring(root, encoding="unicode")
    if entry.name == "bed" and environment.bed is not None:
        root = read_xml(file, here, EnvironmentFileError)
        changed_bed(environment.bed, root, here)
        return ElementTree.tostring(root, encoding="unicode")
    if not environment.is_person(entry.name):
        return None
    text = resized_model(environment, file, where) if environment.has_body else None
    if person_joints(environment).is_articulated:
        text = text or file.read_text(encoding="utf-8")
        text = articulated_model(environment, text, here)
    return text


def _add_model(
    plant: MultibodyPlant,
    entry: ModelEntry | Obstacle,
    where: str,
    *,
    of: EnvironmentFile,
) -> ModelInstanceIndex:
    """Parse the entry's file; the model of the person is that of the environment `of`."""
    file = Path(str(entry.file))
    here = f"{where}: '{entry.file}'"
    check_model_file(file, here)
    text = _own_model(of, entry, where)
    if text is None and not _is_utf8(file):
        # Drake reads names as UTF-8 whatever encoding the file declares.
        text = ElementTree.tostring(read_xml(file, here, EnvironmentFileError), encoding="unicode")
    parser = Parser(plant)
    # Several entries may use one file, e.g. two shelves.
    parser.SetAutoRenaming(True)
    try:
        if text is None:
            instances = parser.AddModels(str(file))
        else:
            instances = parser.AddModelsFromString(text, file.suffix.lower().removeprefix("."))
    except MemoryError:
        raise
    except Exception as error:
        # Drake raises errors of several classes, e.g. ValueError for a number it cannot convert.
        reason = " ".join(str(error).split())
        raise EnvironmentFileError(f"{where}: '{entry.file}' cannot be used: {reason}") from error
    if len(instances) != 1:
        raise EnvironmentFileError(
            f"{where}: '{entry.file}' contains {len(instances)} models, but must contain one. "
            "Give each a file of its own."
        )
    (instance,) = instances
    if plant.GetModelInstanceName(instance) != entry.name:
        _check_free(plant, entry.name, where)
    plant.RenameModelInstance(instance, entry.name)
    return instance


def _is_utf8(file: Path) -> bool:
    try:
        file.read_bytes().decode()
    except UnicodeDecodeError:
        return False
    return True


def _check_free(plant: MultibodyPlant, name: str, where: str) -> None:
    """Refuse a name that another part of the scene has, such as the robot's own."""
    if plant.HasModelInstanceNamed(name):
        raise EnvironmentFileError(
            f"{where}: the name '{name}' is taken in the scene, by the robot or by Drake. "
            "Choose another."
        )


def _fix(
    plant: MultibodyPlant,
    instance: ModelInstanceIndex,
    parent: Frame,
    X_PM: RigidTransform,
    where: str,
) -> None:
    """Weld a model's root to its parent, replacing the pose in the model file."""
    joints = [plant.get_joint(index) for index in plant.GetJointIndices(instance)]
    to_world = [j for j in joints if j.parent_body() == plant.world_body()]
    if not all(isinstance(joint, WeldJoint) for joint in to_world):
        raise EnvironmentFileError(
            f"{where}: a joint connects the model to the world, but the environment file places "
            "it. Give the joint a link of the model as its parent."
        )
    # A <static> model, or one welded to the world, is detached and placed as the file requires.
    pose_of = {joint.child_body().index(): joint.X_FM() for joint in to_world}
    moved = {j.child_body().index() for j in joints} - set(pose_of)
    for joint in to_world:
        plant.RemoveJoint(joint)
    roots = [i for i in plant.GetBodyIndices(instance) if i not in moved]
    # A URDF has no frame of the model beside that of its root link.
    of_model = plant.HasFrameNamed("__model__", instance)
    if not of_model and len(roots) == 1:
        plant.WeldFrames(parent, plant.get_body(roots[0]).body_frame(), X_PM)
        return
    if not of_model:
        raise EnvironmentFileError(_roots_message(plant, roots, where))
    model_frame = plant.GetFrameByName("__model__", instance)
    if len(roots) == 1:
        plant.WeldFrames(parent, model_frame, X_PM)
        return
    if not all(root in pose_of for root in roots):
        raise EnvironmentFileError(_roots_message(plant, roots, where))
    base = model_frame.body().index()
    X_WM = pose_of[base] @ model_frame.GetFixedPoseInBodyFrame()
    for root in roots:
        X_PL = X_PM @ X_WM.inverse() @ pose_of[root]
        plant.WeldFrames(parent, plant.get_body(root).body_frame(), X_PL)


def _roots_message(plant: MultibodyPlant, roots: list[BodyIndex], where: str) -> str:
    names = ", ".join(plant.get_body(root).name() for root in roots) or "none"
    return (
        f"{where}: the model has {len(roots)} links without a parent: {names}. "
        "Connect them with joints."
    )


def _check_names(
    environment: EnvironmentFile, links: Iterable[str], joints: EnvironmentJoints, where: str
) -> None:
    """Check that the models have every name in the environment file."""
    for link in environment.padding:
        if link not in links:
            raise UnknownNameError("link", link, links, where=f"{where}, field 'padding'")
    for frame, link in environment.body_frames.items():
        if link not in (*links, WORLD):
            known = (*links, WORLD)
            raise UnknownNameError("link", link, known, where=f"{where}, body frame '{frame}'")
    for joint in environment.joints:
        if joint not in joints.by_name:
            raise UnknownNameError("joint", joint, joints.by_name, where=f"{where}, field 'joints'")
    for name, error in environment.errors.items():
        joints.check_error(name, error, where=f"{where}, field 'errors'")
    joints.check_posture(where=where)
    for axis in environment.observed_axes:
        joints.check_axis(axis, where=f"{where}, field 'observed'")
