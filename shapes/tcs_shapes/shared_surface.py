"""Shapes that contain a surface together: what each alone contains, and how it is split in two."""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from collections.abc import Callable, Container, Iterable, Iterator
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tcs.errors import RobotError, UnknownNameError
from tcs.model.robots.primitives import FINEST, Primitive
from tcs.model.robots.robot_file import RobotFile
from tcs.model.robots.triangles import cut, distinct, halved, longest_edges
from tcs_shapes.bounding import enclose, enclose_axis, hull_corners, tightest_orientation
from tcs_shapes.containment import box_cost, contains_points
from tcs_shapes.covering import SortedPieces, contain, rounded_box

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

_CUTS = (0.2, 0.35, 0.5, 0.65, 0.8)
"""Where along an axis of a shape it may be split, as fractions of its extent."""

_FIRST, _LAST = 16.0, 1.0
"""First and last angle by which a box is rotated in one step [deg]; each is half that before."""
_DRAWN = 10_000
"""Most points outside by which orientations are compared."""
_LESS = 1 - 1e-6
"""Factor by which a cost has to fall, so that the result does not depend on rounding."""


class SharedSurface(ABC):
    """Shapes that contain a surface together, each of which may change as long as they do.

    What shapes should leave free is numbered by the class that derives from this, such as the cells
    of a grid outside the body. What a shape holds of it has a cost unless another one holds it too.
    """

    def __init__(
        self,
        body: str,
        shapes: Iterable[Primitive],
        surface: tuple[FloatArray, FloatArray],
        longest: float,
        count: int,
    ) -> None:
        """Cut the surface into pieces that each lie in a shape.

        Args:
            body: Name of the body.
            shapes: Shapes that enclose the surface.
            surface: Corners of its triangles in the frame of the body [m], shape (n, 3, 3), and
                points inside of which those that shapes contain stay contained, shape (m, 3).
            longest: Longest edge of a piece [m]; pieces that no shape contains are cut further.
            count: Number of what shapes should leave free.

        Raises:
            RobotError: If the shapes leave a part of the surface bare.
        """
        triangles, inside = surface
        self._body, self._shapes = body, list(shapes)
        self._placed = SortedPieces(_pieces_in(self._shapes, triangles, longest))
        self._pieces = self._placed.corners
        points, index = distinct(self._pieces.reshape(-1, 3))
        self._corners, self._index = points, index.reshape(-1, 3)
        self._inside = inside[np.any([s.contains(inside) for s in self._shapes], axis=0)]
        self._within = [self._contained(shape) for shape in self._shapes]
        self._count = np.sum(self._within, axis=0)
        self._held = np.zeros(count, np.int32)
        self._holds = [self._held_by(shape) for shape in self._shapes]
        for numbers in self._holds:
            self._held[numbers] += 1

    @abstractmethod
    def _held_by(self, shape: Primitive) -> IntArray:
        """Return the numbers of what a shape holds and should leave free, shape (n,)."""

    @abstractmethod
    def _cost(self, numbers: IntArray) -> float:
        """Return the cost of holding what has these numbers, in a unit of the class."""

    @abstractmethod
    def _tightest(self, shape: Primitive, points: FloatArray) -> Primitive:
        """Return the shape around points of a shape whose cost is least."""

    @abstractmethod
    def _halved(
        self, shape: Primitive, alone: BoolArray, allowed: float
    ) -> tuple[Primitive, Primitive] | None:
        """Return two shapes in place of one that is left out, None if all cost too much."""

    @property
    def shapes(self) -> tuple[Primitive, ...]:
        """The shapes."""
        return tuple(self._shapes)

    def reduce(self) -> None:
        """Reduce each shape to what it alone contains, those that cost most first."""
        order = np.argsort([-self._own(numbers) for numbers in self._holds], kind="stable")
        unneeded = []
        for k in order.tolist():
            alone = self._alone(k)
            self._leave_out(k)
            if not alone.any():
                unneeded.append(k)
                continue
            self._put(k, self._tightest(self._shapes[k], self._points(*self._rows(alone))))
        for k in sorted(unneeded, reverse=True):
            self._remove(k)

    def split(self, most: int, worth: float) -> None:
        """Split the shapes that cost most in two, one after the other.

        Args:
            most: Largest number of shapes that are added.
            worth: Least decrease of the cost for which a shape is split.
        """
        whole, end = set[int](), len(self._shapes) + most
        while len(self._shapes) < end:
            costs = {k: self._own(n) for k, n in enumerate(self._holds) if k not in whole}
            k = max(costs, key=costs.__getitem__, default=-1)
            if k < 0 or costs[k] <= worth:
                return
            if not self._is_split(k, costs[k] - worth):
                whole.add(k)

    def _is_split(self, k: int, allowed: float) -> bool:
        """Split a shape if its halves cost at most so much; return whether."""
        alone = self._alone(k)
        if not alone.any():
            return False
        shape = self._shapes[k]
        self._leave_out(k)
        halves = self._halved(shape, alone, allowed)
        if halves is None:
            self._put(k, shape)
            return False
        self._put(k, halves[0])
        self._append(halves[1])
        return True

    def _parted(self, shape: Primitive, alone: BoolArray) -> Iterator[list[FloatArray]]:
        """Yield the points of what a shape alone contains, on both sides of cuts across it."""
        rows, deep_rows = self._rows(alone)
        seen = self._pieces[rows].mean(axis=1) @ shape.rotation
        deep = self._inside[deep_rows] @ shape.rotation
        if not len(seen):
            return
        low, high = seen.min(axis=0), seen.max(axis=0)
        for axis, fraction in itertools.product(range(3), _CUTS):
            at = low[axis] + fraction * (high[axis] - low[axis])
            first, second = seen[:, axis] <= at, deep[:, axis] <= at
            halves = [
                self._points(rows[some], deep_rows[deeper])
                for some, deeper in ((first, second), (~first, ~second))
            ]
            if all(map(len, halves)):
                yield halves

    def _points(self, pieces: IntArray, inside: IntArray) -> FloatArray:
        """Return the corners of pieces and the points inside of given numbers, shape (n, 3)."""
        used = np.zeros(len(self._corners), np.bool_)
        used[self._index[pieces]] = True
        return hull_corners(np.concatenate([self._corners[used], self._inside[inside]]))

    def _rows(self, chosen: BoolArray) -> tuple[IntArray, IntArray]:
        """Return the numbers of the pieces and of the points inside that are chosen."""
        n = len(self._pieces)
        return np.flatnonzero(chosen[:n]), np.flatnonzero(chosen[n:])

    def _alone(self, k: int) -> BoolArray:
        """Return which pieces and points inside one shape alone contains."""
        return np.asarray(self._within[k] & (self._count == 1))

    def _leave_out(self, k: int) -> None:
        self._count -= self._within[k]
        self._held[self._holds[k]] -= 1

    def _put(self, k: int, shape: Primitive) -> None:
        self._shapes[k] = shape
        self._within[k], self._holds[k] = self._contained(shape), self._held_by(shape)
        self._put_back(k)

    def _put_back(self, k: int) -> None:
        """Put a shape back that was left out."""
        self._count += self._within[k]
        self._held[self._holds[k]] += 1

    def _append(self, shape: Primitive) -> None:
        self._shapes.append(shape)
        self._within.append(np.zeros(len(self._count), np.bool_))
        self._holds.append(np.empty(0, np.int64))
        self._put(len(self._shapes) - 1, shape)

    def _remove(self, k: int) -> None:
        """Remove a shape that is left out."""
        del self._shapes[k], self._within[k], self._holds[k]

    def _own(self, numbers: IntArray) -> float:
        """Return the cost of what one shape alone holds."""
        return self._cost(numbers[self._held[numbers] == 1])

    def _contained(self, shape: Primitive) -> BoolArray:
        inside = contains_points(rounded_box(shape), self._inside)
        return np.concatenate([self._placed.within(shape), inside])


def by_body(
    robot: RobotFile, shapes: Iterable[Primitive], named: Iterable[str], surfaces: Container[str]
) -> dict[str, tuple[Primitive, ...]]:
    """Return the shapes of each body.

    Args:
        robot: The robot.
        shapes: Its primitives.
        named: Bodies that must have shapes and a surface.
        surfaces: Bodies with a surface.

    Raises:
        UnknownNameError: If one of these bodies has none.
    """
    found: dict[str, tuple[Primitive, ...]] = {}
    for shape in shapes:
        found[shape.body] = (*found.get(shape.body, ()), shape)
    for body in named:
        if body not in found or body not in surfaces:
            raise UnknownNameError("body", body, found, where=f"primitives '{robot.primitives}'")
    return found


def around(body: str, shape: Primitive, points: FloatArray) -> list[Primitive]:
    """Return shapes that contain points of a shape: boxes, and capsules within a capsule.

    Args:
        body: Name of the body.
        shape: The shape.
        points: In the frame of the body [m], shape (n, 3).
    """
    found = [
        enclose(body, points, "box", R) for R in (shape.rotation, tightest_orientation(points))
    ]
    if shape.kind == "capsule":
        found.append(within_capsule(shape, points))
        found.append(enclose(body, points, "capsule", shape.rotation))
    return found


def within_capsule(shape: Primitive, points: FloatArray) -> Primitive:
    """Return a capsule around some points of a capsule [m], shape (n, 3), on its axis."""
    radius, length = shape.size
    seen = (points - np.array(shape.xyz)) @ shape.rotation
    off_axis = np.square(seen[:, :2]).sum(axis=1)
    beyond = np.maximum(np.abs(seen[:, 2]) - length / 2, 0.0)
    radius = float(np.sqrt(off_axis + beyond**2).max())
    reach = np.sqrt(np.maximum(radius**2 - off_axis, 0.0))
    top = min(float((seen[:, 2] - reach).max()), length / 2)
    bottom = max(float((seen[:, 2] + reach).min()), -length / 2)
    axis = shape.rotation[:, 2]
    ends = np.array(shape.xyz) + np.array([[bottom], [max(top, bottom)]]) * axis
    tight = enclose_axis(body=shape.body, first=ends[0], last=ends[1], radius=radius)
    tight = replace(tight, quaternion=shape.quaternion)
    out = float(tight.distance(points).max())
    return tight.shrunk(-np.ceil(out * 1e6 + 1) * 1e-6) if out > 0 else tight


def _pieces_in(shapes: list[Primitive], triangles: FloatArray, longest: float) -> FloatArray:
    """Return pieces of triangles that each lie in a shape, shape (n, 3, 3)."""
    left, found = cut(triangles, longest), []
    while len(left):
        whole = contain(shapes, left)
        found.append(left[whole])
        left = left[~whole]
        corners = left.reshape(-1, 3)
        bare = ~np.any([shape.contains(corners) for shape in shapes], axis=0)
        if bare.any() or (longest_edges(left) < FINEST).any():
            at = np.round(corners[bare.argmax()], 3).tolist()
            raise RobotError(
                f"primitives of body '{shapes[0].body}' do not enclose its surface near {at} m in "
                "its frame: fit the body again first."
            )
        left = halved(left)
    return np.concatenate(found)


def least_protruding(
    points: FloatArray,
    R: FloatArray,
    outside: FloatArray,
    costs: FloatArray,
    per_volume: float,
) -> FloatArray:
    """Return an orientation R_BP of the box around points in which it contains little that costs.

    Starting from R, the box is rotated about its own axes in smaller and smaller steps, as long as
    that helps: the result is a local minimum.

    Args:
        points: Points that the box contains [m], shape (n, 3).
        R: Orientation to start from, shape (3, 3).
        outside: Points that it should not contain [m], shape (m, 3).
        costs: Cost of each of them, shape (m,).
        per_volume: Cost of the volume of the box [1/m^3].
    """
    if len(outside) > _DRAWN:
        # Any, but always the same ones.
        some = np.random.default_rng(0).choice(len(outside), _DRAWN, replace=False)
        outside, costs = outside[some], costs[some] * (len(outside) / _DRAWN)

    def cost(R: FloatArray) -> float:
        return float(box_cost(points, outside, costs, np.ascontiguousarray(R), per_volume))

    return least_costly(R, cost)


def least_costly(R: FloatArray, cost: Callable[[FloatArray], float]) -> FloatArray:
    """Return an orientation of little cost, a local minimum that is found from R.

    Args:
        R: Orientation to start from, shape (3, 3).
        cost: Cost of an orientation.
    """
    best, least, step = R, cost(R), _FIRST
    while step >= _LAST:
        found = _first_better(best, least, step, cost)
        if found is None:
            step /= 2
        else:
            best, least = found
    return best


def _first_better(
    R: FloatArray, least: float, step: float, cost: Callable[[FloatArray], float]
) -> tuple[FloatArray, float] | None:
    """Return the first orientation a step away [deg] that costs less, and its cost."""
    for tried in _rotated(R, step):
        value = cost(tried)
        if value < least * _LESS:
            return tried, value
    return None


def _rotated(R: FloatArray, step: float) -> Iterator[FloatArray]:
    """Yield an orientation rotated about each of its axes, to both sides, by an angle [deg]."""
    for turn in _turns(step):
        yield R @ turn


@cache
def _turns(step: float) -> tuple[FloatArray, ...]:
    """Return rotations about each axis, to both sides, by an angle [deg]."""
    return tuple(
        Rotation.from_euler(axis, angle, degrees=True).as_matrix()
        for axis in "xyz"
        for angle in (step, -step)
    )
