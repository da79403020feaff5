"""The scene of a score file from above: outlines of furniture, person and base, and the goals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from tcs.model.grid import Grid
from tcs.model.scene import EnvironmentFile, Scene, goal_poses
from tcs.model.scene.environment.environment_file import WORLD
from tcs.model.scene.pieces import PIECES
from tcs.output.report.score.scene_solids import base_outline, environment_parts, part_solid
from tcs.output.report.score.shown_set import ShownSet, scored_scenes
from tcs.placement.store import ScoreFile
from tcs.service.jobs import Progress

MOST_STATES = 60
"""Most states of the environment that are outlined: those of the maps of `tcs map --states`."""
_WIDEST, _WIDEST_DEG = 0.5, 90.0
"""Widest range of a joint that is offered, either way: many have no limits of their own."""
_DECIMALS = 3
"""Decimals of positions [m]: a millimetre is less than a pixel."""


def scene_outlines(file: ScoreFile, progress: Progress, only: int | None = None) -> dict[str, Any]:
    """Return the outlines of a scene from above.

    Args:
        file: A score file.
        progress: Reports the states done and in all.
        only: The one state to outline; all by default.

    Returns:
        `base`: the outline of the base in its own frame [m]; `things`: models and obstacles that
        can be moved, each with its name, category, pose in its parent and the name of the thing
        that it stands on; `pieces`: outlines of what can be added; `axes`: the environment's axes
        of the grid with the limits of their joints; `joints`: what can be set beside the grid;
        `states`: for each state of the environment, outlines with their category and the name of
        their thing, the lower first, and `goals`, positions [m].

    Raises:
        StoreMismatchError: If the models are not those the file was made from.
    """
    grid = file.configurations
    shown = ShownSet(None, (), (), file.nominal_index, "", file)
    job, scene = scored_scenes(file, shown)[0]
    base = base_outline(scene)
    states = []
    count = min(math.prod(grid.environment_shape), MOST_STATES)
    for state in range(count) if only is None else [min(only, count - 1)]:
        for name, value in grid.configuration(state * grid.state_size).environment:
            scene.set_joint(name, value)
        states.append(
            {
                "outlines": _outlines(scene),
                "goals": [
                    np.round(X_MG.translation(), _DECIMALS).tolist()
                    for X_MG in scene.seen_from_mount(goal_poses(scene, job.task))
                ],
            }
        )
        progress(state + 1, count)
    return {
        "base": np.round(base, _DECIMALS).tolist(),
        "things": things_of(scene.spec.environment),
        "pieces": _pieces(),
        "axes": _axes(scene, grid),
        "joints": _joints(scene, [axis.name for axis in grid.environment_axes]),
        "states": states,
    }


def things_of(environment: EnvironmentFile) -> list[dict[str, Any]]:
    """Return what can be moved on the floor.

    >>> from tcs.model.scene import load_environment
    >>> [(one["name"], one["on"]) for one in things_of(load_environment("bed"))]
    [('bed', None), ('person', 'bed'), ('wall', None)]
    """
    found = []
    for entry in environment.placed:
        parent = getattr(entry, "parent", WORLD)
        found.append(
            {
                "name": entry.name,
                "category": "person" if environment.is_person(entry.name) else "furniture",
                "on": None if parent == WORLD else parent.split("::", maxsplit=1)[0],
                "x": entry.xyz[0],
                "y": entry.xyz[1],
                "turn_deg": entry.rpy_deg[2],
            }
        )
    return found


def _outlines(scene: Scene) -> list[dict[str, Any]]:
    """Return the outlines of the environment in the present state of a scene, the lower first."""
    plant = scene.built.plant
    found = []
    for part, category in environment_parts(scene):
        solid = part_solid(scene, part, category, in_mount=True)
        thing = plant.GetModelInstanceName(plant.get_body(part.body).model_instance())
        outline = {
            "category": category.name.lower(),
            "thing": thing,
            "points": np.round(solid.footprint, _DECIMALS).tolist(),
        }
        found.append((float(solid.corners[:, 2].mean()), outline))
    return [outline for _, outline in sorted(found, key=lambda one: one[0])]


def _joints(scene: Scene, of_grid: Sequence[str]) -> list[dict[str, Any]]:
    """Return the joints that may be set beside the axes of the grid, in m or deg."""
    joints = scene.built.environment_joints
    following = {name for posture in joints.posture.values() for name in posture.joints}
    found = []
    for name in joints.by_name:
        if name in of_grid or name in following:
            continue
        is_angle = joints.is_revolute(name)
        scale, widest = (180.0 / math.pi, _WIDEST_DEG) if is_angle else (1.0, _WIDEST)
        low, high = joints.limits(name)
        found.append(
            {
                "name": f"{name}_deg" if is_angle else name,
                "low": round(max(low * scale, -widest), 6),
                "high": round(min(high * scale, widest), 6),
                "value": round(joints.default(name) * scale, 6),
            }
        )
    return found


def _axes(scene: Scene, grid: Grid) -> list[dict[str, Any]]:
    """Return the axes of the environment with the limits of their joints, in m or deg."""
    joints = scene.built.environment_joints
    found = []
    for axis in grid.environment_axes:
        scale = 180.0 / math.pi if axis.unit == "deg" else 1.0
        low, high = (limit * scale for limit in joints.limits(axis.name))
        last = axis.start + (axis.count - 1) * axis.step
        name = f"{axis.name}_deg" if axis.unit == "deg" else axis.name
        limits = {"low": round(max(low, -1e3), 6), "high": round(min(high, 1e3), 6)}
        found.append({"name": name, **limits, "first": axis.start, "last": last})
    return found


def _pieces() -> dict[str, list[list[list[float]]]]:
    """Return the outlines of the pieces of furniture that can be added, in their own frame [m]."""
    outlines = {}
    for piece, boxes in PIECES.items():
        outlines[piece] = [
            [[x + a * w / 2, y + b * d / 2] for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
            for (w, d, _), (x, y, _) in boxes
        ]
    return outlines
