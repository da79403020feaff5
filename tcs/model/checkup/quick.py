"""Faults of a robot file that are found without its meshes, in milliseconds."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tcs.files.paths import is_path
from tcs.model.checkup.tool import fingers_off_axis, tool_axes_problem
from tcs.model.robots import load_robot
from tcs.model.robots.tool_place import tool_place
from tcs.model.robots.urdf.pose import pose_in_root

SUNK = 0.1
"""Depth of a primitive below the root that shows a root above the floor [m]: those of a large base
protrude from it by up to 6 cm (Baxter's pedestal)."""


def quick_problems(robot: str | Path) -> tuple[str, ...]:
    """Return problems of a robot file of one's own that a check-up would find, one sentence each.

    Only those that need no mesh: the axes of the tool frame and where it lies, and a root above the
    floor.

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
    place = tool_place(loaded)
    if place is not None and place.doubt:
        found.append(place.doubt)
    model, positions = loaded.model(), loaded.with_mimics(loaded.joint_positions())
    lowest, arm = 0.0, model.links_moved_by(loaded.arm_joints[0])
    for shape in loaded.load_primitives():
        if shape.body in model.links and shape.body not in arm:
            R, p = pose_in_root(model, shape.body, positions)
            lowest = min(lowest, float(p[2] + R[2] @ np.array(shape.xyz)) - shape.reach(R[2]))
    if lowest < -SUNK:
        found.append(
            f"its primitives reach {-lowest:.2f} m below '{loaded.root_body}', but the root must "
            "be on the floor: add a mount."
        )
    return tuple(found)
