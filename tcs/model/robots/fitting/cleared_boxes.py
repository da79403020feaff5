"""Random boxes that the surface of a body clears, and which of them a shape touches."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from tcs.kernel.arrays import BOX, CAPSULE, SPHERE, Shapes
from tcs.kernel.collide import closer, pack, spheres_overlap
from tcs.model.robots.extras import model_with_extras
from tcs.model.robots.primitives import Primitive
from tcs.model.robots.robot_file import RobotFile
from tcs.model.robots.urdf.pose import pose_in_root

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
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
