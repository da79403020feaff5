"""Two surfaces of a robot, and the two joints on which their distance depends."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from tcs.errors import RobotError
from tcs.kernel.collide import BOUND, CENTRE, ROTATION, closer
from tcs.model.robots.extras import model_with_extras
from tcs.model.robots.robot_file import RobotFile
from tcs.model.robots.urdf import Urdf
from tcs.model.robots.urdf.pose import pose_in_root
from tcs_shapes.blocked import packed
from tcs_shapes.clearance import joints_between
from tcs_shapes.self_collision import BodyPair

if TYPE_CHECKING:
    import coal

FloatArray = NDArray[np.float64]
Line = tuple[FloatArray, FloatArray]
"""A point of an axis [m] and its direction, shapes (3,)."""

SLICE = 0.0005
"""Height of the slices across the axis [m]."""
SIDES = 128
"""Sides of the polygon around the circle of a slice."""
_SAME = 0.00005
"""Slices whose radii differ by less [m] are one."""


class Hull(NamedTuple):
    """A convex hull."""

    corners: FloatArray
    """Shape (n, 3) [m]."""
    faces: FloatArray
    """Equations of the faces, shape (m, 4)."""


@dataclass(frozen=True, eq=False)
class SurfacePair:
    """Two surfaces in the robot's root frame with all joints at 0, and the joints between them.

    Attributes:
        pair: Names of the bodies, the one nearer to the base first.
        joints: The joints, the one nearer to the base first; the same one twice if it is alone.
        is_swept: Whether a surface is what the body sweeps as a third joint between them turns.
        axes: Their axes.
        triangles: Both surfaces [m], shapes (n, 3, 3).
        models: The same for `coal`.
    """

    pair: BodyPair
    joints: tuple[str, str]
    is_swept: bool
    axes: tuple[Line, Line]
    triangles: tuple[FloatArray, FloatArray]
    models: tuple[Any, Any]
    hulls: tuple[Hull, Hull]
    """Their convex hulls."""
    shapes: tuple[FloatArray, FloatArray]
    """The shapes of the bodies, packed, shapes (n, 17)."""

    @classmethod
    def of(
        cls,
        robot: RobotFile,
        pair: BodyPair,
        carried: Mapping[str, FloatArray],
        joints: tuple[str, str],
    ) -> SurfacePair:
        """Place the surfaces of a pair of bodies.

        Args:
            robot: The robot.
            pair: The pair.
            carried: From `carried_triangles`.
            joints: From `table_pairs`. The joint next to a body may be left out: that body counts
                as all that it sweeps as the joint turns.

        Raises:
            RobotError: If the package `coal` is missing.
        """
        model = model_with_extras(robot)
        order = list(robot.arm_joints)
        names = sorted((j.name for j in joints_between(model, *pair)), key=order.index)
        placed, shapes = [], []
        # The joint next to each body.
        for body, joint in zip(pair, (names[0], names[-1]), strict=True):
            R, p = pose_in_root(model, body, {})
            surface = np.asarray(carried[body] @ R.T + p)
            placed.append(surface if joint in joints else revolved(surface, _axis(model, joint)))
            own = [shape for shape in robot.load_primitives() if shape.body == body]
            shapes.append(_moved(packed(own), R, p))
        first, second = placed
        return cls(
            pair=pair,
            joints=joints,
            is_swept=not set(names) <= set(joints),
            axes=(_axis(model, joints[0]), _axis(model, joints[1])),
            triangles=(first, second),
            models=(coal_model(first), coal_model(second)),
            hulls=(convex_hull(first), convex_hull(second)),
            shapes=(shapes[0], shapes[1]),
        )

    @property
    def is_of_one_joint(self) -> bool:
        """Whether there is a single joint between the bodies."""
        return self.joints[0] == self.joints[1]

    def angles(self, positions: Mapping[str, float]) -> tuple[float, float]:
        """Return the angles of both joints [rad], of the positions of all."""
        first, second = self.joints
        return positions[first], positions[second]

    def distance(self, first: float, second: float, farthest: float = np.inf) -> float:
        """Return the distance of the surfaces at two joint angles [m], 0 where they meet.

        It is 0 too where one may be within the other.

        Args:
            first: Angle of the first joint [rad].
            second: Angle of the second joint [rad].
            farthest: Distance that is enough to know [m]: nothing greater is returned.
        """
        import coal

        R, p = self._pose(first, second)
        X, request, result = coal.Transform3s(R, p), coal.DistanceRequest(), coal.DistanceResult()
        # Pairs of triangles that are farther apart than what was found are not looked at.
        result.min_distance = min(farthest, result.min_distance)
        found = coal.distance(
            self.models[0], coal.Transform3s(), self.models[1], X, request, result
        )
        if found <= 0.0 or self._may_enclose(R, p):
            return 0.0
        return float(found)

    def shapes_touch(self, first: float, second: float, gap: float) -> bool:
        """Return whether shapes of the bodies may be closer than a gap [m] at two joint angles.

        Where a third joint moves shapes, it is not known, and they may.
        """
        if self.is_swept:
            return True
        here, there = self.shapes[0], _moved(self.shapes[1], *self._pose(first, second))
        away = here[:, None, CENTRE:ROTATION] - there[None, :, CENTRE:ROTATION]
        reach = here[:, None, BOUND] + there[:, BOUND] + gap
        near = np.argwhere(np.einsum("ijk,ijk->ij", away, away) < reach**2)
        return any(closer(here, i, there, j, gap) for i, j in near.tolist())

    def _pose(self, first: float, second: float) -> tuple[FloatArray, FloatArray]:
        """Return the motion of the second body from where it is with both joints at 0."""
        R, p = _turned(self.axes[0], first)
        if self.is_of_one_joint:
            return R, p
        R_2, p_2 = _turned(self.axes[1], second)
        return R @ R_2, R @ p_2 + p

    def _may_enclose(self, R: FloatArray, p: FloatArray) -> bool:
        """Return whether all corners of a surface are within the convex hull of the other."""
        here, there = self.hulls
        return _all_within(there.corners @ R.T + p, here) or _all_within(
            (here.corners - p) @ R, there
        )

    def reach(self) -> tuple[float, float]:
        """Return for each joint how far from its axis a point of a body can be [m].

        It is that of the body for which it is less: whichever of both a joint is said to move,
        their distance changes as much.
        """
        here, there = (t.reshape(-1, 3) for t in self.triangles)
        inner, outer = self.axes
        if self.is_of_one_joint:
            return float(min(_from_line(here, inner).max(), _from_line(there, inner).max())), 0.0
        around_outer = _from_line(there, outer)
        around_inner = _from_line(here, inner)
        first = (_from_line(_on_line(there, outer), inner) + around_outer).max()
        second = (_from_line(_on_line(here, inner), outer) + around_inner).max()
        return (
            float(min(around_inner.max(), first)),
            float(min(around_outer.max(), second)),
        )


def _axis(model: Urdf, name: str) -> Line:
    """Return the axis of a joint in the root frame with all joints at 0."""
    joint = model.joints[name]
    R, p = pose_in_root(model, joint.child, {})
    axis = np.array(joint.axis)
    return p, np.asarray(R @ (axis / np.linalg.norm(axis)))


def _turned(axis: Line, angle: float) -> tuple[FloatArray, FloatArray]:
    """Return the rotation about an axis by an angle [rad], and the translation with it."""
    R = Rotation.from_rotvec(angle * axis[1]).as_matrix()
    return np.asarray(R), np.asarray(axis[0] - R @ axis[0])


def _moved(rows: FloatArray, R: FloatArray, p: FloatArray) -> FloatArray:
    """Return packed shapes moved by a pose."""
    moved = rows.copy()
    moved[:, CENTRE:ROTATION] = rows[:, CENTRE:ROTATION] @ R.T + p
    moved[:, ROTATION:] = (R @ rows[:, ROTATION:].reshape(-1, 3, 3)).reshape(-1, 9)
    return moved


def _on_line(points: FloatArray, line: Line) -> FloatArray:
    """Return the points of a line that are nearest to points, shape (n, 3)."""
    along = (points - line[0]) @ line[1]
    return np.asarray(line[0] + along[:, None] * line[1])


def _from_line(points: FloatArray, line: Line) -> FloatArray:
    """Return the distances of points from a line [m], shape (n,)."""
    return np.asarray(np.linalg.norm(points - _on_line(points, line), axis=1))


def _all_within(points: FloatArray, hull: Hull) -> bool:
    """Return whether all points are within a convex hull; none is within a flat one."""
    if not len(hull.faces):
        return False
    # Nearly always one of a few points, from all over them, shows that they are not.
    few = points[:: max(1, len(points) // 8)]
    return _are_within(few, hull) and _are_within(points, hull)


def _are_within(points: FloatArray, hull: Hull) -> bool:
    return bool(np.all(points @ hull.faces[:, :3].T + hull.faces[:, 3] <= 0.0))


def convex_hull(triangles: FloatArray) -> Hull:
    """Return the convex hull of triangles, without faces if it is flat."""
    points = triangles.reshape(-1, 3)
    try:
        hull = ConvexHull(points)
    except QhullError:
        return Hull(points, np.empty((0, 4)))
    return Hull(points[hull.vertices], np.asarray(hull.equations))


def coal_model(triangles: FloatArray) -> coal.BVHModelOBBRSS:
    """Return triangles of shape (n, 3, 3) as a hierarchy of bounding volumes.

    Raises:
        RobotError: If the package `coal` is missing.
    """
    try:
        import coal
    except ImportError:
        raise RobotError(
            "tables of distances are measured by the package 'coal': pip install 'tcs[distances]'."
        ) from None
    corners, index = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    points, faces = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    _extend(points, corners)
    _extend(faces, (coal.Triangle(a, b, c) for a, b, c in index.reshape(-1, 3).tolist()))
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(faces), len(points))
    model.addSubModel(points, faces)
    model.endModel()
    return model


def _extend(vector: Any, items: Iterable[Any]) -> None:
    """Append items to a vector of C++."""
    for item in items:
        vector.append(item)


def revolved(triangles: FloatArray, axis: Line) -> FloatArray:
    """Return a surface that contains all that triangles sweep as they turn about an axis.

    It is a stack of prisms, of one radius each, around the slices of what is swept: a ring of them
    is filled up to the axis.

    Args:
        triangles: Corners [m], shape (n, 3, 3).
        axis: The axis.

    Returns:
        Corners of triangles [m], shape (m, 3, 3).
    """
    low, radius = _profile(triangles, axis)
    return np.concatenate(
        [
            _prism(axis, low[k], low[k + 1], float(radius[k]))
            for k in range(len(radius))
            if radius[k] > 0.0
        ]
    )


def _profile(triangles: FloatArray, axis: Line) -> tuple[FloatArray, FloatArray]:
    """Return where slices along an axis begin, and the last ends, and the radii of all [m]."""
    along = (triangles - axis[0]) @ axis[1]
    count = max(1, int(np.ceil(np.ptp(along) / SLICE)))
    low = np.linspace(along.min(), along.max(), count + 1)
    radius = np.zeros(count)
    for k in range(count):
        touched = (along.min(axis=1) <= low[k + 1]) & (along.max(axis=1) >= low[k])
        points = _between(triangles[touched], along[touched], low[k], low[k + 1])
        off = points - axis[0]
        off = off - np.outer(off @ axis[1], axis[1])
        # The distance from the axis is convex: on a piece of a triangle, a corner is the farthest.
        radius[k] = np.linalg.norm(off, axis=1).max(initial=0.0)
    starts, merged = [low[0]], [radius[0]]
    for k in range(1, count):
        if abs(radius[k] - merged[-1]) < _SAME:
            merged[-1] = max(merged[-1], radius[k])
        else:
            starts.append(low[k])
            merged.append(radius[k])
    return np.array([*starts, low[-1]]), np.array(merged)


def _between(triangles: FloatArray, along: FloatArray, low: float, high: float) -> FloatArray:
    """Return the corners of the pieces of triangles between two planes across an axis, (n, 3)."""
    found = [triangles[(along >= low) & (along <= high)]]
    for i in range(3):
        j = (i + 1) % 3
        start, end = along[:, i], along[:, j]
        for plane in (low, high):
            crosses = (start - plane) * (end - plane) < 0.0
            at = (plane - start[crosses]) / (end[crosses] - start[crosses])
            corners = triangles[crosses]
            found.append(corners[:, i] + at[:, None] * (corners[:, j] - corners[:, i]))
    return np.concatenate(found)


def _prism(axis: Line, low: float, high: float, radius: float) -> FloatArray:
    """Return the triangles of a prism around a cylinder [m], shape (4 SIDES, 3, 3)."""
    origin, z = axis
    x = np.cross(z, np.eye(3)[np.abs(z).argmin()])
    x = x / np.linalg.norm(x)
    angles = 2.0 * np.pi * np.arange(SIDES) / SIDES
    rim = (
        radius
        / np.cos(np.pi / SIDES)
        * (np.cos(angles)[:, None] * x + np.sin(angles)[:, None] * np.cross(z, x))
    )
    bottom, top = origin + low * z, origin + high * z
    here, there = bottom + rim, top + rim
    here_on, there_on = np.roll(here, -1, axis=0), np.roll(there, -1, axis=0)
    return np.concatenate(
        [
            np.stack([np.tile(bottom, (SIDES, 1)), here_on, here], axis=1),
            np.stack([here, here_on, there_on], axis=1),
            np.stack([here, there_on, there], axis=1),
            np.stack([np.tile(top, (SIDES, 1)), there, there_on], axis=1),
        ]
    )
