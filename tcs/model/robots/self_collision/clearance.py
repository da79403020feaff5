"""How close the surfaces of two bodies of a robot can come."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial import cKDTree

from tcs.model.robots.robot_file import RobotFile
from tcs.model.robots.self_collision.plant import BodyPair
from tcs.model.robots.urdf import Joint, Urdf
from tcs.model.robots.urdf.pose import pose_in_root
from tcs.model.robots.urdf.surfaces import welded_top

FloatArray = NDArray[np.float64]

SPACING = 0.005
"""Distance between the points that stand for a surface [m]."""
CLEAR = 0.008
"""Surfaces whose points never come closer than this [m] do not meet: they are at least half of it
apart even where both surfaces lie between their points."""
FINER = 0.2
"""Parts that glide past each other a few millimetres apart are looked at once more, with points
and clearance smaller by this factor."""
MEETING = CLEAR * FINER
"""Closer than this [m] is never clear: whoever comes so close meets, and need not be looked at
further."""
_FAR = 0.05
"""Distances beyond this [m] are not told apart."""
_NEAR = 2 * CLEAR
"""Surfaces farther apart than this [m] as seen from points 5 mm apart are looked at no closer."""
_POINT_SEED = 0
_DRAWS = 300
_DESCENTS = 6
_AT_LIMIT = 0.3
"""Share of draws that put a joint at one of its limits, where bodies come closest."""


class SurfaceDistance:
    """The bodies' original surfaces as points, and how close two of them can come."""

    def __init__(
        self,
        model: Urdf,
        triangles: Mapping[str, FloatArray],
        scale: float = 1.0,
        rough: SurfaceDistance | None = None,
    ) -> None:
        """Take the surfaces; points are spread when a body is first asked for.

        Args:
            model: The robot.
            triangles: Its bodies' surfaces, each in its body's frame [m], shapes (n, 3, 3).
            scale: How many times smaller than usual distances are looked at.
            rough: The same surfaces at the usual scale, which say where a closer look is due.
        """
        self._model = model
        self._rough = rough
        self._spacing = SPACING * scale
        self._clear = CLEAR * scale
        self._triangles = triangles
        self._points: dict[str, FloatArray] = {}
        self._trees: dict[str, cKDTree] = {}

    def has(self, body: str) -> bool:
        """Return whether a body has a surface."""
        return body in self._triangles

    def closest_approach(self, pair: BodyPair, robot: RobotFile, seed: int) -> float:
        """Return how close two bodies' surfaces come [m], at most 0.05, within the limits in force.

        The joints between them are drawn at random, often at their limits; from the closest draws
        a search descends further.

        Args:
            pair: Names of the bodies.
            robot: Whose limits are in force.
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
        """Return how far two bodies' surfaces are apart [m], at most 0.05.

        Args:
            pair: Names of the bodies.
            positions: Every joint between them [rad or m].
        """
        far = _FAR
        if self._rough is not None:
            rough = self._rough.distance(pair, positions)
            if rough > _NEAR:
                return rough
            # Points at a fifth of the spacing lie within it of those that are this close.
            far = rough + SPACING
        # The tree takes the body of many points; each point of the other costs a query.
        many, few = sorted(pair, key=lambda body: -len(self._of(body)))
        if many not in self._trees:
            self._trees[many] = cKDTree(self._of(many))
        tree = self._trees[many]
        R_AB, p_AB = _relative_pose(self._model, (many, few), positions)
        seen = self._of(few) @ R_AB.T + p_AB
        # Far points take the tree longest, and nobody asks how far they are.
        seen = seen[((seen > tree.mins - far) & (seen < tree.maxes + far)).all(axis=1)]
        near, _ = tree.query(seen, distance_upper_bound=far)
        return min(float(near.min(initial=far)), far)

    def _of(self, body: str) -> FloatArray:
        """Return points on a body's surface in its frame [m], shape (n, 3): corners included."""
        if body not in self._points:
            triangles = self._triangles[body]
            edges = triangles[:, 1:] - triangles[:, :1]
            areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) / 2
            rng = np.random.default_rng(_POINT_SEED)
            count = int(areas.sum() / self._spacing**2) + 1
            chosen = rng.choice(len(triangles), count, p=areas / areas.sum())
            uv = rng.random((count, 2))
            # The half of the square beyond its diagonal folds back onto the triangle.
            uv = np.where(uv.sum(axis=1, keepdims=True) > 1, 1 - uv, uv)
            inner = triangles[chosen, 0] + np.einsum("ni,nij->nj", uv, edges[chosen])
            corners = np.unique(triangles.reshape(-1, 3), axis=0)
            self._points[body] = np.concatenate([inner, corners])
        return self._points[body]


def joints_between(model: Urdf, first: str, second: str) -> tuple[Joint, ...]:
    """Return the movable joints on the way from one body to another."""
    up, down = (_movable_above(model, body) for body in (first, second))
    shared = {joint.name for joint in up} & {joint.name for joint in down}
    return tuple(joint for joint in (*up, *down) if joint.name not in shared)


def free_joints(model: Urdf, joints: Iterable[Joint]) -> tuple[str, ...]:
    """Return the joints that decide where some joints stand: themselves, or whom they mimic."""
    names = []
    for joint in joints:
        while joint.mimic is not None:
            joint = model.joints[joint.mimic.leader]
        names.append(joint.name)
    return tuple(dict.fromkeys(names))


def _movable_above(model: Urdf, body: str) -> list[Joint]:
    joints = []
    while (top := welded_top(model, body)[0]) in model.parent_joints:
        joints.append(model.parent_joints[top])
        body = joints[-1].parent
    return joints


def _relative_pose(
    model: Urdf, pair: BodyPair, positions: Mapping[str, float]
) -> tuple[FloatArray, FloatArray]:
    """Return R_AB and p_AoBo_A of the second body B of a pair in the first, A."""
    (R_A, p_A), (R_B, p_B) = (pose_in_root(model, body, positions) for body in pair)
    return R_A.T @ R_B, R_A.T @ (p_B - p_A)
