"""What a table of distances is made from: the meshes of two bodies and the joints between them."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tcs.errors import RobotError
from tcs.files.unchanged import kept_while_unchanged
from tcs.model.robots.extras import model_with_extras
from tcs.model.robots.robot_file import RobotFile
from tcs.model.robots.urdf import Joint, Urdf
from tcs.model.robots.urdf.surfaces import (
    geometry_triangles,
    place,
    surface_geometries,
    welded_top,
)

FloatArray = NDArray[np.float64]


def carried_bodies(model: Urdf, carriers: Collection[str]) -> Mapping[str, tuple[str, ...]]:
    """Return the bodies whose surfaces the shapes of each body must enclose.

    Args:
        model: The robot.
        carriers: Bodies with shapes.

    Returns:
        By body: itself, and bodies with a surface that are welded to it and have no shapes of their
        own. A body with a surface but without shapes on anything welded to it stands for itself.
    """
    tops = {body: welded_top(model, body)[0] for body in carriers if body in model.links}
    found: dict[str, list[str]] = {}
    for body in model.links:
        if not surface_geometries(model, body):
            continue
        top = body if body in tops else welded_top(model, body)[0]
        welded = (c for c in tops if tops[c] == top)
        found.setdefault(body if body in tops else next(welded, body), []).append(body)
    return {carrier: tuple(bodies) for carrier, bodies in found.items()}


def body_surface(robot: RobotFile, body: str) -> FloatArray:
    """Return the surface that the shapes of a body must enclose, in its frame [m], (n, 3, 3).

    Raises:
        RobotError: If the URDF or a mesh cannot be read.
    """
    model = model_with_extras(robot)
    _, R_AC, p_AC = welded_top(model, body)
    pieces = [np.empty((0, 3, 3))]
    for member in _carried(robot).get(body, ()):
        _, R_AB, p_AB = welded_top(model, member)
        for geometry in surface_geometries(model, member):
            triangles = place(geometry_triangles(geometry), geometry.xyz, geometry.rpy)
            pieces.append((triangles @ R_AB.T + p_AB - p_AC) @ R_AC)
    return np.concatenate(pieces)


def source_digest(robot: RobotFile, pair: tuple[str, str]) -> str:
    """Return the SHA-256 of the surfaces of two bodies and of the joints that carry them.

    Args:
        robot: The robot.
        pair: Names of two bodies.

    Raises:
        RobotError: If the URDF or a mesh cannot be read.
    """
    model, carried = model_with_extras(robot), _carried(robot)
    sha = hashlib.sha256()
    for body in pair:
        for member in carried.get(body, ()):
            sha.update(f"\0{body} {member}".encode())
            for joint in _carrying(model, member):
                fields = (joint.name, joint.type, joint.xyz, joint.rpy, joint.axis)
                sha.update(repr(fields).encode())
            for geometry in surface_geometries(model, member):
                sha.update(repr((geometry.shape, geometry.size, geometry.xyz)).encode())
                sha.update(repr(geometry.rpy).encode())
                if geometry.mesh is not None:
                    sha.update(_content_digest(geometry.mesh).encode())
    return sha.hexdigest()


def _carried(robot: RobotFile) -> Mapping[str, tuple[str, ...]]:
    """Return the bodies whose surfaces belong to each body of a robot, extra ones included."""
    carriers = dict.fromkeys(shape.body for shape in robot.load_primitives())
    # The surface of an extra body is its own shapes.
    own = {body.name: (body.name,) for body in robot.bodies}
    return own | dict(carried_bodies(robot.model(), carriers))


def _carrying(model: Urdf, body: str) -> list[Joint]:
    """Return the joints from a body up to the root."""
    joints = []
    while (joint := model.parent_joints.get(body)) is not None:
        joints.append(joint)
        body = joint.parent
    return joints


@kept_while_unchanged(files=256)
def _content_digest(mesh: Path) -> str:
    """Return the SHA-256 of a mesh file."""
    try:
        return hashlib.sha256(mesh.read_bytes()).hexdigest()
    except OSError as error:
        raise RobotError(f"mesh '{mesh}' cannot be read: {error.strerror}.") from error
