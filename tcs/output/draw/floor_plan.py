"""Parts of a picture from above: score cells, shadows of the room, robots to scale, a scale bar."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection, QuadMesh
from matplotlib.colors import ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon
from matplotlib.patheffects import AbstractPathEffect, Normal, Stroke
from numpy.typing import NDArray

from tcs.model.grid import InitialConfiguration
from tcs.output.draw.colours import BLOCKED, CASING, EMPTY, HERE, MEMBER, SCALE
from tcs.output.draw.solids import Category, Solid
from tcs.output.words import member_text
from tcs.placement.tables.place_map import FloatArray, PlaceMap

ARROW = 0.45
"""Length of a heading arrow [m]: a little beyond the front of a mobile robot."""
MARGIN = 0.05
"""Free room around what is shown [m]."""
_EDGE = "#00000066"
"""Around each shadow, so that it keeps its shape where colours are hard to tell apart."""


@dataclass(frozen=True, eq=False)
class BaseFootprint:
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


def draw_cells(axes: Axes, places: PlaceMap, values: NDArray[np.float64], most: float) -> QuadMesh:
    """Colour each place by its value, grey where the robot cannot stand at all.

    Args:
        axes: Where to.
        places: The places.
        values: A value for each; no colour where it is 0, shape (X, Y).
        most: The value at the upper end of the scale.
    """
    edges = (cell_edges(places.x), cell_edges(places.y))
    blocked = np.ma.masked_where(places.free, np.ones(places.free.shape))
    axes.pcolormesh(*edges, blocked.T, cmap=ListedColormap([BLOCKED]), rasterized=True)
    scored = np.ma.masked_less_equal(values, 0.0)
    return axes.pcolormesh(*edges, scored.T, cmap=SCALE, vmin=0.0, vmax=most, rasterized=True)


def draw_room(axes: Axes, room: Sequence[Solid]) -> None:
    """Draw shadows on the floor, what is lower first: the person sits on the chair."""
    # By their middles: a raised head rest reaches higher than the head that lies before it.
    ordered = sorted(room, key=lambda solid: float(solid.corners[:, 2].mean()))
    axes.add_collection(
        PolyCollection(
            [solid.footprint for solid in ordered],
            facecolors=[solid.category.colour for solid in ordered],
            edgecolors=_EDGE,
            linewidths=0.6,
            zorder=3,
        ),
        autolim=False,
    )


def draw_base(
    axes: Axes, stand: BaseFootprint, *, label: str = "", is_here: bool = False, size: float = 1.0
) -> None:
    """Draw the base of a robot to scale, and which way it faces.

    Args:
        axes: Where to.
        stand: The robot.
        label: What to write in its middle.
        is_here: Whether it is where the robot is now, rather than a place to go to.
        size: Of lines and letters.
    """
    at, colour = stand.configuration, HERE if is_here else MEMBER
    cased: list[AbstractPathEffect] = [
        Stroke(linewidth=4.4 * size, foreground=CASING),
        Normal(),
    ]
    outline = Polygon(
        stand.polygon,
        facecolor=f"{CASING}50",
        edgecolor=colour,
        lw=2.0 * size,
        ls="--" if is_here else "-",
        zorder=5,
    )
    # Around the line alone: a casing would fill the outline.
    axes.add_patch(Polygon(stand.polygon, fill=False, edgecolor=CASING, lw=4.4 * size, zorder=4.9))
    axes.add_patch(outline)
    tip = (at.base_x + ARROW * math.cos(at.base_yaw), at.base_y + ARROW * math.sin(at.base_yaw))
    arrow = {
        "arrowstyle": "-|>",
        "color": colour,
        "lw": 2.0 * size,
        "mutation_scale": 16 * size,
        "shrinkA": 0,
        "shrinkB": 0,
        "path_effects": cased,
    }
    axes.annotate("", tip, (at.base_x, at.base_y), arrowprops=arrow, zorder=6)
    axes.text(
        at.base_x,
        at.base_y,
        label,
        color="white",
        weight="bold",
        fontsize=10 * size,
        ha="center",
        va="center",
        zorder=7,
        bbox={"boxstyle": "circle,pad=0.25", "facecolor": colour, "edgecolor": CASING},
    )


def draw_scale_bar(axes: Axes, *, size: float = 1.0) -> None:
    """Draw a bar in the lower left corner that is as long on the floor as it says.

    Call it when the limits of the axes are set.

    Args:
        axes: Where to.
        size: Of lines and letters.
    """
    (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
    length = 1.0 if x1 - x0 > 2.5 else 0.5
    left, low = x0 + 0.04 * (x1 - x0), y0 + 0.04 * (y1 - y0)
    tick = 0.012 * (y1 - y0)
    line = np.array([[0, tick], [0, -tick], [0, 0], [length, 0], [length, -tick], [length, tick]])
    effects: list[AbstractPathEffect] = [Stroke(linewidth=4.0 * size, foreground=CASING), Normal()]
    axes.plot(
        *(line + np.array([left, low])).T, color=HERE, lw=1.6 * size, path_effects=effects, zorder=8
    )
    axes.text(
        left + length / 2.0,
        low + 0.5 * tick,
        f"{length:g} m",
        ha="center",
        va="bottom",
        fontsize=9 * size,
        path_effects=effects,
        zorder=8,
    )


def frame(axes: Axes, points: Iterable[FloatArray], margin: float = MARGIN) -> None:
    """Show everything that has corners at these points [m], to scale, and nothing else."""
    found = np.concatenate(list(points))
    low, high = found.min(axis=0), found.max(axis=0)
    axes.set_aspect("equal")
    axes.set_xlim(low[0] - margin, high[0] + margin)
    axes.set_ylim(low[1] - margin, high[1] + margin)


def cell_edges(centres: FloatArray) -> FloatArray:
    """Return the borders of cells around evenly spaced centres, one more than there are."""
    step = float(centres[1] - centres[0]) if len(centres) > 1 else 0.05
    return np.append(centres - step / 2.0, centres[-1] + step / 2.0)


def legend_handles(room: Sequence[Solid], *, robot: bool) -> list[Artist]:
    """Return what goes into a legend: the room, places without a colour, and robots."""
    kinds = [kind for kind in Category if any(solid.category is kind for solid in room)]
    handles: list[Artist] = [Patch(facecolor=kind.colour, label=kind.label) for kind in kinds]
    handles.append(Patch(facecolor=BLOCKED, label="robot cannot stand here"))
    handles.append(Patch(facecolor=EMPTY, edgecolor="#bbbbbb", label="no goal in reach"))
    if robot:
        label = "robot's base to scale, and its heading"
        handles.append(Patch(facecolor="none", edgecolor=MEMBER, lw=2.0, label=label))
    return handles


def stops(members: Sequence[BaseFootprint], here: BaseFootprint | None) -> list[Artist]:
    """Return where robot and members stand in numbers, for a legend."""
    handles: list[Artist] = []
    if here is not None:
        said = member_text(here.configuration.to_json())
        handles.append(Patch(facecolor="none", edgecolor=HERE, ls="--", label=f"now: {said}"))
    for number, stand in enumerate(members, start=1):
        said = member_text(stand.configuration.to_json())
        handles.append(
            Line2D([], [], ls="none", color=MEMBER, marker="o", label=f"{number}: {said}")
        )
    return handles
