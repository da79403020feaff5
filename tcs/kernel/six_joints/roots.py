"""Roots of the determinant of the eliminant: the angles of joint c that have a solution."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner

TURN = 2.0 * np.pi
DEGREE = 8
"""Degree of the determinant in c."""
SAMPLES = 18
"""Values of the determinant around a turn: one more than its polynomial has coefficients."""
FINE = 120
"""Cells of a turn that are searched for roots: 3 degrees wide."""
NODES, CELLS = 20, 48
"""Values of the determinant in an arc, and cells that are searched there."""
WIDEST = np.pi / 6
"""Greatest width of such an arc [rad]: there the polynomial of the nodes is exact to rounding."""
MOST_ARCS = 64
"""Greatest number of arcs that are waiting."""
RELIABLE = 1e-2
"""Fraction of the greatest value below which a polynomial is too rounded to be used."""
FINEST = 1e-5
"""Width of a cell [rad] below which no shorter arc is sampled."""
TOUCHES = 0.05
"""Fraction of the values beside it below which an extremum counts as a double root, which rounding
may have lifted off zero: Newton's method decides."""
ROOT_STEPS = 40
"""Most steps of regula falsi."""
ROOT_WIDTH = 1e-7
"""Last step of a root [rad]; Newton's method does the rest."""


def _turn_weights() -> FloatArray:
    """Return the weights of the samples of a turn in its fine values, shape (FINE, 2, SAMPLES)."""
    angles = TURN * (np.arange(FINE)[:, None] / FINE - np.arange(SAMPLES) / SAMPLES)
    k = np.arange(1, DEGREE + 1)[:, None, None]
    values = 1.0 + 2.0 * np.cos(k * angles).sum(axis=0)
    slopes = -2.0 * (k * np.sin(k * angles)).sum(axis=0)
    return np.ascontiguousarray(np.stack([values, slopes], axis=1) / SAMPLES)


def _arc_weights() -> FloatArray:
    """Return the weights of the nodes in the fine values of an arc of width 1."""
    fine = np.linspace(-1.0, 1.0, CELLS + 1)
    basis = np.polynomial.chebyshev.chebvander(2.0 * _NODES - 1.0, NODES - 1)
    to_terms = np.linalg.inv(basis)
    values = np.polynomial.chebyshev.chebvander(fine, NODES - 1)
    slopes = np.polynomial.chebyshev.chebval(
        fine, np.polynomial.chebyshev.chebder(np.eye(NODES)), tensor=True
    ).T
    # The arc from -1 to 1 has width 2.
    return np.ascontiguousarray(np.stack([values @ to_terms, 2.0 * slopes @ to_terms], axis=1))


_NODES = 0.5 - 0.5 * np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
"""Chebyshev nodes of an arc from 0 to 1."""
_TURN, _ARC = _turn_weights(), _arc_weights()


@inner
def fill_eliminant(table: FloatArray, cosine: float, sine: float, matrix: FloatArray) -> None:
    """Fill the eliminant at an angle of c, shape (12, 12)."""
    for i in range(6):
        row = table[8 + i]
        for j in range(9):
            value = row[8 + j] + cosine * row[17 + j] + sine * row[26 + j]
            matrix[i, j], matrix[6 + i, 3 + j] = value, value
        for j in range(3):
            matrix[i, 9 + j], matrix[6 + i, j] = 0.0, 0.0


@inner
def _determinant(table: FloatArray, angle: float, A: FloatArray) -> float:
    """Return the determinant of the eliminant at an angle of c; A, shape (12, 12), is scratch."""
    fill_eliminant(table, np.cos(angle), np.sin(angle), A)
    product = 1.0
    for n in range(12):
        row = n
        for i in range(n + 1, 12):
            if abs(A[i, n]) > abs(A[row, n]):
                row = i
        if A[row, n] == 0.0:
            return 0.0
        if row != n:
            product = -product
            for j in range(n, 12):
                A[row, j], A[n, j] = A[n, j], A[row, j]
        product *= A[n, n]
        inverse = 1.0 / A[n, n]
        for i in range(n + 1, 12):
            factor = A[i, n] * inverse
            if factor != 0.0:
                for j in range(n + 1, 12):
                    A[i, j] -= factor * A[n, j]
    return product


@inner
def find_roots(table: FloatArray, roots: FloatArray) -> int:
    """Fill the angles of c at which the determinant vanishes, as `_scan` does; return their number.

    Where the polynomial of the whole turn is so small that it is rounded, as where roots lie close
    together, one of a shorter arc replaces it, and so on.
    """
    matrix, samples = np.empty((12, 12)), np.empty(max(SAMPLES, NODES))
    for n in range(SAMPLES):
        samples[n] = _determinant(table, TURN * n / SAMPLES, matrix)
    arcs, counts = np.empty((MOST_ARCS, 2)), np.zeros(2, np.int64)
    fine = np.empty((FINE + 1, 2))
    _interpolated(_TURN, samples, fine)
    fine[FINE, 0], fine[FINE, 1] = fine[0, 0], fine[0, 1]
    _scan(table, 0.0, TURN / FINE, fine, arcs, counts, matrix, roots)
    shorter = np.empty((CELLS + 1, 2))
    while counts[0] > 0:
        counts[0] -= 1
        start, width = arcs[counts[0], 0], arcs[counts[0], 1]
        for n in range(NODES):
            samples[n] = _determinant(table, start + width * _NODES[n], matrix)
        _interpolated(_ARC, samples, shorter)
        for n in range(CELLS + 1):
            shorter[n, 1] /= width
        _scan(table, start, width / CELLS, shorter, arcs, counts, matrix, roots)
    return counts[1]


@inner
def _interpolated(weights: FloatArray, samples: FloatArray, fine: FloatArray) -> None:
    """Fill the values and slopes of a polynomial from its samples, shape (n, 2).

    Args:
        weights: Of each sample in each value and slope, shape (n, 2, samples).
        samples: Values at the samples.
        fine: Filled.
    """
    for n in range(weights.shape[0]):
        for k in range(2):
            total = 0.0
            for i in range(weights.shape[2]):
                total += weights[n, k, i] * samples[i]
            fine[n, k] = total


@inner
def _scan(
    table: FloatArray,
    start: float,
    step: float,
    fine: FloatArray,
    arcs: FloatArray,
    counts: IntArray,
    matrix: FloatArray,
    roots: FloatArray,
) -> None:
    """Add the roots in an arc, and the arcs in which the values are too rounded.

    Args:
        table: From `eliminate`.
        start: First angle [rad].
        step: Width of a cell [rad].
        fine: Values and slopes at the ends of the cells, shape (cells + 1, 2).
        arcs: Filled with start and width of arcs to be sampled anew.
        counts: Number of arcs and of roots, increased.
        matrix: Scratch, shape (12, 12).
        roots: Filled with roots, and 1 where the sign changes, else 0, shape (n, 2).
    """
    cells = len(fine) - 1
    least = 0.0
    for n in range(cells):
        least = max(least, RELIABLE * abs(fine[n, 0]))
    if step < FINEST:
        least = 0.0
    n = 0
    while n < cells and counts[1] + 4 <= len(roots):
        if min(abs(fine[n, 0]), abs(fine[n + 1, 0])) >= least or counts[0] == MOST_ARCS:
            _scan_cell(table, start + n * step, step, fine[n], fine[n + 1], counts, matrix, roots)
            n += 1
            continue
        m = n + 1
        while m < cells and (m - n + 1) * step <= WIDEST:
            if min(abs(fine[m, 0]), abs(fine[m + 1, 0])) >= least:
                break
            m += 1
        arcs[counts[0], 0], arcs[counts[0], 1] = start + n * step, (m - n) * step
        counts[0] += 1
        n = m


@inner
def _scan_cell(
    table: FloatArray,
    start: float,
    step: float,
    low: FloatArray,
    high: FloatArray,
    counts: IntArray,
    matrix: FloatArray,
    roots: FloatArray,
) -> None:
    """Add the roots in a cell, between the extrema of the cubic with its values and slopes."""
    rise, left, right = high[0] - low[0], low[1] * step, high[1] * step
    # Coefficients of the derivative: left + 2 b t + 3 c t^2.
    b, c = 3.0 * rise - 2.0 * left - right, left + right - 2.0 * rise
    square = b * b - 3.0 * c * left
    size = max(abs(low[0]), abs(high[0]))
    last, at_last = 0.0, low[0]
    for k in range(3):
        t = 1.0
        if k < 2:
            if square <= 0.0:
                continue
            # Both roots of the derivative, without cancellation, the lower one first.
            q = -b - (np.sqrt(square) if b > 0.0 else -np.sqrt(square))
            one = left / q if q != 0.0 else 2.0
            other = q / (3.0 * c) if c != 0.0 else 2.0
            t = min(one, other) if k == 0 else max(one, other)
            if not last < t < 1.0:
                continue
        here = high[0] if k == 2 else _determinant(table, start + step * t, matrix)
        if (here > 0.0) != (at_last > 0.0):
            ends = start + step * last, start + step * t
            roots[counts[1], 0] = _root(table, ends[0], ends[1], at_last, here, matrix)
            roots[counts[1], 1] = 1.0
            counts[1] += 1
        elif k < 2 and abs(here) < TOUCHES * size:
            roots[counts[1], 0], roots[counts[1], 1] = start + step * t, 0.0
            counts[1] += 1
        last, at_last = t, here


@inner
def _root(
    table: FloatArray, low: float, high: float, at_low: float, at_high: float, matrix: FloatArray
) -> float:
    """Return the root of the determinant in an interval at whose ends its signs differ.

    Regula falsi, in the Illinois variant: the end that stays has its value halved.
    """
    side, middle = 0, low
    for _ in range(ROOT_STEPS):
        last = middle
        middle = (low * at_high - high * at_low) / (at_high - at_low)
        if abs(middle - last) < ROOT_WIDTH:
            break
        here = _determinant(table, middle, matrix)
        if (here > 0.0) == (at_low > 0.0):
            low, at_low = middle, here
            at_high *= 0.5 if side == -1 else 1.0
            side = -1
        else:
            high, at_high = middle, here
            at_low *= 0.5 if side == 1 else 1.0
            side = 1
    return middle
