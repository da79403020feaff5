"""What bodies look like in Meshcat: the robot as its meshes, or as its collision shapes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.colors import to_rgb
from numpy.typing import NDArray
from pydrake.geometry import Box, Mesh, Meshcat, Rgba, Role, Shape
from pydrake.math import RigidTransform
from pydrake.multibody.tree import BodyIndex

from tcs.model.robots.urdf.meshes import mesh_triangles
from tcs.model.scene import Scene
from tcs.model.scene.contacts import Group
from tcs.output.draw import Category

FloatArray = NDArray[np.float64]
_GREY = Rgba(0.75, 0.77, 0.8, 1.0)
"""Of meshes that the URDF gives no colour."""

_LIGHTS = {
    "SpotLight": 0.0,
    "PointLightNegativeX": 6.0,
    "PointLightPositiveX": 6.0,
    "AmbientLight": 0.9,
    "FillLight": 0.4,
}
"""Strengths of Meshcat's lights: under its own ones colours fade to white."""


@dataclass(frozen=True, eq=False)
class Drawn:
    """One shape of a body."""

    body: BodyIndex
    shape: Shape
    X_LS: RigidTransform
    """Its pose in the body's frame L."""
    colour: Rgba


def robot_shapes(scene: Scene, meshes: bool) -> list[Drawn]:
    """Return what the robot is shown as.

    Bodies that have no mesh, such as a tool of our own, show their collision shapes.
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
            shapes.append(Drawn(body.index(), shape, X_LS, colour))
    drawn = {one.body for one in shapes}
    colourings = {Group.ARM: Category.ARM, Group.BODY: Category.ROBOT}
    for part in parts:
        if part.body not in drawn:
            shape, X_LS = inspector.GetShape(part.geometry), inspector.GetPoseInFrame(part.geometry)
            shapes.append(Drawn(part.body, shape, X_LS, rgba(colourings[part.group].colour)))
    return shapes


def draw_shapes(
    meshcat: Meshcat, root: str, shapes: Sequence[Drawn], *, compact: bool = False
) -> None:
    """Give Meshcat the shapes of bodies, each body a path of its own that can be moved.

    Args:
        meshcat: Where to.
        root: Path above the bodies.
        shapes: Their shapes.
        compact: Whether meshes are handed over as bare triangles, which take a fifth of the room
            of their files, but seconds to read.
    """
    for number, one in enumerate(shapes):
        path = f"{root}/{int(one.body)}/{number}"
        if compact and isinstance(one.shape, Mesh):
            corners, faces = _triangles(one.shape)
            meshcat.SetTriangleMesh(path, corners, faces, one.colour)
        else:
            meshcat.SetObject(path, one.shape, one.colour)
        meshcat.SetTransform(path, one.X_LS)


def draw_ground(meshcat: Meshcat) -> None:
    """Lay a plain floor, and light it evenly."""
    meshcat.SetProperty("/Grid", "visible", False)
    meshcat.SetProperty("/Axes", "visible", False)
    for light, strength in _LIGHTS.items():
        meshcat.SetProperty(f"/Lights/{light}/<object>", "intensity", strength)
    meshcat.SetObject("ground", Box(6.0, 6.0, 0.01), Rgba(0.93, 0.93, 0.91, 1.0))
    meshcat.SetTransform("ground", RigidTransform([0.0, 0.0, -0.006]))


def rgba(colour: str) -> Rgba:
    """Return a colour that matplotlib knows by its name or its hexadecimal digits, opaque."""
    return Rgba(*to_rgb(colour), 1.0)


def _triangles(mesh: Mesh) -> tuple[FloatArray, NDArray[np.int32]]:
    """Return corners [m], shape (3, n), and triangles, shape (3, m), of a mesh."""
    found = mesh_triangles(Path(mesh.source().path()))
    # Files repeat a corner for each of its triangles; Meshcat keeps it in single precision.
    single = found.reshape(-1, 3).astype(np.float32)
    corners, at = np.unique(single, axis=0, return_inverse=True)
    scaled = corners.astype(np.float64) * mesh.scale3()
    faces = at.reshape(-1, 3).astype(np.int32)
    return np.asfortranarray(scaled.T), np.asfortranarray(faces.T)
