"""Least squares with bounds on the variables, by active sets."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import BoolArray, FloatArray

_GUESSES = 6
"""Iterations of the primal-dual method after which it is cycling; it nearly always takes fewer."""
_ROUNDS = 50
"""Greatest number of changes of the active set; each lowers the cost, and seven joints need far
fewer."""


def bounded_minimum(
    hessian: FloatArray, slope: FloatArray, lower: FloatArray, upper: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Return the x within bounds that minimises x^T H x / 2 - g^T x.

    The primal-dual active set method of Hintermüller, Ito and Kunisch (2003) changes all variables
    of the active set at once and mostly takes two or three iterations. If it cycles, the method
    that changes one variable at a time, which cannot cycle, is used instead.

    Args:
        hessian: H, positive definite, shape (n, n).
        slope: g, shape (n,).
        lower: Lower bounds, shape (n,), -inf for none.
        upper: Upper bounds, shape (n,), at least the lower ones.

    Returns:
        x, shape (n,), and which variables are held at a bound, shape (n,).
    """
    x = np.asarray(np.linalg.solve(hessian, slope), dtype=np.float64)
    below, above = x < lower, x > upper
    if not (below.any() or above.any()):
        return x, below
    # A multiplier below this is rounding, of the size of the rounding of the cost.
    slack = 1e-12 * (1.0 + float(np.abs(slope).max()))
    for _ in range(_GUESSES):
        held = below | above
        bound = np.where(below, lower, np.where(above, upper, 0.0))
        reduced = np.where(held[:, None] | held, 0.0, hessian)
        reduced.flat[:: len(x) + 1] += held
        x = np.linalg.solve(reduced, np.where(held, bound, slope - hessian @ bound))
        x[held] = bound[held]
        pull = slope - hessian @ x
        # A free variable beyond a bound becomes active; an active one stays so while its
        # multiplier points outwards.
        now_below = np.where(below, pull < slack, ~above & (x < lower))
        now_above = np.where(above, pull > -slack, ~below & (x > upper))
        if (now_below == below).all() and (now_above == above).all():
            return x, held
        below, above = now_below, now_above
    return _one_by_one(hessian, slope, lower, upper, slack)


def _one_by_one(
    hessian: FloatArray, slope: FloatArray, lower: FloatArray, upper: FloatArray, slack: float
) -> tuple[FloatArray, BoolArray]:
    """Return the result of `bounded_minimum` by an active set method whose steps lower the cost.

    Solve for the free variables; move towards the solution up to the first bound and make that
    variable active; once all free variables are within bounds, free the active one whose multiplier
    points inwards most; stop if there is none (Lawson and Hanson, Solving Least Squares Problems,
    chapter 23, for bounds on both sides).
    """
    side = np.zeros(len(slope), np.int8)
    x = np.clip(np.zeros_like(slope), lower, upper)
    for _ in range(_ROUNDS):
        free = np.flatnonzero(side == 0)
        if len(free):
            held = np.flatnonzero(side)
            rest = slope[free] - hessian[np.ix_(free, held)] @ x[held]
            goal = np.asarray(np.linalg.solve(hessian[np.ix_(free, free)], rest), dtype=np.float64)
            fraction, first, at = _first_bound(x[free], goal, lower[free], upper[free])
            x[free] += fraction * (goal - x[free])
            if first >= 0:
                joint = free[first]
                x[joint] = (lower, upper)[at][joint]
                side[joint] = 2 * at - 1
                continue
            x[free] = goal
        # The negative gradient; an active variable is freed if it points inwards.
        pull = slope - hessian @ x
        inwards = np.where(upper > lower, -side * pull, 0.0)
        i = int(inwards.argmax())
        if inwards[i] <= slack:
            break
        side[i] = 0
    return x, side != 0


def _first_bound(
    x: FloatArray, goal: FloatArray, lower: FloatArray, upper: FloatArray
) -> tuple[float, int, int]:
    """Return the fraction of the step from x to goal within bounds, and what limits it.

    Returns:
        The fraction, in [0, 1]; the variable that meets its bound first, -1 if none does; and the
        bound, 0 for lower and 1 for upper.
    """
    fraction, first, side = 1.0, -1, 0
    for i in range(len(x)):
        step = goal[i] - x[i]
        for at, bound in ((0, lower[i]), (1, upper[i])):
            over = goal[i] < bound if at == 0 else goal[i] > bound
            if over:
                part = max((bound - x[i]) / step, 0.0)
                if part < fraction:
                    fraction, first, side = part, i, at
    return float(fraction), first, side
