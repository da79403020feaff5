"""Shapes of a body made tighter: each is reduced to what it alone contains, or split in two."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from joblib import delayed
from numpy.typing import NDArray

from tcs.model.robots.primitives import Primitive
from tcs.model.robots.robot_file import RobotFile
from tcs_shapes.bodies import surfaces_to_enclose
from tcs_shapes.bounding import enclose
from tcs_shapes.containment import set_cells_within
from tcs_shapes.covering import rounded_box, thinned
from tcs_shapes.processes import ordered
from tcs_shapes.shared_surface import (
    BoolArray,
    FloatArray,
    IntArray,
    SharedSurface,
    around,
    by_body,
    least_protruding,
    within_capsule,
)
from tcs_shapes.solids import CLOSING as USUAL_CLOSING
from tcs_shapes.solids import Solid, fillers, measured, spaces_outside

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
    surfaces, tasks = surfaces_to_enclose(robot), {}
    found = by_body(robot, shapes, splits, surfaces)
    for body, most in splits.items():
        given = (*found[body], *rounds.get(body, ()))
        tasks[body] = body, given, surfaces[body][2], spots.get(body, ()), most
    # The longest first: the one that is left at the end should be short.
    order = sorted(tasks, key=lambda body: -len(tasks[body][1]) * len(tasks[body][2]))
    tight = ordered(jobs, (delayed(_tightened_body)(*tasks[body]) for body in order))
    found |= dict(zip(order, tight, strict=True))
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


class Tightening(SharedSurface):
    """Shapes that contain a surface together, each reduced to what the others leave.

    What they should leave free are the cells of a grid outside the body.
    """

    def __init__(
        self,
        body: str,
        shapes: Iterable[Primitive],
        triangles: FloatArray,
        spots: Spots = (),
    ) -> None:
        """Measure the space outside, and cut the surface into pieces that each lie in a shape.

        Args:
            body: Name of the body.
            shapes: Shapes that enclose the triangles.
            triangles: Corners in the frame of the body [m], shape (n, 3, 3).
            spots: Where volume outside counts most.
        """
        shapes = tuple(shapes)
        volume = float(np.ptp(triangles, axis=(0, 1)).prod())
        pitch = max(FINEST_PITCH, float(np.cbrt(volume / (SPOT_CELLS if spots else CELLS))))
        self._solid, inside = space_of(triangles, pitch, _overhang(shapes, triangles))
        self._is_outside = self._solid.outside > 0.0
        self._worth = _worth(self._solid, spots)
        longest = max(PIECE, 2 * pitch)
        super().__init__(body, shapes, (triangles, inside), longest, self._solid.outside.size)
        self._allowed = self._held > 0

    @property
    def excess(self) -> float:
        """Volume of all shapes together that is outside the body [m^3]."""
        return float(np.count_nonzero(self._held)) * self._solid.pitch**3

    def _cost(self, numbers: IntArray) -> float:
        """Return the volume of cells, with that in spots as often as it counts [m^3]."""
        return float(self._worth[numbers].sum(dtype=np.float64)) * self._solid.pitch**3

    def split(self, most: int, worth: float | None = None) -> None:
        """Split the shapes that protrude most in two, one after the other.

        Args:
            most: Largest number of shapes that are added.
            worth: Least decrease of the volume outside for which a shape is split [m^3]; None is a
                fraction of all of it.
        """
        least = _WORTH * self._cost(np.flatnonzero(self._held)) if worth is None else worth
        super().split(most, least)

    def _halved(
        self, shape: Primitive, alone: BoolArray, allowed: float
    ) -> tuple[Primitive, Primitive] | None:
        # Halves lie within the box around all, so that it has all cells in which they can protrude.
        points = self._points(*self._rows(alone))
        cells = self._held_by(enclose(self._body, points, "box", shape.rotation))
        cells = cells[self._held[cells] == 0]
        protruding = self._positions(cells)
        best, least = None, allowed
        for halves in self._parted(shape, alone):
            boxes = [enclose(self._body, points, "box", shape.rotation) for points in halves]
            left = np.any([box.contains(protruding) for box in boxes], axis=0)
            tried = [(boxes, cells[left])]
            if shape.kind == "capsule":
                # Boxes around slices of a round body have corners.
                capsules = [within_capsule(shape, points) for points in halves]
                both = np.concatenate([self._held_by(capsule) for capsule in capsules])
                tried.append((capsules, np.unique(both)))
            for shapes, protruded in tried:
                added = self._added(protruded)
                if added < least:
                    best, least = list(zip(shapes, halves, strict=True)), added
        if best is None:
            return None
        (first, own), (second, rest) = best
        first = self._tightest(first, own)
        # The second is not to hold what the first does already.
        held = self._held_by(first)
        self._held[held] += 1
        second = self._tightest(second, rest)
        self._held[held] -= 1
        return first, second

    def _tightest(self, shape: Primitive, points: FloatArray) -> Primitive:
        tried = [shape, *around(self._body, shape, points)]
        outside, costs = self._bare_near(points)
        starts = {box.quaternion: box.rotation for box in tried if box.kind == "box"}
        for start in starts.values():
            R = least_protruding(points, start, outside, costs, _INSIDE)
            tried.append(enclose(self._body, points, "box", R))
        total = [self._added(self._held_by(s)) + _INSIDE * s.volume for s in tried]
        return tried[int(np.argmin(total))]

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

    def _positions(self, cells: IntArray) -> FloatArray:
        """Return the positions of cells [m], shape (n, 3)."""
        solid = self._solid
        at = np.stack(np.unravel_index(cells, solid.outside.shape), axis=1)
        return np.asarray(at * solid.pitch + solid.origin)

    def _added(self, cells: IntArray) -> float:
        """Return the volume of the cells that no shape contains [m^3].

        Those that no shape contained at first count as many times as is needed to avoid them.
        """
        bare = cells[self._held[cells] == 0]
        return self._cost(bare) + _NEW * self._cost(bare[~self._allowed[bare]])

    def _held_by(self, shape: Primitive) -> IntArray:
        solid = self._solid
        around, first = solid.between(*shape.bounds)
        ends = np.stack([first, [part.stop - 1 for part in around]])
        held = rounded_box(shape)
        return set_cells_within(held, self._is_outside, ends, solid.origin, solid.pitch)


def space_of(triangles: FloatArray, pitch: float, reach: float) -> tuple[Solid, FloatArray]:
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
        measured(empty, origin, pitch, 0.0)
        for empty, origin in spaces_outside(triangles, pitch, balls)
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


def _overhang(shapes: Iterable[Primitive], triangles: FloatArray) -> float:
    """Return how far shapes reach beyond the box around triangles [m]."""
    low, high = np.array([shape.bounds for shape in shapes]).swapaxes(0, 1)
    below = triangles.min(axis=(0, 1)) - low.min(axis=0)
    return float(max(0.0, *below, *(high.max(axis=0) - triangles.max(axis=(0, 1)))))
