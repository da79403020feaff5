"""Boxes among the obstacles of an environment."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from tcs.model.scene import EnvironmentFile
from tcs.model.scene.environment.environment_file import Obstacle as EnvironmentObstacle
from tcs.placement.constraints import Obstacle


def with_obstacles(environment: EnvironmentFile, blocked: Sequence[Obstacle]) -> EnvironmentFile:
    """Return an environment with boxes among its obstacles, named blocked_1, blocked_2 and so on.

    Args:
        environment: The environment.
        blocked: The boxes, in the environment frame.
    """
    taken = {entry.name for entry in environment.placed}
    names = (name for i in itertools.count(1) if (name := f"blocked_{i}") not in taken)
    added = tuple(
        EnvironmentObstacle(
            name=name,
            xyz=(box.x, box.y, float(box.centre[2])),
            rpy_deg=(0.0, 0.0, math.degrees(box.yaw)),
            box=(box.width, box.depth, box.z_high - box.z_low),
        )
        for name, box in zip(names, blocked, strict=False)
    )
    return environment.model_copy(update={"obstacles": (*environment.obstacles, *added)})
