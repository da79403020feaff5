"""Vectors and matrices of three as tuples: closed forms need no memory for them.

A rotation about z is given by its cosine and sine, so that no angle is computed on the way.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]
"""Three rows."""

ALIGNED = 1e-18
"""Squared length [m^2 or 1] of coefficients that determine no angle."""
ROUNDING = 1e-12
"""What rounding may add to a cosine."""


@inner
def vector(a: FloatArray) -> Vector:
    """Return an array of shape (3,) as a vector."""
    return a[0], a[1], a[2]


@inner
def matrix(A: FloatArray) -> Matrix:
    """Return an array of shape (3, 3) as a matrix."""
    return (A[0, 0], A[0, 1], A[0, 2]), (A[1, 0], A[1, 1], A[1, 2]), (A[2, 0], A[2, 1], A[2, 2])


@inner
def fill(A: Matrix, out: FloatArray) -> None:
    """Fill an array of shape (3, 3) with a matrix."""
    for k in range(3):
        out[0, k], out[1, k], out[2, k] = A[0][k], A[1][k], A[2][k]


@inner
def added(a: Vector, b: Vector) -> Vector:
    """Return a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inner
def less(a: Vector, b: Vector) -> Vector:
    """Return a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inner
def dot(a: Vector, b: Vector) -> float:
    """Return a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inner
def triple(a: Vector, b: Vector, c: Vector) -> float:
    """Return the triple product a . (b x c)."""
    return (
        a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
    )


@inner
def greatest(a: Vector) -> float:
    """Return the greatest absolute component."""
    return max(abs(a[0]), max(abs(a[1]), abs(a[2])))


@inner
def transposed(A: Matrix) -> Matrix:
    """Return the transpose of A."""
    return (
        (A[0][0], A[1][0], A[2][0]),
        (A[0][1], A[1][1], A[2][1]),
        (A[0][2], A[1][2], A[2][2]),
    )


@inner
def mapped(A: Matrix, v: Vector) -> Vector:
    """Return A v."""
    return dot(A[0], v), dot(A[1], v), dot(A[2], v)


@inner
def product(A: Matrix, B: Matrix) -> Matrix:
    """Return A B."""
    T = transposed(B)
    return mapped(T, A[0]), mapped(T, A[1]), mapped(T, A[2])


@inner
def turned(cosine: float, sine: float, v: Vector) -> Vector:
    """Return Rz v."""
    return cosine * v[0] - sine * v[1], sine * v[0] + cosine * v[1], v[2]


@inner
def turned_matrix(cosine: float, sine: float, A: Matrix) -> Matrix:
    """Return Rz A."""
    x, y = A[0], A[1]
    return (
        (cosine * x[0] - sine * y[0], cosine * x[1] - sine * y[1], cosine * x[2] - sine * y[2]),
        (sine * x[0] + cosine * y[0], sine * x[1] + cosine * y[1], sine * x[2] + cosine * y[2]),
        A[2],
    )


@inner
def then_turned(A: Matrix, cosine: float, sine: float) -> Matrix:
    """Return A Rz."""
    # A row of A Rz is Rz^T times the row.
    return turned(cosine, -sine, A[0]), turned(cosine, -sine, A[1]), turned(cosine, -sine, A[2])


@inner
def turn_between(x: float, y: float, to_x: float, to_y: float) -> tuple[float, float]:
    """Return cosine and sine of the angle from one direction in the plane to another.

    A vector without a direction counts as the x axis.
    """
    square, to_square = x * x + y * y, to_x * to_x + to_y * to_y
    if square == 0.0:
        x, y, square = 1.0, 0.0, 1.0
    if to_square == 0.0:
        to_x, to_y, to_square = 1.0, 0.0, 1.0
    scale = 1.0 / np.sqrt(square * to_square)
    return scale * (x * to_x + y * to_y), scale * (x * to_y - y * to_x)


@inner
def turns_to(
    cosine: float, sine: float, total: float
) -> tuple[int, tuple[float, float], tuple[float, float]]:
    """Return the two rotations t with cosine cos(t) + sine sin(t) = total, if there are any.

    Returns:
        Their number, 0 or 2; cosine and sine of the angle in the middle between them, and of half
        the angle between them.
    """
    length = np.sqrt(cosine * cosine + sine * sine)
    if length * length < ALIGNED or abs(total) > length * (1.0 + ROUNDING):
        return 0, (1.0, 0.0), (1.0, 0.0)
    ratio = min(max(total / length, -1.0), 1.0)
    off = np.sqrt((1.0 - ratio) * (1.0 + ratio))
    return 2, (cosine / length, sine / length), (ratio, off)


@inner
def either(
    middle: tuple[float, float], off: tuple[float, float], which: int
) -> tuple[float, float]:
    """Return cosine and sine of the lower (0) or the upper (1) of the two rotations."""
    c, s = off[0], off[1] if which == 1 else -off[1]
    return middle[0] * c - middle[1] * s, middle[1] * c + middle[0] * s


@inner
def apart(A: Matrix, B: Matrix) -> float:
    """Return the greatest absolute difference of the entries of two matrices."""
    return max(
        greatest(less(A[0], B[0])), max(greatest(less(A[1], B[1])), greatest(less(A[2], B[2])))
    )
