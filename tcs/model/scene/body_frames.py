"""Where the parts of the person are, in every state of the environment that a grid has."""

from __future__ import annotations

import itertools

from tcs.model.grid import Grid
from tcs.model.scene.scene import Scene


def body_frame_positions(scene: Scene, grid: Grid) -> dict[str, list[float]]:
    """Return where each body frame is in W for each environment state of a grid.

    Args:
        scene: The scene; its state is left as it was.
        grid: Its environment axes move the joints of the same name.

    Returns:
        By name, x, y, z [m] of each state in C order over the axes, one after the other.
    """
    before = scene.positions()
    places: dict[str, list[float]] = {name: [] for name in scene.built.body_frames}
    axes = grid.environment_axes
    try:
        for state in itertools.product(*(axis.values for axis in axes)):
            for axis, value in zip(axes, state, strict=True):
                scene.set_joint(axis.name, float(value))
            for name, numbers in places.items():
                numbers.extend(scene.body_frame_pose(name).translation().tolist())
    finally:
        scene.restore(before)
    return places
