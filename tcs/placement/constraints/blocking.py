"""What an obstacle blocks: body poses that touch it, and stored solutions whose arm touches it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tcs.model.grid import Grid
from tcs.placement.constraints.contact import in_contact, point_distance
from tcs.placement.constraints.obstacles import Obstacle
from tcs.placement.store.robot_shapes import Primitives, RobotShapes
from tcs.placement.tables import ScoreTable, SetTable

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

ROUNDING = 1e-5
"""Added to radii and clearances [m]: joints stored as float32 move a link by up to 4e-6 m, and
centres kept as float32 are rounded by 2e-7 m."""


@dataclass(frozen=True, eq=False)
class Postures:
    """The robot at each candidate, and its arm in each stored solution of a hand.

    They are independent of a query.
    """

    shapes: RobotShapes
    """The robot's shapes."""
    sets: SetTable
    """The candidates."""
    grid: Grid
    """Their grid."""
    scores: ScoreTable
    """The stored solutions."""
    hand: int = 0
    """Number of the hand of the shapes, whose solutions count."""

    @cached_property
    def base(self) -> FloatArray:
        """x, y [m] and heading [rad] of the base of each candidate in W, shape (C, 3)."""
        values = self.grid.values(self.sets.candidates)
        return np.stack([values[name] for name in ("base_x", "base_y", "base_yaw")], axis=1)

    @cached_property
    def level(self) -> IntArray:
        """Torso level of each candidate, shape (C,)."""
        return self.grid.indices(self.sets.candidates)[:, -1]

    @cached_property
    def body_poses(self) -> tuple[IntArray, IntArray]:
        """A candidate for each distinct pose of the body, and the pose of each candidate.

        Shapes (U,) and (C,). The body is the same in all states of the environment.
        """
        _, first, inverse = np.unique(
            self.sets.candidates % self.grid.state_size, return_index=True, return_inverse=True
        )
        return first.astype(np.int64), inverse.astype(np.int64)

    @cached_property
    def pairs(self) -> tuple[IntArray, IntArray]:
        """Candidate and goal of each stored solution of a candidate, shapes (R,)."""
        candidate, goal = np.nonzero(self.sets.served == self.hand + 1)
        return candidate.astype(np.int64), goal.astype(np.int64)

    @cached_property
    def joints(self) -> FloatArray:
        """Arm joints of these solutions [rad], shape (R, 7)."""
        candidate, goal = self.pairs
        stored = np.flatnonzero(self.scores.reached)
        flat = self.sets.candidates[candidate].astype(np.int64) * self.scores.goals + goal
        return self.scores.arm_joints[np.searchsorted(stored, flat)].astype(np.float64)

    @cached_property
    def centres(self) -> NDArray[np.float32]:
        """Centre of each arm shape in B in each solution [m], by coordinate, shape (3, R, n).

        Float32, which is enough to find the shapes near an obstacle.
        """
        links_R, links_p = self.link_poses
        arm = self.shapes.arm
        centres = np.empty((3, len(links_p), len(arm.type)), dtype=np.float32)
        for shape, link in enumerate(arm.frame - 1):
            centres[:, :, shape] = (links_p[:, link] + links_R[:, link] @ arm.p[shape]).T
        return centres

    @cached_property
    def spheres(self) -> tuple[FloatArray, FloatArray]:
        """Centre in B and radius of a sphere about the arm in each solution, (R, 3) and (R,)."""
        bound = self.shapes.arm.bound + self.shapes.arm.pad
        low = (self.centres - bound).min(axis=2, initial=np.inf)
        high = (self.centres + bound).max(axis=2, initial=-np.inf)
        middle = (low + high) / 2.0 if len(bound) else np.zeros((3, len(self.joints)))
        out = np.linalg.norm(self.centres - middle[:, :, None], axis=0) + bound
        return middle.T.copy(), out.max(axis=1, initial=0.0) + ROUNDING

    @cached_property
    def reach(self) -> FloatArray:
        """Radius of a vertical cylinder about the base that holds the arm of a candidate, (C,)."""
        middle, radius = self.spheres
        reach = np.zeros(len(self.sets.candidates))
        np.maximum.at(reach, self.pairs[0], np.hypot(middle[:, 0], middle[:, 1]) + radius)
        return reach + ROUNDING

    @cached_property
    def link_poses(self) -> tuple[FloatArray, FloatArray]:
        """Poses of the arm's links in B in each solution, (R, links, 3, 3) and (R, links, 3)."""
        return self.shapes.link_poses(self.joints, self.level[self.pairs[0]])


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
