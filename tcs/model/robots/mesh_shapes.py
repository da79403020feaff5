"""Shapes around a mesh of the user's own: an obstacle, or a tool in the hand."""

from __future__ import annotations

import hashlib
import itertools
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tcs.errors import DataFileError, RobotError
from tcs.files.paths import cache_folder
from tcs.files.quantities import POSITION
from tcs.files.reading import read_bytes
from tcs.model.robots.primitives import Primitive, read_primitives, write_primitives
from tcs.model.robots.urdf.meshes import MAX_BYTES, mesh_triangles

FloatArray = NDArray[np.float64]

PROTRUSION = 0.01
"""Distance by which the shapes around a mesh may protrude unless the file says otherwise [m]."""
MOST_SHAPES = 100
"""Largest number of shapes around a mesh; if they do not suffice, some protrude farther."""
_VERSION = "2"
"""Part of the cache key: increase it when the fit changes."""
_LINES = 200
"""Lines along either side of a mesh by which overlapping parts are measured."""
_DECIMALS = 7
"""Corners that agree to so many decimals are one: exporters write each triangle by itself."""


def shapes_around_mesh(
    file: Path,
    scale: float,
    protrusion: float,
    where: str,
    error: type[DataFileError],
    *,
    closed: bool = True,
) -> tuple[Primitive, ...]:
    """Return boxes and capsules that enclose a mesh and its inside; the user's cache keeps them.

    Of a mesh that is not closed, the surface is enclosed, and what lies behind openings narrower
    than 3 cm.

    Args:
        file: A mesh.
        scale: Metres per unit of the file.
        protrusion: Distance by which they may protrude from it [m].
        where: Name of what it is in messages.
        error: Class of the error to raise.
        closed: Whether a mesh that is not closed is refused.

    Raises:
        DataFileError: As `error`, if the file cannot be used.
    """
    content = read_bytes(file, f"{where}: mesh '{file}'", error, limit=MAX_BYTES)
    triangles = own_mesh(file, scale, where, error)
    single = open_edges(triangles) if closed else 0
    if single:
        raise error(
            f"{where}: mesh '{file}' is not closed: {single:,} of its edges do not join two "
            "triangles, so its inside is unknown. Close it, or give boxes that enclose it."
        )
    key = hashlib.sha256(content)
    key.update(repr((_VERSION, file.suffix.lower(), scale, protrusion, MOST_SHAPES)).encode())
    kept = cache_folder("obstacles") / f"{file.stem}_{key.hexdigest()[:16]}.csv"
    if kept.is_file():
        try:
            return read_primitives(kept)
        except RobotError:
            # Damaged: fitted again.
            pass
    # Imported when a mesh is fitted: nothing else here needs it.
    from tcs_shapes.covering import Target, fit_triangles

    fit = fit_triangles(file.stem, triangles, Target(protrusion, MOST_SHAPES))
    write_primitives(kept, fit.primitives)
    return read_primitives(kept)


def own_mesh(file: Path, scale: float, where: str, error: type[DataFileError]) -> FloatArray:
    """Return the triangles of a mesh [m], shape (n, 3, 3).

    Args:
        file: A mesh.
        scale: Metres per unit of the file; of a Collada file, by which its metres are multiplied.
        where: Name of what it is in messages.
        error: Class of the error to raise.

    Raises:
        DataFileError: As `error`, if it cannot be read, or leaves the scene.
    """
    try:
        triangles = np.asarray(mesh_triangles(file)) * scale
    except RobotError as fault:
        raise error(f"{where}: {fault}") from None
    check_positions(triangles, f"{where}: mesh '{file}'", error)
    return triangles


def enclosed_volume(triangles: FloatArray) -> float:
    """Return the volume that a closed mesh encloses, overlaps of its parts counted once [m^3].

    Parts that overlap are measured along a grid of lines, to about a per cent.

    Args:
        triangles: Corners [m], shape (n, 3, 3).
    """
    faces = _corner_numbers(triangles)
    count = int(faces.max()) + 1
    ends = np.repeat(faces[:, 0], 2), faces[:, 1:].ravel()
    links = coo_array((np.ones(len(ends[0])), ends), shape=(count, count))
    _, part_of_corner = connected_components(links, directed=False)
    part = part_of_corner[faces[:, 0]]
    parts = [triangles[part == k] for k in range(int(part.max()) + 1)]
    parts = [p for p in parts if len(p)]
    boxes = np.array([(p.min(axis=(0, 1)), p.max(axis=(0, 1))) for p in parts])
    apart = all(
        ((boxes[:i, 0] >= boxes[i, 1]) | (boxes[:i, 1] <= boxes[i, 0])).any(axis=1).all()
        for i in range(len(parts))
    )
    if apart:
        return sum(abs(_signed_volume(p)) for p in parts)
    return _volume_along_lines(triangles, part)


def _signed_volume(triangles: FloatArray) -> float:
    """Return the volume within a surface [m^3], negative if it is turned inside out."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    return float(np.einsum("ni,ni->n", a, np.cross(b, c)).sum()) / 6.0


def _volume_along_lines(triangles: FloatArray, part: NDArray[np.int32]) -> float:
    """Return the volume that is in any part of a mesh [m^3], summed over lines along z."""
    low, high = triangles[..., :2].min(axis=(0, 1)), triangles[..., :2].max(axis=(0, 1))
    pitch = (high - low) / _LINES
    # In units of the grid, whose lines hit no corner of a box.
    a, b, c = np.moveaxis((triangles[..., :2] - low) / pitch - 0.5123, 1, 0)
    corners = np.stack([a, b, c])
    first = np.ceil(corners.min(axis=0)).astype(np.int64).clip(0, _LINES - 1)
    last = np.floor(corners.max(axis=0)).astype(np.int64).clip(-1, _LINES - 1)
    size = np.maximum(last - first + 1, 0)
    many = size.prod(axis=1)
    of = np.repeat(np.arange(len(triangles)), many)
    k = np.arange(len(of)) - np.repeat(np.cumsum(many) - many, many)
    line = first[of] + np.stack(
        [k // np.maximum(size[of, 1], 1), k % np.maximum(size[of, 1], 1)], 1
    )
    ab, ac, ap = (b - a)[of], (c - a)[of], line - a[of]
    area = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        u = (ap[:, 0] * ac[:, 1] - ap[:, 1] * ac[:, 0]) / area
        v = (ab[:, 0] * ap[:, 1] - ab[:, 1] * ap[:, 0]) / area
    hit = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0)
    of, line, area, u, v = of[hit], line[hit], area[hit], u[hit], v[hit]
    z = triangles[of, 0, 2] + u * (triangles[of, 1, 2] - triangles[of, 0, 2])
    z += v * (triangles[of, 2, 2] - triangles[of, 0, 2])
    order = np.lexsort((z, line[:, 0] * _LINES + line[:, 1]))
    length, at, depth = 0.0, -1, dict[int, int]()
    cells, ways = line[:, 0] * _LINES + line[:, 1], np.sign(area).astype(int)
    for i, j in itertools.pairwise(order.tolist()):
        if cells[i] != at:
            at, depth = int(cells[i]), {}
        depth[int(part[of[i]])] = depth.get(int(part[of[i]]), 0) + int(ways[i])
        if cells[j] == at and any(depth.values()):
            length += float(z[j] - z[i])
    return length * float(pitch.prod())


def check_positions(points: FloatArray, where: str, error: type[DataFileError]) -> None:
    """Refuse coordinates that are not positions in a scene.

    Raises:
        DataFileError: As `error`.
    """
    extremes = float(points.min()), float(points.max())
    POSITION.check(extremes, f"{where}: a coordinate", error)


def open_edges(triangles: FloatArray) -> int:
    """Return how many edges do not join as many triangles in either direction.

    Args:
        triangles: Corners [m], shape (n, 3, 3).
    """
    faces = _corner_numbers(triangles)
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    ways = np.where(edges[:, 0] < edges[:, 1], 1, -1)
    _, of = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    balance = np.bincount(of.ravel(), weights=ways)
    return int(np.count_nonzero(balance))


def _corner_numbers(triangles: FloatArray) -> NDArray[np.int64]:
    """Return the numbers of the corners of triangles, equal where they agree, shape (n, 3)."""
    corners = np.round(triangles.reshape(-1, 3), _DECIMALS) + 0.0
    _, index = np.unique(corners, axis=0, return_inverse=True)
    return np.asarray(index.reshape(-1, 3))
