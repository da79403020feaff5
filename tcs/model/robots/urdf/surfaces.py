"""Surfaces of the bodies of a robot as triangles, and the bodies that are welded together."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tcs.errors import RobotError
from tcs.files.unchanged import kept_while_unchanged
from tcs.model.robots.triangles import distinct
from tcs.model.robots.urdf.meshes import mesh_triangles
from tcs.model.robots.urdf.model import Geometry, Urdf, Vector

FloatArray = NDArray[np.float64]

MARKER_SIZE = 0.011
"""A box, cylinder or sphere of at most this length and width [m] marks a frame and is not part of
the robot."""

LARGEST_PART = 8.0
"""Farthest that a surface may reach from the origin of its link [m]: meshes whose unit was
forgotten reach farther, and no part of a mobile manipulator does."""

_ROUND_SECTIONS = 48


def body_triangles(model: Urdf) -> dict[str, FloatArray]:
    """Return the triangles of every body that has a surface, in its own frame [m].

    They are those of the visual and the collision geometry, because either may contain parts that
    the other lacks. Boxes, cylinders and spheres of at most `MARKER_SIZE` are left out: they mark
    frames.

    Args:
        model: The robot.

    Returns:
        Corners by body, each of shape (n, 3, 3).

    Raises:
        RobotError: If a mesh cannot be read.
    """
    found = {}
    for body in model.links:
        geometries = surface_geometries(model, body)
        if geometries:
            meshes = tuple(g.mesh for g in geometries if g.mesh is not None)
            found[body] = _placed_triangles(meshes, geometries, body)
    return found


@kept_while_unchanged(files=64)
def _placed_triangles(
    meshes: tuple[Path, ...], geometries: tuple[Geometry, ...], body: str
) -> FloatArray:
    """Return the triangles of the geometries of a body in its frame [m], shape (n, 3, 3).

    Args:
        meshes: The files of those that are meshes.
        geometries: The geometries.
        body: Name of the body in messages.

    Raises:
        RobotError: If one cannot be read, or reaches farther than `LARGEST_PART`.
    """
    pieces = [place(geometry_triangles(g), g.xyz, g.rpy) for g in geometries]
    for geometry, triangles in zip(geometries, pieces, strict=True):
        farthest = float(np.abs(triangles).max())
        if farthest > LARGEST_PART:
            what = f"mesh '{geometry.mesh}'" if geometry.mesh else f"a {geometry.shape}"
            raise RobotError(
                f"link '{body}': {what} reaches {farthest:,.1f} m from its origin, but a part of a "
                f"robot reaches {LARGEST_PART:g} m at most. Write metres, or give the mesh the "
                "'scale' of its unit, e.g. 0.001 0.001 0.001 for millimetres; what is no part of "
                "the robot is left out with --ignore LINK."
            )
    # One mesh often is both visual and collision geometry.
    corners, _ = distinct(np.concatenate(pieces).reshape(-1, 9))
    corners.setflags(write=False)
    return corners.reshape(-1, 3, 3)


def surface_geometries(model: Urdf, body: str) -> tuple[Geometry, ...]:
    """Return the geometries of a body that are its surface: those that mark no frame."""
    return tuple(g for g in model.links[body] if g.is_surface and not _is_marker(g))


def geometry_triangles(geometry: Geometry) -> FloatArray:
    """Return the triangles of a geometry in its own frame [m], shape (n, 3, 3).

    A cylinder or sphere becomes a circumscribed polyhedron, so that a primitive that encloses the
    triangles encloses the round geometry as well.
    """
    if geometry.mesh is not None:
        return np.asarray(mesh_triangles(geometry.mesh) * np.array(geometry.size))
    # Its import takes long, and scenes of robots that ship are built without it.
    import trimesh

    if geometry.shape == "box":
        solid = trimesh.creation.box(geometry.size)
    elif geometry.shape == "cylinder":
        radius, length = geometry.size
        solid = trimesh.creation.cylinder(
            radius / math.cos(math.pi / _ROUND_SECTIONS), length, sections=_ROUND_SECTIONS
        )
    else:
        solid = trimesh.creation.icosphere(subdivisions=2, radius=geometry.size[0])
        # The faces cut into the sphere: scale until the nearest one touches it.
        nearest = np.einsum("ij,ij->i", solid.triangles[:, 0], solid.face_normals).min()
        solid.apply_scale(geometry.size[0] / nearest)
    return np.asarray(solid.triangles, dtype=np.float64)


def place(triangles: FloatArray, xyz: Vector, rpy: Vector) -> FloatArray:
    """Return triangles in the parent frame, given the pose of their frame in the parent."""
    R = Rotation.from_euler("xyz", rpy).as_matrix()
    return np.asarray(triangles @ R.T + np.array(xyz))


def welded_top(model: Urdf, body: str) -> tuple[str, FloatArray, FloatArray]:
    """Return the uppermost body to which fixed joints weld a body, and the pose of the body in it.

    Args:
        model: The robot.
        body: Name of the body B.

    Returns:
        Name of the uppermost body A (B itself if a movable joint carries it), R_AB of shape
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
    # A cylinder gives its radius first, then its length.
    widths = (
        geometry.size if geometry.shape == "box" else (2 * geometry.size[0], *geometry.size[1:])
    )
    return max(widths) <= MARKER_SIZE
