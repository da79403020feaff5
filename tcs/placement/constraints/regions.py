"""Forbidden regions: polygons on the floor on which the robot must not stand."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError, one_line
from tcs.files.quantities import POSITION
from tcs.placement.constraints.contact import segment_distance
from tcs.placement.store.robot_shapes import BOX, RobotShapes

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

RADIUS = 0.5
"""Radius [m] of the circle about the base that stands for the robot if its shapes are unknown: the
base of a PR2, 0.67 m square, fits into 0.48 m."""

MAX_VERTICES = 1000
"""Most vertices of a region."""

ROUNDING = 1e-9
"""Added to footprints [m], so that rounding does not decide whether a touched edge is forbidden."""


_PAIRS = 2**16
"""Pairs of base pose and edge that are compared at once: some megabytes."""


@dataclass(frozen=True, slots=True)
class Region:
    """A polygon on the floor, its edge included, in the environment frame W."""

    vertices: tuple[tuple[float, float], ...]
    """x and y of its corners in order [m]; the last is joined with the first."""

    def __post_init__(self) -> None:
        """Check the vertices.

        Raises:
            SelectionError: If there are fewer than three, more than `MAX_VERTICES`, or one is not
                two numbers in range.
        """
        try:
            vertices = tuple((float(x), float(y)) for x, y in self.vertices)
        except (OverflowError, TypeError, ValueError):
            raise SelectionError("Region: each vertex must be two numbers, x and y [m].") from None
        if not 3 <= len(set(vertices)) <= len(vertices) <= MAX_VERTICES:
            raise SelectionError(
                f"Region: has {len(set(vertices))} different vertices; must have 3 to "
                f"{MAX_VERTICES}."
            )
        for vertex in vertices:
            POSITION.check(vertex, "Region: a coordinate", SelectionError)
        object.__setattr__(self, "vertices", vertices)

    @classmethod
    def parse(cls, text: str) -> Self:
        """Return the region of a text "X1 Y1, X2 Y2, X3 Y3, ..." [m].

        Raises:
            SelectionError: If the text is not of that form.

        >>> Region.parse("0 0, 1 0, 1 1").vertices
        ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0))
        """
        try:
            vertices = [[float(number) for number in part.split()] for part in text.split(",")]
        except ValueError:
            vertices = []
        if not vertices or any(len(vertex) != 2 for vertex in vertices):
            raise SelectionError(
                f"Region '{one_line(text)}' must be X1 Y1, X2 Y2, X3 Y3, ... in metres, or a "
                ".yaml file with the key 'polygon', a list of [x, y]."
            )
        return cls(tuple((x, y) for x, y in vertices))

    @classmethod
    def read(cls, path: Path) -> Self:
        """Return the region of a YAML file with the key `polygon`, a list of [x, y] [m].

        Raises:
            SelectionError: If the file cannot be read or used.
        """
        from tcs.errors import DataFileError
        from tcs.files.documents import read_mapping

        where = f"region file '{path}'"
        try:
            content = read_mapping(path, where, DataFileError, known=("polygon",))
        except DataFileError as error:
            raise SelectionError(str(error)) from None
        if set(content) != {"polygon"} or not isinstance(content["polygon"], list):
            raise SelectionError(f"{where} must have the one key 'polygon', a list of [x, y].")
        return cls.of(content["polygon"], where)

    @classmethod
    def of(cls, polygon: object, where: str) -> Self:
        """Return the region of a list of [x, y] [m].

        Args:
            polygon: The list.
            where: Its source, for the message.

        Raises:
            SelectionError: If it is no such list.
        """
        if not isinstance(polygon, list):
            raise SelectionError(
                f"{where}: {one_line(repr(polygon))} must be a list of [x, y] [m]."
            )
        return cls(tuple(tuple(vertex) for vertex in polygon if _is_pair(vertex, where)))

    @property
    def name(self) -> str:
        """The region in the form that `parse` takes."""
        return ", ".join(f"{x:g} {y:g}" for x, y in self.vertices)


@dataclass(frozen=True, slots=True)
class Footprint:
    """The floor that the robot covers: a rectangle in B, widened by a radius all around."""

    low: tuple[float, float]
    """Least x and y in the base frame B [m]."""
    high: tuple[float, float]
    """Greatest x and y in B [m]."""
    radius: float
    """Distance [m] by which it extends beyond the rectangle."""

    @classmethod
    def of(cls, shapes: RobotShapes | None) -> Self:
        """Return the vertical projection of the shapes fixed to the base, as a rectangle.

        Without shapes it is a circle of `RADIUS` about the base.
        """
        fixed = None if shapes is None else np.flatnonzero(shapes.body.frame == 0)
        if shapes is None or fixed is None or not fixed.size:
            return cls((0.0, 0.0), (0.0, 0.0), RADIUS)
        body = shapes.body
        size, R = body.size[fixed], body.R[fixed]
        box = np.einsum("nij,nj->ni", np.abs(R), size)
        capsule = np.abs(R[:, :, 2]) * size[:, 1:2] + size[:, :1]
        half = np.where((body.type[fixed] == BOX)[:, None], box, capsule) + body.pad[fixed, None]
        low, high = (body.p[fixed] - half).min(axis=0), (body.p[fixed] + half).max(axis=0)
        return cls((float(low[0]), float(low[1])), (float(high[0]), float(high[1])), 0.0)

    def overlaps(self, region: Region, base: FloatArray) -> BoolArray:
        """Return whether the robot would stand on a region, shape (n,).

        Args:
            region: The region.
            base: x, y [m] and heading [rad] of the base in W, shape (n, 3).
        """
        vertex = np.array(region.vertices)
        widest = np.maximum(np.abs(self.low), np.abs(self.high))
        reach = float(np.hypot(*widest)) + self.radius + ROUNDING
        low, high = vertex.min(axis=0) - reach, vertex.max(axis=0) + reach
        found = np.zeros(len(base), dtype=np.bool_)
        near = np.flatnonzero(np.all((base[:, :2] >= low) & (base[:, :2] <= high), axis=1))
        # So many at a time that the memory does not depend on their number.
        step = max(_PAIRS // len(vertex), 1)
        for rows in (near[i : i + step] for i in range(0, len(near), step)):
            found[rows] = self._touches(vertex, base[rows])
        return found

    def _touches(self, vertex: FloatArray, base: FloatArray) -> BoolArray:
        """Return whether a polygon with vertices (k, 2) in W meets the footprint, shape (n,)."""
        low, high = np.array(self.low), np.array(self.high)
        corner = vertex[None] - base[:, None, :2]
        cos, sin = np.cos(base[:, 2:]), np.sin(base[:, 2:])
        # Vertices in the frame of the rectangle's middle.
        middle, half = (low + high) / 2.0, (high - low) / 2.0
        x = cos * corner[..., 0] + sin * corner[..., 1] - middle[0]
        y = cos * corner[..., 1] - sin * corner[..., 0] - middle[1]
        next_x, next_y = np.roll(x, -1, axis=1), np.roll(y, -1, axis=1)
        gap = _least_gap(half, x, y, next_x, next_y)
        # Edges that no axis separates cross the rectangle; of a few only the distance decides.
        close = gap <= 0.0
        pose, edge = np.nonzero((gap > 0.0) & (gap <= self.radius + ROUNDING))
        if len(pose):
            ends = (
                np.stack([x[pose, edge], y[pose, edge], np.zeros(len(pose))], axis=1),
                np.stack([next_x[pose, edge], next_y[pose, edge], np.zeros(len(pose))], axis=1),
            )
            distance = segment_distance(np.append(half, 1.0), *ends)
            close[pose, edge] = distance <= self.radius + ROUNDING
        # A rectangle that no edge meets is inside or outside as a whole.
        return np.asarray(np.any(close, axis=1) | _surrounded(x, y, next_x, next_y))

    def to_json(self) -> dict[str, Any]:
        """Return the footprint as plain containers [m]."""
        if self.radius:
            return {"type": "circle", "radius": self.radius}
        return {
            "type": "rectangle",
            "x": [round(self.low[0], 4), round(self.high[0], 4)],
            "y": [round(self.low[1], 4), round(self.high[1], 4)],
        }


def _least_gap(
    half: FloatArray, x: FloatArray, y: FloatArray, next_x: FloatArray, next_y: FloatArray
) -> FloatArray:
    """Return a lower bound of the distance of edges from a rectangle [m], shape (n, k).

    It is the greatest gap along three axes, the sides of the rectangle and the normal of the edge;
    where it is not positive, they meet.

    Args:
        half: Half sizes of the rectangle, which is centred at the origin [m], shape (2,).
        x: x of the first ends of the edges [m], shape (n, k).
        y: y of the first ends.
        next_x: x of the second ends.
        next_y: y of the second ends.
    """
    gap = np.maximum(np.minimum(x, next_x), -np.maximum(x, next_x)) - half[0]
    np.maximum(gap, np.maximum(np.minimum(y, next_y), -np.maximum(y, next_y)) - half[1], out=gap)
    dx, dy = next_x - x, next_y - y
    beyond = np.abs(x * next_y - y * next_x) - (np.abs(dy) * half[0] + np.abs(dx) * half[1])
    length = np.hypot(dx, dy)
    normal = np.divide(beyond, length, out=np.full_like(gap, -np.inf), where=length > 0.0)
    return np.asarray(np.maximum(gap, normal))


def _surrounded(x: FloatArray, y: FloatArray, next_x: FloatArray, next_y: FloatArray) -> BoolArray:
    """Return whether polygons with these edges (n, k) wind around the origin, shape (n,).

    Where a polygon crosses itself, both windings count as inside.
    """
    upward = (y <= 0.0) & (next_y > 0.0)
    downward = (y > 0.0) & (next_y <= 0.0)
    side = x * next_y - y * next_x
    winding = np.sum(upward & (side > 0.0), axis=1) - np.sum(downward & (side < 0.0), axis=1)
    return np.asarray(winding != 0)


def _is_pair(vertex: object, where: str) -> bool:
    """Return True for two numbers.

    Raises:
        SelectionError: For anything else.
    """
    if (
        not isinstance(vertex, list)
        or len(vertex) != 2
        or any(isinstance(v, bool) or not isinstance(v, int | float) for v in vertex)
    ):
        raise SelectionError(f"{where}: vertex {one_line(repr(vertex))} must be [x, y] [m].")
    return True
