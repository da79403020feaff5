"""Boxes, capsules and spheres that enclose the meshes of a robot, and the CSV files of them."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tcs.errors import RobotError
from tcs.files.quantities import POSITION, PRIMITIVES, SIZE
from tcs.files.reading import read_text
from tcs.files.writing import whole_file
from tcs.model.robots.triangles import halved, longest_edges

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

Kind = Literal["sphere", "capsule", "box"]
SIZES: dict[str, int] = {"sphere": 1, "capsule": 2, "box": 3}
"""Length of `size` for each type of shape."""

FINEST = 1e-4
"""Edge of the pieces at which the cutting of triangles ends [m]."""
_TOUCH = 1e-6
"""Distance within which boxes around shapes count as overlapping [m]: far above the rounding of
quaternions in files, and it only costs a test more."""
MAX_BYTES = 10 * 1024**2
"""Most bytes of a file of primitives: a hundred times the largest that ships."""

_COLUMNS = (
    "body", "kind", "size_a", "size_b", "size_c", "x", "y", "z", "qw", "qx", "qy", "qz",
)  # fmt: skip
# Files hold 9 decimals of a rotation, so the length of a quaternion is 1 to a few 1e-9.
_UNIT_TOLERANCE = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class Primitive:
    """One convex shape P on a body B of the robot.

    Raises:
        RobotError: If `kind` is unknown, a size or the centre is out of its physical range, or the
            quaternion is not unit.
    """

    body: str
    kind: Kind
    size: tuple[float, ...]
    """Sphere: radius. Capsule: radius, length between cap centres along its z. Box: full sizes
    along its x, y, z [m]."""
    xyz: tuple[float, float, float]
    """Centre in the body, p_BoPo_B [m]."""
    quaternion: tuple[float, float, float, float]
    """Orientation R_BP, wxyz."""

    def __post_init__(self) -> None:
        where = f"primitive of body '{self.body}'"
        if self.kind not in SIZES:
            raise RobotError(f"{where}: kind is '{self.kind}', but must be {', '.join(SIZES)}.")
        if len(self.size) != SIZES[self.kind] or not all(s > 0 for s in self.size):
            raise RobotError(
                f"{where}: a {self.kind} needs {SIZES[self.kind]} positive size(s) [m], "
                f"not {self.size}."
            )
        SIZE.check(self.size, f"{where}: a size", RobotError)
        POSITION.check(self.xyz, f"{where}: a coordinate of its centre", RobotError)
        if not abs(math.hypot(*self.quaternion) - 1) <= _UNIT_TOLERANCE:
            raise RobotError(f"{where}: quaternion {self.quaternion} (wxyz) must have length 1.")

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        if self.kind == "box":
            return math.prod(self.size)
        radius = self.size[0]
        length = self.size[1] if self.kind == "capsule" else 0.0
        return math.pi * radius**2 * (length + 4 / 3 * radius)

    @property
    def rotation(self) -> FloatArray:
        """R_BP, shape (3, 3)."""
        return rotation_of(self.quaternion)

    @property
    def bounds(self) -> FloatArray:
        """Least and greatest corner of the primitive's box along the body's axes [m], shape (2, 3).

        It is not rounded outward: add a tolerance where a touch counts.
        """
        R_BP = self.rotation
        if self.kind == "box":
            reach = np.abs(R_BP) @ (np.array(self.size) / 2)
        else:
            half_length = self.size[1] / 2 if self.kind == "capsule" else 0.0
            reach = np.abs(R_BP[:, 2]) * half_length + self.size[0]
        return np.asarray(np.array(self.xyz) + np.array([-reach, reach]))

    def reach(self, direction: FloatArray) -> float:
        """Return how far the primitive extends from its centre along a direction [m].

        Args:
            direction: Of length 1, in the body's axes, shape (3,).
        """
        along = np.abs(direction @ self.rotation)
        if self.kind == "box":
            return float(along @ np.array(self.size)) / 2
        length = self.size[1] if self.kind == "capsule" else 0.0
        return float(along[2]) * length / 2 + self.size[0]

    def contains(self, p_BoQ_B: FloatArray, *, tolerance: float = 0.0) -> BoolArray:
        """Return which points of the body lie in the primitive.

        Args:
            p_BoQ_B: Points in the body frame [m], shape (..., 3).
            tolerance: Distance outside that still counts as inside [m].

        Returns:
            Booleans, shape (...).
        """
        # By coordinate: NumPy is slow along an axis of three.
        p_PoQ_P = np.abs((p_BoQ_B - np.array(self.xyz)) @ self.rotation)
        x, y, z = p_PoQ_P[..., 0], p_PoQ_P[..., 1], p_PoQ_P[..., 2]
        if self.kind == "box":
            a, b, c = (s / 2 + tolerance for s in self.size)
            return np.asarray((x <= a) & (y <= b) & (z <= c))
        if self.kind == "capsule":
            z = np.maximum(z - self.size[1] / 2, 0.0)
        radius = self.size[0] + tolerance
        return np.asarray(x * x + y * y + z * z <= radius**2)

    def distance(self, p_BoQ_B: FloatArray) -> FloatArray:
        """Return the distances of points of the body from the primitive [m], 0 inside.

        Args:
            p_BoQ_B: Points in the body frame [m], shape (..., 3).

        Returns:
            Shape (...).
        """
        p_PoQ_P = np.abs((p_BoQ_B - np.array(self.xyz)) @ self.rotation)
        half, radius = np.array(self.size) / 2, 0.0
        if self.kind != "box":
            radius = self.size[0]
            half = np.array([0.0, 0.0, self.size[1] / 2 if self.kind == "capsule" else 0.0])
        beyond = np.linalg.norm(np.maximum(p_PoQ_P - half, 0.0), axis=-1)
        return np.asarray(np.maximum(beyond - radius, 0.0))

    def contains_triangles(self, triangles: FloatArray, *, tolerance: float = 0.0) -> BoolArray:
        """Return which triangles lie wholly in the primitive, by their corners: it is convex.

        Args:
            triangles: Corners in the body frame [m], shape (n, 3, 3).
            tolerance: Distance outside that still counts as inside [m].

        Returns:
            Booleans, shape (n,).
        """
        return np.asarray(self.contains(triangles, tolerance=tolerance).all(axis=-1))

    def shrunk(self, by: float) -> Primitive:
        """Return the primitive with every face moved inward by `by` [m]; negative: outward.

        Raises:
            RobotError: If no volume would be left.
        """
        if self.kind == "box":
            size = tuple(s - 2 * by for s in self.size)
        else:
            size = (self.size[0] - by, *self.size[1:])
        return Primitive(
            body=self.body, kind=self.kind, size=size, xyz=self.xyz, quaternion=self.quaternion
        )


def rotation_of(quaternion: Iterable[float]) -> FloatArray:
    """Return the rotation matrix of a quaternion (wxyz), shape (3, 3)."""
    w, x, y, z = np.array(tuple(quaternion)) / math.hypot(*quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion_of_rpy(rpy: Iterable[float]) -> tuple[float, float, float, float]:
    """Return the quaternion (wxyz) of roll, pitch, yaw about fixed axes [rad], as in a URDF."""
    roll, pitch, yaw = rpy
    cr, sr = math.cos(roll / 2), math.sin(roll / 2)
    cp, sp = math.cos(pitch / 2), math.sin(pitch / 2)
    cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def enclosed(primitives: Iterable[Primitive], triangles: FloatArray) -> BoolArray:
    """Return which triangles lie wholly in the union of the primitives.

    A triangle does if it can be cut into pieces that each lie in one primitive, which is convex. It
    is not sufficient that its corners do: its middle could protrude between two primitives. Cutting
    ends with a corner that is in no primitive, or with pieces of FINEST, which do not count.

    Args:
        primitives: Primitives of one body.
        triangles: Corners in the body frame [m], shape (n, 3, 3).

    Returns:
        Booleans, shape (n,).
    """
    shapes = tuple(primitives)
    inside = np.ones(len(triangles), dtype=np.bool_)
    pieces, triangle = triangles, np.arange(len(triangles))
    while len(pieces):
        whole = np.zeros(len(pieces), dtype=np.bool_)
        touched = np.zeros(pieces.shape[:2], dtype=np.bool_)
        a, b, c = pieces[..., 0].T
        low = np.minimum(np.minimum(a, b), c) - _TOUCH
        high = np.maximum(np.maximum(a, b), c) + _TOUCH
        for shape in shapes:
            (least, _, _), (greatest, _, _) = shape.bounds
            near = np.flatnonzero((low <= greatest) & (high >= least))
            corners = shape.contains(pieces[near])
            whole[near] |= corners[:, 0] & corners[:, 1] & corners[:, 2]
            touched[near] |= corners
        out = ~whole & (~touched.all(axis=1) | (longest_edges(pieces) < FINEST))
        inside[triangle[out]] = False
        left = ~whole & inside[triangle]
        pieces, triangle = halved(pieces[left]), np.tile(triangle[left], 2)
    return inside


def union_volume(primitives: Iterable[Primitive], samples: int = 20_000, seed: int = 0) -> float:
    """Return the volume of the union of the primitives of one body [m^3].

    Each primitive is sampled uniformly; a point that lies in m of them counts 1/m. The volume of
    one primitive is exact; the standard error of a union of primitives of one size is at most
    half the summed volume over the square root of twice the samples.

    Args:
        primitives: Primitives of one body.
        samples: Points in each of two primitives; more than two share twice as many.
        seed: Seed of the points; the same seed gives the same volume.
    """
    shapes = tuple(primitives)
    if len(shapes) < 2:
        return sum(shape.volume for shape in shapes)
    rng = np.random.default_rng(seed)
    least, greatest = np.array([shape.bounds for shape in shapes]).transpose(1, 0, 2)
    total = 0.0
    for i, shape in enumerate(shapes):
        points = _points_in(shape, 2 * samples // max(2, len(shapes)), rng)
        count = np.zeros(len(points), dtype=np.int64)
        near = (least <= greatest[i] + _TOUCH) & (greatest >= least[i] - _TOUCH)
        for j in np.flatnonzero(near.all(axis=1)):
            if shapes[j] != shape:
                count += shapes[j].contains(points)
        total += shape.volume * float(np.mean(1.0 / (1.0 + count)))
    return total


def _points_in(shape: Primitive, samples: int, rng: np.random.Generator) -> FloatArray:
    """Return points spread uniformly in a primitive, in its body's frame [m], shape (n, 3)."""
    if shape.kind == "box":
        half = np.array(shape.size) / 2
    else:
        radius = shape.size[0]
        length = shape.size[1] if shape.kind == "capsule" else 0.0
        half = np.array([radius, radius, radius + length / 2])
    points = rng.uniform(-1.0, 1.0, size=(samples, 3)) * half
    p_BoQ_B = np.asarray(points @ shape.rotation.T + np.array(shape.xyz))
    return p_BoQ_B if shape.kind == "box" else p_BoQ_B[shape.contains(p_BoQ_B)]


def write_primitives(path: Path, primitives: Iterable[Primitive]) -> None:
    """Write primitives to a CSV file: metres with 6 decimals, quaternions (wxyz) with 9.

    Raises:
        OutputError: If the file cannot be written.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_COLUMNS)
    for p in primitives:
        sizes = [f"{s:.6f}" for s in p.size] + [""] * (3 - len(p.size))
        place = [f"{x + 0.0:.6f}" for x in p.xyz]
        writer.writerow([p.body, p.kind, *sizes, *place, *(f"{q + 0.0:.9f}" for q in p.quaternion)])
    with whole_file(path, "Primitives file") as stream:
        stream.write(text.getvalue().encode())


def read_primitives(path: Path) -> tuple[Primitive, ...]:
    """Return the primitives of a CSV file, in its order.

    Raises:
        RobotError: If the file cannot be read, or a row is not a valid primitive.
    """
    text = read_text(path, f"primitives '{path}'", RobotError, limit=MAX_BYTES)
    try:
        rows = list(csv.DictReader(io.StringIO(text, newline="")))
    except csv.Error as error:
        raise RobotError(f"primitives '{path}' is not a CSV file: {error}.") from None
    PRIMITIVES.check(len(rows), f"primitives '{path}': its number of rows", RobotError)
    found = []
    for number, row in enumerate(rows, start=2):
        where = f"primitives '{path}', line {number}"
        if set(row) != set(_COLUMNS):
            raise RobotError(f"{where}: its columns must be {', '.join(_COLUMNS)}.")
        try:
            sizes = tuple(float(row[key]) for key in _COLUMNS[2:5] if row[key])
            x, y, z, qw, qx, qy, qz = (float(row[key]) for key in _COLUMNS[5:])
            found.append(
                Primitive(
                    body=row["body"],
                    kind=row["kind"],  # type: ignore[arg-type]  # checked by Primitive
                    size=sizes,
                    xyz=(x, y, z),
                    quaternion=(qw, qx, qy, qz),
                )
            )
        except (TypeError, ValueError) as error:
            raise RobotError(f"{where}: {error}.") from error
        except RobotError as error:
            raise RobotError(f"{where}: {error}") from error
    return tuple(found)
