"""Small multiples: the map of each state of the environment, all in one scale."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tcs.kernel.dexterity import DEFAULT_MEASURE
from tcs.output.draw import floor_plan
from tcs.output.draw.floor_plan import BaseFootprint
from tcs.output.draw.solids import Category, Solid
from tcs.output.words import REACHABILITY_LABEL, axis_title, manipulability_label
from tcs.placement.tables.place_map import FloatArray, PlaceMap

Score = Literal["reachability", "manipulability"]
_PANEL = 2.5
"""Width of a panel [in]."""
_LINES = 0.7
"""Scale of lines and text, relative to a single map."""
_MARGIN = 0.15
"""Margin around base positions, person and bases [m]."""


@dataclass(frozen=True, eq=False)
class StatePanel:
    """The map of one state of the environment."""

    places: PlaceMap
    """The scores in this state."""
    environment: Sequence[Solid]
    """Furniture, person and obstacles in this state."""
    members: Sequence[tuple[int, BaseFootprint]]
    """Members of the set with this state, each with its number in the tour."""


def draw_states(
    panels: Sequence[Sequence[StatePanel]],
    rows: Sequence[str],
    columns: Sequence[str],
    *,
    members: Sequence[BaseFootprint],
    title: str,
    subtitle: str = "",
    score: Score = "reachability",
    measure: str = DEFAULT_MEASURE,
) -> Figure:
    """Return a picture with a panel for each state of the environment.

    The title of a panel is its best score. All panels show the same part of the floor: every base
    position that reaches a goal in any state, the person, and the members of the set.

    Args:
        panels: Row by row, from the top.
        rows: Settings that the states of each row share; may be "".
        columns: Settings that the states of each column share.
        members: The members of the set in the order of the tour.
        title: First line.
        subtitle: Second line.
        score: Score that the colours show.
        measure: Name of the dexterity measure behind P_M.
    """
    points = _shown_points(panels)
    low, high = points.min(axis=0), points.max(axis=0)
    tall = float(np.clip((high - low)[1] / (high - low)[0], 0.5, 1.6))
    size = (_PANEL * len(columns) + 1.6, _PANEL * tall * len(rows) + 1.9 + 0.24 * len(members))
    figure = Figure(figsize=(max(size[0], 7.0), size[1]), layout="constrained")
    grid = figure.subplots(len(rows), len(columns), sharex=True, sharey=True, squeeze=False)
    floor_plan.frame(grid[0, 0], [points], _MARGIN)
    factor = 100.0 if score == "reachability" else 1.0
    values = [[factor * getattr(panel.places, score) for panel in row] for row in panels]
    best = max(float(one.max(initial=0.0)) for row in values for one in row)
    most = 100.0 if score == "reachability" else best or 1.0
    mesh = None
    for i, row in enumerate(panels):
        for j, panel in enumerate(row):
            axes = grid[i, j]
            mesh = floor_plan.draw_cells(axes, panel.places, values[i][j], most)
            _draw_panel(axes, panel, _best_text(float(values[i][j].max(initial=0.0)), score))
            if i == 0:
                axes.annotate(
                    columns[j], (0.5, 1.0), (0, 22), xycoords="axes fraction",
                    textcoords="offset points", ha="center", fontsize=11, weight="bold",
                )  # fmt: skip
        y_label = axis_title("base_y")
        grid[i, 0].set_ylabel(f"{rows[i]}\n{y_label}" if rows[i] else y_label, fontsize=9)
    for axes in grid[-1]:
        axes.set_xlabel(axis_title("base_x"), fontsize=9)
    floor_plan.draw_scale_bar(grid[-1, 0], size=_LINES + 0.15)
    if mesh is not None:
        is_reachability = score == "reachability"
        label = REACHABILITY_LABEL if is_reachability else manipulability_label(measure)
        figure.colorbar(mesh, ax=list(grid.ravel()), label=label, shrink=0.6, aspect=30)
    width = int(9.5 * figure.get_figwidth())
    lines = [*textwrap.wrap(title, width), *textwrap.wrap(subtitle, width)]
    lines.append(f"Best of all {panels[0][0].places.over_words} at each base position.")
    figure.suptitle("\n".join(lines), fontsize=11)
    environment = [solid for row in panels for panel in row for solid in panel.environment]
    excluded = any(panel.places.excluded is not None for row in panels for panel in row)
    handles = floor_plan.legend_handles(environment, robot=bool(members), excluded=excluded)
    handles += floor_plan.pose_handles(members, None)
    figure.legend(handles=handles, loc="outside lower left", ncols=1, frameon=False, fontsize=9)
    return figure


def _draw_panel(axes: Axes, panel: StatePanel, text: str) -> None:
    floor_plan.draw_environment(axes, panel.environment)
    for number, base in panel.members:
        floor_plan.draw_base(axes, base, label=str(number), size=_LINES)
    axes.set_aspect("equal")
    axes.tick_params(labelsize=8)
    axes.set_title(text, fontsize=9, pad=4)


def _best_text(best: float, score: Score) -> str:
    """Return the best score of a panel as text."""
    if best <= 0.0:
        return "no goal reached"
    return f"best {best:.0f}%" if score == "reachability" else f"best {best:.3f}"


def _shown_points(panels: Sequence[Sequence[StatePanel]]) -> FloatArray:
    """Return corners of everything that has to be visible in every panel [m], shape (n, 2)."""
    found = []
    for panel in (panel for row in panels for panel in row):
        places = panel.places
        grid = np.stack(np.meshgrid(places.x, places.y, indexing="ij"), axis=-1)
        found.append(grid[places.reachability > 0.0])
        found += [base.polygon for _, base in panel.members]
        found += [
            solid.footprint for solid in panel.environment if solid.category is Category.PERSON
        ]
    points = np.concatenate(found) if found else np.empty((0, 2))
    if len(points):
        return points
    places = panels[0][0].places
    corners = np.array([[places.x[0], places.y[0]], [places.x[-1], places.y[-1]]])
    return np.asarray(corners + np.array([[-0.5], [0.5]]))
