"""Null vectors of the eliminant at a root, and the angles of joints d and e that they hold.

At a solution, the products x_d^i x_e^j of the half-angle tangents are a null vector. Where two
solutions lie so close together in c that they have one root, the null vectors are a plane. The two
of this form in it are those that a shift of the power of x_d, or of x_e, multiplies by a number.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner, int_constant
from tcs.kernel.six_joints.equations import swap_columns, swap_rows

PLANE = 1e-4
"""Ratio of the second to last pivot to the first below which the null vectors are a plane. A plane
holds the null vector in any case, so that a high ratio only costs time."""
MOST_VECTORS = 5
"""Greatest number of vectors at a root: the null vector, and two in a plane for each shift."""
OF_D, OF_E = int_constant(3), int_constant(1)
"""Distance of entries of a null vector whose power of x_d, or of x_e, differs by one."""


@inner
def null_vectors(A: FloatArray, is_double: bool, order: IntArray, vectors: FloatArray) -> int:
    """Fill the null vector of the eliminant; in a plane of them, those that may be solutions too.

    Args:
        A: The eliminant, shape (12, 12); overwritten.
        is_double: Whether the root is a double one, so that there is a plane in any case.
        order: Scratch, shape (12,).
        vectors: Filled, shape (MOST_VECTORS + 2, 12); the last two are scratch.

    Returns:
        Number of vectors.
    """
    last = _reduced(A, order)
    _substituted(A, order, -A[10, 11] / A[10, 10] if A[10, 10] != 0.0 else 0.0, 1.0, vectors[0])
    if last > PLANE and not is_double:
        return 1
    _substituted(A, order, 1.0, 0.0, vectors[MOST_VECTORS])
    _substituted(A, order, 0.0, 1.0, vectors[MOST_VECTORS + 1])
    count = _split(vectors, 1, OF_D)
    return _split(vectors, count, OF_E)


@inner
def half_angle(vector: FloatArray, stride: int) -> float:
    """Return the angle of d (OF_D) or e (OF_E) that a null vector holds [rad].

    Entries a stride apart stand as cosine and sine of half the angle.
    """
    best, angle = 0.0, 0.0
    for i in range(12 - stride):
        if stride == OF_E and i % 3 == 2:
            continue
        low, high = vector[i], vector[i + stride]
        size = low * low + high * high
        if size > best:
            best, angle = size, 2.0 * np.arctan2(high, low)
    return angle


@inner
def _reduced(A: FloatArray, order: IntArray) -> float:
    """Reduce A by full pivoting, until its last two rows and columns are left.

    Returns:
        Ratio of the greatest entry that is left, moved to the corner, to the first pivot.
    """
    for n in range(12):
        order[n] = n
    first, best = 0.0, 0.0
    for n in range(11):
        row, column, best = n, n, 0.0
        for i in range(n, 12):
            for j in range(n, 12):
                if abs(A[i, j]) > best:
                    row, column, best = i, j, abs(A[i, j])
        if n == 0:
            first = best
        swap_rows(A, n, row)
        swap_columns(A, n, column)
        order[n], order[column] = order[column], order[n]
        if best > 0.0 and n < 10:
            inverse = 1.0 / A[n, n]
            for i in range(n + 1, 12):
                factor = A[i, n] * inverse
                for j in range(n + 1, 12):
                    A[i, j] -= factor * A[n, j]
    return best / first if first > 0.0 else 0.0


@inner
def _substituted(A: FloatArray, order: IntArray, u: float, v: float, out: FloatArray) -> None:
    """Fill the vector that the reduced A maps to zero but for its last two rows, from two entries.

    Args:
        A: From `_reduced`.
        order: From `_reduced`.
        u: The entry of the second to last column.
        v: That of the last column.
        out: Filled, shape (12,).
    """
    out[order[10]], out[order[11]] = u, v
    for i in range(9, -1, -1):
        total = 0.0
        for j in range(i + 1, 12):
            total -= A[i, j] * out[order[j]]
        out[order[i]] = total / A[i, i] if A[i, i] != 0.0 else 0.0


@inner
def _split(vectors: FloatArray, count: int, stride: int) -> int:
    """Add the vectors of the plane of the last two whose entries a stride apart are proportional.

    With low and high entries L and H of the plane's vectors (9 or 8 rows, 2 columns), these are the
    y with H y cos(t) = L y sin(t). The pencil is projected on the columns of L + H / 2, a mixture
    whose columns are independent even where those of L or of H are not.

    Returns:
        Number of vectors.
    """
    u, v = vectors[MOST_VECTORS], vectors[MOST_VECTORS + 1]
    L, H = np.zeros((2, 2)), np.zeros((2, 2))
    for i in range(12 - stride):
        if stride == OF_E and i % 3 == 2:
            continue
        k = i + stride
        a, b = u[i] + 0.5 * u[k], v[i] + 0.5 * v[k]
        L[0, 0] += a * u[i]
        L[0, 1] += a * v[i]
        L[1, 0] += b * u[i]
        L[1, 1] += b * v[i]
        H[0, 0] += a * u[k]
        H[0, 1] += a * v[k]
        H[1, 0] += b * u[k]
        H[1, 1] += b * v[k]
    # det(H cos(t) - L sin(t)) = high cos^2 - middle cos sin + low sin^2.
    low, high = L[0, 0] * L[1, 1] - L[0, 1] * L[1, 0], H[0, 0] * H[1, 1] - H[0, 1] * H[1, 0]
    middle = L[0, 0] * H[1, 1] + H[0, 0] * L[1, 1] - L[0, 1] * H[1, 0] - H[0, 1] * L[1, 0]
    square = middle * middle - 4.0 * low * high
    if square < 0.0:
        return count
    root = 0.5 * (middle + (np.sqrt(square) if middle > 0.0 else -np.sqrt(square)))
    for sine, cosine in ((root, low), (high, root)):
        x, y = H[0, 0] * cosine - L[0, 0] * sine, H[0, 1] * cosine - L[0, 1] * sine
        z, w = H[1, 0] * cosine - L[1, 0] * sine, H[1, 1] * cosine - L[1, 1] * sine
        if z * z + w * w > x * x + y * y:
            x, y = z, w
        for k in range(12):
            vectors[count, k] = x * v[k] - y * u[k]
        count += 1
    return count
