"""Maps of success over two measures of a population."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from tcs.kernel.arrays import BoolArray
from tcs.output.draw.colours import SCALE

if TYPE_CHECKING:
    from tcs.placement.population import Population

_AXES = (
    ("stature", "stature [m]"),
    ("abdominalextensiondepthsitting", "abdominal depth, seated [m]"),
)
_CELLS = (22, 12)
"""Hexagons across the picture, and in height."""


def population_figure(found: Population) -> Figure:
    """Return a figure of the fraction of people who are served, over stature and abdominal depth.

    One panel is for the best set, one for the two sets that together serve most.

    Args:
        found: The population.
    """
    panels: list[tuple[str, BoolArray]] = [("best set", found.kept)]
    if found.is_complete and found.two is not None and found.served_by_two is not None:
        first, second = found.two
        panels.append((f"sets {first + 1} and {second + 1} together", found.served_by_two))
    return _maps(found, panels)


def _maps(found: Population, panels: Sequence[tuple[str, BoolArray]]) -> Figure:
    x, y = (found.people.values[:, found.people.measures.index(name)] for name, _ in _AXES)
    figure = Figure(figsize=(1.0 + 4.1 * len(panels), 3.6), layout="constrained")
    all_axes = figure.subplots(1, len(panels), squeeze=False, sharey=True)[0]
    for axes, (title, served) in zip(all_axes, panels, strict=True):
        drawn = axes.hexbin(
            *(x, y),
            C=served.astype(np.float64),
            reduce_C_function=np.mean,
            gridsize=_CELLS,
            cmap=SCALE,
            vmin=0.0,
            vmax=1.0,
            linewidths=0.2,
        )
        axes.set_title(f"{title}: {served.mean():.1%} served", fontsize=9)
        axes.set_xlabel(_AXES[0][1], fontsize=9)
        axes.tick_params(labelsize=8)
    all_axes[0].set_ylabel(_AXES[1][1], fontsize=9)
    bar = figure.colorbar(drawn, ax=list(all_axes), fraction=0.05)
    bar.set_label("fraction served", fontsize=9)
    bar.ax.tick_params(labelsize=8)
    return figure
