"""Shapes around a closed mesh of the user's own: an obstacle, or a tool in the hand."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tcs.errors import DataFileError, RobotError
from tcs.files.paths import cache_folder
from tcs.files.quantities import POSITION
from tcs.files.reading import read_bytes
from tcs.model.robots.fitting import Target
from tcs.model.robots.fitting.covering import fit_triangles
from tcs.model.robots.primitives import Primitive, read_primitives, write_primitives
from tcs.model.robots.urdf.meshes import MAX_BYTES, mesh_triangles

FloatArray = NDArray[np.float64]

PROTRUSION = 0.01
"""Distance by which the shapes around a mesh may protrude unless the file says otherwise [m]."""
MOST_SHAPES = 100
"""Largest number of shapes around a mesh; if they do not suffice, some protrude farther."""
_VERSION = "2"
"""Part of the cache key: increase it when the fit changes."""
_DECIMALS = 7
"""Corners that agree to so many decimals are one: exporters write each triangle by itself."""


def shapes_around_mesh(
    file: Path, scale: float, protrusion: float, where: str, error: type[DataFileError]
) -> tuple[Primitive, ...]:
    """Return boxes and capsules that enclose a mesh and its inside; the user's cache keeps them.

    Args:
        file: An OBJ, STL or glTF file.
        scale: Metres per unit of the file.
        protrusion: Distance by which they may protrude from it [m].
        where: Name of what it is in messages.
        error: Class of the error to raise.

    Raises:
        DataFileError: As `error`, if the file cannot be used.
    """
    content = read_bytes(file, f"{where}: mesh '{file}'", error, limit=MAX_BYTES)
    triangles = closed_mesh(file, scale, where, error)
    key = hashlib.sha256(content)
    key.update(repr((_VERSION, file.suffix.lower(), scale, protrusion, MOST_SHAPES)).encode())
    kept = cache_folder("obstacles") / f"{file.stem}_{key.hexdigest()[:16]}.csv"
    if kept.is_file():
        try:
            return read_primitives(kept)
        except RobotError:
            # Damaged: fitted again.
            pass
    fit = fit_triangles(file.stem, triangles, Target(protrusion, MOST_SHAPES))
    write_primitives(kept, fit.primitives)
    return read_primitives(kept)


def closed_mesh(file: Path, scale: float, where: str, error: type[DataFileError]) -> FloatArray:
    """Return the triangles of a closed mesh [m], shape (n, 3, 3).

    Args:
        file: An OBJ, STL or glTF file.
        scale: Metres per unit of the file.
        where: Name of what it is in messages.
        error: Class of the error to raise.

    Raises:
        DataFileError: As `error`, if it cannot be read, is not closed, or leaves the scene.
    """
    try:
        triangles = np.asarray(mesh_triangles(file)) * scale
    except RobotError as fault:
        raise error(f"{where}: {fault}") from None
    check_positions(triangles, f"{where}: mesh '{file}'", error)
    single = _open_edges(triangles)
    if single:
        raise error(
            f"{where}: mesh '{file}' is not closed: {single:,} of its edges do not join two "
            "triangles, so its inside is unknown. Close it, or give boxes that enclose it."
        )
    return triangles


def check_positions(points: FloatArray, where: str, error: type[DataFileError]) -> None:
    """Refuse coordinates that are not positions in a scene.

    Raises:
        DataFileError: As `error`.
    """
    extremes = float(points.min()), float(points.max())
    POSITION.check(extremes, f"{where}: a coordinate", error)


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
