"""Work on a device over time, and by phase: Figures 10 and 11 of the null-space paper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from tcs_studies.output.draw.boxes import COLOURS

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
