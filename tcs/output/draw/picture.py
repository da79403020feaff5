"""A picture in space: robot, furniture, person and goals from their collision shapes."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from tcs.output.draw import camera as cameras
from tcs.output.draw.camera import Camera, nearest_camera
from tcs.output.draw.goal_marks import GoalMark, draw_goal_marks, mark_handles
from tcs.output.draw.raster import Mesh, Raster, rasterise_scene
from tcs.output.draw.shading import shade
from tcs.output.draw.solids import Category, FloatArray, Solid

_TITLE_WIDTH = 66
"""Characters of the title per line above a view."""
_CAPTION_WIDTH = 74
"""Characters of a caption per line."""
_WIDTH, _HEIGHT, _LINE = 6.6, 6.0, 0.2
"""Width of a panel, its height without the caption, and height of a line of that [inch]."""
_GOALS_APART = 12.0
"""Distance below which goals share one mark [px]: about its width."""
_UNHIDDEN = 0.6
"""Fraction of the robot and person that a view has to show, of what the best view shows."""
_GOALS = {Category.GOAL: 1.0, Category.CURRENT_GOAL: 5.0}
"""Weight of each visible pixel of a goal; the tool hides most of the goal it is at."""
_LEFT_OUT = "walls near the camera are left out"


@dataclass(frozen=True, eq=False)
class ScenePanel:
    """One panel of the picture."""

    solids: Sequence[Solid]
    """Everything in the scene."""
    subject: FloatArray
    """Points that have to be in the picture, seen from as near as possible [m], shape (n, 3)."""
    azimuths: tuple[float, ...]
    """Candidate directions from the subject to the camera [rad]. The one that shows most of the
    goals is used, with most weight on the current goal, unless the robot or the person is hidden
    from there."""
    caption: str
    goals: Sequence[GoalMark] = ()
    """Goals that are marked, never hidden."""


class _Candidate(NamedTuple):
    """The visible parts from one direction."""

    goals: float
    """Weighted pixels of the goals."""
    subject: int
    """Pixels of robot, person and goals."""
    left_out: tuple[int, ...]
    """Numbers of the solids that are left out."""
    camera: Camera
    raster: Raster


def draw_scene(views: Sequence[ScenePanel], *, title: str) -> Figure:
    """Return a picture with one panel for each view.

    Args:
        views: The panels, left to right.
        title: First line; "" for none.
    """
    figure = Figure(figsize=(_WIDTH * len(views), _WIDTH), layout="constrained")
    panels = figure.subplots(1, len(views), squeeze=False)[0]
    for axes, view in zip(panels, views, strict=True):
        image, is_whole, camera = _render(view)
        axes.imshow(image, interpolation="antialiased")
        if view.goals:
            at = cameras.pixels_of(camera, np.array([mark.position for mark in view.goals]))
            draw_goal_marks(axes, view.goals, (at - 0.5) / 2.0, apart=_GOALS_APART)
        axes.set_axis_off()
        # In the middle, lines above the picture may be beyond the edge.
        axes.set_anchor("S")
        lines = [*view.caption.splitlines(), *([] if is_whole else [f"({_LEFT_OUT})"])]
        wrapped = [part for line in lines for part in textwrap.wrap(line, _CAPTION_WIDTH)]
        axes.set_title("\n".join(wrapped), fontsize=11)
        # A long caption makes the figure higher: its first lines would be cut off.
        height = max(float(figure.get_figheight()), _HEIGHT + _LINE * len(wrapped))
        figure.set_figheight(height)
    if title:
        width = _TITLE_WIDTH * len(views)
        lines = [line for part in title.splitlines() for line in textwrap.wrap(part, width)]
        figure.suptitle("\n".join(lines), fontsize=13)
    shown = {solid.category for view in views for solid in view.solids}
    handles: list[Artist] = [
        Patch(facecolor=one.colour, edgecolor="#555555", lw=0.5, label=one.label)
        for one in Category
        if one in shown
    ]
    handles += mark_handles([mark for view in views for mark in view.goals])
    columns = min(4 * len(views), 8)
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, frameon=False)
    return figure


def _render(view: ScenePanel) -> tuple[FloatArray, bool, Camera]:
    """Return the picture from the best direction, (h, w, 3), whether it is whole, the camera."""
    mesh = Mesh.of(view.solids)
    weight = np.array([_GOALS.get(solid.category, 0.0) for solid in view.solids])[mesh.owner]
    is_subject = mesh.is_subject(view.solids)
    candidates = []
    for azimuth in view.azimuths:
        camera = nearest_camera(view.subject, azimuth)
        raster, left_out = rasterise_scene(view.solids, mesh, camera)
        visible = raster.triangle[raster.triangle >= 0]
        goals, subject = float(weight[visible].sum()), int(is_subject[visible].sum())
        candidates.append(_Candidate(goals, subject, left_out, camera, raster))
    # From behind furniture, a goal may be visible beside it while the robot is hidden.
    clear = _UNHIDDEN * max(one.subject for one in candidates)
    unhidden = [one for one in candidates if one.subject >= clear]
    whole = [one for one in unhidden if not one.left_out]
    best = max(whole or unhidden, key=lambda one: one.goals)
    image = shade(view.solids, mesh, best.camera, best.raster)
    width, height = cameras.SIZE
    # The average of two by two pixels smooths the edges.
    smooth = image.reshape(height // 2, 2, width // 2, 2, 3).mean(axis=(1, 3))
    return np.asarray(smooth), not best.left_out, best.camera
