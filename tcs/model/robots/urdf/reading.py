"""Read a URDF file and check that its joints form one tree."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from tcs.errors import RobotError, UnknownNameError
from tcs.files.quantities import ANGLE, ENTRIES, EXTENT, JOINT_LIMIT, MESH_SCALE, POSITION
from tcs.files.unchanged import kept_while_unchanged
from tcs.files.xml_documents import read_xml
from tcs.model.robots.urdf.model import MOVABLE, Geometry, Joint, Mimic, Urdf, Vector
from tcs.model.robots.urdf.packages import resolve_uri

AXIS_LENGTHS = (1e-3, 1e3)
"""Least and greatest length of the axis of a movable joint: rounded, but a direction."""

WORLD = "world"
"""Name that Drake gives to the body that does not move: no link can have it."""

ROOT = "root_link"
"""Name under which a root link called `world` is read, as in URDFs of arms to be bolted down."""

_XACRO = re.compile(r"^xacro:|\{[^}]*xacro[^}]*\}|\$\{|\$\(")
"""What is left of macros from which a URDF is generated: a name in one of their XML namespaces
(`http://www.ros.org/wiki/xacro`, `http://ros.org/wiki/xacro`), or a substitution."""


def read_urdf(path: Path, folders: tuple[str, ...] = ()) -> Urdf:
    """Return the links and joints of a URDF file.

    A joint whose limits are one value is fixed there, and so are those that mimic it. A capsule
    becomes a cylinder and two spheres. A mesh that is not found keeps the reason as its `fault`.

    Args:
        path: The file; read anew only if it has changed.
        folders: Folders that packages are searched in first.

    Raises:
        RobotError: If the file cannot be read, is not a URDF, or its joints do not form one tree.
    """
    model = _kept(path, folders)
    # What was missing may have come since.
    missing = any(g.fault for geometries in model.links.values() for g in geometries)
    return _read(path, folders) if missing else model


def _read(path: Path, folders: tuple[str, ...]) -> Urdf:
    """Return the links and joints of a URDF file; see `read_urdf`."""
    root = read_xml(path, f"URDF '{path}'", RobotError)
    if root.tag != "robot":
        raise RobotError(f"URDF '{path}': the root element is '{root.tag}', but must be 'robot'.")
    if any(_has_macro(element) for element in root.iter()):
        raise RobotError(
            f"URDF '{path}' has xacro macros. Expand it with xacro first: xacro {path.name} > "
            "robot.urdf"
        )
    colours = {
        element.get("name", ""): colour
        for element in root.findall("material")
        if (colour := _colour(element)) is not None
    }

    for tag in ("link", "joint"):
        ENTRIES.check(len(root.findall(tag)), f"URDF '{path}': its number of {tag}s", RobotError)
        _check_distinct(root, tag, path)
    links: dict[str, tuple[Geometry, ...]] = {}
    for link in root.findall("link"):
        name = _attribute(link, "name", path)
        elements = (*link.findall("visual"), *link.findall("collision"))
        links[name] = tuple(
            geometry
            for element in elements
            for geometry in _geometries(element, colours, path, name, folders)
        )
    joints = {j.name: j for j in (_joint(element, path) for element in root.findall("joint"))}
    model = _without_world(Urdf(path=path, links=links, joints=joints))
    _check_tree(model)
    return _without_locked(model)


_kept = kept_while_unchanged(files=64)(_read)


def _has_macro(element: ElementTree.Element) -> bool:
    """Return whether an element, or an attribute of it, is what a macro leaves to be expanded."""
    return any(_XACRO.search(text) for text in (element.tag, *element.attrib.values()))


def _check_distinct(root: ElementTree.Element, tag: str, path: Path) -> None:
    """Refuse two links, or two joints, of one name: the first would be lost."""
    seen = set()
    for element in root.findall(tag):
        name = _attribute(element, "name", path)
        if name in seen:
            raise RobotError(f"URDF '{path}': two {tag}s are named '{name}'. Rename one.")
        seen.add(name)


def _without_locked(model: Urdf) -> Urdf:
    """Return the model with joints fixed whose limits are one value, and those that mimic them."""
    locked = {j.name: j.hard[0] for j in model.joints.values() if _is_locked(j)}
    if not locked:
        return model

    def position(joint: Joint) -> float | None:
        """Return the one position of a joint [rad or m], None if it moves."""
        if joint.mimic is None:
            return locked.get(joint.name)
        led = position(model.joints[joint.mimic.leader])
        return None if led is None else joint.mimic.multiplier * led + joint.mimic.offset

    joints = {
        name: joint if (at := position(joint)) is None else _fixed_at(joint, at)
        for name, joint in model.joints.items()
    }
    return Urdf(path=model.path, links=model.links, joints=joints)


def _is_locked(joint: Joint) -> bool:
    return joint.is_movable and joint.hard[0] == joint.hard[1] and joint.mimic is None


def _fixed_at(joint: Joint, position: float) -> Joint:
    """Return a joint that is fixed at a position [rad or m]."""
    # Imported here: most models need no rotation, and this takes as long as reading them.
    from scipy.spatial.transform import Rotation

    xyz, rpy = joint.xyz, joint.rpy
    if position:
        R = Rotation.from_euler("xyz", rpy)
        axis = np.array(joint.axis) / math.hypot(*joint.axis)
        if joint.type == "prismatic":
            x, y, z = (np.array(xyz) + R.apply(axis * position)).tolist()
            xyz = (x, y, z)
        else:
            turned = R * Rotation.from_rotvec(axis * position)
            roll, pitch, yaw = turned.as_euler("xyz", suppress_warnings=True).tolist()
            rpy = (roll, pitch, yaw)
    return replace(
        joint, type="fixed", xyz=xyz, rpy=rpy, hard=(0.0, 0.0), soft=(0.0, 0.0), mimic=None,
        locked=position,
    )  # fmt: skip


def _without_world(model: Urdf) -> Urdf:
    """Return the model with a root link called `world` renamed to `ROOT`."""
    if WORLD not in model.links or WORLD in model.parent_joints or ROOT in model.links:
        return model
    links = {ROOT if name == WORLD else name: found for name, found in model.links.items()}
    joints = {
        name: replace(joint, parent=ROOT) if joint.parent == WORLD else joint
        for name, joint in model.joints.items()
    }
    return Urdf(path=model.path, links=links, joints=joints)


def _check_tree(model: Urdf) -> None:
    """Raise an error without links, or if joints name others, form no tree or carry the world."""
    if not model.links:
        raise RobotError(
            f"URDF '{model.path}': it has no link, so it describes no robot. If the package has "
            "another URDF of it, name that one."
        )
    if WORLD in model.links:
        raise RobotError(
            f"URDF '{model.path}': a link is named '{WORLD}', which stands for the environment. "
            "Rename it, or remove it with the joint that fixes the robot to it."
        )
    for joint in model.joints.values():
        for link in (joint.parent, joint.child):
            if link not in model.links:
                where = f"URDF '{model.path}', joint '{joint.name}'"
                raise UnknownNameError("link", link, model.links, where=where)
        _check_mimic(model, joint)
    roots = [link for link in model.links if link not in model.parent_joints]
    # If every link but the root has one parent joint, a link that does not lead to the root is part
    # of a cycle.
    disconnected = len(roots) != 1 or len(model.parent_joints) != len(model.joints)
    if disconnected or not all(_reaches_root(model, link) for link in model.links):
        raise RobotError(
            f"URDF '{model.path}': its joints do not form one tree "
            f"(links without a parent joint: {', '.join(roots) or 'none'})."
        )


def _reaches_root(model: Urdf, link: str) -> bool:
    for _ in model.links:
        if link not in model.parent_joints:
            return True
        link = model.parent_joints[link].parent
    return False


def _check_mimic(model: Urdf, joint: Joint) -> None:
    """Raise an error if the chain of leaders of a mimic joint is unknown, fixed or cyclic."""
    where = f"URDF '{model.path}', joint '{joint.name}', mimic"
    seen = {joint.name}
    while joint.mimic is not None:
        joint = model.joint(joint.mimic.leader, where)
        if joint.name in seen or not joint.is_movable:
            raise RobotError(f"{where}: '{joint.name}' must be another, movable joint.")
        seen.add(joint.name)


def _joint(element: ElementTree.Element, path: Path) -> Joint:
    name = _attribute(element, "name", path)
    where = f"URDF '{path}', joint '{name}'"
    joint_type = element.get("type", "")
    if joint_type not in (*MOVABLE, "fixed"):
        raise RobotError(
            f"{where}: type '{joint_type}' is not supported, only {', '.join(MOVABLE)} and fixed. "
            "Make one that stands for the drive of the base 'fixed': scoring moves the base itself."
        )
    ends = {}
    for end in ("parent", "child"):
        found = element.find(end)
        if found is None:
            raise RobotError(f"{where}: there is no '{end}' element.")
        ends[end] = _attribute(found, "link", path)
    hard = _hard_limits(element, joint_type, where)
    xyz, rpy = _origin(element, where)
    return Joint(
        name=name,
        type=joint_type,
        parent=ends["parent"],
        child=ends["child"],
        xyz=xyz,
        rpy=rpy,
        axis=_axis(element, joint_type, where),
        hard=hard,
        soft=_soft_limits(element, hard, where),
        mimic=_mimic(element, where),
        velocity=_velocity(element, where),
    )


def _axis(element: ElementTree.Element, joint_type: str, where: str) -> Vector:
    """Return the axis of a joint; refuse one of a movable joint that has no direction."""
    axis = _vector(element.find("axis"), "xyz", (1.0, 0.0, 0.0), where)
    shortest, longest = AXIS_LENGTHS
    if joint_type in MOVABLE and not shortest <= math.hypot(*axis) <= longest:
        raise RobotError(
            f"{where}: its axis has length {math.hypot(*axis):.6g}, but must have a direction: "
            f"write a vector of length 1 ({shortest:g} to {longest:,.0f} is accepted)."
        )
    return axis


def _hard_limits(element: ElementTree.Element, joint_type: str, where: str) -> tuple[float, float]:
    if joint_type == "fixed":
        return 0.0, 0.0
    if joint_type == "continuous":
        return -math.inf, math.inf
    limit = element.find("limit")
    if limit is None:
        raise RobotError(f"{where}: a {joint_type} joint needs a 'limit' element.")
    # By the URDF specification a missing bound is 0.
    lower, upper = (_numbers(limit.get(key, "0"), 1, where)[0] for key in ("lower", "upper"))
    if lower > upper:
        raise RobotError(f"{where}: its lower limit {lower} is above its upper limit {upper}.")
    quantity = POSITION if joint_type == "prismatic" else JOINT_LIMIT
    quantity.check((lower, upper), f"{where}: a limit", RobotError)
    return lower, upper


def _velocity(element: ElementTree.Element, where: str) -> float:
    limit = element.find("limit")
    text = "0" if limit is None else limit.get("velocity", "0")
    # Exporters write 0 for an unknown velocity; an immovable joint would be fixed.
    speed = _numbers(text, 1, where)[0]
    return speed if speed > 0.0 else math.inf


def _soft_limits(
    element: ElementTree.Element, hard: tuple[float, float], where: str
) -> tuple[float, float]:
    safety = element.find("safety_controller")
    # A safety controller without positions limits the velocity only.
    if safety is None or not {"soft_lower_limit", "soft_upper_limit"} <= safety.attrib.keys():
        return hard
    lower, upper = (
        _numbers(safety.get(key, ""), 1, where)[0]
        for key in ("soft_lower_limit", "soft_upper_limit")
    )
    lower, upper = max(lower, hard[0]), min(upper, hard[1])
    if lower > upper:
        raise RobotError(f"{where}: its soft limits do not overlap its hard limits.")
    return lower, upper


def _mimic(element: ElementTree.Element, where: str) -> Mimic | None:
    mimic = element.find("mimic")
    if mimic is None:
        return None
    multiplier, offset = (
        _numbers(mimic.get(key, default), 1, where)[0]
        for key, default in (("multiplier", "1"), ("offset", "0"))
    )
    JOINT_LIMIT.check((multiplier, offset), f"{where}: a number of its 'mimic'", RobotError)
    return Mimic(leader=mimic.get("joint", ""), multiplier=multiplier, offset=offset)


def _geometries(
    element: ElementTree.Element,
    colours: Mapping[str, tuple[float, ...]],
    path: Path,
    link: str,
    folders: tuple[str, ...],
) -> tuple[Geometry, ...]:
    """Return the geometries of a visual or collision element: three for a capsule."""
    where = f"URDF '{path}', link '{link}'"
    holder = element.find("geometry")
    if holder is None or len(holder) == 0:
        return ()
    shape = holder[0]
    # Drake's own shapes have its namespace, or a prefix that is not declared.
    kind = re.split("[}:]", shape.tag)[-1]
    mesh: Path | None = None
    fault = ""
    if kind == "mesh":
        size: tuple[float, ...] = _vector(shape, "scale", (1.0, 1.0, 1.0), where)
        address = _attribute(shape, "filename", path)
        try:
            mesh = resolve_uri(address, path.parent, folders)
        except RobotError as error:
            mesh, fault = Path(address), f"{where}: {error}"
    elif kind == "box":
        size = _vector(shape, "size", (0.0, 0.0, 0.0), where)
    elif kind in ("cylinder", "capsule"):
        size = tuple(_numbers(shape.get(key, ""), 1, where)[0] for key in ("radius", "length"))
    elif kind == "sphere":
        size = _numbers(shape.get("radius", ""), 1, where)
    else:
        raise RobotError(
            f"{where}: geometry is '{kind}', but must be mesh, box, cylinder, capsule or sphere."
        )
    quantity = MESH_SCALE if kind == "mesh" else EXTENT
    quantity.check(size, f"{where}: a number of a '{kind}'", RobotError)
    if kind == "mesh" and not all(size):
        raise RobotError(f"{where}: a mesh has the scale {size}, but 0 would flatten it.")
    xyz, rpy = _origin(element, where)
    material = element.find("material")
    rgba = None
    if material is not None:
        rgba = _colour(material) or colours.get(material.get("name", ""))
    found = Geometry(
        role="visual" if element.tag == "visual" else "collision",
        shape="cylinder" if kind == "capsule" else kind,  # type: ignore[arg-type]  # tested above
        size=size,
        mesh=mesh,
        xyz=xyz,
        rpy=rpy,
        rgba=rgba,  # type: ignore[arg-type]  # four numbers, see _colour
        fault=fault,
    )
    return (found, *_caps(found)) if kind == "capsule" else (found,)


def _caps(cylinder: Geometry) -> tuple[Geometry, ...]:
    """Return the spheres that make a cylinder a capsule, whose length is between their centres."""
    # Imported here: most models need no rotation, and this takes as long as reading them.
    from scipy.spatial.transform import Rotation

    radius, length = cylinder.size
    along = Rotation.from_euler("xyz", cylinder.rpy).as_matrix()[:, 2] * (length / 2)
    ends = np.array(cylinder.xyz) + np.stack([along, -along])
    return tuple(
        replace(cylinder, shape="sphere", size=(radius,), xyz=(float(x), float(y), float(z)))
        for x, y, z in ends
    )


def _colour(material: ElementTree.Element) -> tuple[float, ...] | None:
    """Return red, green, blue and opacity; None without a colour, or if it is none."""
    colour = material.find("color")
    try:
        return None if colour is None else _numbers(colour.get("rgba", ""), 4, "colour")
    except RobotError:
        return None


def _origin(element: ElementTree.Element, where: str) -> tuple[Vector, Vector]:
    origin = element.find("origin")
    zero = (0.0, 0.0, 0.0)
    xyz, rpy = _vector(origin, "xyz", zero, where), _vector(origin, "rpy", zero, where)
    POSITION.check(xyz, f"{where}: a coordinate of an 'origin'", RobotError)
    ANGLE.check(rpy, f"{where}: an angle of an 'origin'", RobotError)
    return xyz, rpy


def _vector(element: ElementTree.Element | None, key: str, default: Vector, where: str) -> Vector:
    if element is None or key not in element.attrib:
        return default
    x, y, z = _numbers(element.get(key, ""), 3, where)
    return x, y, z


def _numbers(text: str, count: int, where: str) -> tuple[float, ...]:
    try:
        numbers = tuple(float(word) for word in text.split())
    except ValueError:
        numbers = ()
    if len(numbers) != count or not all(math.isfinite(number) for number in numbers):
        raise RobotError(f"{where}: '{text}' must be {count} finite number(s).")
    return numbers


def _attribute(element: ElementTree.Element, key: str, path: Path) -> str:
    value = element.get(key)
    if not value:
        raise RobotError(f"URDF '{path}': a '{element.tag}' element has no '{key}'.")
    return value
