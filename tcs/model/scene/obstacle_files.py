"""Meshes and point clouds that obstacles are read from."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import EnvironmentFileError, RobotError
from tcs.files.quantities import POSITION
from tcs.files.reading import read_bytes
from tcs.model.robots.urdf.meshes import MAX_BYTES, mesh_triangles

FloatArray = NDArray[np.float64]

LEAST_POINTS = 10
"""Fewest points of a cloud that count as an obstacle."""
MOST_POINTS = 5_000_000
_DECIMALS = 7
"""Corners that agree to so many decimals are one: exporters write each triangle by itself."""


def closed_mesh(file: Path, scale: float, where: str) -> FloatArray:
    """Return the triangles of a closed mesh [m], shape (n, 3, 3).

    Args:
        file: An OBJ, STL or glTF file.
        scale: Metres per unit of the file.
        where: Name of the obstacle in messages.

    Raises:
        EnvironmentFileError: If it cannot be read, is not closed, or leaves the scene.
    """
    try:
        triangles = np.asarray(mesh_triangles(file)) * scale
    except RobotError as error:
        raise EnvironmentFileError(f"{where}: {error}") from None
    _check_positions(triangles, f"{where}: mesh '{file}'")
    single = _open_edges(triangles)
    if single:
        raise EnvironmentFileError(
            f"{where}: mesh '{file}' is not closed: {single:,} of its edges do not join two "
            "triangles, so its inside is unknown. Close it, or give boxes that enclose it."
        )
    return triangles


def cloud_points(file: Path, scale: float, where: str) -> FloatArray:
    """Return the points of a cloud [m], shape (n, 3).

    Args:
        file: A NumPy array of shape (n, 3 or more), or a PLY file, whose faces are ignored.
        scale: Metres per unit of the file.
        where: Name of the obstacle in messages.

    Raises:
        EnvironmentFileError: If it cannot be read, or has too few points or other numbers.
    """
    here = f"{where}: point cloud '{file}'"
    content = read_bytes(file, here, EnvironmentFileError, limit=MAX_BYTES)
    try:
        if file.suffix.lower() == ".npy":
            read: Any = np.load(io.BytesIO(content), allow_pickle=False)
        else:
            import trimesh

            loaded: Any = trimesh.load(io.BytesIO(content), file_type="ply", process=False)
            read = loaded.vertices
        points = np.asarray(read, dtype=np.float64)
    except Exception as error:  # readers raise errors of many classes
        text = " ".join(str(error).split()) or type(error).__name__
        raise EnvironmentFileError(f"{here} cannot be used: {text}.") from None
    if points.ndim != 2 or points.shape[1] < 3:
        raise EnvironmentFileError(
            f"{here} has the shape {points.shape}, but must have x, y, z in each row: (n, 3)."
        )
    if not LEAST_POINTS <= len(points) <= MOST_POINTS:
        raise EnvironmentFileError(
            f"{here} has {len(points):,} point(s), but must have {LEAST_POINTS} to "
            f"{MOST_POINTS:,}. Give single objects as 'box' or 'sphere'."
        )
    points = points[:, :3] * scale
    _check_positions(points, here)
    return points


def _check_positions(points: FloatArray, where: str) -> None:
    """Refuse coordinates that are not positions in a scene."""
    extremes = float(points.min()), float(points.max())
    POSITION.check(extremes, f"{where}: a coordinate", EnvironmentFileError)


def _open_edges(triangles: FloatArray) -> int:
    """Return how many edges do not join as many triangles in either direction."""
    corners = np.round(triangles.reshape(-1, 3), _DECIMALS) + 0.0
    _, index = np.unique(corners, axis=0, return_inverse=True)
    faces = index.reshape(-1, 3)
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    ways = np.where(edges[:, 0] < edges[:, 1], 1, -1)
    _, of = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    balance = np.bincount(of.ravel(), weights=ways)
    return int(np.count_nonzero(balance))
