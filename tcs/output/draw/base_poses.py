"""Figures of base poses from above: heat maps of the best score at each base position."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tcs.output.draw.heat_map import heat_map_of

FloatArray = NDArray[np.float64]

COLOURS = "turbo"
"""From 0, dark blue, to 1, dark red, as in the ITCM thesis."""


@dataclass(frozen=True, eq=False)
class BasePoseView:
    """One panel: base poses and the tool positions that they reach."""

    poses: FloatArray
    """x, y [m], yaw [rad] and score of each, shape (n, 4)."""
    step: float
    """Distance of neighbouring base positions [m]."""
    positions: FloatArray
    """Tool positions, x, y [m], shape (m, 2)."""
    grasps: FloatArray
    """Grippers: x, y [m] and heading [rad], shape (k, 3)."""
    caption: str
    marked: Sequence[tuple[str, FloatArray, str]] = ()
    """Highlighted base poses: name, (x, y, yaw) and colour."""


def draw_base_poses(views: Sequence[BasePoseView], *, title: str, score: str = "score") -> Figure:
    """Return a figure with one panel for each view, all at one scale.

    Args:
        views: The panels, left to right.
        title: Title of the figure.
        score: Label of the colour bar.

    Source:
        ITCM thesis, Figures 3, 5 and 37, which draw a line for each base pose, so that those of
        one position hide each other; here a cell has the colour of the best one.
    """
    figure = Figure(figsize=(5.6 * len(views) + 0.9, 6.2), layout="constrained")
    panels = figure.subplots(1, len(views), squeeze=False)[0]
    low, high = _extent(views)
    for axes, view in zip(panels, views, strict=True):
        _draw(axes, view)
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
    bar = ScalarMappable(Normalize(0.0, 1.0), COLOURS)
    figure.colorbar(bar, ax=list(panels), label=f"{score}, best heading", shrink=0.8)
    figure.suptitle(title, fontsize=13)
    return figure


def _extent(views: Sequence[BasePoseView]) -> tuple[FloatArray, FloatArray]:
    """Return the limits of all panels [m]."""
    points = np.concatenate([np.vstack([view.poses[:, :2], view.positions]) for view in views])
    return points.min(axis=0) - 0.15, points.max(axis=0) + 0.15


def _draw(axes: Axes, view: BasePoseView) -> None:
    found = heat_map_of(view.poses, view.step)
    # An image in vector formats too: cells beside each other would show seams.
    axes.pcolormesh(
        *found.edges, found.best, cmap=COLOURS, norm=Normalize(0.0, 1.0), rasterized=True
    )
    for x, y, heading in view.grasps:
        _draw_gripper(axes, x, y, heading)
    axes.plot(*view.positions.T, "o", ms=7, mfc="white", mec="black", mew=1.3, zorder=5)
    for name, (x, y, yaw), colour in view.marked:
        tip = (x + 0.14 * np.cos(yaw), y + 0.14 * np.sin(yaw))
        arrow = {"arrowstyle": "-|>", "color": colour, "lw": 2.2, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", tip, (x, y), arrowprops=arrow, zorder=6)
        axes.plot([x], [y], "s", ms=6, color=colour, mec="white", zorder=7, label=name)
    if view.marked:
        axes.legend(loc="upper left", fontsize=9)
    axes.set_aspect("equal")
    axes.set_title(view.caption, fontsize=11)
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.grid(color="0.9", lw=0.5)
    axes.set_axisbelow(True)


def _draw_gripper(axes: Axes, x: float, y: float, heading: float) -> None:
    """Draw a gripper as a U, open towards the object."""
    c, s = np.cos(heading), np.sin(heading)
    shape = np.array([[0.02, 0.035], [-0.05, 0.035], [-0.05, -0.035], [0.02, -0.035]])
    wrist = np.array([[-0.05, 0.0], [-0.09, 0.0]])
    rotation = np.array([[c, s], [-s, c]])
    for part, width in ((shape, 1.6), (wrist, 3.0)):
        axes.plot(*(part @ rotation + [x, y]).T, color="#7b3fa0", lw=width, zorder=4)
