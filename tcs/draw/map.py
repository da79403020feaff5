"""The map: how good every base place is, and where the chosen members stand."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon
from numpy.typing import NDArray

from tcs.draw.places import FloatArray, PlaceMap
from tcs.draw.solids import Kind, Solid
from tcs.kernel.dexterity import DEFAULT_MEASURE
from tcs.tables import InitialConfiguration

_MEMBER = "#d7263d"
_HERE = "#111111"
_BLOCKED = "#d4d8dd"
_TITLE_WIDTH = 115
"""Letters that fit into a line of the title."""
_ARROW = 0.45
"""Length of a heading arrow [m]: a little beyond the front of a mobile robot."""


@dataclass(frozen=True, eq=False)
class Stand:
    """A robot standing somewhere, as seen from above."""

    configuration: InitialConfiguration
    """Where, in the frame of the map."""
    outline: FloatArray
    """Outline of its base in the base's own frame [m], shape (n, 2)."""

    @property
    def polygon(self) -> FloatArray:
        """The outline where it stands [m], shape (n, 2)."""
        at = self.configuration
        c, s = math.cos(at.base_yaw), math.sin(at.base_yaw)
        return np.asarray(self.outline @ np.array([[c, s], [-s, c]]) + [at.base_x, at.base_y])


def draw_map(
    places: PlaceMap,
    room: Sequence[Solid],
    members: Sequence[Stand],
    *,
    here: Stand | None = None,
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
        (left, 100.0 * places.reachability, 100.0, "goals reached, P_R [%]"),
        (right, places.manipulability, top or 1.0, f"manipulability, P_M ({measure}) [0 to 1]"),
    )
    for axes, values, most, label in panels:
        _draw_scores(figure, axes, places, values, most, label)
        _draw_room(axes, room)
        _draw_tour(axes, members, here)
        axes.set_aspect("equal")
        axes.set_xlabel("base x [m]")
    left.set_ylabel("base y [m]")
    _frame(left, places, members, here)
    lines = [*textwrap.wrap(title, _TITLE_WIDTH), *textwrap.wrap(subtitle, _TITLE_WIDTH)]
    figure.suptitle("\n".join(lines), fontsize=13)
    _draw_legend(figure, room, members, here)
    return figure


def _draw_scores(
    figure: Figure,
    axes: Axes,
    places: PlaceMap,
    values: NDArray[np.float64],
    most: float,
    label: str,
) -> None:
    """Colour each place by its score; grey where the robot cannot stand at all."""
    edges = (_edges(places.x), _edges(places.y))
    blocked = np.ma.masked_where(places.free, np.ones(places.free.shape))
    axes.pcolormesh(*edges, blocked.T, cmap=ListedColormap([_BLOCKED]), rasterized=True)
    scored = np.ma.masked_less_equal(values, 0.0)
    mesh = axes.pcolormesh(*edges, scored.T, cmap="viridis", vmin=0.0, vmax=most, rasterized=True)
    figure.colorbar(mesh, ax=axes, label=label, shrink=0.8)
    axes.set_title("best of all headings and heights at each place", fontsize=10)


def _draw_room(axes: Axes, room: Sequence[Solid]) -> None:
    """Draw shadows on the floor, what is lower first: the person sits on the chair."""
    # By their middles: a raised head rest reaches higher than the head that lies before it.
    ordered = sorted(room, key=lambda solid: float(solid.corners[:, 2].mean()))
    axes.add_collection(
        PolyCollection(
            [solid.footprint for solid in ordered],
            facecolors=[solid.kind.colour for solid in ordered],
            edgecolors="#00000030",
            linewidths=0.6,
            zorder=3,
        ),
        autolim=False,
    )


def _draw_tour(axes: Axes, members: Sequence[Stand], here: Stand | None) -> None:
    """Draw where the robot is, where it is to go, and the straight lines between."""
    stops = [stand for stand in (here, *members) if stand is not None]
    line = np.array([[s.configuration.base_x, s.configuration.base_y] for s in stops])
    if here is not None and len(stops) > 1:
        axes.plot(line[:, 0], line[:, 1], ":", color=_HERE, linewidth=1.4, zorder=4)
    if here is not None:
        _draw_stand(axes, here, _HERE, "", "--")
    for number, stand in enumerate(members, start=1):
        _draw_stand(axes, stand, _MEMBER, str(number), "-")


def _draw_stand(axes: Axes, stand: Stand, colour: str, label: str, line: str) -> None:
    at = stand.configuration
    axes.add_patch(
        Polygon(stand.polygon, facecolor="#ffffff70", edgecolor=colour, lw=2.0, ls=line, zorder=5)
    )
    tip = (
        at.base_x + _ARROW * math.cos(at.base_yaw),
        at.base_y + _ARROW * math.sin(at.base_yaw),
    )
    arrow = {"arrowstyle": "-|>", "color": colour, "lw": 2.0, "mutation_scale": 16}
    axes.annotate("", tip, (at.base_x, at.base_y), arrowprops=arrow, zorder=6)
    axes.text(
        at.base_x,
        at.base_y,
        label,
        color="white",
        weight="bold",
        ha="center",
        va="center",
        zorder=7,
        bbox={"boxstyle": "circle,pad=0.25", "facecolor": colour, "edgecolor": "none"},
    )


def _frame(axes: Axes, places: PlaceMap, members: Sequence[Stand], here: Stand | None) -> None:
    """Show the whole grid, and every robot outside it."""
    points = [np.stack(np.meshgrid(_edges(places.x), _edges(places.y)), -1).reshape(-1, 2)]
    points += [stand.polygon for stand in (*members, here) if stand is not None]
    low, high = np.min([p.min(0) for p in points], 0), np.max([p.max(0) for p in points], 0)
    axes.set_xlim(low[0] - 0.05, high[0] + 0.05)
    axes.set_ylim(low[1] - 0.05, high[1] + 0.05)


def _draw_legend(
    figure: Figure, room: Sequence[Solid], members: Sequence[Stand], here: Stand | None
) -> None:
    """Say below what is what, and beside it where robot and members stand in numbers."""
    kinds = [kind for kind in Kind if any(solid.kind is kind for solid in room)]
    handles: list[Artist] = [Patch(facecolor=kind.colour, label=kind.label) for kind in kinds]
    handles.append(Patch(facecolor=_BLOCKED, label="robot cannot stand here"))
    handles.append(Patch(facecolor="white", edgecolor="#bbbbbb", label="no goal in reach"))
    if here is not None:
        handles.append(Line2D([], [], ls=":", color=_HERE, label="way, as the travel cost has it"))
    figure.legend(handles=handles, loc="outside lower left", ncols=2, frameon=False, fontsize=10)
    stops: list[Artist] = []
    if here is not None:
        said = _described(here.configuration)
        stops.append(Patch(facecolor="none", edgecolor=_HERE, ls="--", label=f"now: {said}"))
    for number, stand in enumerate(members, start=1):
        said = _described(stand.configuration)
        stops.append(Patch(facecolor="none", edgecolor=_MEMBER, label=f"{number}: {said}"))
    figure.legend(handles=stops, loc="outside lower right", frameon=False, fontsize=10)


def _described(configuration: InitialConfiguration) -> str:
    """Return a configuration in a few words."""
    at = configuration.to_json()
    text = (
        f"x {at['base_x']:.2f} m, y {at['base_y']:.2f} m, heading "
        f"{at['base_yaw_deg'] % 360.0:.0f}°, torso {at['torso']:.2f} m"
    )
    for name, value in configuration.environment:
        text += f", {name.replace('_', ' ')} " + (
            f"{at[f'{name}_deg']:.0f}°" if f"{name}_deg" in at else f"{value:.2f} m"
        )
    return text


def _edges(centres: FloatArray) -> FloatArray:
    """Return the borders of cells around evenly spaced centres, one more than there are."""
    step = float(centres[1] - centres[0]) if len(centres) > 1 else 0.05
    return np.append(centres - step / 2.0, centres[-1] + step / 2.0)
