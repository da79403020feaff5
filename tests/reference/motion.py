"""Reference check of motions in plain loops: every pair of shapes at closely spaced postures.

It shares no code with the certified check of `tcs.kernel.motion`, and bounds nothing: it samples a
curve so densely that no point of the arm moves farther than a given distance from one posture to
the next.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np

from tcs.kernel.arrays import Chain, FloatArray, Shapes
from tests.reference.kinematics import PlacedShape, distance
from tests.reference.pairs import PlacedScene, bounds_at

FAR = 0.05
"""Excess [m] beyond which bounding spheres decide."""


def checked_pairs(
    placed: PlacedScene, q: FloatArray
) -> Iterator[tuple[PlacedShape, PlacedShape, float]]:
    """Yield the pairs of shapes to check at joint angles q, with the distance to keep [m]."""
    arm, scene = placed.arm_at(q), placed.scene
    bounds = bounds_at(scene.distances, q)

    def is_apart(a: PlacedShape, b: PlacedShape, required: float) -> bool:
        return bounds.get(frozenset((a.body, b.body)), -math.inf) >= required

    for i, shape in enumerate(arm):
        for others, checked, margin in (
            (placed.environment, scene.arm_vs_environment, scene.margin),
            (placed.body, scene.arm_vs_body, scene.self_margin),
        ):
            for j, other in enumerate(others):
                required = max(margin, shape.pad + other.pad)
                own = others is placed.body
                if checked[i, j] and not (own and is_apart(shape, other, required)):
                    yield shape, other, required
        for j in range(i):
            if scene.arm_vs_arm[i, j] and scene.arm.frame[i] != scene.arm.frame[j]:
                required = max(scene.self_margin, shape.pad + arm[j].pad)
                if not is_apart(shape, arm[j], required):
                    yield shape, arm[j], required


def least_excess(placed: PlacedScene, q: FloatArray) -> float:
    """Return the least distance beyond the required one of any checked pair [m], at most FAR.

    Negative where a pair is in contact.
    """
    least = FAR
    for a, b, required in checked_pairs(placed, q):
        if float(np.linalg.norm(a.p - b.p)) - a.sphere - b.sphere - required < least:
            least = min(least, distance(a, b) - required)
    return least


def point_on_curve(control: FloatArray, t: float) -> FloatArray:
    """Return the point of a cubic Bezier curve at t in [0, 1], by de Casteljau's construction."""
    points = np.array(control)
    while len(points) > 1:
        points = (1.0 - t) * points[:-1] + t * points[1:]
    return points[0]


def partial_curve(control: FloatArray, t: float) -> FloatArray:
    """Return the control points of the part of a cubic Bezier curve before t, shape (4, 7)."""
    return np.array([point_on_curve(control[: n + 1], t) for n in range(4)])


def straight_curve(start: FloatArray, end: FloatArray) -> FloatArray:
    """Return the control points of a straight edge, shape (4, 7)."""
    return np.array([start + (end - start) * n / 3.0 for n in range(4)])


def samples_along(chain: Chain, arm: Shapes, control: FloatArray, step: float) -> int:
    """Return into how many parts to divide a curve so that no point of the arm moves farther.

    Args:
        chain: The arm.
        arm: Its shapes, in link frames.
        control: Control points of a cubic Bezier curve [rad], shape (4, 7).
        step: Greatest motion of any point of the arm between postures [m].
    """
    radius = float(np.max(np.linalg.norm(arm.p[0], axis=1) + np.linalg.norm(arm.size, axis=1)))
    length = float(np.sum(np.linalg.norm(chain.p[1:7], axis=1))) + radius
    turned = float(np.abs(np.diff(control, axis=0)).sum())
    return max(2, math.ceil(turned * length / step))


def is_free_along(control: FloatArray, samples: int, touches: Callable[[FloatArray], bool]) -> bool:
    """Return whether nothing touches at equally spaced points of a curve, its ends included.

    Args:
        control: Control points of a cubic Bezier curve [rad], shape (4, 7).
        samples: Number of parts into which the points divide it.
        touches: Whether something touches at joint angles.
    """
    return not any(touches(point_on_curve(control, n / samples)) for n in range(samples + 1))
