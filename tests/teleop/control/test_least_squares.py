from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from tcs.teleop.control import least_squares
from tcs.teleop.control.least_squares import bounded_minimum


def problem(seed, rows):
    rng = np.random.default_rng(seed)
    A, b = rng.normal(size=(rows, 7)), 3.0 * rng.normal(size=rows)
    # Some bounds are zero, as of joints at their limits, some are none.
    lower = -rng.exponential(size=7) * rng.integers(0, 2, 7)
    upper = rng.exponential(size=7) * rng.integers(0, 2, 7)
    lower[rng.random(7) < 0.2], upper[rng.random(7) < 0.2] = -np.inf, np.inf
    return A, b, lower, upper


@pytest.mark.parametrize("guesses", [6, 0], ids=["all at once", "one by one"])
@given(seed=st.integers(0, 10**6), rows=st.integers(3, 12))
def test_the_minimum_within_bounds_is_found(seed, rows, guesses):
    A, b, lower, upper = problem(seed, rows)
    ease = 1e-3
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(least_squares, "_GUESSES", guesses)
        x, held = bounded_minimum(A.T @ A + ease * np.eye(7), A.T @ b, lower, upper)
    assert ((x >= lower) & (x <= upper)).all()
    assert ((x == lower) | (x == upper))[held].all()
    # Optimality: zero gradient of free variables, multipliers of active ones point outwards.
    pull = A.T @ (b - A @ x) - ease * x
    # The slope is of size 10 to 100 and rounded to 1e-13 of that, through a condition of 1e5.
    assert np.abs(pull[~held]).max(initial=0.0) < 1e-8
    at_lower, at_upper = held & (x == lower), held & (x == upper) & (lower < upper)
    assert (pull[at_lower & (lower < upper)] <= 1e-8).all()
    assert (pull[at_upper] >= -1e-8).all()


def test_scipy_finds_the_same():
    for seed in range(20):
        A, b, lower, upper = problem(seed, 9)
        # scipy needs bounds that differ.
        lower, upper = lower - 1e-3, upper + 1e-3
        ours, _ = bounded_minimum(A.T @ A, A.T @ b, lower, upper)
        theirs = lsq_linear(A, b, (lower, upper), method="bvls", tol=1e-14).x
        # Nine rows of noise have a condition below 1e3, squared in the normal equations.
        np.testing.assert_allclose(ours, theirs, atol=1e-8)


def test_a_start_without_bounds_in_the_way_is_the_plain_solution():
    A = np.random.default_rng(1).normal(size=(7, 7))
    H = A.T @ A + np.eye(7)
    x, held = bounded_minimum(H, np.ones(7), np.full(7, -np.inf), np.full(7, np.inf))
    np.testing.assert_allclose(H @ x, np.ones(7), atol=1e-12)
    assert not held.any()


def test_a_variable_that_may_not_move_stays():
    A = np.random.default_rng(2).normal(size=(9, 7))
    lower, upper = np.full(7, -0.1), np.full(7, 0.1)
    lower[3] = upper[3] = 0.0
    x, held = bounded_minimum(A.T @ A, A.T @ np.ones(9), lower, upper)
    assert x[3] == 0.0
    assert held[3]
