"""The surface of each body of a robot, as triangles, and which bodies are welded together."""

from __future__ import annotations

import math

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tcs.model.robots.urdf.meshes import mesh_triangles
from tcs.model.robots.urdf.model import Geometry, Urdf, Vector

FloatArray = NDArray[np.float64]

MARKER_SIZE = 0.011
"""A box, cylinder or ball no longer or wider than this [m] marks a frame and is no part of the
robot."""

_ROUND_SECTIONS = 48


def body_triangles(model: Urdf) -> dict[str, FloatArray]:
    """Return the triangles of every body that has a surface, in its own frame [m].

    Visual and collision geometry both count: either may show something that the other lacks.
    Boxes, cylinders and balls of at most `MARKER_SIZE` are skipped, for they only mark frames.

    Args:
        model: The robot.

    Returns:
        Corners by body, each of shape (n, 3, 3).

    Raises:
        RobotError: If a mesh cannot be read.
    """
    found = {}
    for body in model.links:
        pieces = [
            place(geometry_triangles(geometry), geometry.xyz, geometry.rpy)
            for geometry in surface_geometries(model, body)
        ]
        if pieces:
            # Often one mesh serves both as visual and as collision geometry.
            found[body] = np.unique(np.concatenate(pieces), axis=0)
    return found


def surface_geometries(model: Urdf, body: str) -> tuple[Geometry, ...]:
    """Return the geometries of a body that are part of the robot: all but frame markers."""
    return tuple(geometry for geometry in model.links[body] if not _is_marker(geometry))


def geometry_triangles(geometry: Geometry) -> FloatArray:
    """Return the triangles of a geometry in its own frame [m], shape (n, 3, 3).

    A cylinder or sphere becomes a polyhedron around it, so that what encloses the triangles
    encloses the round body as well.
    """
    if geometry.mesh is not None:
        return np.asarray(mesh_triangles(geometry.mesh) * np.array(geometry.size))
    if geometry.shape == "box":
        solid = trimesh.creation.box(geometry.size)
    elif geometry.shape == "cylinder":
        radius, length = geometry.size
        solid = trimesh.creation.cylinder(
            radius / math.cos(math.pi / _ROUND_SECTIONS), length, sections=_ROUND_SECTIONS
        )
    else:
        solid = trimesh.creation.icosphere(subdivisions=2, radius=geometry.size[0])
        # Its faces cut into the sphere: move the nearest one out to it.
        nearest = np.einsum("ij,ij->i", solid.triangles[:, 0], solid.face_normals).min()
        solid.apply_scale(geometry.size[0] / nearest)
    return np.asarray(solid.triangles, dtype=np.float64)


def place(triangles: FloatArray, xyz: Vector, rpy: Vector) -> FloatArray:
    """Return triangles moved from a frame to its parent, given the frame's pose there."""
    R = Rotation.from_euler("xyz", rpy).as_matrix()
    return np.asarray(triangles @ R.T + np.array(xyz))


def welded_top(model: Urdf, body: str) -> tuple[str, FloatArray, FloatArray]:
    """Return the uppermost body that fixed joints tie a body to, and the body's pose in it.

    Args:
        model: The robot.
        body: Name of the body B.

    Returns:
        Name of the uppermost body A (B itself when a movable joint carries it), R_AB of shape
        (3, 3) and p_AoBo_A of shape (3,) [m].
    """
    R, p = np.eye(3), np.zeros(3)
    joint = model.parent_joints.get(body)
    while joint is not None and not joint.is_movable:
        R_up = Rotation.from_euler("xyz", joint.rpy).as_matrix()
        R, p = R_up @ R, R_up @ p + np.array(joint.xyz)
        body = joint.parent
        joint = model.parent_joints.get(body)
    return body, R, p


def _is_marker(geometry: Geometry) -> bool:
    if geometry.mesh is not None:
        return False
    # Radius before length, where there are any.
    widths = (
        geometry.size if geometry.shape == "box" else (2 * geometry.size[0], *geometry.size[1:])
    )
    return max(widths) <= MARKER_SIZE
