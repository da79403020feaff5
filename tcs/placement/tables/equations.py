"""TC-reachability and TC-manipulability, equations (1) and (4) of the TCS paper.

Sums run over the goals one by one, in order and in double precision, wherever
these scores are computed: here, in the compiled kernel and online. A matrix
product would be shorter, but BLAS adds in an order of its own, and a set could
then beat the best single configuration on one machine and tie with it on another.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def tc_reachability(
    reached: NDArray[np.bool_], weights: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return P_R, the weighted fraction of goals that can be reached: TCS eq. (1).

    Args:
        reached: Whether a goal is reached, shape (..., goals).
        weights: Weights of the goals, sum 1, shape (goals,).

    Returns:
        P_R in [0, 1], shape (...).

    >>> float(tc_reachability(np.array([True, False, True]), np.array([0.5, 0.25, 0.25])))
    0.75
    """
    total = np.zeros(reached.shape[:-1])
    for g, weight in enumerate(weights):
        total += float(weight) * reached[..., g]
    return total


def tc_manipulability(
    dexterity: NDArray[np.float32] | NDArray[np.float64], weights: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return P_M, the weighted dexterity over the goals: TCS eq. (4).

    Args:
        dexterity: Greatest dexterity at each goal (kinematic isotropy in the paper), 0 where it is
            not reached, shape (..., goals).
        weights: Weights of the goals, sum 1, shape (goals,).

    Returns:
        P_M in [0, 1], shape (...).

    >>> float(tc_manipulability(np.array([0.5, 0.0]), np.array([0.5, 0.5])))
    0.25
    """
    total = np.zeros(dexterity.shape[:-1])
    for g, weight in enumerate(weights):
        # Widen first: a float32 array times a Python float stays float32.
        total += float(weight) * dexterity[..., g].astype(np.float64)
    return total


def members_by_dexterity(
    reached: NDArray[np.bool_], dexterity: NDArray[np.float32]
) -> list[list[int]]:
    """Return the members of a set that reach each goal, the most dexterous first.

    The first one serves the goal; the dexterity of a goal that is reached may be 0. Of equal
    members the first in the order of the visits comes first.

    Args:
        reached: Whether a member reaches a goal, shape (m, G).
        dexterity: Its dexterity there, shape (m, G).

    >>> reached = np.array([[True, False], [True, False]])
    >>> members_by_dexterity(reached, np.array([[0.1, 0.0], [0.2, 0.0]], np.float32))
    [[1, 0], []]
    """
    order = np.argsort(-dexterity, axis=0, kind="stable")
    return [[int(n) for n in of_goal if reached[n, g]] for g, of_goal in enumerate(order.T)]


def float32_above(values: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return the least float32 not below each value: a bound must not round down.

    >>> [float(v) for v in float32_above(np.array([0.5, 0.1]))]
    [0.5, 0.10000000149011612]
    """
    near = values.astype(np.float32)
    return np.where(near < values, np.nextafter(near, np.float32(np.inf)), near)
