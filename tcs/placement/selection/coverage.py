"""Whether the path around the furniture stays where the scores know what blocks the base."""

from __future__ import annotations

import itertools

import numpy as np

from tcs.model.grid import Grid, InitialConfiguration
from tcs.placement.selection.distances import ON_EDGE, LatticeDistances
from tcs.placement.selection.travel import Legs


def warning_outside(
    legs: Legs, here: InitialConfiguration, cells: tuple[int, ...], grid: Grid
) -> str | None:
    """Return a warning if the path around the furniture leaves the grid, else None.

    Args:
        legs: Travel from the current state, by either route; a straight path, which ignores the
            furniture, causes no warning.
        here: The current state.
        cells: Base cells of the members, in the order of the tour.
        grid: The scored grid.
    """
    distances = legs.distances
    if not isinstance(distances, LatticeDistances):
        return None
    axes = (grid.axis("base_x"), grid.axis("base_y"))
    low = np.array([axis.values[0] for axis in axes])
    high = np.array([axis.values[-1] for axis in axes])
    covered = f"x {low[0]:g} to {high[0]:g} m, y {low[1]:g} to {high[1]:g} m"
    start = np.array([here.base_x, here.base_y])
    if np.any((start < low - ON_EDGE) | (start > high + ON_EDGE)):
        return (
            f"The path around the furniture starts outside the scored grid ({covered}), where the "
            "scores do not show what blocks the base."
        )
    metres = [float(legs.here_to_cell[cells[0]]) / legs.metre if legs.metre else np.inf]
    metres += [
        float(distances.between(np.array(one), np.array(other)))
        for one, other in itertools.pairwise(cells)
    ]
    stops = np.concatenate([start[None], distances.cell_xy[list(cells)]])
    to_edge = np.minimum(stops - low, high - stops).min(axis=1)
    # A leg that is too short to reach the edge and return needs no search.
    if np.all(np.array(metres) <= to_edge[:-1] + to_edge[1:]):
        return None
    path = distances.path(float(start[0]), float(start[1]), cells, low, high)
    outside = np.any((path < low - ON_EDGE) | (path > high + ON_EDGE), axis=1)
    if not np.any(outside):
        return None
    x, y = path[int(np.argmax(outside))]
    return (
        f"The path around the furniture leaves the scored grid ({covered}) at ({x:.2f}, {y:.2f}) "
        "m; beyond it the scores do not show what blocks the base."
    )
