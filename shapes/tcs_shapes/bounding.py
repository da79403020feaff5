"""Smallest bounding boxes and capsules of points."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from tcs.model.robots.primitives import Primitive, rotation_of
from tcs.model.robots.triangles import distinct
from tcs_shapes.containment import circle_around, tightest_rectangles

FloatArray = NDArray[np.float64]

_DECIMALS = 6
_STEP = 10.0**-_DECIMALS
_QUATERNION_DECIMALS = 9
# A flat part still needs a box with some thickness; this is thinner than any relevant part.
_THINNEST = 1e-4
_FACETS = 32
"""Most facets of a hull for which the smallest rectangle is computed: a rounded part has thousands,
and a coarse estimate rules out most of them."""
_COARSE_ANGLES = np.linspace(0.0, np.pi / 2, 6, endpoint=False)
"""Angles about the normal of a facet at which its box is estimated [rad]."""
_CIRCLE_STEPS = 2000
"""Steps toward the smallest circle around points."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A bounding shape of points, before its figures are rounded.

    Attributes:
        kind: "box" or "capsule".
        R: R_BP, shape (3, 3); a capsule lies along its z.
        volume: [m^3].
    """

    kind: str
    R: FloatArray
    volume: float


def corner_points(triangles: FloatArray) -> FloatArray:
    """Return the corners of the convex hull of triangles, shape (m, 3).

    Args:
        triangles: Corners [m], shape (n, 3, 3).
    """
    return hull_corners(distinct(triangles.reshape(-1, 3))[0])


def hull_corners(points: FloatArray) -> FloatArray:
    """Return the points that are corners of the convex hull of points, shape (m, 3)."""
    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except QhullError:
        # Flat or too few points.
        return points


def hull_volume(triangles: FloatArray) -> float:
    """Return the volume of the convex hull of triangles [m^3], shape (n, 3, 3).

    A flat part counts as its bounding box, with a thickness of a tenth of a millimetre.
    """
    points = triangles.reshape(-1, 3)
    try:
        return float(ConvexHull(points).volume)
    except QhullError:
        return float(np.maximum(np.ptp(points, axis=0), _THINNEST).prod())


def tightest_orientation(points: FloatArray) -> FloatArray:
    """Return the orientation R_BP of the smallest box around points with a face on a hull facet.

    The cross-section of such a box is the smallest rectangle around the points projected along the
    normal of the facet. The smallest box of any orientation need not have a face on a facet, but is
    hardly smaller.

    Args:
        points: [m], shape (m, 3).
    """
    try:
        hull = ConvexHull(points)
    except QhullError:
        return np.eye(3)
    best, best_volume = np.eye(3), math.inf
    normals = np.unique(np.round(hull.equations[:, :3], 6), axis=0)
    frames = _frames_with_z(normals / np.linalg.norm(normals, axis=1, keepdims=True))
    corners = points[hull.vertices]
    chosen = _promising(corners, frames)
    angles, areas = tightest_rectangles(corners, np.ascontiguousarray(chosen))
    for frame, angle, area in zip(chosen, angles.tolist(), areas.tolist(), strict=True):
        volume = area * float(np.ptp(corners @ frame[:, 2]))
        # A margin, so that the result does not depend on rounding.
        if volume < best_volume * (1 - 1e-9):
            best_volume = volume
            c, s = math.cos(angle), math.sin(angle)
            best = frame @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return best


def best_candidate(points: FloatArray, orientations: FloatArray) -> Candidate:
    """Return the smallest box or capsule around points.

    Args:
        points: [m], shape (m, 3).
        orientations: Orientations to try, shape (k, 3, 3), the tightest one first.
    """
    tried = list(orientations)
    boxes = [Candidate("box", R, _box_volume(points, R)) for R in tried]
    smallest = min(boxes, key=lambda candidate: candidate.volume)
    # A capsule may lie along any axis of a frame.
    for R, axis in itertools.product(tried[:2], range(3)):
        frame = np.roll(R, 2 - axis, axis=1)
        # A lower bound of the volume first, because finding the circle is slow.
        width, height = np.ptp(points @ frame[:, :2], axis=0).max(), np.ptp(points @ frame[:, 2])
        if capsule_volume(width / 2, max(height - width, 0.0)) < smallest.volume:
            radius, length, _ = _capsule_around(points, frame)
            volume = capsule_volume(radius, length)
            if volume < smallest.volume:
                smallest = Candidate("capsule", frame, volume)
    return smallest


def enclose(body: str, points: FloatArray, kind: str, R: FloatArray) -> Primitive:
    """Return the bounding primitive of points with a given orientation, rounded outward.

    Orientation and centre are rounded first; the sizes are measured from the rounded pose and
    rounded up, so the figures in the file enclose every point exactly.

    Args:
        body: Name of the body.
        points: In its frame [m], shape (m, 3).
        kind: "box" or "capsule".
        R: R_BP, shape (3, 3).
    """
    w, x, y, z = _rounded_quaternion(R)
    R = rotation_of((w, x, y, z))
    if kind == "capsule":
        _, length, centre = _capsule_around(points, R)
        length = max(_rounded_up(length), _THINNEST)
    else:
        seen = points @ R
        centre = R @ ((seen.min(axis=0) + seen.max(axis=0)) / 2)
    centre = np.round(centre, _DECIMALS) + 0.0
    seen = np.abs((points - centre) @ R)
    if kind == "capsule":
        beyond = np.maximum(seen[:, 2] - length / 2, 0.0)
        radius = float(np.sqrt(seen[:, 0] ** 2 + seen[:, 1] ** 2 + beyond**2).max())
        size: tuple[float, ...] = (_rounded_up(radius), length)
    else:
        size = tuple(max(_rounded_up(2 * half), _THINNEST) for half in seen.max(axis=0))
    return Primitive(
        body=body,
        kind="capsule" if kind == "capsule" else "box",
        size=size,
        xyz=(float(centre[0]), float(centre[1]), float(centre[2])),
        quaternion=(w, x, y, z),
    )


def enclose_axis(body: str, first: FloatArray, last: FloatArray, radius: float) -> Primitive:
    """Return the capsule around an axis, its figures rounded.

    Args:
        body: Name of the body.
        first: One end of the axis [m], shape (3,).
        last: The other end [m], shape (3,); the same for a sphere.
        radius: [m].
    """
    length = float(np.linalg.norm(last - first))
    along = (last - first) / length if length else np.eye(3)[2]
    w, x, y, z = _rounded_quaternion(_frames_with_z(along[None])[0])
    centre = np.round((first + last) / 2, _DECIMALS) + 0.0
    return Primitive(
        body=body,
        kind="capsule",
        size=(_rounded_up(radius), max(_rounded_up(length), _THINNEST)),
        xyz=(float(centre[0]), float(centre[1]), float(centre[2])),
        quaternion=(w, x, y, z),
    )


def moved(shape: Primitive, body: str, R: FloatArray, p: FloatArray) -> Primitive:
    """Return a primitive in the frame of another body, grown by what rounding may take off.

    Args:
        shape: The primitive P on a body B.
        body: Name of the other body C.
        R: R_CB, shape (3, 3).
        p: p_CoBo_C [m], shape (3,).
    """
    if np.allclose(R, np.eye(3), rtol=0, atol=1e-12) and not p.any():
        return replace(shape, body=body)
    centre = np.round(R @ np.array(shape.xyz) + p, _DECIMALS) + 0.0
    return replace(
        shape.shrunk(-2 * _STEP),
        body=body,
        xyz=(float(centre[0]), float(centre[1]), float(centre[2])),
        quaternion=_rounded_quaternion(R @ shape.rotation),
    )


def _rounded_up(length: float) -> float:
    """Return a length rounded up, plus one step as margin for rounding errors in checks."""
    return round((math.ceil(length / _STEP) + 1) * _STEP, _DECIMALS)


def _rounded_quaternion(R: FloatArray) -> tuple[float, float, float, float]:
    w, x, y, z = Rotation.from_matrix(R).as_quat(canonical=True, scalar_first=True)
    first, *rest = (round(float(q), _QUATERNION_DECIMALS) + 0.0 for q in (w, x, y, z))
    return first, rest[0], rest[1], rest[2]


def _box_volume(points: FloatArray, R: FloatArray) -> float:
    return float(np.ptp(points @ R, axis=0).prod())


def capsule_volume(radius: float, length: float) -> float:
    """Return the volume of a capsule whose cap centres are a length apart [m^3]."""
    return math.pi * radius**2 * (length + 4 / 3 * radius)


def _frames_with_z(z: FloatArray) -> FloatArray:
    """Return right-handed frames with given z axes, shape (n, 3, 3), for axes of shape (n, 3)."""
    x = np.cross(np.eye(3)[np.argmin(np.abs(z), axis=1)], z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=2)


def _promising(points: FloatArray, frames: FloatArray) -> FloatArray:
    """Return the frames whose box around points has the least estimated volume, shape (k, 3, 3)."""
    if len(frames) <= _FACETS:
        return frames
    x, y, z = np.moveaxis(frames, 2, 0)

    def widths(directions: FloatArray) -> FloatArray:
        return np.asarray(np.ptp(directions @ points.T, axis=1))

    areas = [
        widths(math.cos(angle) * x + math.sin(angle) * y)
        * widths(math.cos(angle) * y - math.sin(angle) * x)
        for angle in _COARSE_ANGLES
    ]
    volumes = np.min(areas, axis=0) * widths(z)
    # In the order of the facets, so that ties are resolved in the same way.
    chosen = np.sort(np.argsort(volumes, kind="stable")[:_FACETS])
    return np.asarray(frames[chosen])


def _capsule_around(points: FloatArray, R: FloatArray) -> tuple[float, float, FloatArray]:
    """Return radius, length between cap centres and centre of a capsule along the z axis of R."""
    seen = points @ R
    middle, radius = circle_around(np.ascontiguousarray(seen[:, :2]), _CIRCLE_STEPS)
    off_axis = np.square(seen[:, :2] - middle).sum(axis=1)
    # Largest axial distance from a point to a cap centre whose cap contains it.
    reach = np.sqrt(np.maximum(radius**2 - off_axis, 0.0))
    top, bottom = float((seen[:, 2] - reach).max()), float((seen[:, 2] + reach).min())
    centre = R @ np.array([*middle, (top + bottom) / 2])
    return radius, max(top - bottom, 0.0), centre
