"""Null vectors of a matrix whose null space is known, and the angles that they hold."""

from __future__ import annotations

import numpy as np
import pytest

from tcs.kernel.cache import jit
from tcs.kernel.six_joints.null_space import MOST_VECTORS, OF_D, OF_E, half_angle, null_vectors

PAIRS = {
    "apart": ((0.7, -1.1), (-2.0, 0.4)),
    "same d": ((0.7, -1.1), (0.7, 0.4)),
    "same e": ((0.7, -1.1), (-2.0, -1.1)),
    "close": ((0.7, -1.1), (0.71, -1.12)),
    "no tangent": ((np.pi, -1.1), (-2.0, np.pi)),
}
"""Angles of d and e [rad] of two solutions at one root."""
EXACT = 1e-11
"""Error of the angles [rad]: the worst of 300 matrices of each kind, a close pair, is 1.2e-13."""


@jit
def angles_at(A, is_double, order, vectors, angles):
    """Fill the angles of d and e of each null vector, shape (n, 2); return their number n."""
    count = null_vectors(A, is_double, order, vectors)
    for k in range(count):
        angles[k, 0] = half_angle(vectors[k], OF_D)
        angles[k, 1] = half_angle(vectors[k], OF_E)
    return count


def products(d, e):
    """Return the products of the powers of both tangents, homogeneous, shape (12,), of length 1."""
    (c, s), (u, v) = ((np.cos(angle / 2), np.sin(angle / 2)) for angle in (d, e))
    of_d = [c**3, c**2 * s, c * s**2, s**3]
    of_e = [u**2, u * v, v**2]
    return np.outer(of_d, of_e).ravel()


def eliminant(rng, solutions, off=0.0):
    """Return a matrix that maps the products of the solutions to zero, and no others.

    Args:
        rng: Source of its entries.
        solutions: Angles of d and e [rad].
        off: Size of the entries that are added, as rounding adds them.
    """
    kept = np.linalg.qr(np.array([products(*angles) for angles in solutions]).T)[0]
    A = rng.normal(size=(12, 12))
    return A - A @ kept @ kept.T + off * rng.normal(size=(12, 12))


def found_angles(A, is_double=False):
    angles = np.full((MOST_VECTORS, 2), np.nan)
    order, vectors = np.empty(12, np.int64), np.empty((MOST_VECTORS + 2, 12))
    count = angles_at(A, is_double, order, vectors, angles)
    return angles[:count]


def farthest(solution, found):
    """Return how far the nearest of the angles found is from a solution [rad]."""
    off = found - np.array(solution)
    return float(np.abs(off - 2 * np.pi * np.rint(off / (2 * np.pi))).max(axis=1).min())


@pytest.mark.parametrize("solution", [(0.7, -1.1), (-2.0, 3.0), (np.pi, 0.1)])
def test_a_null_vector_holds_the_angles_of_its_solution(solution, rng):
    found = found_angles(eliminant(rng, [solution]))
    assert len(found) == 1
    assert farthest(solution, found) < EXACT


@pytest.mark.parametrize("solutions", PAIRS.values(), ids=PAIRS)
@pytest.mark.parametrize("is_double", [False, True])
def test_a_plane_of_null_vectors_holds_the_angles_of_both_solutions(solutions, is_double, rng):
    for _ in range(20):
        found = found_angles(eliminant(rng, solutions), is_double)
        for solution in solutions:
            assert farthest(solution, found) < EXACT


def test_solutions_are_found_in_a_plane_that_is_not_exact(rng):
    # As at a root next to two solutions. The worst of 300 such matrices is off by 2e-8.
    solutions = PAIRS["apart"]
    for _ in range(20):
        found = found_angles(eliminant(rng, solutions, off=1e-9))
        for solution in solutions:
            assert farthest(solution, found) < 1e-6


def test_no_solutions_are_made_of_a_plane_without_any(rng):
    # Products of complex tangents: their real and their imaginary parts are a plane.
    tangent = 0.3 + 0.8j
    powers = np.outer(tangent ** np.arange(4), (0.2 - 1.1j) ** np.arange(3)).ravel()
    kept = np.linalg.qr(np.array([powers.real, powers.imag]).T)[0]
    A = rng.normal(size=(12, 12))
    assert len(found_angles(A - A @ kept @ kept.T)) == 1
