"""Small scatter plots, one panel for each group of points."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from tcs_studies.output.draw.boxes import COLOURS

FloatArray = NDArray[np.float64]

_COLUMNS = 4


@dataclass(frozen=True, eq=False)
class Cloud:
    """The points of one panel."""

    title: str
    points: Sequence[tuple[FloatArray, FloatArray]]
    """x and y of each series of points."""
    marked: tuple[float, float] | None = None
    """A point to highlight."""


def draw_clouds(
    clouds: Sequence[Cloud], series: Sequence[str], *, x_label: str, y_label: str
) -> Figure:
    """Return a figure with a panel for each cloud, each with its own axes.

    Args:
        clouds: The panels.
        series: Names of the series of points.
        x_label: Name of x, with its unit.
        y_label: Name of y, with its unit.
    """
    columns = min(_COLUMNS, max(len(clouds), 1))
    rows = math.ceil(len(clouds) / columns)
    figure = Figure(figsize=(8.2, 1.0 + 2.05 * rows), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, cloud in zip(panels, clouds, strict=False):
        for i, (x, y) in enumerate(cloud.points):
            axes.scatter(x, y, s=7, color=COLOURS[i], alpha=0.5, lw=0, rasterized=True)
        if cloud.marked is not None:
            axes.plot(*cloud.marked, "D", mfc="none", mec="#222222", ms=7, mew=1.2)
        axes.set_title(cloud.title, fontsize=8)
        axes.grid(color="#e6e9ed", lw=0.8)
        axes.set_axisbelow(True)
        axes.tick_params(labelsize=7)
        axes.locator_params(nbins=4)
    for axes in panels[len(clouds) :]:
        axes.set_axis_off()
    figure.supxlabel(x_label, fontsize=9)
    figure.supylabel(y_label, fontsize=9)
    handles = [_dot("o", COLOURS[i], name) for i, name in enumerate(series)]
    if any(cloud.marked for cloud in clouds):
        handles.append(_dot("D", "none", "best set"))
    figure.legend(handles=handles, loc="outside upper left", ncols=3, frameon=False, fontsize=9)
    return figure


def _dot(marker: str, colour: str, label: str) -> Line2D:
    edge = "#222222" if colour == "none" else "none"
    return Line2D([], [], ls="none", marker=marker, ms=6, mfc=colour, mec=edge, label=label)
