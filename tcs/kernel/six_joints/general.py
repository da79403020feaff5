"""Constants of the elimination that solves any arm of six revolute joints.

The arm with its tool at a goal is a closed loop of six joints. Read from some joint on, its joints
are a to f, and H1 to H6 are the fixed transforms after each:

    Rz(c) H3 Rz(d) H4 Rz(e) H5 Rz(f) = H2^-1 Rz(-b) H1^-1 Rz(-a) H6^-1.

Both sides map the axis of joint f to the same line, whatever f. Fourteen functions of the direction
l and the origin p of that line are linear in the products of the cosines and sines of a and b on
the right, and of c, d and e on the left: l, p, p.p, p.l, p x l and (p.p) l - 2 (p.l) p.
`elimination` removes a and b, then d and e.

H1 is the transform that holds the goal, so the left side is constant. The loop is read forwards
(a to f are the joints 6, 1, 2, 3, 4, 5 of the arm) or backwards (1, 6, 5, 4, 3, 2): with axes that
meet or are parallel, the solutions may be separated by the angle of c in one of the two only.

Source: M. Raghavan and B. Roth, "Inverse kinematics of the general 6R manipulator and related
linkages", Journal of Mechanical Design 115(3), 1993.
"""

from __future__ import annotations

import itertools
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import Chain, FloatArray

FORWARDS, BACKWARDS = 1, -1
"""Directions in which the loop is read."""
EQUATIONS = 14
"""Number of functions of a line that both sides of the loop have in common."""
POSTURES = 40
"""Number of random postures with which the direction is chosen."""
SEPARATED = 1e-9
"""Least ratio of the second least to the greatest singular value of the eliminant at a solution:
below it, solutions share the angle of joint c, or the eliminant vanishes at every angle."""
UNSEPARATED = 0.1
"""Fraction of the postures that may be less separated: some are singular."""
QUARTERS = 0.0, np.pi / 2, np.pi
"""Angles at which functions linear in 1, cosine and sine are evaluated."""
TO_TERMS = np.array([[0.5, 0.0, 0.5], [0.5, 0.0, -0.5], [-0.5, 1.0, -0.5]])
"""From values at `QUARTERS` to the coefficients of 1, cosine and sine."""
TO_HALF_ANGLE = np.array([[1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [0.0, 2.0, 0.0]])
"""Coefficients of 1, x and x^2 of 1, cosine and sine, times 1 + x^2, with x the tangent of half the
angle."""


class GeneralArm(NamedTuple):
    """Constants of the elimination; lengths are in units of the arm's own size."""

    direction: int
    """FORWARDS or BACKWARDS, or 0 for an arm that is solved otherwise."""
    per_metre: float
    """One metre in units of the arm's size."""
    left: FloatArray
    """The left side: coefficients of 1, cosine and sine of c, times x_d^i x_e^j with the tangents x
    of half the angles, shape (EQUATIONS, 27)."""
    before: FloatArray
    """Transform before joint 1, or its inverse if the loop is read backwards, shape (3, 4)."""
    after: FloatArray
    """Transform after joint 6, or its inverse, shape (3, 4)."""
    second: FloatArray
    """H2, shape (3, 4)."""
    line: FloatArray
    """Direction and origin of the axis of f, seen from joint a, shape (2, 3)."""


def no_general_arm() -> GeneralArm:
    """Return what stands in the place of the constants for an arm that is solved otherwise."""
    return GeneralArm(
        0,
        1.0,
        np.zeros((EQUATIONS, 27)),
        np.zeros((3, 4)),
        np.zeros((3, 4)),
        np.zeros((3, 4)),
        np.zeros((2, 3)),
    )


def general_arm(chain: Chain) -> GeneralArm | None:
    """Return the constants of an arm of six revolute joints.

    Returns:
        None if neither direction separates its solutions, as with coinciding or redundant axes.
    """
    return _general_arm(chain.R.tobytes(), chain.p.tobytes())


@lru_cache(maxsize=32)
def _general_arm(R: bytes, p: bytes) -> GeneralArm | None:
    """Return the constants of the arm of these rotations and translations."""
    steps = [
        _transform(F, f)
        for F, f in zip(
            np.frombuffer(R).reshape(8, 3, 3), np.frombuffer(p).reshape(8, 3), strict=True
        )
    ]
    # The joint that remains at 0 comes before the first one.
    steps = [steps[0] @ steps[1], *steps[2:]]
    arms = [_read(steps, direction) for direction in (FORWARDS, BACKWARDS)]
    separations = [_separation(arm, steps) for arm in arms]
    best = int(np.argmax(separations))
    return arms[best] if separations[best] > SEPARATED else None


def _read(steps: list[FloatArray], direction: int) -> GeneralArm:
    """Return the constants with the loop read in a direction."""
    size = float(np.mean([np.linalg.norm(X[:3, 3]) for X in steps[1:6]]))
    # An arm without offsets has no size; its goals are unreachable but for one point.
    per_metre = 1.0 / size if size > 0.0 else 1.0
    scaled = [_transform(X[:3, :3], X[:3, 3] * per_metre) for X in steps]
    between = scaled[1:6]
    before, after = scaled[0], scaled[6]
    if direction == BACKWARDS:
        between = [_inverse(X) for X in reversed(between)]
        before, after = _inverse(before), _inverse(after)
    second, third, fourth, fifth, sixth = between

    def left(c: float, d: float, e: float) -> FloatArray:
        X = _about_z(c) @ third @ _about_z(d) @ fourth @ _about_z(e) @ fifth
        return line_functions(X[:3, 2], X[:3, 3])

    values = np.array([left(*angles) for angles in itertools.product(QUARTERS, repeat=3)])
    terms = np.einsum(
        "cx,di,dy,ej,ez,xyzk->kcij",
        TO_TERMS,
        TO_HALF_ANGLE,
        TO_TERMS,
        TO_HALF_ANGLE,
        TO_TERMS,
        values.reshape(3, 3, 3, EQUATIONS),
    )
    X = _inverse(sixth)
    return GeneralArm(
        direction=direction,
        per_metre=per_metre,
        left=np.ascontiguousarray(terms.reshape(EQUATIONS, 27)),
        before=before[:3].copy(),
        after=after[:3].copy(),
        second=second[:3].copy(),
        line=np.array([X[:3, 2], X[:3, 3]]),
    )


def line_functions(l: FloatArray, p: FloatArray) -> FloatArray:  # noqa: E741
    """Return the functions of a line's direction l and origin p, shape (EQUATIONS,)."""
    return np.concatenate([p, l, [p @ p], [p @ l], np.cross(p, l), (p @ p) * l - 2.0 * (p @ l) * p])


def _separation(arm: GeneralArm, steps: list[FloatArray]) -> float:
    """Return how well solutions are separated at the worst of most postures, 0 if not at all."""
    rng = np.random.default_rng(0)
    found = []
    for q in rng.uniform(-np.pi, np.pi, (POSTURES, 6)):
        X, axes = steps[0], []
        for angle, step in zip(q, steps[1:], strict=True):
            axes.append(X[:3, 2:])
            X = X @ _about_z(angle) @ step
        # The axes as lines: dependent where two joints move the tool in the same way.
        lines = np.array([np.concatenate([axis[:, 0], np.cross(*axis.T)]) for axis in axes])
        if np.linalg.matrix_rank(lines, tol=SEPARATED) < 6:
            found.append(0.0)
            continue
        goal = first_transform(arm, X[:3, :3], X[:3, 3])
        matrix = eliminant(arm, goal, float(q[1] if arm.direction == FORWARDS else -q[4]))
        values = np.linalg.svd(matrix, compute_uv=False)
        is_solution = values[-1] < 1e-3 * values[-2]
        found.append(values[-2] / values[0] if is_solution else 0.0)
    return float(np.quantile(found, UNSEPARATED))


def first_transform(arm: GeneralArm, R_AG: FloatArray, p_AG: FloatArray) -> FloatArray:
    """Return H1, which holds the goal, shape (4, 4)."""
    before, after = (np.vstack([X, [0.0, 0.0, 0.0, 1.0]]) for X in (arm.before, arm.after))
    goal = _transform(R_AG, p_AG * arm.per_metre)
    if arm.direction == FORWARDS:
        return np.asarray(after @ _inverse(goal) @ before)
    return np.asarray(before @ goal @ after)


def eliminant(arm: GeneralArm, first: FloatArray, c: float) -> FloatArray:
    """Return the matrix whose determinant vanishes where joint c has a solution, shape (12, 12).

    In plain numpy, by singular values: `elimination` has the same by pivots.
    """
    second = np.vstack([arm.second, [0.0, 0.0, 0.0, 1.0]])

    def right(a: float, b: float) -> FloatArray:
        X = _inverse(second) @ _about_z(-b) @ _inverse(first) @ _about_z(-a)
        return line_functions(X[:3, :3] @ arm.line[0], X[:3, :3] @ arm.line[1] + X[:3, 3])

    values = np.array([right(*angles) for angles in itertools.product(QUARTERS, repeat=2)])
    terms = np.einsum("ax,by,xyk->kab", TO_TERMS, TO_TERMS, values.reshape(3, 3, EQUATIONS))
    terms = terms.reshape(EQUATIONS, 9)
    left = arm.left.reshape(EQUATIONS, 3, 9).copy()
    left[:, 0, [0, 2, 6, 8]] -= terms[:, :1]
    free = np.linalg.svd(terms[:, 1:])[0][:, 8:]
    rows = free.T @ (left[:, 0] + np.cos(c) * left[:, 1] + np.sin(c) * left[:, 2])
    matrix = np.zeros((12, 12))
    matrix[:6, :9], matrix[6:, 3:] = rows, rows
    return matrix


def _transform(R: FloatArray, p: FloatArray) -> FloatArray:
    """Return a homogeneous transform, shape (4, 4)."""
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = R, p
    return X


def _inverse(X: FloatArray) -> FloatArray:
    """Return the inverse of a transform."""
    R = X[:3, :3].T
    return _transform(R, -R @ X[:3, 3])


def _about_z(angle: float) -> FloatArray:
    """Return a rotation about z as a transform."""
    c, s = np.cos(angle), np.sin(angle)
    return _transform(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), np.zeros(3))
