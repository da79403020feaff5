"""Values of participants under several conditions: repetitions, means, and tests between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tcs.kernel.arrays import FloatArray
from tcs_studies.output.draw.boxes import COLOURS

_GREY, _LINE, _INK = "#c4c9cf", "#a9b0b8", "#222222"
_SPREAD = 0.16
"""Half of the width over which the repetitions of a condition are spread."""
_WIDTH, _HEIGHT = 3.1, 3.3
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
    figure = Figure(figsize=(_WIDTH * len(panels), _HEIGHT), layout="constrained")
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
