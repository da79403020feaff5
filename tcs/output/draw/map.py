"""The map: how good every base place is, and where the chosen members stand."""

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
from tcs.output.draw.solids import Solid
from tcs.output.words import REACHABILITY_LABEL, axis_title, manipulability_label
from tcs.placement.tables.place_map import FloatArray, PlaceMap

_TITLE_WIDTH = 115
"""Letters that fit into a line of the title."""
_PANEL_WIDTH = 70
"""Letters that fit above a panel."""
_BEYOND = 0.5
"""How far beyond the grid the room is shown [m]: the end of a bed, not all of a long wall."""


def draw_map(
    places: PlaceMap,
    room: Sequence[Solid],
    members: Sequence[BaseFootprint],
    *,
    here: BaseFootprint | None = None,
    title: str,
    subtitle: str = "",
    measure: str = DEFAULT_MEASURE,
) -> Figure:
    """Return a picture of the best scores per base place, beside each other: P_R and P_M.

    Args:
        places: The scores.
        room: Furniture, person and obstacles, drawn as their shadows on the floor.
        members: The chosen configurations in the order of the tour; none is fine.
        here: Where the robot is now.
        title: First line, for a person.
        subtitle: Second line, e.g. the scores of the chosen set.
        measure: Name of the dexterity measure behind P_M.
    """
    figure = Figure(figsize=(12.4, 7.0), layout="constrained")
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    top = float(places.manipulability.max(initial=0.0))
    panels = (
        (left, 100.0 * places.reachability, 100.0, REACHABILITY_LABEL),
        (right, places.manipulability, top or 1.0, manipulability_label(measure)),
    )
    shown = [stand.polygon for stand in (*members, here) if stand is not None]
    floor_plan.frame(left, [_grid_and_room(places, room), *shown])
    over = textwrap.fill(f"best of all {places.over_words} at each place", _PANEL_WIDTH)
    for axes, values, most, label in panels:
        mesh = floor_plan.draw_cells(axes, places, values, most)
        figure.colorbar(mesh, ax=axes, label=label, shrink=0.8)
        axes.set_title(over, fontsize=10)
        floor_plan.draw_room(axes, room)
        _draw_tour(axes, members, here)
        floor_plan.draw_scale_bar(axes)
        axes.set_aspect("equal")
        axes.set_xlabel(axis_title("base_x"))
    left.set_ylabel(axis_title("base_y"))
    lines = [*textwrap.wrap(title, _TITLE_WIDTH), *textwrap.wrap(subtitle, _TITLE_WIDTH)]
    figure.suptitle("\n".join(lines), fontsize=13)
    handles = floor_plan.legend_handles(room, robot=bool(members))
    if here is not None:
        handles.append(Line2D([], [], ls=":", color=HERE, label="way, as the travel cost has it"))
    figure.legend(handles=handles, loc="outside lower left", ncols=2, frameon=False, fontsize=10)
    stops = floor_plan.stops(members, here)
    figure.legend(handles=stops, loc="outside lower right", frameon=False, fontsize=10)
    return figure


def _grid_and_room(places: PlaceMap, room: Sequence[Solid]) -> FloatArray:
    """Return corners of what is shown: the grid and what stands in it [m], shape (n, 2)."""
    edges = (floor_plan.cell_edges(places.x), floor_plan.cell_edges(places.y))
    low, high = np.array([[edge[0], edge[-1]] for edge in edges]).T
    around = [np.clip(s.footprint, low - _BEYOND, high + _BEYOND) for s in room]
    return np.concatenate([np.stack([low, high]), *around])


def _draw_tour(axes: Axes, members: Sequence[BaseFootprint], here: BaseFootprint | None) -> None:
    """Draw where the robot is, where it is to go, and the straight lines between."""
    stops = [stand for stand in (here, *members) if stand is not None]
    line = np.array([[s.configuration.base_x, s.configuration.base_y] for s in stops])
    if here is not None:
        if len(stops) > 1:
            axes.plot(line[:, 0], line[:, 1], ":", color=HERE, linewidth=1.4, zorder=4)
        floor_plan.draw_base(axes, here, is_here=True)
    for number, stand in enumerate(members, start=1):
        floor_plan.draw_base(axes, stand, label=str(number))
