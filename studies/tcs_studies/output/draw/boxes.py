"""Box plots, and scatter plots of clouds of points."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

COLOURS = (
    *("#0072B2", "#E69F00", "#009E73", "#CC79A7"),
    *("#D55E00", "#56B4E9", "#F0E442", "#777777"),
)
"""The colours of Okabe and Ito, distinct under colour vision deficiency; the first four (blue,
orange, green, purple) are also distinct in grey. The last one is lighter than theirs, which is
black: the median must be visible."""
_INK = "#222222"
_HEIGHT = 0.26
"""Height of a box in inches."""
_GAP = 0.6
"""Gap between two groups, in boxes."""


@dataclass(frozen=True, eq=False)
class BoxPlot:
    """The samples of one method."""

    series: int
    """Number of the series, which sets colour and name."""
    samples: NDArray[np.float64]
    """Shape (n,)."""
    reference: tuple[float, float] | None = None
    """Published mean and standard deviation."""


@dataclass(frozen=True, eq=False)
class BoxGroup:
    """Boxes one below the other, under one name."""

    name: str
    boxes: Sequence[BoxPlot]


def draw_boxes(
    groups: Sequence[BoxGroup], series: Sequence[str], *, label: str, reference: str = ""
) -> Figure:
    """Return horizontal box plots of groups of samples, the first group on top.

    A box extends from the first to the third quartile. Its line is the median, its whiskers extend
    to the 5th and 95th percentile, and the dot is the mean; samples beyond are small rings.

    Args:
        groups: The groups.
        series: Names of the series.
        label: Name of the samples, with their unit.
        reference: Name of the published figures.
    """
    rows = sum(len(group.boxes) + _GAP for group in groups)
    figure = Figure(figsize=(8.2, 1.3 + _HEIGHT * rows), layout="constrained")
    axes = figure.subplots()
    top, ticks = 0.0, []
    for group in groups:
        for i, box in enumerate(group.boxes):
            _draw(axes, top + i, box)
        ticks.append(top + (len(group.boxes) - 1) / 2.0)
        top += len(group.boxes) + _GAP
        axes.axhline(top - 0.5 - _GAP / 2.0, color="#d5dae0", lw=0.8, zorder=0)
    axes.set_yticks(ticks, [group.name for group in groups], fontsize=9)
    axes.tick_params(axis="y", length=0)
    axes.set_ylim(top - _GAP / 2.0 - 0.5, -0.5 - _GAP / 2.0)
    axes.set_xlabel(label)
    axes.grid(axis="x", color="#e6e9ed", lw=0.8)
    axes.set_axisbelow(True)
    for side in ("top", "right", "left"):
        axes.spines[side].set_visible(False)
    used = sorted({box.series for group in groups for box in group.boxes})
    handles: list[Artist] = [Patch(facecolor=COLOURS[i], label=series[i]) for i in used]
    handles.append(_mark("o", "mean", "#c9ced4"))
    if any(box.reference for group in groups for box in group.boxes):
        handles.append(_mark("D", f"{reference}: mean, one std to each side", "#F0E442"))
    figure.legend(handles=handles, loc="outside upper left", ncols=3, frameon=False, fontsize=9)
    return figure


def _draw(axes: Axes, y: float, box: BoxPlot) -> None:
    low, first, median, third, high = np.percentile(box.samples, (5, 25, 50, 75, 95))
    outer = np.unique(box.samples[(box.samples < low) | (box.samples > high)])
    spread = {"med": median, "q1": first, "q3": third, "whislo": low, "whishi": high}
    axes.bxp(
        [{**spread, "fliers": outer, "mean": box.samples.mean()}],
        positions=[y],
        orientation="horizontal",
        widths=0.62,
        patch_artist=True,
        manage_ticks=False,
        showmeans=True,
        boxprops={"facecolor": COLOURS[box.series], "edgecolor": _INK, "lw": 0.8},
        medianprops={"color": _INK, "lw": 1.6},
        whiskerprops={"color": _INK, "lw": 0.8},
        capprops={"color": _INK, "lw": 0.8},
        # In the colour of the series: of a box of equal samples only the dot is visible.
        meanprops={"marker": "o", "mfc": COLOURS[box.series], "mec": _INK, "ms": 6.0},
        flierprops={"marker": "o", "mfc": "none", "mec": "#8a939c", "ms": 2.5, "mew": 0.6},
    )
    if box.reference is not None:
        mean, std = box.reference
        ends = np.clip([mean - std, mean + std], 0.0, 100.0)
        axes.plot(ends, [y + 0.4] * 2, color=_INK, lw=1.0, zorder=5)
        axes.plot([mean], [y + 0.4], "D", mfc="#F0E442", mec=_INK, ms=4.5, mew=0.8, zorder=6)


def _mark(marker: str, label: str, colour: str) -> Line2D:
    return Line2D([], [], ls="none", marker=marker, mfc=colour, mec=_INK, ms=5, label=label)


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
