"""Distances of the surfaces of two bodies of a robot, over the two joints between them.

Shapes enclose the surface of a link, and are fatter than it. Where at most two joints decide the
relative pose of two bodies, a table holds how far apart their surfaces are at least: a pair is in
contact where its shapes touch and the table does not show that its surfaces are apart.

In: a robot file and its meshes. Out: tables, kept in a file beside the primitives (`read_tables`,
`write_tables`); those that hold for the meshes at hand (`tables_in_force`); and the distance of two
surfaces at one posture by other means (`surface_distance`), which judges the tables.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import logging
import math
import zipfile
import zlib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from tcs.errors import RobotError
from tcs.files.unchanged import kept_while_unchanged
from tcs.files.writing import whole_file
from tcs.model.robots.extras import model_with_extras
from tcs.model.robots.robot_file import RobotFile
from tcs.model.robots.urdf import Joint, Urdf
from tcs.model.robots.urdf.surfaces import (
    geometry_triangles,
    place,
    surface_geometries,
    welded_top,
)

UNIT = 4e-5
"""Distance that one step of a corner stands for [m]."""
FARTHEST = 255 * UNIT
"""The farthest that a corner can hold [m], 10.2 mm."""
NOTHING = -1.0
"""Bound where none is known [m]: no distance is less."""
MOST_CORNERS = 1 << 24
"""Most corners of one table."""
_HEADER = "header"
FloatArray = NDArray[np.float64]
_LOG = logging.getLogger(__name__)

_CHUNK = 200_000
"""Pairs of triangles compared at once."""


@dataclass(frozen=True, kw_only=True, eq=False)
class DistanceTable:
    """Lower bounds of the distance of two surfaces.

    A full turn of either joint is divided into equal cells. A corner of a cell holds the distance
    there, rounded down. In between, the square of the distance is at least what is interpolated,
    less what its curvature can take away: see `bound`.

    Attributes:
        pair: Names of the two bodies, the one nearer to the base first.
        joints: The joint nearer to the base and the one nearer to the tool; the same name twice if
            there is only one between the bodies.
        reach: For each joint, how far from its axis any point of one of the bodies can be, of the
            body for which that is less [m].
        corners: Distances at the corners of the cells in `UNIT`, 0 where nothing is known, shape
            (cells of the first joint, cells of the second): a full turn ends where it begins.
        source: Digest of the meshes and of the joints, from `source_digest`.
    """

    pair: tuple[str, str]
    joints: tuple[str, str]
    reach: tuple[float, float]
    corners: NDArray[np.uint8]
    source: str

    def bound(self, positions: Mapping[str, float], rounding: float = 0.0) -> float:
        """Return a lower bound of the distance of the surfaces [m], `NOTHING` where none is known.

        As one joint turns by an angle x, the square of the distance of two points is
        `c - 2 r s cos(x - x0)`, with r and s their distances from its axis. Its second derivative
        is at most `2 r s`. Points closer than `FARTHEST` have `|r - s| <= FARTHEST`, and one of r
        and s is at most the reach R: `r s <= R (R + FARTHEST)`. The least of such functions, and of
        the square of `FARTHEST`, is nowhere below the chord between two angles h apart by more than
        `R (R + FARTHEST) h^2 t (1 - t)`, t the fraction of the way: less the parabola of that
        curvature each is concave, and so is the least of them. This holds for one joint after the
        other.

        Args:
            positions: Positions of the joints [rad].
            rounding: What rounding may have changed of them [rad]: the bound is the greatest of
                those nearby.
        """
        if rounding:
            first, second = self.joints
            nearby = itertools.product((-rounding, rounding), repeat=2)
            moved = (
                {first: positions[first] + a, second: positions[second] + b} for a, b in nearby
            )
            return max(self.bound(each) for each in moved)
        places, lost = [], 0.0
        for name, reach, count in zip(self.joints, self.reach, self.corners.shape, strict=True):
            step = 2.0 * math.pi / count
            turned = positions[name] % (2.0 * math.pi)
            cell = min(int(turned / step), count - 1)
            way = turned / step - cell
            lost += reach * (reach + FARTHEST) * step**2 * way * (1.0 - way)
            places.append(((cell, 1.0 - way), ((cell + 1) % count, way)))
        square = sum(
            u * v * (float(self.corners[i, j]) * UNIT) ** 2
            for (i, u), (j, v) in itertools.product(*places)
        )
        return math.sqrt(square - lost) if square > lost else NOTHING


def write_tables(path: Path, tables: Sequence[DistanceTable], source: str) -> None:
    """Write tables to a file.

    Args:
        path: The file, `.npz`.
        tables: The tables.
        source: Where the meshes are from, with their version, and how the tables were made.

    Raises:
        OutputError: If the file cannot be written.
    """
    described = [
        {"pair": t.pair, "joints": t.joints, "reach": t.reach, "source": t.source} for t in tables
    ]
    header = json.dumps({"source": source, "tables": described})
    arrays: dict[str, Any] = {f"corners_{n}": t.corners for n, t in enumerate(tables)}
    arrays[_HEADER] = np.frombuffer(header.encode(), np.uint8)
    with whole_file(path, "tables of distances") as stream:
        np.savez_compressed(stream, **arrays)


@kept_while_unchanged(files=16)
def read_tables(path: Path) -> tuple[DistanceTable, ...]:
    """Return the tables of a file.

    Raises:
        RobotError: If it is no such file, or damaged.
    """
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as arrays:
            header = json.loads(bytes(arrays[_HEADER]))
            return tuple(
                _table(fields, arrays[f"corners_{n}"]) for n, fields in enumerate(header["tables"])
            )
    except OSError as error:
        raise RobotError(f"tables of distances '{path}': {error}.") from error
    except (ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise RobotError(
            f"'{path}' is no file of distances, damaged, or of an earlier version. Restore or "
            "measure it again, or remove the field 'distances' of the robot file: shapes alone "
            "decide then."
        ) from error


def _table(fields: dict[str, Any], corners: Any) -> DistanceTable:
    """Return a table from its description and its corners.

    Raises:
        ValueError: If they are none.
    """
    if corners.dtype != np.uint8 or corners.ndim != 2 or not 0 < corners.size <= MOST_CORNERS:
        raise ValueError("corners")
    pair, joints, reach = (tuple(fields[name]) for name in ("pair", "joints", "reach"))
    # Of a reach below 0, or that is not a number, nothing follows.
    if not (len(pair) == len(joints) == len(reach) == 2 and all(r >= 0.0 for r in reach)):
        raise ValueError("fields")
    corners.flags.writeable = False
    return DistanceTable(
        pair=(str(pair[0]), str(pair[1])),
        joints=(str(joints[0]), str(joints[1])),
        reach=(float(reach[0]), float(reach[1])),
        corners=corners,
        source=str(fields["source"]),
    )


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


def tables_in_force(robot: RobotFile) -> tuple[DistanceTable, ...]:
    """Return the tables of a robot's file that were made from the meshes and joints at hand.

    Of pairs that the others describe, shapes alone decide, and one warning says so; of pairs that
    need no check, nothing is returned.

    Raises:
        RobotError: If the file of the tables cannot be read.
    """
    if robot.distances is None:
        return ()
    off = {frozenset(pair) for pair in robot.disabled_pairs}
    # A file may hold tables of both arms of a robot.
    tables = [
        table
        for table in read_tables(Path(robot.distances))
        if frozenset(table.pair) not in off and set(table.joints) <= set(robot.arm_joints)
    ]
    kept = [table for table in tables if _holds(robot, table)]
    others = [" / ".join(table.pair) for table in tables if table not in kept]
    if others:
        _warn_once(robot.name, robot.distances, ", ".join(others))
    return tuple(kept)


@lru_cache(maxsize=64)
def _warn_once(robot: str, file: str, pairs: str) -> None:
    """Say of which pairs the tables do not hold, once."""
    _LOG.warning(
        "Robot '%s': other meshes or joints than those of its tables of distances, '%s': the "
        "shapes alone decide on contact of %s.",
        robot,
        file,
        pairs,
    )


def _holds(robot: RobotFile, table: DistanceTable) -> bool:
    """Return whether a table was made from the meshes and joints at hand."""
    try:
        return source_digest(robot, table.pair) == table.source
    except RobotError:
        return False


def surface_distance(first: FloatArray, second: FloatArray, farthest: float) -> float:
    """Return the distance of two surfaces [m], 0 where they cross, at most `farthest`.

    It is 0 too where one is within the convex hull of the other: triangles of a body inside another
    one are apart.

    Args:
        first: Triangles [m], shape (n, 3, 3).
        second: Triangles in the same frame [m], shape (m, 3, 3).
        farthest: Distance beyond which nothing is compared [m].
    """
    if _is_within(first, second) or _is_within(second, first):
        return 0.0
    for _ in range(2):
        first = _near(first, second, farthest)
        second = _near(second, first, farthest)
    if not (len(first) and len(second)):
        return farthest
    least = farthest
    low, high = second.min(axis=1), second.max(axis=1)
    rows = max(1, _CHUNK // len(second))
    for start in range(0, len(first), rows):
        some = first[start : start + rows]
        apart = np.maximum(
            some.min(axis=1)[:, None] - high[None], low[None] - some.max(axis=1)[:, None]
        )
        i, j = np.nonzero(np.linalg.norm(np.maximum(apart, 0.0), axis=2) <= least)
        if len(i):
            least = min(least, float(_distances(some[i], second[j]).min()))
    return least


def _is_within(triangles: FloatArray, others: FloatArray) -> bool:
    """Return whether all triangles are within the convex hull of others."""
    if not (len(triangles) and len(others)):
        return False
    points, around = triangles.reshape(-1, 3), others.reshape(-1, 3)
    # Hardly ever even within the box around them.
    low, high = around.min(axis=0), around.max(axis=0)
    if not ((points >= low) & (points <= high)).all():
        return False
    try:
        faces = ConvexHull(around).equations
    except QhullError:
        return False
    return bool((points @ faces[:, :3].T + faces[:, 3] <= 0.0).all())


def _near(triangles: FloatArray, others: FloatArray, distance: float) -> FloatArray:
    """Return the triangles whose boxes are within a distance of the box around others [m]."""
    if not (len(triangles) and len(others)):
        return triangles[:0]
    low, high = others.min(axis=(0, 1)) - distance, others.max(axis=(0, 1)) + distance
    inside = (triangles.max(axis=1) >= low) & (triangles.min(axis=1) <= high)
    return np.asarray(triangles[inside.all(axis=1)])


def _distances(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the distance of each triangle of a from that of b in the same row [m], shape (n,)."""
    found = [
        _of_segments(a[:, i], a[:, (i + 1) % 3], b[:, j], b[:, (j + 1) % 3])
        for i, j in itertools.product(range(3), repeat=2)
    ]
    for x, y in ((a, b), (b, a)):
        found += [_of_point(x[:, i], y) for i in range(3)]
        found += [np.where(_pierces(x[:, i], x[:, (i + 1) % 3], y), 0.0, np.inf) for i in range(3)]
    return np.asarray(np.min(found, axis=0))


def _of_segments(p: FloatArray, q: FloatArray, r: FloatArray, s: FloatArray) -> FloatArray:
    """Return the distances of segments pq and rs, shape (n,) (Ericson 2005, section 5.1.9)."""
    u, v, w = q - p, s - r, p - r
    a, e, f = _dot(u, u), _dot(v, v), _dot(v, w)
    b, c = _dot(u, v), _dot(u, w)
    with np.errstate(divide="ignore", invalid="ignore"):
        across = a * e - b * b
        at = np.where(across > 1e-14 * a * e, np.clip((b * f - c * e) / across, 0.0, 1.0), 0.0)
        on = np.where(e > 0.0, (b * at + f) / e, 0.0)
        within = np.clip(on, 0.0, 1.0)
        at = np.where(on == within, at, np.clip((b * within - c) / a, 0.0, 1.0))
    at = np.where(a > 0.0, at, 0.0)
    return np.asarray(np.linalg.norm(w + at[:, None] * u - within[:, None] * v, axis=1))


def _of_point(p: FloatArray, triangle: FloatArray) -> FloatArray:
    """Return the distances of points from the faces below or above them, inf if there is none."""
    normal, beyond = _beyond_edges(p, triangle)
    length = np.linalg.norm(normal, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        height = np.abs(_dot(p - triangle[:, 0], normal)) / length
    return np.where((length > 0.0) & ~beyond, height, np.inf)


def _pierces(p: FloatArray, q: FloatArray, triangle: FloatArray) -> NDArray[np.bool_]:
    """Return whether segments pq cross triangles, shape (n,)."""
    normal = np.cross(triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0])
    start, end = _dot(p - triangle[:, 0], normal), _dot(q - triangle[:, 0], normal)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = np.where(start != end, start / (start - end), 0.0)
    beyond = _beyond_edges(p + at[:, None] * (q - p), triangle)[1]
    return np.asarray((start * end <= 0.0) & (_dot(normal, normal) > 0.0) & ~beyond)


def _beyond_edges(p: FloatArray, triangle: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return the normals of triangles, and whether points are beside the faces."""
    normal = np.cross(triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0])
    beyond = np.zeros(len(p), np.bool_)
    for i in range(3):
        edge = triangle[:, (i + 1) % 3] - triangle[:, i]
        beyond |= _dot(np.cross(edge, p - triangle[:, i]), normal) < 0.0
    return normal, beyond


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("ij,ij->i", a, b))
