"""A URDF reduced to what a plant needs: links, joints, limits and, on request, visual meshes."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable
from pathlib import Path

from tcs.model.robots.urdf.meshes import as_obj
from tcs.model.robots.urdf.model import Geometry, Joint, Urdf
from tcs.model.robots.urdf.packages import resolve_uri
from tcs.model.robots.urdf.reading import read_urdf


def kinematic_urdf(urdf: str | Path, meshes: bool = False) -> str:
    """Return `urdf_text` of a URDF file.

    Args:
        urdf: The original: a path, or a `package://` address.
        meshes: Whether to keep visual geometry, its meshes converted to OBJ in the user's cache.

    Raises:
        RobotError: If the URDF or one of its meshes cannot be used.
    """
    model = read_urdf(resolve_uri(str(urdf), Path()))
    if meshes:
        model.require_surfaces()
    return urdf_text(model, meshes)


def urdf_text(model: Urdf, meshes: bool = False) -> str:
    """Return the text of a URDF that Drake reads without a warning.

    It lacks transmissions, sensors, simulator extensions, inertias, mimic elements and collision
    geometry, which scoring does not need and for which Drake prints warnings, 117 for the PR2.

    Args:
        model: The robot.
        meshes: Whether to keep visual geometry, its meshes converted to OBJ in the user's cache.

    Raises:
        RobotError: If one of its meshes cannot be used.
    """
    root = ElementTree.Element("robot", name=model.path.stem)
    for name, geometries in model.links.items():
        link = ElementTree.SubElement(root, "link", name=name)
        if meshes:
            for geometry in geometries:
                # A mesh that is only drawn may be missing; surfaces were checked.
                if geometry.role == "visual" and not geometry.fault:
                    _add_visual(link, geometry)
    for joint in model.joints.values():
        _add_joint(root, joint)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _add_joint(root: ElementTree.Element, joint: Joint) -> None:
    element = ElementTree.SubElement(root, "joint", name=joint.name, type=joint.type)
    _add_origin(element, joint.xyz, joint.rpy)
    ElementTree.SubElement(element, "parent", link=joint.parent)
    ElementTree.SubElement(element, "child", link=joint.child)
    if not joint.is_movable:
        return
    ElementTree.SubElement(element, "axis", xyz=_words(joint.axis))
    if joint.type != "continuous":
        lower, upper = joint.hard
        limit = {"lower": repr(lower), "upper": repr(upper), "effort": "0", "velocity": "0"}
        ElementTree.SubElement(element, "limit", limit)


def _add_visual(link: ElementTree.Element, geometry: Geometry) -> None:
    visual = ElementTree.SubElement(link, "visual")
    _add_origin(visual, geometry.xyz, geometry.rpy)
    holder = ElementTree.SubElement(visual, "geometry")
    if geometry.mesh is not None:
        # Drake needs a URI here: a text has no folder that a relative path could start from.
        address = f"file://{as_obj(geometry.mesh)}"
        attributes = {"filename": address, "scale": _words(geometry.size)}
        ElementTree.SubElement(holder, "mesh", attributes)
    elif geometry.shape == "box":
        ElementTree.SubElement(holder, "box", size=_words(geometry.size))
    elif geometry.shape == "sphere":
        ElementTree.SubElement(holder, "sphere", radius=repr(geometry.size[0]))
    else:
        radius, length = geometry.size
        ElementTree.SubElement(holder, "cylinder", radius=repr(radius), length=repr(length))
    if geometry.rgba is not None:
        # Drake requires a name for every material; the colour in it makes it unique.
        name = "rgba_" + "_".join(f"{channel:g}" for channel in geometry.rgba)
        material = ElementTree.SubElement(visual, "material", name=name)
        ElementTree.SubElement(material, "color", rgba=_words(geometry.rgba))


def _add_origin(element: ElementTree.Element, xyz: Iterable[float], rpy: Iterable[float]) -> None:
    ElementTree.SubElement(element, "origin", xyz=_words(xyz), rpy=_words(rpy))


def _words(numbers: Iterable[float]) -> str:
    # repr preserves a float exactly, so Drake's kinematics are those of the original file.
    return " ".join(repr(float(number)) for number in numbers)
