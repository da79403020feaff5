"""The lattice of base positions of a grid, with the moves that the scores show to be free."""

from __future__ import annotations

import math

import numpy as np

from tcs.model.grid import ROBOT_AXES, Grid
from tcs.placement.tables import BaseLattice, ScoreTable
from tcs.placement.tables.base_lattice import MOVES

BORDER = 0.6
"""Distance by which obstacles at the border of the grid are extended beyond it [m]. The grid has
no data there, and the paper's grid ends at the foot end of the bed: half a PR2 and the end of the
bed are 0.6 m."""

STEP = 0.1
"""Distance of neighbours along an axis on which the grid has a single value [m]."""


def lattice_of(scores: ScoreTable, grid: Grid) -> BaseLattice:
    """Return the lattice of the base positions of a grid and its surroundings.

    The base can move to a neighbour if, in some state of the environment and with some heading and
    torso height, its body is free of contact at both positions; diagonally if also at the two
    positions beside the diagonal. At each position the robot may turn, move its torso and have the
    environment set. Positions are checked, not the path between them. Configurations that a
    constraint excluded count as in contact.

    Args:
        scores: Scores of every configuration of the grid.
        grid: The grid.
    """
    # Nothing is known about the body where a configuration was not scored.
    blocked = scores.has_no_free_body
    names = list(ROBOT_AXES)
    x, y = names.index("base_x") - len(names), names.index("base_y") - len(names)
    free = np.moveaxis(~blocked.reshape(grid.shape), (x, y), (-2, -1))
    free = free.reshape(-1, *free.shape[-2:])
    axes = [grid.axis(name) for name in ("base_x", "base_y")]
    known = [axis.step for axis in axes if axis.count > 1] or [STEP]
    step = [axis.step if axis.count > 1 else known[0] for axis in axes]
    border = [math.ceil(BORDER / s - 1e-9) for s in step]  # 0.6 / 0.1 rounds to less than 6
    free = np.pad(free, ((0, 0), (border[0],) * 2, (border[1],) * 2), mode="edge")
    # Beyond that everything is free, which one ring of positions represents.
    free = np.pad(free, ((0, 0), (1, 1), (1, 1)), constant_values=True)
    shape = free.shape[-2:]
    moves = np.zeros((len(MOVES), *shape), dtype=np.bool_)
    for along, (dx, dy) in zip(moves, MOVES, strict=True):
        low, high = max(0, -dy), shape[1] - max(0, dy)
        rows, columns = {0, dx}, {0, dy}
        possible = np.ones((len(free), shape[0] - dx, high - low), dtype=np.bool_)
        for i in rows:
            for j in columns:
                possible &= free[:, i : shape[0] - dx + i, low + j : high + j]
        along[: shape[0] - dx, low:high] = possible.any(axis=0)
    return BaseLattice(
        start=(
            axes[0].start - (border[0] + 1) * step[0],
            axes[1].start - (border[1] + 1) * step[1],
        ),
        step=(step[0], step[1]),
        moves=moves,
    )
