"""The score map on the floor: a colour for each base position."""

from __future__ import annotations

from dataclasses import dataclass

import matplotlib
import numpy as np
from matplotlib.colors import to_rgb
from numpy.typing import NDArray

from tcs.output.draw.colours import SCALE
from tcs.output.draw.floor_plan import cell_widths
from tcs.output.view.viewed_set import ViewedSet
from tcs.output.words import REASON_COLOURS
from tcs.placement.reasons.distribution import CHECKS
from tcs.placement.tables import Reason
from tcs.placement.tables.place_map import PlaceMap, best_per_place, rows_of_state

FloatArray = NDArray[np.float64]

REACHABILITY, MANIPULABILITY, REASON, SUCCESS = (
    "reachability",
    "manipulability",
    "reason",
    "success",
)
"""Quantities that the floor can show."""
_NEAREST = (*CHECKS, Reason.REACHED)
"""Reasons in the order of the checks, so that the last one passed the most checks."""


@dataclass(frozen=True, eq=False)
class FloorMap:
    """The base positions with a colour; the others reach no goal, or have no estimate."""

    places: FloatArray
    """x and y of their centres in W [m], shape (n, 2)."""
    half: tuple[float, float]
    """Half the widths of the cells along x and y [m]."""
    colours: FloatArray
    """Red, green, blue of each, 0 to 1, shape (n, 3)."""


def colourings(viewed: ViewedSet) -> tuple[str, ...]:
    """Return the quantities that the floor can show: success only if it has been estimated."""
    known = (REACHABILITY, MANIPULABILITY, REASON)
    return known if viewed.success is None else (*known, SUCCESS)


def floor_map(viewed: ViewedSet, state: int, goal: int, colouring: str) -> FloorMap:
    """Return the map for one state of the environment.

    Args:
        viewed: The scores and the set.
        state: Number of the environment's state, in C order over its axes.
        goal: The goal that is shown; matters for the reasons only.
        colouring: One of `colourings`.

    Returns:
        At each base position, over all headings and torso heights: the best P_R, P_M or estimated
        success of one configuration, or the result of the configuration that passed the most
        checks. The scale of P_R and P_M ends at the best base position of this state.
    """
    grid, scores = viewed.grid, viewed.scores
    places = PlaceMap.of_state(scores, grid, state)
    if colouring == REASON:
        rank = np.argsort([int(reason) for reason in _NEAREST])
        codes = scores.reason[rows_of_state(grid, state), goal]
        best = best_per_place(grid, rank[codes], state)
        table = np.array([to_rgb(REASON_COLOURS[reason]) for reason in _NEAREST])
        colours, shown = table[best], np.ones(best.shape, dtype=np.bool_)
    else:
        values = _values(viewed, places, state, colouring)
        shown = values > 0.0
        top = 1.0 if colouring == SUCCESS else float(values.max(initial=0.0)) or 1.0
        colours = matplotlib.colormaps[SCALE](values / top)[..., :3]
    middles = np.stack(np.meshgrid(places.x, places.y, indexing="ij"), axis=-1)
    width, depth = cell_widths(places.x, places.y)
    half = width / 2.0, depth / 2.0
    return FloorMap(places=middles[shown], half=half, colours=np.asarray(colours[shown]))


def _values(viewed: ViewedSet, places: PlaceMap, state: int, colouring: str) -> FloatArray:
    """Return the best P_R, P_M or success of one configuration at each place, shape (X, Y)."""
    if colouring == REACHABILITY:
        return places.reachability
    if colouring == MANIPULABILITY:
        return places.manipulability
    rows = np.arange(viewed.grid.size)[rows_of_state(viewed.grid, state)]
    values = np.zeros(rows.size)
    success = viewed.success
    if success is not None:
        single = success.of_size(1)
        members = success.members[single, 0]
        here = np.isin(members, rows)
        values[np.searchsorted(rows, members[here])] = success.success[single][here]
    return np.asarray(best_per_place(viewed.grid, values, state))
