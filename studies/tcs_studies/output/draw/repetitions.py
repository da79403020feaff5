"""Repetitions of a task: paths from above, a distance over time, and learning."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from matplotlib.ticker import MaxNLocator

from tcs.kernel.arrays import FloatArray
from tcs_studies.output.draw.boxes import COLOURS

_GREYS = (0.15, 0.75)
"""Darkest and lightest grey of the participants."""
_INK = "#222222"
_MARKERS = ("pick", "place")
_WIDTH = 3.3
"""Width of a panel in inches."""


@dataclass(frozen=True, eq=False)
class RepetitionGroup:
    """Repetitions of all participants under one condition."""

    name: str
    paths: Sequence[Sequence[FloatArray]]
    """By participant and repetition: time [s] and position [m], shapes (k, 4)."""
    table: FloatArray
    """Corners of the table from above [m], shape (4, 2)."""
    markers: FloatArray
    """Positions of pick and place [m], shape (2, 3)."""


def draw_paths(groups: Sequence[RepetitionGroup], base_radius: float) -> Figure:
    """Return paths from above in the frame of the base, as in the ITCM thesis, Figure 51.

    Args:
        groups: The conditions.
        base_radius: Radius of the mobile base [m].
    """
    figure = Figure(figsize=(_WIDTH * len(groups), 4.4), layout="constrained")
    panels = figure.subplots(1, len(groups), squeeze=False, sharex=True, sharey=True)[0]
    for axes, group in zip(panels, groups, strict=True):
        table = _from_above(group.table)
        axes.add_patch(Polygon(table, facecolor="#f1ece2", edgecolor="#b9ab8d", zorder=0))
        axes.add_patch(Circle((0.0, 0.0), base_radius, facecolor="#dfe3e8", edgecolor="#8b949e"))
        axes.annotate("", (0.0, 0.22), (0.0, 0.0), arrowprops={"arrowstyle": "->", "color": _INK})
        for shade, one in _shades(group):
            path = _from_above(one[:, 1:3])
            axes.plot(*path.T, color=shade, lw=0.6)
            axes.plot(*path[0], "*", color=shade, ms=6)
        for place, mark, name in zip(_from_above(group.markers), "os", _MARKERS, strict=True):
            axes.plot(*place, mark, color=COLOURS[1], mec=_INK, ms=7, label=name)
        axes.autoscale_view()
        axes.set_xlabel("to the right of the base [m]")
        axes.set_title(group.name, fontsize=10)
        axes.set_aspect("equal")
    panels[0].legend(frameon=False, fontsize=8, loc="lower left")
    panels[0].set_ylabel("ahead of the base [m]")
    return figure


def _from_above(points: FloatArray) -> FloatArray:
    """Return points of the base frame as seen from above, ahead up: shape (..., 2)."""
    return np.stack([-points[..., 1], points[..., 0]], axis=-1)


def draw_distances(groups: Sequence[RepetitionGroup]) -> Figure:
    """Return the distance to the place over time, as in the ITCM thesis, Figure 52.

    Args:
        groups: The conditions.
    """
    figure = Figure(figsize=(_WIDTH * len(groups), 3.0), layout="constrained")
    panels = figure.subplots(1, len(groups), squeeze=False, sharex=True, sharey=True)[0]
    for axes, group in zip(panels, groups, strict=True):
        for shade, one in _shades(group):
            distance = np.linalg.norm(one[:, 1:] - group.markers[1], axis=1)
            axes.plot(one[:, 0], distance, color=shade, lw=0.6)
        axes.set_title(group.name, fontsize=10)
        axes.set_xlabel("time [s]")
        axes.grid(color="#e6e9ed", lw=0.8)
    panels[0].set_ylabel("distance to the place [m]")
    return figure


def _shades(group: RepetitionGroup) -> list[tuple[str, FloatArray]]:
    """Return the repetitions, each with the grey of its participant."""
    shades = np.linspace(*_GREYS, max(len(group.paths), 1))
    return [
        (str(shade), one)
        for shade, participant in zip(shades, group.paths, strict=False)
        for one in participant
    ]


@dataclass(frozen=True, eq=False)
class LearningPart:
    """Times of the repetitions of one part of the protocol."""

    name: str
    series: int
    """Number of the condition, which sets the colour."""
    times: Sequence[FloatArray]
    """Completion times by participant [s], shapes (repetitions,)."""
    curve: tuple[float, float, float] | None
    """a, b and c of a x^b + c [s]; None if it was not fitted."""


def draw_learning(parts: Sequence[LearningPart]) -> Figure:
    """Return the completion time from repetition to repetition, as in Figure 53 of the thesis.

    Args:
        parts: The parts of the protocol.
    """
    figure = Figure(figsize=(2.1 * len(parts), 3.2), layout="constrained")
    panels = figure.subplots(1, len(parts), squeeze=False, sharey=True)[0]
    for axes, part in zip(panels, parts, strict=True):
        colour = COLOURS[part.series % len(COLOURS)]
        for shade, times in zip(np.linspace(*_GREYS, len(part.times)), part.times, strict=True):
            number = np.arange(1, len(times) + 1)
            axes.plot(number, times, color=str(shade), lw=0.7, zorder=1)
            axes.plot(number, times, "o", color=colour, ms=2.5, zorder=2)
        longest = max((len(times) for times in part.times), default=0)
        complete = [times for times in part.times if len(times) == longest]
        if longest:
            number = np.arange(1, longest + 1)
            axes.plot(number, np.mean(complete, axis=0), color=_INK, lw=2.2, zorder=3)
            if part.curve is not None:
                a, b, c = part.curve
                axes.plot(number, a * number**b + c, color=colour, lw=1.6, ls="--", zorder=4)
        axes.set_title(part.name, fontsize=9)
        axes.xaxis.set_major_locator(MaxNLocator(4, integer=True))
        axes.set_xlabel("repetition")
        axes.grid(color="#e6e9ed", lw=0.8)
    panels[0].set_ylabel("completion time [s]")
    return figure
