"""Shapes of a body split where they are struck by boxes that its surface clears."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numba
import numpy as np
from joblib import delayed
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from tcs.kernel.arrays import BOX, CAPSULE, SPHERE, Shapes
from tcs.kernel.collide import BOUND, closer, pack, spheres_overlap
from tcs.model.robots.extras import model_with_extras
from tcs.model.robots.primitives import Primitive
from tcs.model.robots.robot_file import RobotFile
from tcs.model.robots.urdf.pose import pose_in_root
from tcs_shapes.bodies import surfaces_to_enclose
from tcs_shapes.bounding import enclose, tightest_orientation
from tcs_shapes.processes import ordered
from tcs_shapes.shared_surface import (
    BoolArray,
    FloatArray,
    IntArray,
    SharedSurface,
    around,
    by_body,
    least_costly,
    within_capsule,
)
from tcs_shapes.solids import fillers
from tcs_shapes.tightening import space_of

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
Pose = tuple[FloatArray, FloatArray]
"""Orientation, shape (3, 3), and position [m], shape (3,)."""

EDGES = (0.02, 0.4)
"""Least and greatest edge of a box [m]."""
MARGIN = 0.001
"""Distance that bodies must keep from a box [m], the default of an environment."""
NEAR = 0.003
"""Distance beyond the margin [m] up to which a box counts as close to a shape."""
POSTURES = 200
"""Random postures of the arm in which a box must be clear of its other links."""
_TYPES = {"sphere": SPHERE, "capsule": CAPSULE, "box": BOX}
_FACTORS = {"sphere": np.ones(1), "capsule": np.array([1.0, 0.5]), "box": np.full(3, 0.5)}
"""The kernel's half sizes over the sizes of a primitive."""


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


@dataclass(frozen=True, slots=True, eq=False)
class Boxes:
    """Boxes in the frame of a body.

    Attributes:
        half: Half their sizes [m], shape (n, 3).
        R: Their orientations, shape (n, 3, 3).
        p: Their centres [m], shape (n, 3).
        rows: The same as packed shapes of the kernel, shape (n, 17).
    """

    half: FloatArray
    R: FloatArray
    p: FloatArray
    rows: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        n = len(self.half)
        object.__setattr__(self, "rows", _packed(np.full(n, BOX), self.half, self.R, self.p))

    def __len__(self) -> int:
        return len(self.half)

    def some(self, chosen: NDArray[np.generic]) -> Boxes:
        """Return some of the boxes, by number or by truth."""
        return Boxes(self.half[chosen], self.R[chosen], self.p[chosen])


def touched(shape: Primitive, boxes: Boxes) -> BoolArray:
    """Return which boxes are closer than the margin to a shape, shape (n,)."""
    return touched_rows(shape, boxes.rows)


def touched_rows(shape: Primitive, rows: FloatArray) -> BoolArray:
    """Return the same for the rows of boxes, shape (n, 17)."""
    size = np.zeros((1, 3))
    size[0, : len(shape.size)] = np.array(shape.size) * _FACTORS[shape.kind]
    kind, p = np.array([_TYPES[shape.kind]]), np.array([shape.xyz])
    return np.asarray(_closer_rows(_packed(kind, size, shape.rotation[None], p), rows))


def touched_by_box(half: FloatArray, R: FloatArray, p: FloatArray, rows: FloatArray) -> BoolArray:
    """Return which boxes are closer than the margin to a box, shape (n,).

    Args:
        half: Half the sizes of the box [m], shape (3,).
        R: Its orientation, shape (3, 3).
        p: Its centre [m], shape (3,).
        rows: Rows of the others, in the same frame, shape (n, 17).
    """
    row = _packed(np.array([BOX]), half[None], R[None], p[None])
    return np.asarray(_closer_rows(row, rows))


def _packed(
    kinds: NDArray[np.integer], size: FloatArray, R: FloatArray, p: FloatArray
) -> FloatArray:
    n = len(kinds)
    none = np.zeros(n)
    shapes = Shapes(
        type=kinds.astype(np.int8),
        size=size,
        pad=none,
        body=none.astype(np.int16),
        frame=none.astype(np.int8),
        R=R[None],
        p=p[None],
    )
    return np.asarray(pack(shapes)[0])


@numba.njit()
def _closer_rows(row: FloatArray, rows: FloatArray) -> BoolArray:
    """Return which packed shapes are closer than the margin to the one of a row, shape (n,)."""
    found = np.zeros(len(rows), np.bool_)
    for j in range(len(rows)):
        if spheres_overlap(row, 0, rows, j, MARGIN):
            found[j] = closer(row, 0, rows, j, MARGIN)
    return found


class Surface:
    """The surface of a body, to be told whether a box clears it."""

    def __init__(self, triangles: FloatArray) -> None:
        """Find the hull of triangles of shape (n, 3, 3) [m]."""
        self._triangles = triangles
        low, high = triangles.min(axis=1), triangles.max(axis=1)
        self._middle, self._reach = (low + high) / 2, (high - low) / 2
        points = triangles.reshape(-1, 3)
        self.low, self.high = points.min(axis=0), points.max(axis=0)
        self._centre = (self.low + self.high) / 2
        self._radius = float(np.linalg.norm(points - self._centre, axis=1).max())
        try:
            self._faces = np.asarray(ConvexHull(points).equations)
        except QhullError:
            # Flat: it contains nothing.
            self._faces = np.array([[0.0, 0.0, 0.0, 1.0]])

    def is_clear(self, half: FloatArray, R: FloatArray, p: FloatArray) -> bool:
        """Return whether a box keeps the margin, grown by which it meets no triangle.

        A box whose centre is within the convex hull is not clear: it may be within the surface.

        Args:
            half: Half the sizes of the box [m], shape (3,).
            R: Its orientation, shape (3, 3).
            p: Its centre in the frame of the triangles [m], shape (3,).
        """
        half = half + MARGIN
        away = p - self._centre
        if np.linalg.norm(away) > self._radius + np.linalg.norm(half):
            return True
        if np.all(self._faces[:, :3] @ p + self._faces[:, 3] <= 0.0):
            return False
        apart = np.abs(self._middle - p) > self._reach + np.abs(R) @ half
        near = self._triangles[~apart.any(axis=1)]
        return not _meets(half, (near - p) @ R).any()


def _meets(half: FloatArray, triangles: FloatArray) -> BoolArray:
    """Return which triangles meet a box about the origin, shape (n,).

    Args:
        half: Half the sizes of the box [m], shape (3,).
        triangles: Corners in the frame of the box [m], shape (n, 3, 3).
    """
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    triangles = triangles[((low <= half) & (high >= -half)).all(axis=1)]
    edges = np.roll(triangles, -1, axis=1) - triangles
    normals = np.cross(edges[:, 0], edges[:, 1])
    axes = [normals]
    for k in range(3):
        for unit in np.eye(3):
            axes.append(np.cross(edges[:, k], unit))
    apart = np.zeros(len(triangles), np.bool_)
    for axis in axes:
        seen = np.einsum("nij,nj->ni", triangles, axis)
        reach = np.abs(axis) @ half
        apart |= (seen.min(axis=1) > reach) | (seen.max(axis=1) < -reach)
    return ~apart


def cleared_boxes(
    robot: RobotFile,
    body: str,
    shapes: Iterable[Primitive],
    surfaces: Mapping[str, FloatArray],
    *,
    draws: int,
    seed: int = 0,
) -> Boxes:
    """Return random boxes that the surfaces of the arm clear, and that shapes of a body come near.

    Boxes are drawn evenly about the body, with edges of 2 to 40 cm. In a random posture of the arm,
    another for each box, none of its other links touches it either.

    Args:
        robot: The robot.
        body: Name of the body.
        shapes: Its shapes.
        surfaces: Surface of each body in its frame [m], shapes (n, 3, 3).
        draws: Number of boxes that are drawn.
        seed: Seed of the draws.

    Returns:
        Boxes in the frame of the body that a shape is closer to than `MARGIN` and `NEAR`.

    Raises:
        RobotError: If the robot's model cannot be used.
    """
    rng = np.random.default_rng(seed)
    own = Surface(surfaces[body])
    reach = EDGES[1] * np.sqrt(3) / 2 + MARGIN + NEAR
    boxes = Boxes(
        half=rng.uniform(*EDGES, (draws, 3)) / 2,
        R=Rotation.random(draws, rng=rng).as_matrix(),
        p=rng.uniform(own.low - reach, own.high + reach, (draws, 3)),
    )
    near = np.zeros(draws, np.bool_)
    for shape in shapes:
        left = np.flatnonzero(~near)
        near[left] = touched(shape.shrunk(-NEAR), boxes.some(left))
    boxes = boxes.some(near)
    is_clear = [own.is_clear(*box) for box in zip(boxes.half, boxes.R, boxes.p, strict=True)]
    boxes = boxes.some(np.array(is_clear, np.bool_))
    others, poses = _other_links(robot, body, surfaces, rng)
    clear = []
    for i, box in enumerate(zip(boxes.half, boxes.R, boxes.p, strict=True)):
        posture = poses[i % len(poses)]
        clear.append(all(_keeps_clear(others[name], posture[name], box) for name in others))
    return boxes.some(np.array(clear, np.bool_))


def _other_links(
    robot: RobotFile,
    body: str,
    surfaces: Mapping[str, FloatArray],
    rng: np.random.Generator,
) -> tuple[dict[str, Surface], list[dict[str, Pose]]]:
    """Return the other links of the arm, and in random postures the pose of the body in each."""
    model = model_with_extras(robot)
    names = model.links_moved_by(robot.arm_joints[0]) & surfaces.keys() - {body}
    others = {name: Surface(surfaces[name]) for name in sorted(names)}
    limits, rest = robot.joint_limits(), robot.joint_positions()
    low, high = np.array([limits[name] for name in robot.arm_joints]).clip(-np.pi, np.pi).T
    found = []
    for drawn in rng.uniform(low, high, (POSTURES, len(low))):
        at = robot.with_mimics(rest | dict(zip(robot.arm_joints, map(float, drawn), strict=True)))
        R_AB, p_AB = pose_in_root(model, body, at)
        posture = {}
        for name in others:
            R_AC, p_AC = pose_in_root(model, name, at)
            posture[name] = (R_AC.T @ R_AB, R_AC.T @ (p_AB - p_AC))
        found.append(posture)
    return others, found


def _keeps_clear(
    surface: Surface, pose: Pose, box: tuple[FloatArray, FloatArray, FloatArray]
) -> bool:
    """Return whether a surface clears a box, given the pose of the box's frame in its own."""
    (R, p), (half, R_box, p_box) = pose, box
    return surface.is_clear(half, R @ R_box, R @ p_box + p)
