"""Equations of the elimination: fill them for a goal, and remove the products of a and b."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner
from tcs.kernel.six_joints.general import EQUATIONS, FORWARDS, GeneralArm

FULL_RANK = 1e-13
"""Ratio of pivots below which the products of a and b cannot be told apart."""


@inner
def fill_first_transform(
    arm: GeneralArm, R_AG: FloatArray, p_AG: FloatArray, aside: float, X: FloatArray
) -> None:
    """Fill H1, which holds the goal, shape (3, 4), displaced if `aside` is not 0."""
    goal = np.empty((3, 4))
    # The rotation vector aside * (1, -2, 2) / 3, as a rotation by its Cayley map.
    w, x, y, z = 1.0, aside / 6.0, -aside / 3.0, aside / 3.0
    n = 1.0 / (w * w + x * x + y * y + z * z)
    turn = np.empty((3, 3))
    turn[0, 0], turn[0, 1], turn[0, 2] = (
        n * (w * w + x * x - y * y - z * z),
        2.0 * n * (x * y - w * z),
        2.0 * n * (x * z + w * y),
    )
    turn[1, 0], turn[1, 1], turn[1, 2] = (
        2.0 * n * (x * y + w * z),
        n * (w * w - x * x + y * y - z * z),
        2.0 * n * (y * z - w * x),
    )
    turn[2, 0], turn[2, 1], turn[2, 2] = (
        2.0 * n * (x * z - w * y),
        2.0 * n * (y * z + w * x),
        n * (w * w - x * x - y * y + z * z),
    )
    for r in range(3):
        for c in range(3):
            goal[r, c] = R_AG[r, 0] * turn[0, c] + R_AG[r, 1] * turn[1, c] + R_AG[r, 2] * turn[2, c]
        goal[r, 3] = p_AG[r] * arm.per_metre + aside * (0.5 - 0.8 * r + 0.7 * r * r)
    middle, product = np.empty((3, 4)), np.empty((3, 4))
    if arm.direction == FORWARDS:
        _inverted(goal, middle)
        _composed(arm.after, middle, product)
        _composed(product, arm.before, X)
    else:
        _composed(arm.before, goal, product)
        _composed(product, arm.after, X)


@inner
def _inverted(X: FloatArray, out: FloatArray) -> None:
    """Fill the inverse of a transform, shape (3, 4)."""
    for r in range(3):
        out[r, 0], out[r, 1], out[r, 2] = X[0, r], X[1, r], X[2, r]
        out[r, 3] = -(X[0, r] * X[0, 3] + X[1, r] * X[1, 3] + X[2, r] * X[2, 3])


@inner
def _composed(X: FloatArray, Y: FloatArray, out: FloatArray) -> None:
    """Fill the product of two transforms, shape (3, 4)."""
    for r in range(3):
        for c in range(4):
            out[r, c] = X[r, 0] * Y[0, c] + X[r, 1] * Y[1, c] + X[r, 2] * Y[2, c]
        out[r, 3] += X[r, 3]


@inner
def fill_right_side(arm: GeneralArm, first: FloatArray, values: FloatArray) -> None:
    """Fill the coefficients of 1, cosine and sine of a and of b, shape (3, 3, EQUATIONS)."""
    H1, H2 = np.empty((3, 4)), np.empty((3, 4))
    _inverted(first, H1)
    _inverted(arm.second, H2)
    l, p, m, n = np.empty(3), np.empty(3), np.empty(3), np.empty(3)  # noqa: E741
    u, v = np.empty(3), np.empty(3)
    for a in range(3):
        _quarters_back(arm.line[0], a, l)
        _quarters_back(arm.line[1], a, p)
        _mapped(H1, l, 0.0, m)
        _mapped(H1, p, 1.0, n)
        for b in range(3):
            _quarters_back(m, b, l)
            _quarters_back(n, b, p)
            _mapped(H2, l, 0.0, u)
            _mapped(H2, p, 1.0, v)
            _line_functions(u, v, values[a, b])
    for k in range(EQUATIONS):
        for b in range(3):
            x, y, z = values[0, b, k], values[1, b, k], values[2, b, k]
            values[0, b, k], values[1, b, k] = 0.5 * (x + z), 0.5 * (x - z)
            values[2, b, k] = y - 0.5 * (x + z)
        for a in range(3):
            x, y, z = values[a, 0, k], values[a, 1, k], values[a, 2, k]
            values[a, 0, k], values[a, 1, k] = 0.5 * (x + z), 0.5 * (x - z)
            values[a, 2, k] = y - 0.5 * (x + z)


@inner
def _quarters_back(v: FloatArray, quarters: int, out: FloatArray) -> None:
    """Fill a vector rotated about z by 0, -90 or -180 degrees, shape (3,)."""
    out[2] = v[2]
    if quarters == 0:
        out[0], out[1] = v[0], v[1]
    elif quarters == 1:
        out[0], out[1] = v[1], -v[0]
    else:
        out[0], out[1] = -v[0], -v[1]


@inner
def _mapped(X: FloatArray, v: FloatArray, is_point: float, out: FloatArray) -> None:
    """Fill X v, with the translation for a point (1) and without for a direction (0)."""
    for r in range(3):
        out[r] = X[r, 0] * v[0] + X[r, 1] * v[1] + X[r, 2] * v[2] + is_point * X[r, 3]


@inner
def _line_functions(l: FloatArray, p: FloatArray, out: FloatArray) -> None:  # noqa: E741
    """Fill the functions of a line, shape (EQUATIONS,)."""
    square = p[0] * p[0] + p[1] * p[1] + p[2] * p[2]
    along = p[0] * l[0] + p[1] * l[1] + p[2] * l[2]
    for i in range(3):
        out[i], out[3 + i] = p[i], l[i]
        out[11 + i] = square * l[i] - 2.0 * along * p[i]
    out[6], out[7] = square, along
    out[8] = p[1] * l[2] - p[2] * l[1]
    out[9] = p[2] * l[0] - p[0] * l[2]
    out[10] = p[0] * l[1] - p[1] * l[0]


@inner
def eliminate(arm: GeneralArm, values: FloatArray, table: FloatArray, products: IntArray) -> float:
    """Fill the equations, shape (EQUATIONS, 35), and remove the products of a and b.

    The first eight columns are those of the products, the others as in `GeneralArm.left`. The last
    six rows become free of the products, the first eight columns an upper triangle.

    Args:
        arm: The arm.
        values: From `fill_right_side`.
        table: Filled.
        products: Filled with the product of each of the first eight columns, in the order cos(b),
            sin(b), cos(a), cos(a) cos(b), cos(a) sin(b), sin(a), sin(a) cos(b), sin(a) sin(b).

    Returns:
        Ratio of the least to the greatest pivot.
    """
    for k in range(EQUATIONS):
        n = 0
        for a in range(3):
            for b in range(3):
                if a + b > 0:
                    table[k, n] = values[a, b, k]
                    n += 1
        for j in range(27):
            table[k, 8 + j] = arm.left[k, j]
        # The constant of the right side, times (1 + x_d^2) (1 + x_e^2).
        for j in (8, 10, 14, 16):
            table[k, j] -= values[0, 0, k]
    for n in range(8):
        products[n] = n
    greatest, least = 0.0, 0.0
    for n in range(8):
        row, column, least = n, n, 0.0
        for i in range(n, EQUATIONS):
            for j in range(n, 8):
                if abs(table[i, j]) > least:
                    row, column, least = i, j, abs(table[i, j])
        if n == 0:
            greatest = least
        if least <= FULL_RANK * greatest:
            return 0.0
        swap_rows(table, n, row)
        swap_columns(table, n, column)
        products[n], products[column] = products[column], products[n]
        for i in range(n + 1, EQUATIONS):
            factor = table[i, n] / table[n, n]
            for j in range(n + 1, 35):
                table[i, j] -= factor * table[n, j]
    return least / greatest


@inner
def swap_rows(A: FloatArray, i: int, k: int) -> None:
    """Exchange two rows."""
    if i != k:
        for j in range(A.shape[1]):
            A[i, j], A[k, j] = A[k, j], A[i, j]


@inner
def swap_columns(A: FloatArray, j: int, k: int) -> None:
    """Exchange two columns."""
    if j != k:
        for i in range(A.shape[0]):
            A[i, j], A[i, k] = A[i, k], A[i, j]
