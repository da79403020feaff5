"""The model of the person, resized: the links of the papers' average man stretched to a body.

Every link is stretched along the axes of its frame by `tcs.model.people.link_scales`, and so are
the positions of the joints on it: links stay connected. Its shapes enclose the stretched skin
(`covers`). A seated person keeps their thighs on the
seat and their back at the back rest; a lying one their back on the mattress and their hips where
the bed bends.
"""

from __future__ import annotations

import copy
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

from tcs.errors import EnvironmentFileError
from tcs.files.xml_documents import read_xml
from tcs.kernel.arrays import FloatArray
from tcs.model.people import Scale, link_scales
from tcs.model.scene.environment.environment_file import EnvironmentFile
from tcs.model.scene.person.covers import cover, padding_for, parts_of
from tcs.model.scene.person.shapes import (
    LinkShape,
    read_pose,
    read_shape,
    write_position,
    write_shape,
)

_TRUNK = ("upper_body", "mid_body", "lower_body")
_LIMBS = (
    ("arm", "upper_body"),
    ("forearm", "arm"),
    ("hand", "forearm"),
    ("quad", "lower_body"),
    ("calf", "quad"),
    ("foot", "calf"),
)
ROOT = "head_center"
"""The link from which the person is resized."""
PARENTS: Mapping[str, str] = {
    "neck_link": ROOT,
    "upper_body_link": "neck_link",
    "mid_body_link": "upper_body_link",
    "lower_body_link": "mid_body_link",
    **{
        f"{link}_{side}_link": f"{parent}_link" if parent in _TRUNK else f"{parent}_{side}_link"
        for link, parent in _LIMBS
        for side in ("left", "right")
    },
}
"""The link from which each link hangs, from the head outward."""
_ELLIPTIC = ("mid_body", "lower_body", "quad")
"""Parts whose depth and breadth are of different measures, with capsules across or along them."""
_SAME_FRAME = {"head_link": "head", "head_turn_link": "head", "neck_rotation": "neck"}
"""Links without shapes that move with a part of the person."""

T = TypeVar("T")
Poses = Mapping[str, tuple[FloatArray, FloatArray]]
"""Orientation and position of links in the model frame, by name."""


def part_of(link: str) -> str:
    """Return the key of a link in `LINKS` of `tcs.model.people`.

    >>> part_of("quad_left_link"), part_of("head_center")
    ('quad', 'head')
    """
    if link == ROOT:
        return "head"
    name = link.removesuffix("_link").removesuffix("_left").removesuffix("_right")
    return _SAME_FRAME.get(link, name)


def scales_of(environment: EnvironmentFile) -> dict[str, Scale]:
    """Return how each link of the person is stretched, by "model::link"; {} if it is not resized.

    Raises:
        TcsError: If the body of the person is not valid.
    """
    person = environment.person
    if person is None or not person.has_body:
        return {}
    scales = link_scales(person.body(f"environment '{environment.name}', person"))
    return scales_by_link(environment.person_model, scales)


def scales_by_link(model: str, scales: Mapping[str, T]) -> dict[str, T]:
    """Return the scales of the parts of a person by "model::link".

    Args:
        model: Name of the model of the person.
        scales: By the keys of `LINKS` of `tcs.model.people`, of one person or of many.
    """
    return {f"{model}::{link}": scales[part_of(link)] for link in (ROOT, *PARENTS)}


def padding_of(
    environment: EnvironmentFile, link: str, scales: Mapping[str, ArrayLike]
) -> FloatArray:
    """Return the padding of a link [m], shape (...).

    Args:
        environment: The environment.
        link: Name of the link, "model::link".
        scales: What `scales_of` returns for the environment, {} for the papers' man; of one person
            or of many, shapes (..., 3).
    """
    padding = float(environment.padding.get(link, 0.0))
    scale = scales.get(link)
    return np.asarray(padding) if scale is None else padding_for(padding, scale)


def covers_of(
    environment: EnvironmentFile, link: str, shapes: Sequence[LinkShape], scale: ArrayLike
) -> list[tuple[LinkShape, ...]]:
    """Return for each shape of a link those that enclose it and its skin, stretched.

    Args:
        environment: The environment.
        link: Name of the link, "model::link".
        shapes: The shapes of the papers' man.
        scale: How the link is stretched, shape (..., 3): of one person or of many.
    """
    padding = float(environment.padding.get(link, 0.0))
    numbers = numbers_of_parts(link, shapes)
    return [cover(s, scale, padding, n) for s, n in zip(shapes, numbers, strict=True)]


def numbers_of_parts(link: str, shapes: Sequence[LinkShape]) -> list[int]:
    """Return the number of shapes that each shape of a link has on resized people."""
    is_uneven = part_of(link.partition("::")[2]) in _ELLIPTIC
    return [parts_of(shape, is_uneven=is_uneven) for shape in shapes]


def person_shapes(environment: EnvironmentFile) -> dict[str, list[LinkShape]]:
    """Return the collision shapes of the person's links as in the model's file, by "model::link".

    Raises:
        EnvironmentFileError: If the file cannot be read or a shape is no box or capsule.
    """
    model = environment.person_model
    root, where = model_file(environment)
    return {f"{model}::{link}": shapes for link, shapes in _shapes(root, where).items()}


def poses_in_file(environment: EnvironmentFile) -> Poses:
    """Return the poses of the links of the model's file in the model frame, by link.

    The joints have the positions of the environment file.

    Raises:
        EnvironmentFileError: If the file cannot be read.
    """
    root, _ = model_file(environment)
    return link_poses(root, _joints(environment))


def resized_model(environment: EnvironmentFile, path: Path, where: str) -> str:
    """Return the model of the person as SDFormat, resized to the person of an environment.

    Args:
        environment: An environment whose person has a body.
        path: The model's file.
        where: Name of the model for messages.

    Raises:
        EnvironmentFileError: If the model is not of the links of the papers' person.
    """
    root = read_xml(path, where, EnvironmentFileError)
    links = {link.get("name", ""): link for link in root.iter("link")}
    for name in (ROOT, *PARENTS):
        if name not in links:
            raise EnvironmentFileError(
                f"{where}: '{path}' has no link '{name}', so that the person cannot be resized. "
                "Use person_seated.sdf or person_lying.sdf, or remove 'sex' and the measures."
            )
    scales = {name.partition("::")[2]: scale for name, scale in scales_of(environment).items()}
    for alias, part in _SAME_FRAME.items():
        scales[alias] = next(s for name, s in scales.items() if part_of(name) == part)
    joints = _joints(environment)
    before, shapes = link_poses(root, joints), _shapes(root, where)
    for name in (ROOT, *PARENTS):
        full = f"{environment.person_model}::{name}"
        for kind in ("collision", "visual"):
            elements = links[name].findall(kind)
            stretched = [read_shape(element, where) for element in elements]
            covers = covers_of(environment, full, stretched, scales[name])
            for element, shapes_of_one in zip(elements, covers, strict=True):
                _write_shapes(links[name], element, shapes_of_one)
    _move_joints(links, before, scales)
    after, resized = link_poses(root, joints), _shapes(root, where)
    shift = motion_to_support(before, shapes, after, resized)
    for name in (ROOT, *PARENTS):
        pose = _pose(_carrier(links, name))
        if (over := pose.get("relative_to", "")) not in scales:
            write_position(pose, read_pose(pose)[1] + before[over][0].T @ shift)
    return ElementTree.tostring(root, encoding="unicode")


def _write_shapes(
    link: ElementTree.Element, element: ElementTree.Element, shapes: Sequence[LinkShape]
) -> None:
    """Write the shapes that enclose one, in its place; those after the first get names."""
    at, name = list(link).index(element), element.get("name", "")
    for number, shape in enumerate(shapes):
        written = element if number == 0 else copy.deepcopy(element)
        if number:
            written.set("name", f"{name}_part_{number + 1}")
            link.insert(at + number, written)
        write_shape(written, shape)


def model_file(environment: EnvironmentFile) -> tuple[ElementTree.Element, str]:
    """Return the content of the person's model file, and its name for messages."""
    model = environment.person_model
    (entry,) = (entry for entry in environment.models if entry.name == model)
    where = f"environment '{environment.name}', '{model}'"
    return read_xml(Path(entry.file), where, EnvironmentFileError), where


def _carrier(links: Mapping[str, ElementTree.Element], name: str) -> ElementTree.Element:
    """Return the link that places a link: itself, or for the root the one whose frame it shares."""
    over = _pose(links[name]).get("relative_to", "")
    if over in _SAME_FRAME and (name == ROOT or name in _SAME_FRAME):
        return _carrier(links, over)
    return links[name]


def _move_joints(
    links: Mapping[str, ElementTree.Element], before: Poses, scales: Mapping[str, Scale]
) -> None:
    """Stretch the positions of the joints on each link, in place."""
    # What each origin moves by, so that a person of the same size keeps every digit.
    moved = {ROOT: np.zeros(3)}
    for name, step in steps_of_joints(before, scales).items():
        moved[name] = moved[PARENTS[name]] + step
    for name, link in links.items():
        if name not in scales or name == ROOT:
            continue
        pose = _pose(link)
        over = pose.get("relative_to", "")
        if over in scales:
            write_position(pose, np.array(scales[over]) * read_pose(pose)[1])
        elif name in moved:
            write_position(pose, read_pose(pose)[1] + before[over][0].T @ moved[name])


def steps_of_joints(before: Poses, scales: Mapping[str, ArrayLike]) -> dict[str, FloatArray]:
    """Return how far each link moves relative to its parent, in the model frame [m].

    Args:
        before: Poses of the links before resizing.
        scales: How each link is stretched, by its name, shapes (..., 3): of one person or of many.

    Returns:
        By the keys of `PARENTS`, in their order, shapes (..., 3).
    """
    steps = {}
    for name, parent in PARENTS.items():
        R, p = before[parent]
        offset = R.T @ (before[name][1] - p)
        steps[name] = np.matvec(R, (np.asarray(scales[parent]) - 1.0) * offset)
    return steps


def motion_to_support(
    before: Poses,
    shapes: Mapping[str, list[LinkShape]],
    after: Poses,
    resized: Mapping[str, list[LinkShape]],
) -> FloatArray:
    """Return the motion that puts the resized person on the seat or on the mattress [m].

    Args:
        before: Poses of the links of the papers' man.
        shapes: His shapes.
        after: Poses of those of one person or of many, positions of shapes (..., 3).
        resized: Their shapes.

    Returns:
        Shape (..., 3).
    """
    trunk = [f"{part}_link" for part in _TRUNK]
    thighs = ["quad_left_link", "quad_right_link"]
    R, _ = before["upper_body_link"]
    is_upright = abs(R[2, 0]) > 0.7
    support = thighs if is_upright else trunk
    rise = _least(before, shapes, support)[2] - _least(after, resized, support)[..., 2]
    if is_upright:
        forward = _least(before, shapes, trunk)[0] - _least(after, resized, trunk)[..., 0]
    else:
        forward = before["lower_body_link"][1][0] - after["lower_body_link"][1][..., 0]
    return np.stack([forward, np.zeros_like(rise), rise], axis=-1)


def _least(poses: Poses, shapes: Mapping[str, list[LinkShape]], links: list[str]) -> FloatArray:
    """Return the least x, y and z of the shapes of some links [m], shape (..., 3)."""
    corners = [shape.extent(*poses[link])[0] for link in links for shape in shapes[link]]
    return np.asarray(np.min(corners, axis=0))


def _shapes(root: ElementTree.Element, where: str) -> dict[str, list[LinkShape]]:
    """Return the collision shapes of all links of the person."""
    return {
        name: [read_shape(element, where) for element in link.findall("collision")]
        for link in root.iter("link")
        if (name := link.get("name", "")) == ROOT or name in PARENTS
    }


def _pose(link: ElementTree.Element) -> ElementTree.Element:
    """Return the pose element of a link, added if it has none."""
    pose = link.find("pose")
    if pose is None:
        pose = ElementTree.SubElement(link, "pose")
        pose.text = "0 0 0 0 0 0"
    return pose


def _joints(environment: EnvironmentFile) -> dict[str, float]:
    """Return the joint positions of an environment in the state of its file [m or rad]."""
    joints = dict(environment.joints)
    for leader, posture in environment.posture.items():
        joints.update(posture.positions(joints.get(leader, 0.0)))
    return joints


def link_poses(root: ElementTree.Element, joints: Mapping[str, float]) -> Poses:
    """Return the poses of all links in the model frame at joint positions."""
    plant = MultibodyPlant(0.0)
    (instance,) = Parser(plant).AddModelsFromString(
        ElementTree.tostring(root, encoding="unicode"), "sdf"
    )
    base = plant.GetFrameByName("__model__", instance)
    plant.WeldFrames(plant.world_frame(), base)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    positions = plant.GetPositions(context)
    for name, value in joints.items():
        if plant.HasJointNamed(name, instance):
            positions[plant.GetJointByName(name, instance).position_start()] = value
    plant.SetPositions(context, positions)
    poses = {}
    for index in plant.GetBodyIndices(instance):
        body = plant.get_body(index)
        X = plant.EvalBodyPoseInWorld(context, body)
        poses[body.name()] = (X.rotation().matrix(), X.translation())
    return poses
