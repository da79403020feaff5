"""Parts of a map: score cells, the environment's outlines, base footprints, a scale bar."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

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

IntArray = NDArray[np.int64]

ARROW = 0.45
"""Length of a heading arrow [m]: it ends ahead of the front of a mobile robot."""
LONGEST = 4.0
"""Greatest ratio of the sides of a cell."""
_SINGLE = 0.05
"""Width of the cells along an axis with a single value [m]."""
MARGIN = 0.05
"""Margin around what is shown [m]."""
_EXCLUDED = "////"
"""Hatch of base positions that constraints excluded."""
_EDGE = "#00000066"
"""Outline of each shape, visible where its colour resembles that below."""


@dataclass(frozen=True, eq=False)
class BaseFootprint:
    """The base of a robot from above."""

    configuration: InitialConfiguration
    """Its configuration, in the frame of the map."""
    outline: FloatArray
    """Outline of its base in the base's own frame [m], shape (n, 2)."""
    place: str = ""
    """Where it is relative to the person, in words; "" for unknown."""

    @property
    def polygon(self) -> FloatArray:
        """The outline in the frame of the map [m], shape (n, 2)."""
        at = self.configuration
        c, s = math.cos(at.base_yaw), math.sin(at.base_yaw)
        return np.asarray(self.outline @ np.array([[c, s], [-s, c]]) + [at.base_x, at.base_y])


def draw_cells(axes: Axes, places: PlaceMap, values: NDArray[np.float64], most: float) -> QuadMesh:
    """Colour each base position by its value, grey where the base is blocked, hatched if excluded.

    Args:
        axes: The axes.
        places: The base positions.
        values: Value of each base position, without a colour where it is 0, shape (X, Y).
        most: Value at the upper end of the scale.
    """
    widths = cell_widths(places.x, places.y)
    (x, columns), (y, rows) = (
        _cells_and_gaps(at, width) for at, width in zip((places.x, places.y), widths, strict=True)
    )
    edges, at = (x, y), np.ix_(columns, rows)
    gaps = (columns[:, None] < 0) | (rows[None] < 0)
    blocked = np.ma.masked_where(places.free[at] | gaps, np.ones(gaps.shape))
    axes.pcolormesh(*edges, blocked.T, cmap=ListedColormap([BLOCKED]), rasterized=True)
    if places.excluded is not None:
        excluded = places.excluded[at] & ~gaps
        corners = [
            [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
            for i, (x0, x1) in enumerate(pairwise(edges[0]))
            for j, (y0, y1) in enumerate(pairwise(edges[1]))
            if excluded[i, j]
        ]
        hatched = PolyCollection(
            corners, facecolors=EMPTY, edgecolors=BLOCKED, hatch=_EXCLUDED, linewidths=0.0
        )
        axes.add_collection(hatched, autolim=False)
    scored = np.ma.masked_where((values[at] <= 0.0) | gaps, values[at])
    return axes.pcolormesh(*edges, scored.T, cmap=SCALE, vmin=0.0, vmax=most, rasterized=True)


def draw_environment(axes: Axes, environment: Sequence[Solid]) -> None:
    """Draw the outlines of solids from above, lower ones first: the person sits on the chair."""
    # Ordered by their centres: a raised head rest reaches higher than the head before it.
    ordered = sorted(environment, key=lambda solid: float(solid.corners[:, 2].mean()))
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
    axes: Axes, base: BaseFootprint, *, label: str = "", is_here: bool = False, size: float = 1.0
) -> None:
    """Draw the base of a robot to scale, with its heading.

    Args:
        axes: The axes.
        base: The base.
        label: Text at its origin.
        is_here: Whether it is the current base pose rather than a member of the set.
        size: Scale of lines and text.
    """
    at, colour = base.configuration, HERE if is_here else MEMBER
    cased: list[AbstractPathEffect] = [
        Stroke(linewidth=4.4 * size, foreground=CASING),
        Normal(),
    ]
    outline = Polygon(
        base.polygon,
        facecolor=f"{CASING}50",
        edgecolor=colour,
        lw=2.0 * size,
        ls="--" if is_here else "-",
        zorder=5,
    )
    # A path effect would fill the outline, so the casing is a separate patch.
    axes.add_patch(Polygon(base.polygon, fill=False, edgecolor=CASING, lw=4.4 * size, zorder=4.9))
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
    """Draw a scale bar in the lower left corner, for the current limits of the axes.

    Args:
        axes: The axes.
        size: Scale of lines and text.
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
    """Set the limits of axes to the bounding box of points [m], to scale."""
    found = np.concatenate(list(points))
    low, high = found.min(axis=0), found.max(axis=0)
    axes.set_aspect("equal")
    axes.set_xlim(low[0] - margin, high[0] + margin)
    axes.set_ylim(low[1] - margin, high[1] + margin)


def cell_widths(x: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Return the widths of the cells around evenly spaced base positions [m].

    They are the steps, but at most `LONGEST` times the smaller one: between two rails at the sides
    of a chair there are no base positions.
    """
    steps = [float(at[1] - at[0]) if len(at) > 1 else _SINGLE for at in (x, y)]
    return min(steps[0], LONGEST * steps[1]), min(steps[1], LONGEST * steps[0])


def _cells_and_gaps(centres: FloatArray, width: float) -> tuple[FloatArray, IntArray]:
    """Return the edges of cells, and the number of each cell, -1 for a gap between two."""
    numbers = np.arange(len(centres))
    if len(centres) < 2 or centres[1] - centres[0] <= width:
        return np.append(centres - width / 2.0, centres[-1] + width / 2.0), numbers
    edges = np.stack([centres - width / 2.0, centres + width / 2.0], axis=1).ravel()
    return edges, np.stack([numbers, np.full_like(numbers, -1)], axis=1).ravel()[:-1]


def legend_handles(
    environment: Sequence[Solid], *, robot: bool, excluded: bool = False
) -> list[Artist]:
    """Return the legend of solids, base positions without a colour, and bases.

    Args:
        environment: The solids.
        robot: Whether bases are drawn.
        excluded: Whether constraints excluded base positions.
    """
    shown = {solid.category for solid in environment}
    handles: list[Artist] = [
        Patch(facecolor=one.colour, label=one.label) for one in Category if one in shown
    ]
    handles.append(Patch(facecolor=BLOCKED, label="base blocked"))
    handles.append(Patch(facecolor=EMPTY, edgecolor="#bbbbbb", label="reaches no goal"))
    if excluded:
        label = "excluded by a constraint"
        handles.append(Patch(facecolor=EMPTY, edgecolor=BLOCKED, hatch=_EXCLUDED, label=label))
    if robot:
        label = "robot's base to scale, with heading"
        handles.append(Patch(facecolor="none", edgecolor=MEMBER, lw=2.0, label=label))
    return handles


def pose_handles(members: Sequence[BaseFootprint], here: BaseFootprint | None) -> list[Artist]:
    """Return the legend of the current configuration and of the members."""
    handles: list[Artist] = []
    if here is not None:
        text = member_text(here.configuration.to_json())
        handles.append(Patch(facecolor="none", edgecolor=HERE, ls="--", label=f"now: {text}"))
    for number, base in enumerate(members, start=1):
        text = member_text(base.configuration.to_json())
        place = f"{base.place}\n" if base.place else ""
        handles.append(
            Line2D([], [], ls="none", color=MEMBER, marker="o", label=f"{number}: {place}{text}")
        )
    return handles
