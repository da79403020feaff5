"""The acceptance graph: satisfaction over usefulness, after van der Laan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tcs_studies.output.draw.boxes import COLOURS

_INK = "#222222"
_MARKERS = ("o", "s", "^", "D")
"""Shapes of the means: distinct without colour."""


@dataclass(frozen=True, eq=False)
class AcceptanceScores:
    """Scores of one condition."""

    title: str
    usefulness: NDArray[np.float64]
    """Shape (n,), in [-2, 2]."""
    satisfaction: NDArray[np.float64]
    """Shape (n,), in [-2, 2]."""


def draw_acceptance(conditions: Sequence[AcceptanceScores]) -> Figure:
    """Return satisfaction over usefulness: a small mark per participant, and the means.

    Args:
        conditions: The conditions, each with at least one participant.
    """
    figure = Figure(figsize=(6.2, 5.6), layout="constrained")
    axes = figure.subplots()
    for i, one in enumerate(conditions):
        colour, marker = COLOURS[i % len(COLOURS)], _MARKERS[i % len(_MARKERS)]
        axes.scatter(
            one.usefulness, one.satisfaction, s=22, marker=marker, color=colour, alpha=0.45, lw=0
        )
        axes.scatter(
            [one.usefulness.mean()], [one.satisfaction.mean()], s=130, marker=marker,
            color=colour, edgecolor=_INK, lw=1.0, zorder=3, label=f"{one.title}: mean",
        )  # fmt: skip
    for line in (axes.axhline, axes.axvline):
        line(0.0, color="#767f89", lw=0.8, zorder=0)
    axes.set_xlim(-2.1, 2.1)
    axes.set_ylim(-2.1, 2.1)
    axes.set_aspect("equal")
    axes.set_xlabel("usefulness")
    axes.set_ylabel("satisfaction")
    axes.grid(color="#e6e9ed", lw=0.8)
    axes.set_axisbelow(True)
    figure.legend(loc="outside upper left", ncols=2, frameon=False, fontsize=9)
    return figure
