"""Shapes of bodies in Meshcat: the meshes of the robot, or its collision shapes."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.colors import to_rgb
from numpy.typing import NDArray
from pydrake.geometry import Box, Mesh, Meshcat, Rgba, Role, Shape
from pydrake.math import RigidTransform
from pydrake.multibody.tree import BodyIndex
from scipy.spatial import ConvexHull

from tcs.model.robots.urdf.meshes import mesh_triangles
from tcs.model.scene import Scene
from tcs.model.scene.contacts import Group
from tcs.output.draw import Category

FloatArray = NDArray[np.float64]
TriangleMesh = tuple[FloatArray, NDArray[np.int32]]
"""Corners [m], shape (3, n), and triangles, shape (3, m)."""

_GREY = Rgba(0.75, 0.77, 0.8, 1.0)
"""Colour of meshes without a colour in the URDF."""
ARM_COLOUR = "#a3adb8"
"""Colour of the scored arm: neutral, for the colours of the arrows say what is reached."""

_ROUNDED = 0.7
"""Radius of the edges of a rounded box, as a fraction of its least half size."""
_DIRECTIONS = 12
"""Directions around an edge of a rounded box."""
_SIGNS = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
"""Corners of a cube, shape (8, 3)."""
_SIDES = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]], np.int32
)
"""Corners of its sides, counter-clockwise from outside, shape (6, 4)."""

_LIGHTS = {
    "SpotLight": 0.0,
    "PointLightNegativeX": 6.0,
    "PointLightPositiveX": 6.0,
    "AmbientLight": 0.9,
    "FillLight": 0.4,
}
"""Strengths of Meshcat's lights: under the default ones colours fade to white."""


@dataclass(frozen=True, eq=False)
class BodyShape:
    """One shape of a body."""

    body: BodyIndex
    shape: Shape
    X_LS: RigidTransform
    """Its pose in the body's frame L."""
    colour: Rgba
    is_rounded: bool = False
    """Whether a box is drawn with round edges, as parts of a person are."""


def robot_shapes(scene: Scene, meshes: bool) -> list[BodyShape]:
    """Return the shapes that the robot is shown as.

    Bodies without a mesh, such as a custom tool, are shown as their collision shapes.
    """
    inspector = scene.built.scene_graph.model_inspector()
    plant = scene.built.plant
    parts = [part for part in scene.built.parts if part.group is not Group.ENVIRONMENT]
    instances = {plant.get_body(part.body).model_instance() for part in parts}
    shapes = []
    for geometry in inspector.GetAllGeometryIds(Role.kIllustration) if meshes else ():
        body = plant.GetBodyFromFrameId(inspector.GetFrameId(geometry))
        if body.model_instance() in instances:
            properties = inspector.GetIllustrationProperties(geometry)
            colour = properties.GetPropertyOrDefault("phong", "diffuse", _GREY)
            shape, X_LS = inspector.GetShape(geometry), inspector.GetPoseInFrame(geometry)
            shapes.append(BodyShape(body.index(), shape, X_LS, colour))
    drawn = {one.body for one in shapes}
    colourings = {Group.ARM: ARM_COLOUR, Group.BODY: Category.ROBOT.colour}
    for part in parts:
        if part.body not in drawn:
            shape, X_LS = inspector.GetShape(part.geometry), inspector.GetPoseInFrame(part.geometry)
            shapes.append(BodyShape(part.body, shape, X_LS, rgba(colourings[part.group])))
    return shapes


def draw_shapes(
    meshcat: Meshcat, root: str, shapes: Sequence[BodyShape], *, compact: bool = False
) -> None:
    """Add the shapes of bodies to Meshcat, each body under its own path.

    The boxes of one body and colour are sent as one mesh, which takes a fifth of the bytes that
    they take one by one, and is drawn at once. Round shapes are sent as what they are: triangles as
    smooth would take more bytes, and would be flat.

    Args:
        meshcat: The Meshcat, which rounds the corners of meshes to single precision.
        root: Path above the bodies.
        shapes: Their shapes.
        compact: Whether meshes are sent as bare triangles, a fifth of the size of their files,
            which take seconds to read.
    """
    numbers = itertools.count()
    surfaces: dict[tuple[BodyIndex, tuple[float, ...]], list[TriangleMesh]] = {}
    for one in shapes:
        surface = _surface(one, compact=compact)
        if surface is not None:
            surfaces.setdefault((one.body, _channels(one.colour)), []).append(surface)
            continue
        path = f"{root}/{int(one.body)}/{next(numbers)}"
        meshcat.SetObject(path, one.shape, one.colour)
        meshcat.SetTransform(path, one.X_LS)
    for (body, channels), parts in surfaces.items():
        path = f"{root}/{int(body)}/{next(numbers)}"
        meshcat.SetTriangleMesh(path, *joined(parts), Rgba(*channels))


def sharp_box(size: FloatArray) -> TriangleMesh:
    """Return corners [m], shape (3, 8), and triangles, shape (3, 12), of a box.

    Args:
        size: Lengths of the edges [m], shape (3,).
    """
    corners = 0.5 * np.asarray(size, dtype=np.float64) * _SIGNS
    faces = np.concatenate([_SIDES[:, [0, 1, 2]], _SIDES[:, [0, 2, 3]]])
    return np.asfortranarray(corners.T), np.asfortranarray(faces.T)


def joined(surfaces: Sequence[TriangleMesh]) -> TriangleMesh:
    """Return surfaces as one."""
    firsts = np.cumsum([0, *(corners.shape[1] for corners, _ in surfaces[:-1])], dtype=np.int32)
    faces = [faces + first for (_, faces), first in zip(surfaces, firsts, strict=True)]
    corners = np.concatenate([corners for corners, _ in surfaces], axis=1)
    return np.asfortranarray(corners), np.asfortranarray(np.concatenate(faces, axis=1))


def rounded_box(size: FloatArray) -> TriangleMesh:
    """Return corners [m], shape (3, n), and triangles, shape (3, m), of a box with round edges.

    It is within the box, and touches the middles of its faces.

    Args:
        size: Lengths of the edges [m], shape (3,).
    """
    half = 0.5 * np.asarray(size, dtype=np.float64)
    radius = _ROUNDED * float(half.min())
    angles = np.linspace(0.0, 0.5 * np.pi, _DIRECTIONS // 4 + 1)
    up, around = (grid.ravel() for grid in np.meshgrid(angles, angles))
    octant = np.stack(
        [np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)], axis=1
    )
    corners = np.concatenate([sign * (half - radius + radius * octant) for sign in _SIGNS])
    corners = np.unique(np.round(corners, 9), axis=0)
    hull = ConvexHull(corners)
    faces = hull.simplices.copy()
    # Triangles of the hull have no order; their normals point outward.
    a, b, c = (corners[faces[:, i]] for i in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0.0
    faces[inward] = faces[inward][:, ::-1]
    return np.ascontiguousarray(corners.T), np.ascontiguousarray(faces.T.astype(np.int32))


def draw_ground(meshcat: Meshcat) -> None:
    """Add a plain floor with even light."""
    meshcat.SetProperty("/Grid", "visible", False)
    meshcat.SetProperty("/Axes", "visible", False)
    for light, strength in _LIGHTS.items():
        meshcat.SetProperty(f"/Lights/{light}/<object>", "intensity", strength)
    meshcat.SetObject("ground", Box(6.0, 6.0, 0.01), Rgba(0.93, 0.93, 0.91, 1.0))
    meshcat.SetTransform("ground", RigidTransform([0.0, 0.0, -0.006]))


def rgba(colour: str) -> Rgba:
    """Return an opaque colour from a matplotlib colour name or hexadecimal digits."""
    return Rgba(*to_rgb(colour), 1.0)


def _surface(one: BodyShape, *, compact: bool) -> TriangleMesh | None:
    """Return the surface of a shape in its body's frame; None of one that is sent as it is."""
    if isinstance(one.shape, Box):
        box = rounded_box if one.is_rounded else sharp_box
        corners, faces = box(one.shape.size())
    elif compact and isinstance(one.shape, Mesh):
        corners, faces = _triangles(one.shape)
    else:
        return None
    return one.X_LS.multiply(corners), faces


def _channels(colour: Rgba) -> tuple[float, ...]:
    """Return red, green, blue and opacity of a colour, which can be compared."""
    return colour.r(), colour.g(), colour.b(), colour.a()


def _triangles(mesh: Mesh) -> TriangleMesh:
    """Return corners [m], shape (3, n), and triangles, shape (3, m), of a mesh."""
    found = mesh_triangles(Path(mesh.source().path()))
    # Files repeat a corner for each of its triangles; Meshcat keeps it in single precision.
    single = found.reshape(-1, 3).astype(np.float32)
    corners, at = np.unique(single, axis=0, return_inverse=True)
    scaled = corners.astype(np.float64) * mesh.scale3()
    faces = at.reshape(-1, 3).astype(np.int32)
    return np.asfortranarray(scaled.T), np.asfortranarray(faces.T)
