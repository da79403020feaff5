"""The score map that lies on the floor: a colour for each base place."""

from __future__ import annotations

import math
from dataclasses import dataclass

import matplotlib
import numpy as np
from matplotlib.colors import to_rgb
from numpy.typing import NDArray

from tcs.output.view.answers import COLOURS, Answers
from tcs.placement.reasons.distribution import CHECKS
from tcs.placement.tables import Reason
from tcs.placement.tables.equations import tc_manipulability, tc_reachability

FloatArray = NDArray[np.float64]

REACHABILITY, MANIPULABILITY, REASON, SUCCESS = (
    "reachability",
    "manipulability",
    "reason",
    "success",
)
"""What the floor may be coloured by."""
_SCALE = "viridis"
"""As on the map that `tcs map` draws."""
_NEAREST = (*CHECKS, Reason.REACHED)
"""Reasons, the one that came nearest to reaching the goal last."""


@dataclass(frozen=True, eq=False)
class Floor:
    """Places that have a colour; at the others nothing is reached, or nothing known."""

    places: FloatArray
    """x and y of their middles in W [m], shape (n, 2)."""
    half: tuple[float, float]
    """Half the size of a place along x and y [m]."""
    colours: FloatArray
    """Red, green, blue of each, 0 to 1, shape (n, 3)."""


def kinds(answers: Answers) -> tuple[str, ...]:
    """Return what the floor can be coloured by: success only where it has been estimated."""
    known = (REACHABILITY, MANIPULABILITY, REASON)
    return known if answers.success is None else (*known, SUCCESS)


def floor_of(answers: Answers, state: int, goal: int, kind: str) -> Floor:
    """Return the map for one state of the environment.

    Args:
        answers: The scores.
        state: Number of the environment's state, in C order over its axes.
        goal: The goal that is shown; only the reasons depend on it.
        kind: One of `kinds`.

    Returns:
        The best P_R, P_M, estimated success of one configuration, or the reason that came nearest
        to reaching the goal, over all headings and torso heights at each place. P_R and P_M are
        coloured up to the best place of this state.
    """
    x, y = answers.grid.axis("base_x"), answers.grid.axis("base_y")
    size = answers.grid.size // math.prod(answers.grid.environment_shape)
    rows = slice(state * size, (state + 1) * size)
    shape = (x.count, y.count, -1)
    if kind == REASON:
        rank = np.argsort([int(reason) for reason in _NEAREST])
        best = rank[answers.scores.reason[rows, goal]].reshape(shape).max(axis=2)
        table = np.array([to_rgb(COLOURS[reason]) for reason in _NEAREST])
        colours, shown = table[best], np.ones(best.shape, dtype=np.bool_)
    else:
        values = _values(answers, rows, kind).reshape(shape).max(axis=2)
        shown = values > 0.0
        top = 1.0 if kind == SUCCESS else float(values.max(initial=0.0)) or 1.0
        colours = matplotlib.colormaps[_SCALE](values / top)[..., :3]
    grid = np.stack(np.meshgrid(x.values, y.values, indexing="ij"), axis=-1)
    return Floor(
        places=grid[shown], half=(x.step / 2.0, y.step / 2.0), colours=np.asarray(colours[shown])
    )


def _values(answers: Answers, rows: slice, kind: str) -> FloatArray:
    """Return what configurations are worth, shape (n,)."""
    scores = answers.scores
    if kind == REACHABILITY:
        return np.asarray(tc_reachability(scores.reached[rows], scores.weights))
    if kind == MANIPULABILITY:
        return np.asarray(tc_manipulability(scores.dexterity[rows], scores.weights))
    values = np.zeros(rows.stop - rows.start)
    success = answers.success
    if success is not None:
        single = success.of_size(1)
        at = success.members[single, 0] - rows.start
        here = (at >= 0) & (at < values.size)
        values[at[here]] = success.success[single][here]
    return values
