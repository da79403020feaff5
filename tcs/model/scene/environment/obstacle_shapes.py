"""Boxes, capsules and spheres of an obstacle of the user's own.

The kernel and Drake compare these only, so a cylinder, a mesh and a point cloud become shapes that
enclose them.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tcs.errors import EnvironmentFileError
from tcs.model.robots.mesh_shapes import (
    PROTRUSION,
    enclosed_volume,
    open_edges,
    own_mesh,
    shapes_around_mesh,
)
from tcs.model.robots.primitives import Primitive
from tcs.model.scene.environment.environment_file import Obstacle
from tcs.model.scene.environment.obstacle_files import cloud_points

FloatArray = NDArray[np.float64]

CELL = 0.03
"""Edge of the cells of a point cloud unless the file says otherwise [m]."""
_SIDES = 6
"""Boxes of a cylinder: its circumscribed prism has twice as many sides."""
_NO_ROTATION = (1.0, 0.0, 0.0, 0.0)


def obstacle_shapes(obstacle: Obstacle, where: str) -> tuple[Primitive, ...]:
    """Return the shapes of an obstacle in its own frame, none for a model file.

    - A cylinder becomes boxes that together are the prism of twelve sides around it, which has 2 %
      more volume.
    - A mesh becomes boxes and capsules that enclose every triangle, and the inside of a closed one.
    - Of a point cloud, every cell of a grid with a point in it is solid; the boxes are those cells,
      joined.

    Args:
        obstacle: The obstacle.
        where: Its name in messages.

    Raises:
        EnvironmentFileError: If its file cannot be used.
    """
    if obstacle.box is not None:
        return (_primitive("box", obstacle.box),)
    if obstacle.sphere is not None:
        return (_primitive("sphere", (obstacle.sphere,)),)
    if obstacle.capsule is not None:
        return (_primitive("capsule", obstacle.capsule),)
    if obstacle.cylinder is not None:
        return _prism(*obstacle.cylinder)
    file, scale = Path(str(obstacle.file)), obstacle.scale or 1.0
    if obstacle.type == "mesh":
        if obstacle.cell is not None:
            raise EnvironmentFileError(
                f"{where}: '{file.name}' has faces, so it is a mesh, and 'cell' is for point "
                "clouds. Remove 'cell', or save the points alone."
            )
        protrusion = obstacle.protrusion or PROTRUSION
        return shapes_around_mesh(
            file, scale, protrusion, where, EnvironmentFileError, closed=False
        )
    if obstacle.type == "cloud":
        if obstacle.protrusion is not None:
            raise EnvironmentFileError(
                f"{where}: '{file.name}' has no faces, so it is a point cloud, and 'protrusion' "
                "is for meshes. Remove it."
            )
        # Imported when there is a cloud: nothing else here needs it.
        from tcs_shapes.solids import boxes_of_cells

        points = cloud_points(file, scale, where)
        cell = obstacle.cell or CELL
        return tuple(
            _primitive("box", tuple(high - low), tuple((low + high) / 2))
            for low, high in boxes_of_cells(points, cell)
        )
    return ()


def solid_volume(obstacle: Obstacle, where: str) -> float | None:
    """Return the volume of an obstacle itself [m^3].

    It is None for a model, a point cloud and a mesh that is not closed.

    Raises:
        EnvironmentFileError: If its file cannot be used.
    """
    if obstacle.type == "mesh":
        triangles = _triangles(obstacle, where)
        return None if open_edges(triangles) else enclosed_volume(triangles)
    if obstacle.cylinder is not None:
        radius, length = obstacle.cylinder
        return math.pi * radius**2 * length
    if obstacle.type in ("model", "cloud"):
        return None
    return sum(shape.volume for shape in obstacle_shapes(obstacle, where))


def open_surface(obstacle: Obstacle, where: str) -> tuple[int, float] | None:
    """Return the open edges and the area [m^2] of a mesh that is not closed, None for all else.

    Raises:
        EnvironmentFileError: If its file cannot be used.
    """
    if obstacle.type != "mesh":
        return None
    triangles = _triangles(obstacle, where)
    edges = open_edges(triangles)
    a, b, c = np.moveaxis(triangles, 1, 0)
    area = float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 2.0
    return (edges, area) if edges else None


def _triangles(obstacle: Obstacle, where: str) -> FloatArray:
    scale = obstacle.scale or 1.0
    return own_mesh(Path(str(obstacle.file)), scale, where, EnvironmentFileError)


def _primitive(
    kind: str,
    size: tuple[float, ...],
    xyz: tuple[float, ...] = (0.0, 0.0, 0.0),
    quaternion: tuple[float, float, float, float] = _NO_ROTATION,
) -> Primitive:
    x, y, z = (float(v) for v in xyz)
    return Primitive(
        body="",
        kind=kind,  # type: ignore[arg-type]  # checked by Primitive
        size=tuple(float(s) for s in size),
        xyz=(x, y, z),
        quaternion=quaternion,
    )


def _prism(radius: float, length: float) -> tuple[Primitive, ...]:
    """Return boxes whose union is the prism of 2 `_SIDES` sides around a cylinder."""
    width = 2.0 * radius * math.tan(math.pi / (2 * _SIDES))
    found = []
    for k in range(_SIDES):
        half = math.pi * k / (2 * _SIDES)
        quaternion = (math.cos(half), 0.0, 0.0, math.sin(half))
        found.append(_primitive("box", (2.0 * radius, width, length), quaternion=quaternion))
    return tuple(found)
