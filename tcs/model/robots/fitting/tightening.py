"""Shapes of a body made tighter: each is reduced to what it alone contains, or split in two."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from tcs.errors import RobotError, UnknownNameError
from tcs.model.robots.cutting import cut, distinct, halved, longest_edges
from tcs.model.robots.fitting.bounding import (
    enclose,
    enclose_axis,
    hull_corners,
    tightest_orientation,
)
from tcs.model.robots.fitting.candidates import thinned
from tcs.model.robots.fitting.enclosure import surfaces_to_enclose
from tcs.model.robots.fitting.filling import fillers
from tcs.model.robots.fitting.orienting import least_protruding
from tcs.model.robots.fitting.reduction import contain, contained
from tcs.model.robots.fitting.solid import CLOSING as USUAL_CLOSING
from tcs.model.robots.fitting.solid import Solid, measured, spaces_outside
from tcs.model.robots.primitives import FINEST, Primitive
from tcs.model.robots.robot_file import RobotFile

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

CLOSING = 0.005
"""Radius of the smallest ball that the space outside admits [m]: links pass each other in hollows
that the usual one does not enter."""
_CLOSING_CELLS = 2
"""Least radius of the ball in points of the grid: a smaller one could pass between two of them."""
FINEST_PITCH = 0.0005
"""Least distance of the points of the grid by which the space outside is measured [m]."""
CELLS = 1_000_000
"""Most points of the grid in the box around a body."""
SPOT_CELLS = 3_000_000
"""The same for a body with spots, where others pass it closely."""
PIECE = 0.006
"""Longest edge of a piece [m], if the grid is finer than half of it; pieces that no shape contains
are cut further."""
DEEP = 0.012
"""Depth [m] from which on the inside stays covered, and least spacing of points there."""
SPACINGS = 20
"""Most points inside along a body."""
_CUTS = (0.2, 0.35, 0.5, 0.65, 0.8)
"""Where along an axis of a shape it may be split, as fractions of its extent."""
_WORTH = 0.002
"""Least decrease of the volume outside for which a shape is split, as a fraction of all of it."""
_NEW = 20
"""Weight of volume outside that was free of shapes before: pairs of bodies that were found never to
touch should not do so now."""
_SPOT = 20.0
"""Weight of volume outside in a spot."""
_NEAR = 0.15
"""Border around points in which a box around them is rotated, as a fraction of their extent."""
_INSIDE = 1e-3
"""Cost of volume inside, as a fraction of that outside: of two shapes that protrude alike the
smaller is taken."""


Spots = Sequence[tuple[float, float, float, float]]
"""Balls near the surface of a body: centre in its frame and radius [m]."""


def tightened(
    robot: RobotFile,
    shapes: Iterable[Primitive],
    splits: Mapping[str, int],
    spots: Mapping[str, Spots] = MappingProxyType({}),
    rounds: Mapping[str, Iterable[Primitive]] = MappingProxyType({}),
    jobs: int = 1,
) -> tuple[Primitive, ...]:
    """Return primitives that enclose a robot, those of some bodies made tighter.

    Each shape is reduced to what it alone contains, and boxes are rotated, so that the least volume
    outside the body is left; then those that protrude most are split in two. Only the surface
    decides.

    Args:
        robot: The robot.
        shapes: Primitives that enclose it.
        splits: Largest number of shapes that are added, by body.
        spots: Where others pass a body closely: there its shapes become the closest.
        rounds: Shapes that are added before, by body, along parts that are round.
        jobs: Number of processes, each of which tightens a body at a time.

    Raises:
        UnknownNameError: If a body has no primitive.
        RobotError: If a mesh cannot be read, or primitives do not enclose the surface of a body.
    """
    found: dict[str, tuple[Primitive, ...]] = {}
    for shape in shapes:
        found[shape.body] = (*found.get(shape.body, ()), shape)
    surfaces, tasks = surfaces_to_enclose(robot), []
    for body, most in splits.items():
        if body not in found or body not in surfaces:
            raise UnknownNameError("body", body, found, where=f"primitives '{robot.primitives}'")
        given = (*found[body], *rounds.get(body, ()))
        tasks.append((body, given, surfaces[body][2], spots.get(body, ()), most))
    tight = Parallel(jobs)(delayed(_tightened_body)(*task) for task in tasks)
    found |= dict(zip(splits, tight, strict=True))
    return tuple(shape for fitted in found.values() for shape in fitted)


def _tightened_body(
    body: str, shapes: Iterable[Primitive], triangles: FloatArray, spots: Spots, most: int
) -> tuple[Primitive, ...]:
    """Return the shapes of one body made tighter, up to `most` of them split in two."""
    tightening = Tightening(body, shapes, triangles, spots)
    tightening.reduce()
    tightening.split(most)
    # What shapes leave each other has changed.
    tightening.reduce()
    tight = tightening.shapes
    return (*tight, *fillers(body, tight, triangles))


class Tightening:
    """Shapes that contain a surface together, each reduced to what the others leave."""

    def __init__(
        self,
        body: str,
        shapes: Iterable[Primitive],
        triangles: FloatArray,
        spots: Spots = (),
    ) -> None:
        """Cut the surface into pieces that each lie in a shape.

        Args:
            body: Name of the body.
            shapes: Shapes that enclose the triangles.
            triangles: Corners in the frame of the body [m], shape (n, 3, 3).
            spots: Where volume outside counts most.
        """
        self._body, self._shapes = body, list(shapes)
        volume = float(np.ptp(triangles, axis=(0, 1)).prod())
        pitch = max(FINEST_PITCH, float(np.cbrt(volume / (SPOT_CELLS if spots else CELLS))))
        reach = _overhang(self._shapes, triangles)
        self._solid, inside = _measured(triangles, pitch, reach)
        self._worth = _worth(self._solid, spots)
        self._pieces = _pieces_in(self._shapes, triangles, max(PIECE, 2 * pitch))
        points, index = distinct(self._pieces.reshape(-1, 3))
        self._corners, self._index = points, index.reshape(-1, 3)
        self._inside = inside[np.any([s.contains(inside) for s in self._shapes], axis=0)]
        self._within = [self._contained(shape) for shape in self._shapes]
        self._count = np.sum(self._within, axis=0)
        self._held = np.zeros(self._solid.outside.size, np.int16)
        self._cells = [self._outside(shape) for shape in self._shapes]
        for cells in self._cells:
            self._held[cells] += 1
        self._allowed = self._held > 0

    @property
    def shapes(self) -> tuple[Primitive, ...]:
        """The shapes."""
        return tuple(self._shapes)

    @property
    def excess(self) -> float:
        """Volume of all shapes together that is outside the body [m^3]."""
        return float(np.count_nonzero(self._held)) * self._solid.pitch**3

    def _volume(self, cells: IntArray) -> float:
        """Return the volume of cells, with that in spots as often as it counts [m^3]."""
        return float(self._worth[cells].sum(dtype=np.float64)) * self._solid.pitch**3

    def reduce(self) -> None:
        """Reduce each shape to what it alone contains, those that protrude most first."""
        order = np.argsort([-self._own(cells) for cells in self._cells], kind="stable")
        unneeded = []
        for k in order.tolist():
            alone = np.asarray(self._within[k] & (self._count == 1))
            self._leave_out(k)
            if not alone.any():
                unneeded.append(k)
                continue
            shape, _ = self._tightest(self._shapes[k], self._points(*self._rows(alone)))
            self._put(k, shape)
        for k in sorted(unneeded, reverse=True):
            del self._shapes[k], self._within[k], self._cells[k]

    def split(self, most: int) -> None:
        """Split the shapes that protrude most in two, one after the other.

        Args:
            most: Largest number of shapes that are added.
        """
        whole, end = set[int](), len(self._shapes) + most
        least = _WORTH * self._volume(np.flatnonzero(self._held))
        while len(self._shapes) < end:
            costs = {k: self._own(c) for k, c in enumerate(self._cells) if k not in whole}
            k = max(costs, key=costs.__getitem__, default=-1)
            if k < 0 or costs[k] <= least:
                return
            if not self._is_split(k, costs[k] - least):
                whole.add(k)

    def _is_split(self, k: int, allowed: float) -> bool:
        """Split a shape if its halves protrude by at most a volume [m^3]; return whether."""
        alone = np.asarray(self._within[k] & (self._count == 1))
        if not alone.any():
            return False
        whole = self._shapes[k]
        self._leave_out(k)
        # Halves lie within the box around all, so that it has all cells in which they can protrude.
        around = self._points(*self._rows(alone))
        cells = self._outside(enclose(self._body, around, "box", whole.rotation))
        cells = cells[self._held[cells] == 0]
        protruding = self._positions(cells)
        best, least = None, allowed
        for halves in self._halves(whole, alone):
            boxes = [enclose(self._body, points, "box", whole.rotation) for points in halves]
            left = np.any([box.contains(protruding) for box in boxes], axis=0)
            tried = [(boxes, cells[left])]
            if whole.kind == "capsule":
                # Boxes around slices of a round body have corners.
                capsules = [_within_capsule(whole, points) for points in halves]
                both = np.concatenate([self._outside(capsule) for capsule in capsules])
                tried.append((capsules, np.unique(both)))
            for shapes, protruded in tried:
                added = self._added(protruded)
                if added < least:
                    best, least = list(zip(shapes, halves, strict=True)), added
        if best is None:
            self._put(k, whole)
            return False
        (first, own), (second, rest) = best
        self._put(k, self._tightest(first, own)[0])
        self._shapes.append(second)
        self._within.append(np.zeros_like(alone))
        self._cells.append(np.empty(0, np.int64))
        self._put(len(self._shapes) - 1, self._tightest(second, rest)[0])
        return True

    def _halves(self, shape: Primitive, alone: BoolArray) -> Iterable[list[FloatArray]]:
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

    def _tightest(self, shape: Primitive, points: FloatArray) -> tuple[Primitive, float]:
        """Return the shape around points that protrudes least where no other one does [m^3]."""
        tried = [shape, *_around(self._body, shape, points)]
        outside, costs = self._bare_near(points)
        starts = {box.quaternion: box.rotation for box in tried if box.kind == "box"}
        for start in starts.values():
            R = least_protruding(points, start, outside, costs, _INSIDE)
            tried.append(enclose(self._body, points, "box", R))
        total = [self._added(self._outside(s)) + _INSIDE * s.volume for s in tried]
        best = int(np.argmin(total))
        return tried[best], total[best]

    def _bare_near(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return cells near points that no shape contains, and what each costs.

        Returns:
            Positions outside the body [m], shape (n, 3), and costs [m^3], shape (n,).
        """
        solid = self._solid
        low, high = points.min(axis=0), points.max(axis=0)
        border = _NEAR * float(np.linalg.norm(high - low)) + 2 * solid.pitch
        around, first = solid.between(low - border, high + border)
        held, allowed = (
            a.reshape(solid.outside.shape)[around] for a in (self._held, self._allowed)
        )
        bare = (solid.outside[around] > 0.0) & (held == 0)
        cells = np.argwhere(bare)
        counts = np.where(allowed[bare], 1.0, 1.0 + _NEW)
        return (cells + first) * solid.pitch + solid.origin, counts * solid.pitch**3

    def _points(self, pieces: IntArray, inside: IntArray) -> FloatArray:
        """Return the corners of pieces and the points inside of given numbers, shape (n, 3)."""
        used = np.zeros(len(self._corners), np.bool_)
        used[self._index[pieces]] = True
        return hull_corners(np.concatenate([self._corners[used], self._inside[inside]]))

    def _positions(self, cells: IntArray) -> FloatArray:
        """Return the positions of cells [m], shape (n, 3)."""
        solid = self._solid
        at = np.stack(np.unravel_index(cells, solid.outside.shape), axis=1)
        return np.asarray(at * solid.pitch + solid.origin)

    def _rows(self, chosen: BoolArray) -> tuple[IntArray, IntArray]:
        """Return the numbers of the pieces and of the points inside that are chosen."""
        n = len(self._pieces)
        return np.flatnonzero(chosen[:n]), np.flatnonzero(chosen[n:])

    def _leave_out(self, k: int) -> None:
        self._count -= self._within[k]
        self._held[self._cells[k]] -= 1

    def _put(self, k: int, shape: Primitive) -> None:
        self._shapes[k] = shape
        self._within[k], self._cells[k] = self._contained(shape), self._outside(shape)
        self._count += self._within[k]
        self._held[self._cells[k]] += 1

    def _own(self, cells: IntArray) -> float:
        """Return the volume of the cells that one shape alone contains [m^3]."""
        return self._volume(cells[self._held[cells] == 1])

    def _added(self, cells: IntArray) -> float:
        """Return the volume of the cells that no shape contains [m^3].

        Those that no shape contained at first count as many times as is needed to avoid them.
        """
        bare = cells[self._held[cells] == 0]
        return self._volume(bare) + _NEW * self._volume(bare[~self._allowed[bare]])

    def _contained(self, shape: Primitive) -> BoolArray:
        return np.concatenate([contained(shape, self._pieces), shape.contains(self._inside)])

    def _outside(self, shape: Primitive) -> IntArray:
        """Return the cells outside the body that a shape contains, shape (n,)."""
        solid = self._solid
        around, first = solid.between(*shape.bounds)
        cells = np.argwhere(solid.outside[around] > 0.0) + first
        cells = cells[shape.contains(cells * solid.pitch + solid.origin)]
        return np.asarray(np.ravel_multi_index(tuple(cells.T), solid.outside.shape))


def _measured(triangles: FloatArray, pitch: float, reach: float) -> tuple[Solid, FloatArray]:
    """Return the space of a body, and points deep inside it that shapes should keep covered.

    Args:
        triangles: Corners [m], shape (n, 3, 3).
        pitch: Distance of the points of the grid [m].
        reach: Distance from the surface that the grid must cover [m].
    """
    extent = float(np.ptp(triangles, axis=(0, 1)).max())
    closing = max(CLOSING, _CLOSING_CELLS * pitch)
    balls = (closing, reach), (max(USUAL_CLOSING, extent / SPACINGS), 0.0)
    solid, wide = (
        measured(empty, origin, pitch) for empty, origin in spaces_outside(triangles, pitch, balls)
    )
    # The inside of a cover with openings that only the smaller ball enters.
    deep = wide.points(wide.depth > DEEP)
    cells = np.rint((deep - solid.origin) / pitch).astype(np.int64)
    outside = solid.outside.copy()
    outside[tuple(cells.T)] = 0.0
    inside = wide.points(wide.depth > max(DEEP, 4 * pitch))
    return replace(solid, outside=outside), thinned(inside, max(DEEP, extent / SPACINGS))


def _worth(solid: Solid, spots: Spots) -> NDArray[np.float32]:
    """Return how many times the cells of a grid count, shape (n,)."""
    worth = np.ones(solid.outside.shape, np.float32)
    for *centre, radius in spots:
        around, first = solid.between(np.array(centre) - radius, np.array(centre) + radius)
        cells = np.argwhere(np.ones(worth[around].shape, np.bool_)) + first
        near = np.linalg.norm(cells * solid.pitch + solid.origin - centre, axis=1) <= radius
        worth[tuple(cells[near].T)] = _SPOT
    return worth.ravel()


def _overhang(shapes: list[Primitive], triangles: FloatArray) -> float:
    """Return how far shapes reach beyond the box around triangles [m]."""
    low, high = np.array([shape.bounds for shape in shapes]).swapaxes(0, 1)
    below = triangles.min(axis=(0, 1)) - low.min(axis=0)
    return float(max(0.0, *below, *(high.max(axis=0) - triangles.max(axis=(0, 1)))))


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


def _around(body: str, shape: Primitive, points: FloatArray) -> list[Primitive]:
    """Return shapes that contain points of a shape: boxes, and a capsule within a capsule."""
    found = [
        enclose(body, points, "box", R) for R in (shape.rotation, tightest_orientation(points))
    ]
    if shape.kind == "capsule":
        found.append(_within_capsule(shape, points))
        found.append(enclose(body, points, "capsule", shape.rotation))
    return found


def _within_capsule(shape: Primitive, points: FloatArray) -> Primitive:
    """Return a capsule around the points of a capsule, on its axis."""
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
