"""Which pairs of a robot's bodies need no collision check, and the evidence for each."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.spatial import cKDTree

from tcs.model.robots.enclosure import surfaces_to_enclose
from tcs.model.robots.extras import model_with_extras
from tcs.model.robots.geometry import body_triangles, welded_top
from tcs.model.robots.pose import pose_in_root
from tcs.model.robots.robot_file import DisabledGroup, RobotFile
from tcs.model.robots.self_collision import BodyPair, SelfCollision, sample_positions
from tcs.model.robots.urdf import Joint, Urdf

FloatArray = NDArray[np.float64]

SPACING = 0.005
"""Distance between the points that stand for a surface [m]."""
CLEAR = 0.008
"""Surfaces whose points never come closer than this [m] do not meet: they are at least half of it
apart even where both surfaces lie between their points."""
_FINER = 0.2
"""Parts that glide past each other a few millimetres apart are looked at once more, with points
and clearance smaller by this factor."""
_MEETING = CLEAR * _FINER
"""Closer than this [m] is never clear: whoever comes so close meets, and need not be looked at
further."""
_FAR = 0.05
"""Distances beyond this [m] are not told apart."""
_NEAR = 2 * CLEAR
"""Surfaces farther apart than this [m] as seen from points 5 mm apart are looked at no closer."""
_MOST_JOINTS = 3
"""Up to so many joints between two bodies, the closest approach is searched for."""
_POINT_SEED = 0
_DRAWS = 300
_DESCENTS = 6
_AT_LIMIT = 0.3
"""Share of draws that put a joint at one of its limits, where bodies come closest."""


def propose_disabled_pairs(
    robot: RobotFile, *, postures: int = 2000, seed: int = 0
) -> tuple[DisabledGroup, ...]:
    """Return the pairs of bodies that need no check, in groups with their reason.

    Only pairs with a body that the scored arm moves are looked at; others are never checked. A pair
    whose primitives touch in none of the postures is left enabled, for its check costs little and
    may yet catch something. Of the others a pair is proposed when

    - one joint of the URDF connects the two: they touch where it turns, and its limits keep them
      apart (an extra body, such as a tool, was not built that way and gets no such credit);
    - no more than three joints lie between them, and the original surfaces never come close: what
      touches then is the room that primitives take beyond them. If that needs the soft limits, the
      group holds only while they are in force;
    - its primitives touch in every posture, so that its check would forbid all of them.

    Args:
        robot: The robot; its present disabled pairs do not matter.
        postures: Postures drawn uniformly within the hard limits.
        seed: Seed of the draws.

    Raises:
        RobotError: If the robot's model cannot be used.
    """
    both = hard, soft = robot.with_choices(limits="hard"), robot.with_choices(limits="soft")
    model = model_with_extras(robot)
    built = robot.model().links.keys()
    judge = SelfCollision(robot)
    sampled = sample_positions(hard, postures, seed)
    counts = Counter(pair for posture in sampled for pair in judge.touching(posture))
    moved, hand = (_moved_by(model, robot.arm_joints[i]) for i in (0, -1))
    triangles = _carried_triangles(robot, model)
    surfaces = Surfaces(model, triangles)
    fine = Surfaces(model, triangles, scale=_FINER, rough=surfaces)
    found = _Found()
    for pair, count in sorted(counts.items()):
        if not moved & set(pair) or not all(surfaces.has(body) for body in pair):
            continue
        joints = joints_between(model, *pair)
        few = len(free_joints(model, joints)) <= _MOST_JOINTS
        if len(joints) == 1 and built >= set(pair):
            found.neighbours.append(pair)
            continue
        near = [surfaces.closest_approach(pair, limits, seed) if few else 0.0 for limits in both]
        if near[0] >= CLEAR:
            found.apart_hard[pair] = near[0]
        elif count == postures:
            found.always.append(pair)
        elif near[1] >= CLEAR:
            found.apart_soft[pair] = near[1]
        elif set(pair) <= hand:
            # Never checked either, so a long look would be wasted.
            continue
        elif near[0] >= _MEETING and (gap := fine.closest_approach(pair, hard, seed)) >= _MEETING:
            found.apart_hard[pair] = gap
        elif near[1] >= _MEETING and (gap := fine.closest_approach(pair, soft, seed)) >= _MEETING:
            found.apart_soft[pair] = gap
    return found.groups(postures)


@dataclass
class _Found:
    """Pairs by the reason for which they need no check; distances are closest approaches [m]."""

    neighbours: list[BodyPair] = field(default_factory=list)
    apart_hard: dict[BodyPair, float] = field(default_factory=dict)
    apart_soft: dict[BodyPair, float] = field(default_factory=dict)
    always: list[BodyPair] = field(default_factory=list)

    def groups(self, postures: int) -> tuple[DisabledGroup, ...]:
        """Return the groups that hold any pair."""
        apart = (
            "cannot meet: within the {} joint limits their surfaces stay {:.0f} mm apart or more; "
            "only the room that primitives take beyond them touches"
        )
        hard, soft = (
            apart.format(limits, np.floor(min(pairs.values(), default=0.0) * 1e3))
            for limits, pairs in (("hard", self.apart_hard), ("soft", self.apart_soft))
        )
        neighbours = "neighbours: one joint connects them, and its limits keep them apart"
        always = (
            f"primitives overlap in each of {postures} postures: parts of one joint assembly, so a "
            "check would forbid every posture"
        )
        groups = (
            DisabledGroup(reason=neighbours, pairs=tuple(self.neighbours)),
            DisabledGroup(reason=hard, pairs=tuple(self.apart_hard)),
            DisabledGroup(reason=always, pairs=tuple(self.always)),
            DisabledGroup(reason=soft, limits="soft", pairs=tuple(self.apart_soft)),
        )
        return tuple(group for group in groups if group.pairs)


class Surfaces:
    """The bodies' original surfaces as points, and how close two of them can come."""

    def __init__(
        self,
        model: Urdf,
        triangles: Mapping[str, FloatArray],
        scale: float = 1.0,
        rough: Surfaces | None = None,
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
            if found[-1][0] < _MEETING:
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


def _carried_triangles(robot: RobotFile, model: Urdf) -> dict[str, FloatArray]:
    """Return the surface that each body's primitives stand for, in its frame [m].

    Those of a base stand for all that is welded to it as well: a column, a torso.
    """
    carried = {body: surface for body, (_, _, surface) in surfaces_to_enclose(robot).items()}
    added = body_triangles(model)
    return carried | {body.name: added[body.name] for body in robot.bodies}


def _moved_by(model: Urdf, joint: str) -> set[str]:
    """Return every body that a joint moves."""
    first = model.joints[joint].child
    return {body for body in model.links if model.chain(first, body) is not None}


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
