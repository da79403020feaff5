"""Faults of a robot file that are found without its meshes, in milliseconds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tcs.files.paths import is_path
from tcs.model.checkup.tool import fingers_off_axis, tool_axes_problem
from tcs.model.robots import Primitive, load_robot
from tcs.model.robots.urdf.pose import pose_in_root

SUNK = 0.1
"""Depth of a primitive below the root that shows a root above the floor [m]: those of a large base
protrude from it by up to 6 cm (Baxter's pedestal)."""


def quick_problems(robot: str | Path) -> tuple[str, ...]:
    """Return problems of a robot file of one's own that a check-up would find, one sentence each.

    Only those that need no mesh: the axes of the tool frame, and a root above the floor.

    Args:
        robot: Name of a robot, for which nothing is checked, or path of its file.

    Raises:
        UnknownNameError: If no robot has that name, or its file names something unknown.
        RobotError: If the file, or a model it names, cannot be used.
    """
    if not is_path(str(robot)):
        return ()
    loaded = load_robot(robot)
    found = []
    axis = fingers_off_axis(loaded)
    if axis is not None:
        found.append(tool_axes_problem(loaded, axis))
    model, positions = loaded.model(), loaded.with_mimics(loaded.joint_positions())
    lowest = 0.0
    for shape in loaded.load_primitives():
        if shape.body in model.links:
            R, p = pose_in_root(model, shape.body, positions)
            lowest = min(lowest, float(p[2] + R[2] @ np.array(shape.xyz)) - _reach(shape, R[2]))
    if lowest < -SUNK:
        found.append(
            f"its primitives reach {-lowest:.2f} m below '{loaded.root_body}', but the root must "
            "be on the floor: add a mount."
        )
    return tuple(found)


def _reach(shape: Primitive, direction: NDArray[np.float64]) -> float:
    """Return how far a shape extends from its centre along a direction in its body [m]."""
    along = np.abs(direction @ shape.rotation)
    if shape.kind == "box":
        return float(along @ np.array(shape.size)) / 2
    length = shape.size[1] if shape.kind == "capsule" else 0.0
    return float(along[2]) * length / 2 + shape.size[0]
