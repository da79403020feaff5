"""Small scatter plots beside each other: how well one figure predicts another."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tcs.draw.boxes import COLOURS

_COLUMNS = 4


@dataclass(frozen=True, eq=False)
class Cloud:
    """The points of one panel."""

    title: str
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    marked: tuple[float, float] | None = None
    """A point to be pointed out."""


def draw_clouds(
    clouds: Sequence[Cloud], *, x_label: str, y_label: str, x_span: tuple[float, float]
) -> Figure:
    """Return a panel for each cloud, all on the same axes, y from 0 to 100.

    Args:
        clouds: What to draw.
        x_label: What x is, with its unit.
        y_label: What y is, with its unit.
        x_span: First and last x.
    """
    columns = min(_COLUMNS, max(len(clouds), 1))
    rows = math.ceil(len(clouds) / columns)
    figure = Figure(figsize=(8.2, 0.7 + 2.05 * rows), layout="constrained")
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
    for axes, cloud in zip(panels, clouds, strict=False):
        axes.scatter(cloud.x, cloud.y, s=5, color=COLOURS[0], alpha=0.35, lw=0, rasterized=True)
        if cloud.marked is not None:
            axes.plot(*cloud.marked, "D", mfc=COLOURS[1], mec="#222222", ms=6, mew=0.9)
        axes.set_title(cloud.title, fontsize=8)
        axes.grid(color="#e6e9ed", lw=0.8)
        axes.set_axisbelow(True)
        axes.tick_params(labelsize=7)
        axes.set_xlim(*x_span)
        axes.set_ylim(-3.0, 103.0)
    for axes in panels[len(clouds) :]:
        axes.set_axis_off()
    figure.supxlabel(x_label, fontsize=9)
    figure.supylabel(y_label, fontsize=9)
    return figure
