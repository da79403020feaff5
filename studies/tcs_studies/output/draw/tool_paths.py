"""Pictures of the experiment: paths of the tool beside the line, and the work over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
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


_GREY = "#c9ced4"
"""Colour of the SOLUTION part, grey as in the paper."""
_WIDTH = 8.2
_ROW, _BAR = 1.35, 0.42
"""Heights of a curve and of a bar in inches."""
_SHADES = {"start": "#0072B2", "solution": _GREY, "finish": "#009E73"}
"""Colours of the phases in a bar."""


@dataclass(frozen=True, eq=False)
class WorkCurve:
    """Steps of work over time, of one trial."""

    name: str
    time: NDArray[np.float64]
    """Times of the steps [s], shape (k,)."""
    work: NDArray[np.float64]
    """Work of each step [J], shape (k,)."""
    solution: tuple[float, float] | None
    """Beginning and end of the SOLUTION part [s]; None if there is none."""


def draw_work_over_time(curves: Sequence[WorkCurve]) -> Figure:
    """Return the work of each step over time, one row for each trial, the SOLUTION part in grey.

    Args:
        curves: The trials, on common axes.
    """
    figure = Figure(figsize=(_WIDTH, 0.9 + _ROW * len(curves)), layout="constrained")
    rows = figure.subplots(len(curves), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for i, (axes, curve) in enumerate(zip(rows, curves, strict=True)):
        if curve.solution is not None:
            axes.axvspan(*curve.solution, color=_GREY, lw=0.0, zorder=0)
        axes.plot(curve.time, 1e6 * curve.work, color=COLOURS[i % len(COLOURS)], lw=0.7)
        axes.set_title(curve.name, fontsize=10, loc="left")
        axes.set_ylabel("work [µJ]")
        axes.margins(x=0.0)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
    rows[-1].set_xlabel("time [s]")
    if any(curve.solution is not None for curve in curves):
        figure.legend(
            handles=[Patch(facecolor=_GREY, label="SOLUTION")],
            loc="outside upper right", frameon=False, fontsize=9,
        )  # fmt: skip
    return figure


def draw_work_by_phase(names: Sequence[str], work: Mapping[str, Sequence[float]]) -> Figure:
    """Return a bar of work for each name, divided into phases, the SOLUTION phase in grey.

    Args:
        names: Names of the bars, the first on top.
        work: Work of each bar by phase ("start", "solution", "finish") [J].
    """
    figure = Figure(figsize=(_WIDTH, 1.2 + _BAR * len(names)), layout="constrained")
    axes = figure.subplots()
    left = np.zeros(len(names))
    for phase, values in work.items():
        width = 1e3 * np.asarray(values, dtype=np.float64)
        axes.barh(
            range(len(names)), width, left=left, height=0.62, color=_SHADES[phase],
            edgecolor="#222222", lw=0.6, label=phase.upper(),
        )  # fmt: skip
        left = left + width
    axes.set_yticks(range(len(names)), names, fontsize=9)
    axes.tick_params(axis="y", length=0)
    axes.invert_yaxis()
    axes.set_xlabel("absolute work on the device [mJ]")
    for side in ("top", "right", "left"):
        axes.spines[side].set_visible(False)
    figure.legend(loc="outside upper left", ncols=3, frameon=False, fontsize=9)
    return figure
