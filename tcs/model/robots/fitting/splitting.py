"""Shapes of a body split where they are struck by boxes that its surface clears."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np
from joblib import delayed

from tcs.kernel.collide import BOUND
from tcs.model.robots.fitting.bounding import enclose, tightest_orientation
from tcs.model.robots.fitting.cleared_boxes import (
    Boxes,
    cleared_boxes,
    touched_by_box,
    touched_rows,
)
from tcs.model.robots.fitting.enclosure import surfaces_to_enclose
from tcs.model.robots.fitting.filling import fillers
from tcs.model.robots.fitting.orienting import least_costly
from tcs.model.robots.fitting.processes import ordered
from tcs.model.robots.fitting.shared_surface import (
    BoolArray,
    FloatArray,
    IntArray,
    SharedSurface,
    around,
    by_body,
    within_capsule,
)
from tcs.model.robots.fitting.tightening import space_of
from tcs.model.robots.primitives import Primitive
from tcs.model.robots.robot_file import RobotFile

DRAWS = 300_000
"""Boxes that are drawn about a body."""
CELLS = 300_000
"""Most points of the grid in the box around a body that tells where its inside is."""
PIECES = 80
"""Pieces of the surface along a body, at least."""
GUARDED = 0.005
"""Distance from all shapes [m] up to which new ones should not protrude: where two bodies pass each
other, what their shapes leave free now is in use."""
GUARDS = 20_000
"""Most points there by which that is noticed."""
_GUARD = 1e-3
"""Cost of such a point in a new shape, as a fraction of the boxes near."""
_GRID = 500_000
"""Most points of the grid in the box around all shapes from which those are taken."""
_TOUCHING = 1e-4
"""Distance within which a point counts as being in a shape [m]: rounding may take a shape there."""
_WORTH = 0.0006
"""Least decrease of the cost for which a shape is split, as a fraction of the boxes near."""
_MERGED = 0.0004
"""Greatest increase of the cost for which a shape is saved, as such a fraction."""
_ROUND = 16
"""Most shapes that are split before all are reduced again."""
_REFINED = 6
"""Cuts for which both halves are rotated, the best ones without that."""
_VOLUME = 0.01
"""Cost of as much volume as all shapes have together, in boxes: of two that strike the same boxes
the smaller is taken."""


def split_where_struck(
    robot: RobotFile,
    shapes: Iterable[Primitive],
    most: Mapping[str, int],
    *,
    draws: int = DRAWS,
    jobs: int = 1,
) -> tuple[Primitive, ...]:
    """Return primitives that enclose a robot, those of some bodies struck by fewer boxes.

    Random boxes show where the shapes of a body are in the way of what its surface clears. Each
    shape is reduced to what it alone contains, and turned, so that it strikes the fewest; shapes
    whose union strikes no more become one; then those that strike most are split in two, round
    after round. What protrudes where no shape did is avoided, so that links pass each other as
    before.

    Args:
        robot: The robot.
        shapes: Primitives that enclose it.
        most: Largest number of shapes, by body; a body that has more gets no further ones.
        draws: Boxes that are drawn about each body.
        jobs: Number of processes, each of which takes a body at a time.

    Raises:
        UnknownNameError: If a body has no primitive.
        RobotError: If a mesh cannot be read, or primitives do not enclose the surface of a body.
    """
    surfaces = {body: surface for body, (_, _, surface) in surfaces_to_enclose(robot).items()}
    found = by_body(robot, shapes, most, surfaces)
    calls = (
        delayed(_split_body)(robot, body, found[body], surfaces, number, draws)
        for body, number in most.items()
    )
    new = ordered(jobs, calls)
    found |= dict(zip(most, new, strict=True))
    return tuple(shape for fitted in found.values() for shape in fitted)


def _split_body(
    robot: RobotFile,
    body: str,
    shapes: tuple[Primitive, ...],
    surfaces: Mapping[str, FloatArray],
    most: int,
    draws: int,
) -> tuple[Primitive, ...]:
    """Return the shapes of one body, split in rounds until there are so many."""
    boxes = cleared_boxes(robot, body, shapes, surfaces, draws=draws)
    splitting = Splitting(body, shapes, surfaces[body], boxes)
    splitting.reduce()
    splitting.merge()
    while (room := most - len(splitting.shapes)) > 0:
        before = splitting.struck, len(splitting.shapes)
        splitting.split(min(room, _ROUND))
        # What shapes leave each other has changed.
        splitting.reduce()
        splitting.merge()
        if (splitting.struck, len(splitting.shapes)) == before:
            break
    new = splitting.shapes
    # The largest first: they are the likeliest to touch anything.
    filled = (*new, *fillers(body, new, surfaces[body]))
    return tuple(sorted(filled, key=lambda shape: -shape.volume))


class _Near(NamedTuple):
    """What shapes around some points may hold, and none does."""

    rows: FloatArray
    """Packed boxes, shape (n, 17)."""
    guards: FloatArray
    """Guarded points [m], shape (m, 3)."""


class Splitting(SharedSurface):
    """Shapes that contain a surface together, in the way of as few boxes as possible.

    What they should leave free are boxes, and after them points where no shape was.
    """

    def __init__(
        self,
        body: str,
        shapes: Iterable[Primitive],
        triangles: FloatArray,
        boxes: Boxes,
    ) -> None:
        """Find the space that stays free, and cut the surface into pieces.

        Args:
            body: Name of the body.
            shapes: Shapes that enclose the triangles.
            triangles: Corners in the frame of the body [m], shape (n, 3, 3).
            boxes: Boxes near the shapes that the surface clears.
        """
        shapes = tuple(shapes)
        self._boxes, self._guards = boxes, border_points(shapes)
        self._guard_cost = _GUARD * len(boxes)
        self._costs = np.ones(len(boxes) + len(self._guards))
        self._costs[len(boxes) :] = self._guard_cost
        self._per_volume = _VOLUME / sum(shape.volume for shape in shapes)
        extent = float(np.ptp(triangles, axis=(0, 1)).max())
        pitch = float(np.cbrt(np.ptp(triangles, axis=(0, 1)).prod() / CELLS))
        _, inside = space_of(triangles, pitch, 0.0)
        super().__init__(body, shapes, (triangles, inside), extent / PIECES, len(self._costs))

    @property
    def struck(self) -> int:
        """Number of boxes that a shape touches."""
        return int(np.count_nonzero(self._held[: len(self._boxes)]))

    @property
    def protruding(self) -> int:
        """Number of points where no shape was that one contains now."""
        return int(np.count_nonzero(self._held[len(self._boxes) :]))

    def split(self, most: int, worth: float | None = None) -> None:
        """Split the shapes that strike most boxes in two, one after the other.

        Args:
            most: Largest number of shapes that are added.
            worth: Least decrease of the cost for which a shape is split, in boxes; None is a
                fraction of those near.
        """
        super().split(most, _WORTH * len(self._boxes) if worth is None else worth)

    def merge(self, worth: float | None = None) -> None:
        """Replace two shapes by one where that costs little, beginning with the smallest.

        Args:
            worth: Greatest increase of the cost for which a shape is saved, in boxes; None is a
                fraction of those near.
        """
        allowed = _MERGED * len(self._boxes) if worth is None else worth
        for shape in sorted(self._shapes, key=lambda shape: shape.volume):
            # Others that came before have taken the place of some.
            for k in [n for n, other in enumerate(self._shapes) if other is shape]:
                self._merge(k, allowed)

    def _merge(self, k: int, allowed: float) -> None:
        """Merge a shape with the one with which that costs least, if it does not cost too much."""
        low, high = self._shapes[k].bounds
        best, least, around_both = -1, allowed, np.empty((0, 3))
        for other, shape in enumerate(self._shapes):
            least_other, greatest_other = shape.bounds
            if other == k or (least_other > high).any() or (greatest_other < low).any():
                continue
            before, points = self._both_alone(k, other)
            if len(points):
                near = self._near(points)
                for R in (shape.rotation, self._shapes[k].rotation):
                    more = self._box_cost(points, R, near) - before
                    if more < least:
                        best, least, around_both = other, more, points
            self._put_back(k)
            self._put_back(other)
        if best < 0:
            return
        self._both_alone(k, best)
        R = self._shapes[best].rotation
        merged, _ = self._fitted(enclose(self._body, around_both, "box", R), around_both)
        self._put(best, merged)
        self._remove(k)

    def _both_alone(self, k: int, other: int) -> tuple[float, FloatArray]:
        """Leave two shapes out; return what they cost, and the points they alone contain."""
        self._leave_out(k)
        self._leave_out(other)
        alone = (self._within[k] | self._within[other]) & (self._count == 0)
        held = np.unique(np.concatenate([self._holds[k], self._holds[other]]))
        if not alone.any():
            return self._added(held), np.empty((0, 3))
        return self._added(held), self._points(*self._rows(alone))

    def _cost(self, numbers: IntArray) -> float:
        return float(self._costs[numbers].sum())

    def _held_by(self, shape: Primitive) -> IntArray:
        boxes = np.flatnonzero(touched_rows(shape, self._boxes.rows))
        guards = np.flatnonzero(shape.contains(self._guards))
        return np.concatenate([boxes, guards + len(self._boxes)])

    def _tightest(self, shape: Primitive, points: FloatArray) -> Primitive:
        return self._fitted(shape, points)[0]

    def _halved(
        self, shape: Primitive, alone: BoolArray, allowed: float
    ) -> tuple[Primitive, Primitive] | None:
        options: list[tuple[float, int, list[Primitive], list[FloatArray]]] = []
        for halves in self._parted(shape, alone):
            kinds = [[enclose(self._body, p, "box", shape.rotation) for p in halves]]
            if shape.kind == "capsule":
                # Boxes around slices of a round body have corners.
                kinds.append([within_capsule(shape, points) for points in halves])
            for pair in kinds:
                held = np.unique(np.concatenate([self._held_by(half) for half in pair]))
                options.append((self._added(held), len(options), pair, halves))
        best, least = None, allowed
        for _, _, pair, halves in sorted(options, key=lambda option: option[:2])[:_REFINED]:
            first, one = self._fitted(pair[0], halves[0])
            held = self._held_by(first)
            # The second is not to hold what the first does already.
            self._held[held] += 1
            second, other = self._fitted(pair[1], halves[1])
            self._held[held] -= 1
            if one + other < least:
                best, least = (first, second), one + other
        return best

    def _fitted(self, shape: Primitive, points: FloatArray) -> tuple[Primitive, float]:
        """Return the shape around points that costs least, and what it adds to the cost."""
        near = self._near(points)
        starts = [shape.rotation, tightest_orientation(points)]
        turned = [least_costly(R, lambda R: self._box_cost(points, R, near)) for R in starts]
        tried = [shape, *around(self._body, shape, points)]
        tried += [enclose(self._body, points, "box", R) for R in turned]
        costs = [self._shape_cost(one, near) for one in tried]
        best = int(np.argmin(costs))
        return tried[best], costs[best]

    def _near(self, points: FloatArray) -> _Near:
        """Return what is near points, and what holding it costs."""
        low, high = points.min(axis=0), points.max(axis=0)
        # A box around points of any orientation is within twice the sphere around them.
        centre, reach = (low + high) / 2, float(np.linalg.norm(high - low))
        rows, n = self._boxes.rows, len(self._boxes)
        boxes = np.linalg.norm(self._boxes.p - centre, axis=1) < reach + rows[:, BOUND]
        guards = np.linalg.norm(self._guards - centre, axis=1) < reach
        boxes, guards = boxes & (self._held[:n] == 0), guards & (self._held[n:] == 0)
        return _Near(rows[boxes], self._guards[guards])

    def _box_cost(self, points: FloatArray, R: FloatArray, near: _Near) -> float:
        """Return the cost of the box around points with an orientation."""
        seen = points @ R
        low, high = seen.min(axis=0), seen.max(axis=0)
        half, p = (high - low) / 2, R @ ((low + high) / 2)
        held = (np.abs((near.guards - p) @ R) <= half).all(axis=1)
        struck = touched_by_box(half, R, p, near.rows)
        return self._sum(struck, held) + self._per_volume * float((high - low).prod())

    def _shape_cost(self, shape: Primitive, near: _Near) -> float:
        held = shape.contains(near.guards)
        struck = touched_rows(shape, near.rows)
        return self._sum(struck, held) + self._per_volume * shape.volume

    def _sum(self, struck: BoolArray, held: BoolArray) -> float:
        return np.count_nonzero(struck) + self._guard_cost * np.count_nonzero(held)

    def _added(self, numbers: IntArray) -> float:
        """Return the cost of holding what has these numbers and no shape holds."""
        return self._cost(numbers[self._held[numbers] == 0])


def border_points(shapes: Iterable[Primitive]) -> FloatArray:
    """Return points that no shape contains, within `GUARDED` of one [m], shape (n, 3)."""
    shapes = tuple(shapes)
    low, high = np.array([shape.bounds for shape in shapes]).swapaxes(0, 1)
    low, high = low.min(axis=0) - GUARDED, high.max(axis=0) + GUARDED
    pitch = float(np.cbrt((high - low).prod() / _GRID))
    axes = [np.arange(a, b, pitch) for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    # Faces along the axes would pass between all points of a layer at once.
    points += np.random.default_rng(0).uniform(-pitch / 2, pitch / 2, points.shape)
    is_near, is_within = np.zeros((2, len(points)), np.bool_)
    for shape in shapes:
        least, greatest = shape.bounds + np.array([[-GUARDED], [GUARDED]])
        some = np.flatnonzero(((points > least) & (points < greatest)).all(axis=1))
        is_near[some] |= shape.contains(points[some], tolerance=GUARDED)
        is_within[some] |= shape.contains(points[some], tolerance=_TOUCHING)
    points = points[is_near & ~is_within]
    if len(points) > GUARDS:
        points = points[np.random.default_rng(0).choice(len(points), GUARDS, replace=False)]
    return np.asarray(points)
