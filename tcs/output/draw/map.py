"""The map: the best scores at each base position, and the members of a set."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from tcs.kernel.dexterity import DEFAULT_MEASURE
from tcs.output.draw import floor_plan
from tcs.output.draw.colours import HERE
from tcs.output.draw.floor_plan import BaseFootprint
from tcs.output.draw.goal_marks import GoalMark, draw_goal_marks, goal_handles
from tcs.output.draw.solids import Solid
from tcs.output.words import REACHABILITY_LABEL, axis_title, manipulability_label
from tcs.placement.tables.place_map import FloatArray, PlaceMap

_TITLE_WIDTH = 130
"""Characters per line of the title."""
_PANEL_WIDTH = 70
"""Characters per line above a panel."""
_GOAL_SIZE = 0.8
"""Size of the marks of goals: those around a face are some centimetres apart."""
_GOALS_APART = 0.06
"""Distance below which goals share one mark [m]: about its width."""
_BEYOND = 0.5
"""Extent of the environment shown beyond the grid [m]: the end of a bed, not a whole wall."""


def draw_map(
    places: PlaceMap,
    environment: Sequence[Solid],
    members: Sequence[BaseFootprint],
    *,
    here: BaseFootprint | None = None,
    goals: Sequence[GoalMark] = (),
    title: str,
    subtitle: str = "",
    measure: str = DEFAULT_MEASURE,
) -> Figure:
    """Return two maps side by side: the best P_R and P_M at each base position.

    Args:
        places: The scores.
        environment: Furniture, person and obstacles, drawn as their outlines from above.
        members: The members of the set in the order of the tour; may be empty.
        here: The current base pose.
        goals: The goals, which are marked.
        title: First line.
        subtitle: Second line, e.g. the scores of the set.
        measure: Name of the dexterity measure behind P_M.
    """
    figure = Figure(figsize=(12.4, 7.0), layout="constrained")
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    top = float(places.manipulability.max(initial=0.0))
    panels = (
        (left, 100.0 * places.reachability, 100.0, REACHABILITY_LABEL),
        (right, places.manipulability, top or 1.0, manipulability_label(measure)),
    )
    shown = [base.polygon for base in (*members, here) if base is not None]
    floor_plan.frame(left, [_grid_and_environment(places, environment), *shown])
    over = textwrap.fill(f"best of all {places.over_words} at each base position", _PANEL_WIDTH)
    for axes, values, most, label in panels:
        mesh = floor_plan.draw_cells(axes, places, values, most)
        figure.colorbar(mesh, ax=axes, label=label, shrink=0.8)
        axes.set_title(over, fontsize=10)
        floor_plan.draw_environment(axes, environment)
        _draw_tour(axes, members, here)
        if goals:
            at = np.array([mark.position[:2] for mark in goals])
            draw_goal_marks(axes, goals, at, apart=_GOALS_APART, size=_GOAL_SIZE)
        floor_plan.draw_scale_bar(axes)
        axes.set_aspect("equal")
        axes.set_xlabel(axis_title("base_x"))
    left.set_ylabel(axis_title("base_y"))
    lines = [*textwrap.wrap(title, _TITLE_WIDTH), *textwrap.wrap(subtitle, _TITLE_WIDTH)]
    figure.suptitle("\n".join(lines), fontsize=13)
    handles = floor_plan.legend_handles(
        environment, robot=bool(members), excluded=places.excluded is not None
    )
    if here is not None:
        handles.append(
            Line2D([], [], ls=":", color=HERE, label="straight-line path of the travel cost")
        )
    figure.legend(handles=handles, loc="outside lower left", ncols=2, frameon=False, fontsize=10)
    stops = [*floor_plan.pose_handles(members, here), *goal_handles(goals)]
    figure.legend(handles=stops, loc="outside lower right", frameon=False, fontsize=10)
    return figure


def _grid_and_environment(places: PlaceMap, environment: Sequence[Solid]) -> FloatArray:
    """Return the corners of the grid and of the environment within it [m], shape (n, 2)."""
    half = np.array(floor_plan.cell_widths(places.x, places.y)) / 2.0
    low = np.array([places.x[0], places.y[0]]) - half
    high = np.array([places.x[-1], places.y[-1]]) + half
    around = [np.clip(s.footprint, low - _BEYOND, high + _BEYOND) for s in environment]
    return np.concatenate([np.stack([low, high]), *around])


def _draw_tour(axes: Axes, members: Sequence[BaseFootprint], here: BaseFootprint | None) -> None:
    """Draw the current base pose, the members, and the straight lines between."""
    stops = [base for base in (here, *members) if base is not None]
    line = np.array([[s.configuration.base_x, s.configuration.base_y] for s in stops])
    if here is not None:
        if len(stops) > 1:
            axes.plot(line[:, 0], line[:, 1], ":", color=HERE, linewidth=1.4, zorder=4)
        floor_plan.draw_base(axes, here, is_here=True)
    for number, base in enumerate(members, start=1):
        floor_plan.draw_base(axes, base, label=str(number))
