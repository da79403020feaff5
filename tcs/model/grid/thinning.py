"""A grid with fewer base positions, for a first answer."""

from __future__ import annotations

import dataclasses

import numpy as np

from tcs.errors import SelectionError
from tcs.model.grid.grid import Grid


def thinned(grid: Grid, every: int, around: tuple[float, float] | None = None) -> Grid:
    """Return a grid with every so many of its base positions along x and along y.

    Args:
        grid: The grid with all base positions.
        every: 1 for all, 2 for every second one, ...
        around: x and y [m] of a position whose nearest one of the grid remains; by default the
            first one.

    Raises:
        SelectionError: If `around` is given although all positions remain.

    >>> spec = {name: {"unit": "m", "start": 0, "step": 0.1, "count": 6}
    ...         for name in ("base_x", "base_y", "torso")}
    >>> spec["base_yaw"] = {"unit": "deg", "start": 0, "step": 0, "count": 1}
    >>> grid = Grid.from_spec(spec)
    >>> thinned(grid, 2, (0.52, 0.0)).axis("base_x").values.round(3).tolist()
    [0.1, 0.3, 0.5]
    """
    if every == 1:
        if around is not None:
            raise SelectionError("'around' requires 'every' above 1.")
        return grid
    positions = dict(zip(("base_x", "base_y"), around or (None, None), strict=True))
    axes = []
    for axis in grid.axes:
        if axis.name not in positions or axis.count == 1:
            axes.append(axis)
            continue
        at = positions[axis.name]
        nearest = 0 if at is None else int(np.argmin(np.abs(axis.values - at)))
        first = nearest % min(every, axis.count)
        count = 1 + (axis.count - 1 - first) // every
        start = axis.start + first * axis.step
        axes.append(dataclasses.replace(axis, start=start, step=every * axis.step, count=count))
    return dataclasses.replace(grid, axes=tuple(axes))
