"""Pictures of pick and place: paths, distances and learning, and the means of each participant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
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


_GREY, _LINE = "#c4c9cf", "#a9b0b8"
_SPREAD = 0.16
"""Half of the width over which the repetitions of a condition are spread."""
_PANEL_WIDTH, _PANEL_HEIGHT = 3.1, 3.3
"""Size of a panel in inches."""


@dataclass(frozen=True, eq=False)
class ParticipantPanel:
    """One measure under several conditions."""

    title: str
    """Name of the measure with its unit."""
    values: Sequence[Sequence[FloatArray]]
    """Repetitions by condition and participant, shapes (repetitions,); may be empty."""
    tests: Sequence[tuple[int, int, float]] = ()
    """Pairs of conditions and the p value of their test."""


def draw_participants(panels: Sequence[ParticipantPanel], names: Sequence[str]) -> Figure:
    """Return panels side by side, as in the ITCM thesis, Figures 9, 11, 54, 55, 57 and 58.

    A grey dot is a repetition, a coloured one the mean of a participant; a line links the means of
    a participant. The large dot is the mean of these means, its whiskers the 95 % confidence
    interval. Bars above are tests: * for p < 0.05, ** for p < 0.01, *** for p < 0.001.

    Args:
        panels: The measures.
        names: Names of the conditions.
    """
    figure = Figure(figsize=(_PANEL_WIDTH * len(panels), _PANEL_HEIGHT), layout="constrained")
    for axes, panel in zip(figure.subplots(1, len(panels), squeeze=False)[0], panels, strict=True):
        _draw(axes, panel, names)
    return figure


def _draw(axes: Axes, panel: ParticipantPanel, names: Sequence[str]) -> None:
    means = np.array(
        [[one.mean() if len(one) else np.nan for one in condition] for condition in panel.values]
    )
    axes.plot(range(len(names)), means, color=_LINE, lw=0.8, zorder=1)
    for i, condition in enumerate(panel.values):
        for one in condition:
            # Evenly spread, so that the picture does not depend on random numbers.
            x = i + np.linspace(-_SPREAD, _SPREAD, max(len(one), 1))[: len(one)]
            axes.plot(x, one, "o", color=_GREY, ms=2.5, zorder=0)
        axes.plot(
            np.full(means.shape[1], i),
            means[i],
            "o",
            color=COLOURS[i % len(COLOURS)],
            ms=5,
            zorder=2,
        )
        known = means[i][np.isfinite(means[i])]
        if len(known):
            axes.errorbar(
                i + 0.28, known.mean(), yerr=_confidence(known), fmt="o", color=_INK, ms=7,
                capsize=4, zorder=3,
            )  # fmt: skip
    _tests(axes, panel)
    axes.set_xticks(range(len(names)), names)
    axes.set_xlim(-0.5, len(names) - 0.5)
    axes.set_title(panel.title, fontsize=10)
    axes.grid(axis="y", color="#e6e9ed", lw=0.8)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def _confidence(values: FloatArray) -> float:
    """Return half of the 95 % confidence interval of the mean; 0 for one value."""
    from scipy import stats

    n = len(values)
    if n < 2:
        return 0.0
    return float(stats.t.ppf(0.975, n - 1) * values.std(ddof=1) / np.sqrt(n))


def _tests(axes: Axes, panel: ParticipantPanel) -> None:
    low, high = axes.get_ylim()
    step = 0.09 * (high - low)
    for k, (first, second, p) in enumerate(panel.tests):
        y = high + (k + 0.3) * step
        axes.plot([first, second], [y, y], color=_INK, lw=1.0)
        axes.text(0.5 * (first + second), y, _stars(p), ha="center", va="bottom", fontsize=9)
    axes.set_ylim(low, high + (len(panel.tests) + 0.4) * step)


def _stars(p: float) -> str:
    """Return the mark of a p value.

    >>> [_stars(p) for p in (0.2, 0.04, 0.004, 0.0004)]
    ['n.s.', '*', '**', '***']
    """
    return "n.s." if p >= 0.05 else "*" * sum(p < bound for bound in (0.05, 0.01, 0.001))
