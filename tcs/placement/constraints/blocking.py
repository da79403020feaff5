"""What an obstacle blocks: body poses that touch it, and stored solutions whose arm touches it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tcs.placement.constraints.contact import in_contact, point_distance
from tcs.placement.constraints.obstacles import Obstacle
from tcs.placement.constraints.postures import ROUNDING, Postures
from tcs.placement.store.robot_shapes import Primitives

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def blocked_bodies(obstacle: Obstacle, postures: Postures) -> BoolArray:
    """Return at which candidates the robot at rest touches an obstacle, shape (C,).

    With several rest postures, the arm must be free in each: which of them are free of what was
    scored is not stored.

    Args:
        obstacle: The obstacle.
        postures: The robot at the candidates.
    """
    shapes, body = postures.shapes, postures.shapes.at_stop
    first, inverse = postures.body_poses
    bound = body.bound + body.pad
    reach = float(np.max(np.linalg.norm(body.p[:, :2], axis=1) + bound, initial=0.0))
    frames = _Frames(obstacle, postures.base[first])
    reach += shapes.margin + ROUNDING
    near = np.flatnonzero(point_distance(obstacle.half[:2], frames.base[:, :2]) <= reach)
    torso_shift = shapes.torso_shift[postures.level[first[near]]]
    on_torso = (body.frame == 1).astype(np.float64)
    p_B = body.p.T[:, None] + on_torso * torso_shift.T[:, :, None]
    clearance = np.maximum(shapes.margin, body.pad) + ROUNDING
    blocked = np.zeros(len(first), dtype=np.bool_)
    distance = frames.distances(near, p_B.astype(np.float32))
    # A shape whose inscribed sphere meets the obstacle needs no closer test, nor do others of that
    # pose. Single precision is finer than the clearance.
    inside = np.any(distance <= body.inner, axis=1)
    blocked[near[inside]] = True
    pose, shape = np.nonzero((distance <= body.bound + clearance + ROUNDING) & ~inside[:, None])
    p_O = frames.to_obstacle(near[pose], p_B[:, pose, shape].T)
    R_OB = frames.rotation(near[pose])
    touching = _touching(obstacle, body, shape, R_OB @ body.R[shape], p_O, clearance)
    blocked[near[pose[touching]]] = True
    return np.asarray(blocked[inverse])


def blocked_solutions(obstacle: Obstacle, postures: Postures, admitted: BoolArray) -> BoolArray:
    """Return which stored solutions' arms touch an obstacle, shape (R,).

    Args:
        obstacle: The obstacle.
        postures: The arm in the stored solutions.
        admitted: Candidates to examine, shape (C,); solutions of others count as free.
    """
    shapes, arm = postures.shapes, postures.shapes.arm
    candidate, _ = postures.pairs
    middle, radius = postures.spheres
    frames = _Frames(obstacle, postures.base)
    # The arm of a candidate stays within a circle about its base, so that far ones are left out.
    to_base = point_distance(obstacle.half[:2], frames.base[:, :2])
    examined = np.flatnonzero((admitted & (to_base <= postures.reach + shapes.margin))[candidate])
    at = frames.to_obstacle(candidate[examined], middle[examined])
    near = examined[point_distance(obstacle.half, at) <= radius[examined] + shapes.margin]
    clearance = np.maximum(shapes.margin, arm.pad) + ROUNDING
    distance = frames.distances(candidate[near], postures.centres[:, near])
    blocked = np.zeros(len(candidate), dtype=np.bool_)
    inside = np.any(distance <= arm.inner, axis=1)
    blocked[near[inside]] = True
    close = (distance <= arm.bound + clearance + ROUNDING) & ~inside[:, None]
    row, shape = np.nonzero(close)
    links_R, links_p = postures.link_poses
    solution, link = near[row], arm.frame[shape] - 1
    R_BL = links_R[solution, link]
    p_B = links_p[solution, link] + np.einsum("nij,nj->ni", R_BL, arm.p[shape])
    of_pair = candidate[solution]
    touching = _touching(
        obstacle,
        arm,
        shape,
        frames.rotation(of_pair) @ R_BL @ arm.R[shape],
        frames.to_obstacle(of_pair, p_B),
        clearance,
    )
    blocked[near[row[touching]]] = True
    return blocked


def _touching(
    obstacle: Obstacle,
    primitives: Primitives,
    shape: IntArray,
    R: FloatArray,
    p: FloatArray,
    clearance: FloatArray,
) -> BoolArray:
    """Return which shapes, posed in the obstacle's frame, are too close to it, shape (n,)."""
    return in_contact(
        obstacle.half, primitives.type[shape], primitives.size[shape], R, p, clearance[shape]
    )


class _Frames:
    """Base poses in the frame of an obstacle, which is parallel to the floor."""

    def __init__(self, obstacle: Obstacle, base: FloatArray) -> None:
        """Express base poses (n, 3) [m, m, rad] in the obstacle's frame."""
        cos, sin = np.cos(obstacle.yaw), np.sin(obstacle.yaw)
        dx, dy = base[:, 0] - obstacle.x, base[:, 1] - obstacle.y
        self.base = np.stack(
            [cos * dx + sin * dy, cos * dy - sin * dx, np.full(len(base), -obstacle.centre[2])],
            axis=1,
        )
        """Origin of each base in the obstacle's frame [m], shape (n, 3)."""
        self._half = obstacle.half
        self._cos = np.cos(base[:, 2] - obstacle.yaw)
        self._sin = np.sin(base[:, 2] - obstacle.yaw)

    def to_obstacle(self, which: IntArray, p_B: FloatArray) -> FloatArray:
        """Return points (m, 3) of bases `which` (m,) in the obstacle's frame."""
        cos, sin = self._cos[which], self._sin[which]
        x, y, z = p_B.T
        p_O = self.base[which]
        p_O[:, 0] += cos * x - sin * y
        p_O[:, 1] += sin * x + cos * y
        p_O[:, 2] += z
        return p_O

    def distances(self, which: IntArray, p_B: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the distance of points (3, m, k) of bases `which` from the obstacle, (m, k).

        In single precision, for a first test of many points.
        """
        base, half = self.base[which].astype(np.float32), self._half.astype(np.float32)
        cos, sin = (c[which, None].astype(np.float32) for c in (self._cos, self._sin))
        x, y, z = p_B
        squares = np.zeros(x.shape, dtype=np.float32)
        for axis, p in enumerate((cos * x - sin * y, sin * x + cos * y, z.copy())):
            p += base[:, axis, None]
            np.abs(p, out=p)
            p -= half[axis]
            np.maximum(p, 0.0, out=p)
            p *= p
            squares += p
        return np.sqrt(squares)

    def rotation(self, which: IntArray) -> FloatArray:
        """Return the orientations of bases `which` in the obstacle's frame, shape (m, 3, 3)."""
        R = np.zeros((len(which), 3, 3))
        R[:, 0, 0] = R[:, 1, 1] = self._cos[which]
        R[:, 1, 0] = self._sin[which]
        R[:, 0, 1] = -R[:, 1, 0]
        R[:, 2, 2] = 1.0
        return R
