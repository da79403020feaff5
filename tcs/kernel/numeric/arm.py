"""Constants of an arm for numeric inverse kinematics: bounds of its reach and start postures.

In a seven-joint arm without a closed form, the first and the last joint are still simple. Joint 1
rotates the whole arm about axis 1, and joint 7 leaves every point of axis 7 in place. So joints 2
to 6 alone determine four figures: the distance of a point on axis 7 from axis 1, its height along
axis 1, and the tilt and the azimuth of axis 7. A table of quasi-random postures of these five
joints, indexed by the four figures, supplies postures near a goal: joints 1 and 7 follow in closed
form, and Newton's method removes the remaining error.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from tcs.kernel.analytic.solver import cos_range
from tcs.kernel.arrays import Chain, FloatArray, IntArray
from tcs.kernel.cache import jit
from tcs.kernel.kinematics import link_poses
from tcs.kernel.lines import axis_distance
from tcs.kernel.low_discrepancy import spread
from tcs.kernel.problem import Problem, chain_of

SAMPLES = 1 << 18
"""Number of postures in the table."""
ACROSS, UP, TILTS, TURNS = 14, 28, 8, 12
"""Number of cells per figure: distance from axis 1, height along it, tilt and azimuth of axis 7."""
WIDER = 0.25
"""Extension of the table beyond the joint limits [rad]: few postures lie near a corner of the
limits, and goals that need such a posture would have no start nearby."""
ROUNDING = 1e-9
"""Margin of the reach bounds [m], far above the rounding of a sum of lengths."""
CONTINUOUS_HALF_RANGE = 1e3
"""Half range [rad] assigned to a continuous joint; no joint angle exceeds it."""


class NumericArm(NamedTuple):
    """Constants of one arm. L1..L7 as in `Chain`; F is L1 at a joint angle of zero."""

    R: FloatArray
    """Rotations of the chain, shape (8, 3, 3)."""
    p: FloatArray
    """Translations of the chain [m], shape (8, 3)."""
    R_F: FloatArray
    """Rotations of the chain from F on: as R, but the first is the identity, shape (8, 3, 3)."""
    middle: FloatArray
    """Middle of the joint limits [rad], 0 where continuous, shape (7,)."""
    half: FloatArray
    """Half range of the joints [rad], CONTINUOUS_HALF_RANGE where continuous, shape (7,)."""
    ends: FloatArray
    """Positions of the two end points [m], shape (2,): on axis 1 from the origin of F, and on axis
    7 from the origin of L7."""
    span: FloatArray
    """Least and greatest distance between the two end points [m], shape (2,)."""
    cell: FloatArray
    """Least value and cell size of each of the four figures, shape (4, 2)."""
    first: IntArray
    """First posture of each cell, and the number of postures, shape (cells + 1,)."""
    postures: FloatArray
    """Joints 2 to 6 [rad], up to WIDER beyond their limits, sorted by cell, shape (SAMPLES, 5)."""
    azimuth: FloatArray
    """Azimuth about axis 1 of the end point on axis 7, joint 1 at zero [rad], shape (SAMPLES,)."""


def numeric_arm(chain: Chain) -> NumericArm:
    """Return the constants of an arm; they are computed once for each arm.

    Args:
        chain: Any arm of seven revolute joints.
    """
    arrays = (chain.R, chain.p, chain.lower, chain.upper)
    return _numeric_arm(*(np.ascontiguousarray(a, dtype=np.float64).tobytes() for a in arrays))


def numeric_arm_of(problem: Problem) -> NumericArm:
    """Return the constants of a problem's arm."""
    return numeric_arm(chain_of(problem))


@cache
def _numeric_arm(R_bytes: bytes, p_bytes: bytes, low_bytes: bytes, high_bytes: bytes) -> NumericArm:
    R, p = np.frombuffer(R_bytes).reshape(8, 3, 3).copy(), np.frombuffer(p_bytes).reshape(8, 3)
    lower, upper = np.frombuffer(low_bytes), np.frombuffer(high_bytes)
    limited = upper - lower < 2.0 * np.pi
    low, high = joint_ranges(lower, upper)
    slides = _slides(R, p)
    wide_low, wide_high = np.where(limited, low - WIDER, low), np.where(limited, high + WIDER, high)
    postures = wide_low[1:6] + spread(SAMPLES, 5) * (wide_high - wide_low)[1:6]
    figures, azimuth = np.empty((SAMPLES, 4)), np.empty(SAMPLES)
    R_F, p_F = R.copy(), p.copy()
    R_F[0], p_F[0] = np.eye(3), 0.0
    _figures_of(R_F, p_F, slides[6], postures, figures, azimuth)
    least = np.array([0.0, figures[:, 1].min(), -1.0, -np.pi])
    most = np.array([figures[:, 0].max(), figures[:, 1].max(), 1.0, np.pi])
    cell = np.stack([least, (most - least) / (ACROSS, UP, TILTS, TURNS)], axis=1)
    where = ((figures - cell[:, 0]) / cell[:, 1]).astype(np.int64)
    where = np.clip(where, 0, np.array([ACROSS, UP, TILTS, TURNS]) - 1)
    flat = np.ravel_multi_index(tuple(where.T), (ACROSS, UP, TILTS, TURNS))
    order = np.argsort(flat, kind="stable")
    return NumericArm(
        R=R,
        p=p.copy(),
        R_F=R_F,
        middle=np.where(limited, (low + high) / 2.0, 0.0),
        half=np.where(limited, (high - low) / 2.0, CONTINUOUS_HALF_RANGE),
        ends=slides[[0, 6]],
        span=_span(R, p, slides, float(lower[3]), float(upper[3])),
        cell=cell,
        first=np.searchsorted(flat[order], np.arange(ACROSS * UP * TILTS * TURNS + 1)),
        postures=postures[order],
        azimuth=azimuth[order],
    )


def joint_ranges(lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the limits [rad], -pi and pi for a joint whose range is a full turn or more."""
    limited = upper - lower < 2.0 * np.pi
    return np.where(limited, lower, -np.pi), np.where(limited, upper, np.pi)


def _slides(R: FloatArray, p: FloatArray) -> FloatArray:
    """Return a point on each axis for the reach bounds, from the origin of L1..L7 [m], shape (7,).

    Any points give valid bounds. The bounds are sharp with points where an axis passes closest to
    its neighbour, such as the centre of a spherical shoulder or wrist.
    """
    slides = np.zeros(7)
    for i in (0, 5, 1, 4):
        passing = axis_distance(R[i + 1], p[i + 1])
        if passing is not None:
            slides[i], slides[i + 1] = passing[1:]
    return slides


def _span(
    R: FloatArray, p: FloatArray, slides: FloatArray, lower: float, upper: float
) -> FloatArray:
    """Return the least and greatest distance between the two end points [m], shape (2,).

    A point on an axis is fixed to the links on both sides, so the distance between points on
    neighbouring axes is constant. The distance between the points on axes 3 and 5 depends on joint
    4 alone and is bounded by its limits; the others add at most their sum.
    """
    rest = 0.0
    for i in (0, 1, 4, 5):
        step = p[i + 1] + R[i + 1][:, 2] * slides[i + 1] - np.array([0.0, 0.0, slides[i]])
        rest += float(np.linalg.norm(step))
    b = p[4] + R[4][:, 2] * slides[4]
    c = R[3].T @ (np.array([0.0, 0.0, slides[2]]) - p[3])
    swing = float(np.hypot(b[0], b[1]) * np.hypot(c[0], c[1]))
    phase = float(np.arctan2(c[1], c[0]) - np.arctan2(b[1], b[0]))
    limited = upper - lower < 2.0 * np.pi
    least, most = cos_range(lower - phase, upper - phase, limited)
    steady = float(b @ b + c @ c - 2.0 * b[2] * c[2])
    far = np.sqrt(max(steady - 2.0 * swing * least, 0.0)) + rest + ROUNDING
    near = np.sqrt(max(steady - 2.0 * swing * most, 0.0)) - rest - ROUNDING
    return np.array([near, far])


@jit
def _figures_of(
    R: FloatArray,
    p: FloatArray,
    slide: float,
    postures: FloatArray,
    figures: FloatArray,
    azimuth: FloatArray,
) -> None:
    """Fill the four figures and the azimuth in F of each posture of joints 2 to 6.

    R and p are the chain from F on: the first rotation is the identity, the first translation 0.
    """
    link_R, link_p, q = np.empty((8, 3, 3)), np.empty((8, 3)), np.zeros(7)
    for n in range(len(postures)):
        for i in range(5):
            q[i + 1] = postures[n, i]
        link_poses(R, p, q, link_R, link_p)
        S, o = link_R[7], link_p[7]
        x, y, z = o[0] + S[0, 2] * slide, o[1] + S[1, 2] * slide, o[2] + S[2, 2] * slide
        azimuth[n] = figures_at(x, y, z, S[0, 2], S[1, 2], S[2, 2], figures[n])


@jit
def figures_at(
    x: float, y: float, z: float, ax: float, ay: float, az: float, figures: FloatArray
) -> float:
    """Fill the four figures of a point on axis 7 and the direction of that axis, both in F.

    Returns:
        The azimuth of the point about axis 1 [rad].
    """
    turn = np.arctan2(y, x)
    c, s = np.cos(turn), np.sin(turn)
    figures[0], figures[1], figures[2] = np.hypot(x, y), z, az
    figures[3] = np.arctan2(-s * ax + c * ay, c * ax + s * ay)
    return turn
