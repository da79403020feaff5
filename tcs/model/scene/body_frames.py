"""Positions of the body frames in every environment state of a grid."""

from __future__ import annotations

from tcs.model.grid import Grid
from tcs.model.scene.scene import Scene


def body_frame_positions(scene: Scene, grid: Grid) -> dict[str, list[float]]:
    """Return the position of each body frame in M for each environment state of a grid.

    M is the frame of the base poses: W, or that of the environment's mount.

    Args:
        scene: The scene; its state is restored.
        grid: The grid, whose environment axes move the joints of the same name.

    Returns:
        By name of the body frame: x, y, z [m] of all states, concatenated in C order over the axes.
    """
    before = scene.positions()
    positions: dict[str, list[float]] = {name: [] for name in scene.built.body_frames}
    try:
        for state in grid.environment_states():
            for joint, value in state.items():
                scene.set_joint(joint, value)
            for name, numbers in positions.items():
                (X_MH,) = scene.seen_from_mount([scene.body_frame_pose(name)])
                numbers.extend(X_MH.translation().tolist())
    finally:
        scene.restore(before)
    return positions
