"""The scene of a score file from above: outlines of furniture, person and base, and the goals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tcs.output.report.pictures import scored_scene
from tcs.output.report.scene_solids import base_outline, environment_solids
from tcs.output.report.shown_set import ShownSet
from tcs.placement.store import ScoreFile
from tcs.service.jobs import Progress

MOST_STATES = 60
"""Most states of the environment that are outlined: those of the maps of `tcs map --states`."""
_DECIMALS = 3
"""Decimals of positions [m]: a millimetre is less than a pixel."""


def scene_outlines(file: ScoreFile, progress: Progress) -> dict[str, Any]:
    """Return the outlines of a scene from above.

    Args:
        file: A score file.
        progress: Reports the states done and in all.

    Returns:
        `base`: the outline of the base in its own frame [m]; `states`: for each state of the
        environment, outlines with their category, the lower first, and `goals`, positions [m].

    Raises:
        StoreMismatchError: If the models are not those the file was made from.
    """
    from tcs.model.scene import goal_poses

    grid = file.configurations
    shown = ShownSet(None, (), (), file.nominal_index, "")
    scored = scored_scene(file, shown, arm=next(iter(file.arms), None))
    job, scene = scored
    base = base_outline(scene)
    states = []
    count = min(math.prod(grid.environment_shape), MOST_STATES)
    for state in range(count):
        for name, value in grid.configuration(state * grid.state_size).environment:
            scene.set_joint(name, value)
        solids = sorted(environment_solids(scene), key=lambda one: float(one.corners[:, 2].mean()))
        states.append(
            {
                "outlines": [
                    {
                        "category": solid.category.name.lower(),
                        "points": np.round(solid.footprint, _DECIMALS).tolist(),
                    }
                    for solid in solids
                ],
                "goals": [
                    np.round(X_WG.translation(), _DECIMALS).tolist()
                    for X_WG in goal_poses(scene, job.task)
                ],
            }
        )
        progress(state + 1, count)
    return {"base": np.round(base, _DECIMALS).tolist(), "states": states}
