"""Roots of the determinant of the eliminant: the angles of joint c that have a solution.

The determinant is a trigonometric polynomial, so a few values around a turn give it everywhere. In
an arc, with x the tangent of half the angle from its middle, the determinant times (1 + x^2)^8 is a
polynomial of degree 16, kept as its Bernstein coefficients. There are as many roots as these change
sign, or fewer by an even number (Descartes), so an arc with more than one change is halved. Where
the polynomial is so small that it is rounded, the determinant is sampled anew.
"""

from __future__ import annotations

from math import comb
from typing import Any

import numpy as np

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner

TURN = 2.0 * np.pi
DEGREE = 8
"""Degree of the determinant in c."""
SAMPLES = 18
"""Values of the determinant around a turn: one more than its polynomial has coefficients."""
ARCS = 24
"""Arcs of a turn, 15 degrees wide."""
TERMS = 2 * DEGREE + 1
"""Coefficients of the polynomial in an arc."""
RELIABLE = 1e-7
"""Fraction of the greatest value below which a polynomial is too rounded for its roots to be used:
the one of a turn is exact to 3e-15 of that value in the median, to 1e-11 in the worst of 2,000
poses, and the coefficients of one of an arc to 1e-11."""
ROUNDED = 1e-10
"""Fraction of it below which the sign of a value is uncertain."""
MOST_ARCS = 64
"""Greatest number of arcs that are waiting to be sampled."""
MOST_PARTS = 64
"""Greatest number of parts of an arc that are waiting: one for each halving."""
FINEST = 1e-8
"""Width of a part [rad] that is not halved: it has one root."""
DOUBLE = 1e-3
"""Width of a part [rad] that may have a double root, which rounding of the equations has lifted off
zero or split: by this much it takes a relative error of 1e-6. Newton's method decides."""
START = 0.1
"""Where the turn begins [rad]: not at a multiple of 15 degrees, where roots are of arms in special
positions, as ends of arcs are looked at twice."""
ROOT_STEPS = 60
"""Most steps of regula falsi."""
ROOT_WIDTH = 1e-9
"""Last step of a root, as a fraction of its part. The first steps may be as short as the ratio of
the values at its ends."""


def _basis(t: FloatArray) -> FloatArray:
    """Return the Bernstein polynomials at points of an arc from 0 to 1, shape (points, TERMS)."""
    n = TERMS - 1
    columns = [comb(n, k) * t**k * (1.0 - t) ** (n - k) for k in range(TERMS)]
    return np.array(columns).T


def _inverse(basis: FloatArray) -> Any:
    """Return the inverse of a matrix, in extended precision: its condition is 2e4."""
    one = np.eye(len(basis), dtype=np.longdouble)
    inverse = np.linalg.inv(basis).astype(np.longdouble)
    for _ in range(2):
        inverse = inverse + inverse @ (one - basis.astype(np.longdouble) @ inverse)
    return inverse


def _turn_weights() -> FloatArray:
    """Return the weights of the samples in the coefficients of all arcs of a turn.

    Shape (SAMPLES, ARCS * TERMS).
    """
    x = np.tan(TURN / ARCS / 4) * (2.0 * _NODES - 1.0)
    middles = START + TURN / ARCS * (np.arange(ARCS)[:, None] + 0.5)
    angles = (middles + 2.0 * np.arctan(x)).ravel()
    apart = angles - TURN * np.arange(SAMPLES)[:, None] / SAMPLES
    k = np.arange(1, DEGREE + 1)[:, None, None]
    values = (1.0 + 2.0 * np.cos(k * apart).sum(axis=0)) / SAMPLES
    values *= np.tile((1.0 + x * x) ** DEGREE, ARCS)
    weights = values.reshape(SAMPLES, ARCS, TERMS) @ _TO_TERMS
    return np.ascontiguousarray(weights.reshape(SAMPLES, -1), dtype=np.float64)


_NODES = 0.5 - 0.5 * np.cos(np.pi * (np.arange(TERMS) + 0.5) / TERMS)
"""Chebyshev nodes of an arc from 0 to 1."""
_TO_TERMS = _inverse(_basis(_NODES)).T
_TURN, _ARC = _turn_weights(), np.ascontiguousarray(_TO_TERMS, dtype=np.float64)
"""Weights of the samples of a turn, and of the values at the nodes of an arc, in coefficients."""


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
    """Fill the angles of c at which the determinant vanishes.

    Args:
        table: From `eliminate`.
        roots: Filled with angles [rad], and 1 for a root where the sign changes, 0 for what may be
            a double root, shape (n, 2).

    Returns:
        Number of roots.
    """
    matrix, samples = np.empty((12, 12)), np.empty(SAMPLES)
    greatest = 0.0
    for n in range(SAMPLES):
        samples[n] = _determinant(table, TURN * n / SAMPLES, matrix)
        greatest = max(greatest, abs(samples[n]))
    terms = np.empty(ARCS * TERMS)
    _weighted(_TURN, samples, terms)
    parts, spans = np.empty((MOST_PARTS, TERMS)), np.empty((MOST_PARTS, 2))
    arcs, counts = np.empty((MOST_ARCS, 2)), np.zeros(2, np.int64)
    for n in range(ARCS):
        for k in range(TERMS):
            parts[0, k] = terms[TERMS * n + k]
        start = START + TURN * n / ARCS
        _isolate(parts, spans, start, TURN / ARCS, greatest, arcs, counts, roots)
    while counts[0] > 0:
        counts[0] -= 1
        start, width = arcs[counts[0], 0], arcs[counts[0], 1]
        greatest = 0.0
        for n in range(TERMS):
            x = np.tan(0.25 * width) * (2.0 * _NODES[n] - 1.0)
            angle = start + 0.5 * width + 2.0 * np.arctan(x)
            samples[n] = _determinant(table, angle, matrix) * (1.0 + x * x) ** DEGREE
            greatest = max(greatest, abs(samples[n]))
        _weighted(_ARC, samples, parts[0])
        _isolate(parts, spans, start, width, greatest, arcs, counts, roots)
    return counts[1]


@inner
def _weighted(weights: FloatArray, samples: FloatArray, out: FloatArray) -> None:
    """Fill sums of samples, with weights of shape (samples, sums)."""
    for n in range(weights.shape[1]):
        out[n] = 0.0
    for i in range(weights.shape[0]):
        sample = samples[i]
        for n in range(weights.shape[1]):
            out[n] += weights[i, n] * sample


@inner
def _isolate(
    parts: FloatArray,
    spans: FloatArray,
    start: float,
    width: float,
    scale: float,
    arcs: FloatArray,
    counts: IntArray,
    roots: FloatArray,
) -> None:
    """Add the roots in an arc, and the arcs in it that are too rounded.

    Args:
        parts: Coefficients of the arc in the first row; the others are scratch, shape (MOST_PARTS,
            TERMS).
        spans: Scratch, shape (MOST_PARTS, 2).
        start: Start of the arc [rad].
        width: Its width [rad].
        scale: Greatest of the values from which the polynomial is made.
        arcs: Filled with start and width of arcs to be sampled [rad], shape (MOST_ARCS, 2).
        counts: Number of arcs and of roots, increased.
        roots: As in `find_roots`.
    """
    waiting, last = 1, TERMS - 1
    # Starts and widths of the parts, in x from -1 to 1 times the greatest x.
    spans[0, 0], spans[0, 1] = -1.0, 2.0
    middle, most = start + 0.5 * width, np.tan(0.25 * width)
    while waiting > 0 and counts[1] < len(roots):
        waiting -= 1
        b, low, size = parts[waiting], spans[waiting, 0], spans[waiting, 1]
        # Twice the difference of the tangents is the width, or a little more.
        wide = 2.0 * most * size
        changes, lowest, greatest = 0, 0, abs(b[0])
        for k in range(1, TERMS):
            greatest = max(greatest, abs(b[k]))
            lowest = k if abs(b[k]) < abs(b[lowest]) else lowest
            changes += 1 if (b[k] > 0.0) != (b[k - 1] > 0.0) else 0
        # Rounding could move a root beyond an end where the value is small.
        is_clear = min(abs(b[0]), abs(b[last])) >= ROUNDED * scale
        if is_clear and changes == 0:
            continue
        is_reliable = greatest >= RELIABLE * scale
        if is_clear and changes == 1 and is_reliable:
            roots[counts[1], 0] = middle + 2.0 * np.arctan(most * (low + size * _root(b)))
            roots[counts[1], 1] = 1.0
            counts[1] += 1
        elif wide < FINEST or waiting + 2 > MOST_PARTS:
            roots[counts[1], 0] = middle + 2.0 * np.arctan(most * (low + 0.5 * size))
            roots[counts[1], 1] = 1.0 if (b[0] > 0.0) != (b[last] > 0.0) else 0.0
            counts[1] += 1
        elif not is_reliable and counts[0] < MOST_ARCS:
            arcs[counts[0], 0] = middle + 2.0 * np.arctan(most * low)
            arcs[counts[0], 1] = middle + 2.0 * np.arctan(most * (low + size)) - arcs[counts[0], 0]
            counts[0] += 1
        else:
            # Once on the way down.
            if 0.5 * DOUBLE < wide <= DOUBLE and changes > 1:
                angle = middle + 2.0 * np.arctan(most * (low + size * lowest / last))
                roots[counts[1], 0], roots[counts[1], 1] = angle, 0.0
                counts[1] += 1
            spans[waiting, 1] = 0.5 * size
            spans[waiting + 1, 0], spans[waiting + 1, 1] = low + 0.5 * size, 0.5 * size
            _halve(b, parts[waiting + 1])
            waiting += 2


@inner
def _halve(b: FloatArray, right: FloatArray) -> None:
    """Replace coefficients by those of the left half, and fill those of the right one."""
    last = TERMS - 1
    # De Casteljau's triangle: b[k] becomes the mean of itself and its left neighbour.
    right[last] = b[last]
    for n in range(1, TERMS):
        for k in range(last, n - 1, -1):
            b[k] = 0.5 * (b[k] + b[k - 1])
        right[last - n] = b[last]


@inner
def _root(b: FloatArray) -> float:
    """Return the only root of a polynomial in its arc from 0 to 1.

    Regula falsi, in the Illinois variant: the end that stays has its value halved.
    """
    low, high, at_low, at_high = 0.0, 1.0, b[0], b[TERMS - 1]
    side, middle = 0, low
    for _ in range(ROOT_STEPS):
        last = middle
        middle = (low * at_high - high * at_low) / (at_high - at_low)
        if abs(middle - last) < ROOT_WIDTH:
            break
        here = _value(b, middle)
        if (here > 0.0) == (at_low > 0.0):
            low, at_low = middle, here
            at_high *= 0.5 if side == -1 else 1.0
            side = -1
        else:
            high, at_high = middle, here
            at_low *= 0.5 if side == 1 else 1.0
            side = 1
    return middle


@inner
def _value(b: FloatArray, t: float) -> float:
    """Return the value of a polynomial in its arc from 0 to 1, as nested sums."""
    total, factor, choices = b[0] * (1.0 - t), 1.0, 1.0
    for k in range(1, TERMS - 1):
        factor *= t
        choices *= (TERMS - k) / k
        total = (total + factor * choices * b[k]) * (1.0 - t)
    return total + factor * t * b[TERMS - 1]
