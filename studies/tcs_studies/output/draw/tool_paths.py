"""Paths of a tool beside the commanded line, from above and from the side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tcs_studies.output.draw.boxes import COLOURS

_LINE = "#222222"
_COLUMN = 3.1
"""Width of a group in inches."""


@dataclass(frozen=True, eq=False)
class PathGroup:
    """Paths of one column of the picture."""

    name: str
    paths: Sequence[NDArray[np.float64]]
    """Shapes (k, 3) [m]."""


def draw_tool_paths(
    groups: Sequence[PathGroup],
    start: NDArray[np.float64],
    end: NDArray[np.float64],
    *,
    blocked: float | None = None,
) -> Figure:
    """Return paths from above and from the side, a column for each group.

    Args:
        groups: The paths.
        start: Start of the line [m], shape (3,).
        end: End of the line [m], shape (3,).
        blocked: Fraction of the line at which a joint meets its limit, to mark.
    """
    level = np.array([end[0] - start[0], end[1] - start[1], 0.0])
    level /= np.linalg.norm(level)
    side = np.array([-level[1], level[0], 0.0])
    views = (("to its left [m]", side), ("above [m]", np.array([0.0, 0.0, 1.0])))
    points = np.concatenate([*(path for group in groups for path in group.paths), [start, end]])
    along, left, above = (np.ptp(points @ axis) for axis in (level, side, views[1][1]))
    # The height of a row is the extent of the paths, at the scale of the columns.
    heights = np.clip(_COLUMN * np.array([left, above]) / along, 0.8, 4.0)
    figure = Figure(
        figsize=(_COLUMN * len(groups) + 0.6, float(heights.sum()) + 1.4), layout="constrained"
    )
    axes = figure.subplots(
        2, len(groups), sharex="row", sharey="row", squeeze=False, height_ratios=heights
    )
    for row, (label, up) in enumerate(views):
        for column, group in enumerate(groups):
            panel = axes[row, column]
            for path in group.paths:
                off = path - start
                panel.plot(
                    off @ level, off @ up, color=COLOURS[column % len(COLOURS)], lw=0.6, alpha=0.45
                )
            _line(panel, float((end - start) @ level), float((end - start) @ up), blocked)
            panel.set_aspect("equal")
            panel.grid(color="#e6e9ed", lw=0.8)
            panel.set_axisbelow(True)
            if row == 0:
                panel.set_title(group.name, fontsize=10)
            else:
                panel.set_xlabel("along the line [m]")
            if column == 0:
                panel.set_ylabel(label)
    return figure


def _line(panel: Axes, along: float, up: float, blocked: float | None) -> None:
    panel.plot([0.0, along], [0.0, up], color=_LINE, lw=1.4, ls="--")
    panel.plot([0.0], [0.0], "o", color=_LINE, ms=6)
    panel.plot([along], [up], "s", color=_LINE, ms=6)
    if blocked is not None:
        panel.plot([blocked * along], [blocked * up], "x", color=_LINE, ms=8, mew=1.6)
