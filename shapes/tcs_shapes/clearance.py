"""How close the surfaces of two bodies of a robot can come."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial import cKDTree

from tcs.model.robots.extras import model_with_extras
from tcs.model.robots.robot_file import RobotFile
from tcs.model.robots.triangles import distinct
from tcs.model.robots.urdf import Joint, Urdf
from tcs.model.robots.urdf.pose import pose_in_root
from tcs.model.robots.urdf.surfaces import body_triangles, welded_top
from tcs_shapes.bodies import surfaces_to_enclose
from tcs_shapes.self_collision import BodyPair

FloatArray = NDArray[np.float64]

SPACING = 0.005
"""Spacing of the points that sample a surface [m]."""
CLEAR = 0.008
"""Surfaces whose points never come closer than this [m] do not meet: even between the points they
are at least half of it apart."""
FINER = 0.2
"""Factor on spacing and clearance for a second, finer search of parts that pass each other a few
millimetres apart."""
MEETING = CLEAR * FINER
"""Surfaces that come closer than this [m] count as meeting, and the search ends."""
_FAR = 0.05
"""Cap of the distances [m]."""
_NEAR = 2 * CLEAR
"""Distance at the usual spacing above which the finer search is skipped [m]."""
_POINT_SEED = 0
_DRAWS = 300
_DESCENTS = 6
_AT_LIMIT = 0.3
"""Fraction of draws that put a joint at one of its limits, where bodies come closest."""

EDGE = 0.02
"""Edge of a block [m]."""
_FIRST, _GROWTH = 1, 8
"""Number of blocks that are looked at first, and how many times as many in each further round."""
_ROUNDING = 1e-9
"""Growth of the ball around a block [m], far above what its rounded radius may lack."""


class SurfaceDistance:
    """Distances between the surfaces of two bodies, sampled as points."""

    def __init__(
        self,
        model: Urdf,
        triangles: Mapping[str, FloatArray],
        scale: float = 1.0,
        rough: SurfaceDistance | None = None,
    ) -> None:
        """Keep the surfaces; a body is sampled when it is first used.

        Args:
            model: The robot.
            triangles: Surface of each body in its frame [m], shapes (n, 3, 3).
            scale: Factor on spacing and clearance.
            rough: The same surfaces at the usual scale; only pairs that are near in it are
                computed at this scale.
        """
        self._model = model
        self._rough = rough
        self._spacing = SPACING * scale
        self._clear = CLEAR * scale
        self._triangles = triangles
        self._points: dict[str, FloatArray] = {}
        self._trees: dict[str, cKDTree] = {}
        self._blocks: dict[str, PointBlocks] = {}

    def has(self, body: str) -> bool:
        """Return whether a body has a surface."""
        return body in self._triangles

    def closest_approach(self, pair: BodyPair, robot: RobotFile, seed: int) -> float:
        """Return the least distance of two surfaces within the limits in force [m], at most 0.05.

        The joints between the bodies are drawn at random, often at their limits; the closest draws
        start a local minimisation.

        Args:
            pair: Names of the bodies.
            robot: The robot, with its limits in force.
            seed: Seed of the draws.
        """
        joints = joints_between(self._model, *pair)
        names = free_joints(self._model, joints)
        limits = robot.joint_limits()
        lower = np.array([max(limits[name][0], -np.pi) for name in names])
        upper = np.array([min(limits[name][1], np.pi) for name in names])

        def distance(q: FloatArray) -> float:
            positions = robot.with_mimics(dict(zip(names, map(float, q), strict=True)))
            return self.distance(pair, positions)

        rng = np.random.default_rng(seed)
        draws = rng.uniform(lower, upper, size=(_DRAWS, len(names)))
        ends = np.where(rng.random(draws.shape) < 0.5, lower, upper)
        draws = np.where(rng.random(draws.shape) < _AT_LIMIT, ends, draws)
        found: list[tuple[float, tuple[float, ...]]] = []
        for q in draws:
            found.append((distance(q), tuple(q)))
            if found[-1][0] < MEETING:
                return found[-1][0]
        found.sort(key=lambda item: item[0])
        closest = found[0][0]
        if closest < self._clear:
            return closest
        for start_distance, start in found[:_DESCENTS]:
            if start_distance >= _FAR:
                break
            descent = minimize(
                distance,
                np.array(start),
                method="Nelder-Mead",
                bounds=list(zip(lower, upper, strict=True)),
                options={"maxfev": 60, "xatol": 1e-3, "fatol": 1e-4},
            )
            closest = min(closest, float(descent.fun))
        return closest

    def distance(self, pair: BodyPair, positions: Mapping[str, float]) -> float:
        """Return the distance of two surfaces [m], at most 0.05.

        Args:
            pair: Names of the bodies.
            positions: Positions of every joint between them [rad or m].
        """
        far = _FAR
        if self._rough is not None:
            rough = self._rough.distance(pair, positions)
            if rough > _NEAR:
                return rough
            # A finer point has a rough point of its surface within the usual spacing.
            far = rough + SPACING
        # The body with more points goes into the tree, those of the other are queries.
        many, few = sorted(pair, key=lambda body: -len(self.points(body)))
        if many not in self._trees:
            # Balanced ones take several times as long to build, and as long to ask.
            self._trees[many] = cKDTree(self.points(many), balanced_tree=False, compact_nodes=False)
        tree = self._trees[many]
        R_AB, p_AB = _relative_pose(self._model, (many, few), positions)
        if few not in self._blocks:
            self._blocks[few] = blocks_of(self.points(few))
        return least_distance(tree, self._blocks[few], R_AB, p_AB, far)

    def points(self, body: str) -> FloatArray:
        """Return points on the surface of a body, corners included, in its frame [m], (n, 3)."""
        if body not in self._points:
            triangles = self._triangles[body]
            edges = triangles[:, 1:] - triangles[:, :1]
            areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2
            rng = np.random.default_rng(_POINT_SEED)
            count = int(areas.sum() / self._spacing**2) + 1
            chosen = rng.choice(len(triangles), count, p=areas / areas.sum())
            uv = rng.random((count, 2))
            # Reflect the half of the unit square beyond its diagonal onto the triangle.
            uv = np.where(uv.sum(axis=1, keepdims=True) > 1, 1 - uv, uv)
            inner = triangles[chosen, 0] + np.einsum("ni,nij->nj", uv, edges[chosen])
            corners, _ = distinct(triangles.reshape(-1, 3))
            self._points[body] = np.concatenate([inner, corners])
        return self._points[body]


def carried_surfaces(robot: RobotFile) -> SurfaceDistance:
    """Return the surfaces that the primitives of a robot enclose, at the usual scale.

    Raises:
        RobotError: If the robot's model cannot be used.
    """
    model = model_with_extras(robot)
    return SurfaceDistance(model, carried_triangles(robot, model))


def carried_triangles(robot: RobotFile, model: Urdf) -> dict[str, FloatArray]:
    """Return the surface that the primitives of each body enclose, in its frame [m].

    The primitives of a base also enclose the bodies welded to it, such as a column or a torso.
    """
    carried = {body: surface for body, (_, _, surface) in surfaces_to_enclose(robot).items()}
    added = body_triangles(model)
    return carried | {body.name: added[body.name] for body in robot.bodies}


def joints_between(model: Urdf, first: str, second: str) -> tuple[Joint, ...]:
    """Return the movable joints between one body and another."""
    return differing(movable_above(model, first), movable_above(model, second))


def differing(up: Sequence[Joint], down: Sequence[Joint]) -> tuple[Joint, ...]:
    """Return the joints that move one of two bodies, given those that move each of them."""
    shared = {joint.name for joint in up} & {joint.name for joint in down}
    return tuple(joint for joint in (*up, *down) if joint.name not in shared)


def free_joints(model: Urdf, joints: Iterable[Joint]) -> tuple[str, ...]:
    """Return the independent joints that determine given joints: themselves or their leaders."""
    names = []
    for joint in joints:
        while joint.mimic is not None:
            joint = model.joints[joint.mimic.leader]
        names.append(joint.name)
    return tuple(dict.fromkeys(names))


def movable_above(model: Urdf, body: str) -> list[Joint]:
    """Return the movable joints above a body, the nearest first."""
    joints = []
    while (top := welded_top(model, body)[0]) in model.parent_joints:
        joints.append(model.parent_joints[top])
        body = joints[-1].parent
    return joints


def _relative_pose(
    model: Urdf, pair: BodyPair, positions: Mapping[str, float]
) -> tuple[FloatArray, FloatArray]:
    """Return R_AB and p_AoBo_A of the second body B of a pair in the first body A."""
    (R_A, p_A), (R_B, p_B) = (pose_in_root(model, body, positions) for body in pair)
    return R_A.T @ R_B, R_A.T @ (p_B - p_A)


@dataclass(frozen=True, slots=True)
class PointBlocks:
    """Points sorted by block, and a ball around each block.

    Attributes:
        points: Positions [m], shape (n, 3).
        first: First point of each block, then n, shape (m + 1,).
        centres: Centres of the balls [m], shape (m, 3).
        radii: Their radii [m], shape (m,).
    """

    points: FloatArray
    first: NDArray[np.int64]
    centres: FloatArray
    radii: FloatArray

    def of(self, blocks: NDArray[np.int64]) -> FloatArray:
        """Return the points of some blocks [m], shape (k, 3)."""
        ends = zip(self.first[blocks], self.first[blocks + 1], strict=True)
        return np.concatenate([self.points[first:last] for first, last in ends])


def blocks_of(points: FloatArray) -> PointBlocks:
    """Return points in blocks.

    Args:
        points: At least one point [m], shape (n, 3).
    """
    cells = np.floor((points - points.min(axis=0)) / EDGE).astype(np.int64)
    numbers = np.ravel_multi_index(tuple(cells.T), tuple(cells.max(axis=0) + 1))
    order = np.argsort(numbers, kind="stable")
    points, numbers = points[order], numbers[order]
    starts = np.flatnonzero(np.diff(numbers, prepend=-1))
    low, high = (f.reduceat(points, starts, axis=0) for f in (np.minimum, np.maximum))
    return PointBlocks(
        points=points,
        first=np.append(starts, len(points)),
        centres=(low + high) / 2,
        radii=np.linalg.norm(high - low, axis=1) / 2 + _ROUNDING,
    )


def least_distance(
    tree: cKDTree, blocks: PointBlocks, R: FloatArray, p: FloatArray, far: float
) -> float:
    """Return the least distance of points from those of a tree [m], at most `far`.

    A point is no nearer than the ball around its block, so the blocks are looked at in the order of
    these distances, until the next one is farther than what was found.

    Args:
        tree: Points in a frame A [m].
        blocks: Points in a frame B.
        R: R_AB, shape (3, 3).
        p: p_AoBo_A [m], shape (3,).
        far: Cap of the distance [m].
    """
    bound = far + float(blocks.radii.max())
    away, _ = tree.query(blocks.centres @ R.T + p, distance_upper_bound=bound)
    least = away - blocks.radii
    order = np.argsort(least)
    start, count = 0, _FIRST
    while start < len(order):
        next_ones = order[start : start + count]
        next_ones = next_ones[least[next_ones] < far]
        if not len(next_ones):
            break
        near, _ = tree.query(blocks.of(next_ones) @ R.T + p, distance_upper_bound=far)
        far = float(near.min(initial=far))
        start, count = start + count, count * _GROWTH
    return far
