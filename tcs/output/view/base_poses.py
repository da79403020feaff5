"""Capability maps and task maps as pictures, or as pages that show the headings under the pointer.

A page is one file: it loads nothing, and needs no server.
"""

from __future__ import annotations

import html
import json
import math
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.colors import to_hex

from tcs.capability.map import CapabilityMap
from tcs.capability.merge import TaskMap
from tcs.files.writing import whole_file
from tcs.kernel.arrays import FloatArray
from tcs.output.draw import save_figure
from tcs.output.draw.base_poses import COLOURS, BasePoseView
from tcs.output.draw.capability_maps import map_figure, map_title, map_view, task_figure, task_view
from tcs.output.draw.heat_map import headings_at

_SHADES = 64
"""Number of colours of a page."""
_DIGITS = 3


def write_page(path: Path, view: BasePoseView, *, title: str) -> None:
    """Write an interactive page: a heat map, and the headings of the position under the pointer.

    Args:
        path: The page to write.
        view: What it shows.
        title: Its title.

    Raises:
        OutputError: If it cannot be written.
    """
    best = view.poses[np.argmax(view.poses[:, 3])]
    content = json.dumps(
        {
            "step": view.step,
            "cells": _cells(view),
            "tools": np.round(view.positions, _DIGITS).tolist(),
            "grippers": [_pose(grasp) for grasp in view.grasps],
            "best": _pose(best[:3]),
            "colours": [
                to_hex(colour)
                for colour in matplotlib.colormaps[COLOURS](np.linspace(0, 1, _SHADES))
            ],
        }
    )
    page = files("tcs.output.view").joinpath("base_poses.html").read_text(encoding="utf-8")
    caption = html.escape(view.caption.replace("\n", "; "))
    page = page.replace("{title}", html.escape(title)).replace("{caption}", caption)
    with whole_file(path, "Page") as stream:
        stream.write(page.replace("{content}", content).encode())


def _cells(view: BasePoseView) -> list[list[object]]:
    """Return x and y in steps, and headings [deg] with their scores, of each base position."""
    return [
        [x, y, [[yaw, round(score, _DIGITS)] for yaw, score in found]]
        for (x, y), found in sorted(headings_at(view.poses, view.step).items())
    ]


def _pose(pose: Sequence[float] | FloatArray) -> list[float]:
    """Return x, y [m] and heading [deg] of a pose."""
    x, y, yaw = (float(value) for value in pose)
    return [round(x, _DIGITS), round(y, _DIGITS), round(math.degrees(yaw), _DIGITS)]


def save_task_map(path: Path, task_map: TaskMap) -> None:
    """Draw a task map: an interactive page if the path ends in .html, else a figure.

    Args:
        path: File to write.
        task_map: The task map.

    Raises:
        OutputError: If the format is unknown, or the file cannot be written.
    """
    if path.suffix != ".html":
        save_figure(path, task_figure(task_map))
        return
    write_page(path, task_view(task_map), title=task_map.task.name)


def save_map_layer(
    path: Path, capability: CapabilityMap, *, tilt: int = 0, height: float | None = None
) -> None:
    """Draw one layer of a map: an interactive page if the path ends in .html, else a figure.

    Args:
        path: File to write.
        capability: The map.
        tilt: Number of the tilt.
        height: Height of the tool above the floor [m]; None is the height with most cells.

    Raises:
        UnknownNameError: If the grid has no such tilt.
        SelectionError: If the map has no base pose there, or the height is not finite.
        OutputError: If the format is unknown, or the file cannot be written.
    """
    if path.suffix != ".html":
        save_figure(path, map_figure(capability, tilt=tilt, height=height))
        return
    view = map_view(capability, tilt=tilt, height=height)
    write_page(path, view, title=map_title(capability))
