"""Keys of animations in Meshcat, between which the browser interpolates linearly."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pydrake.geometry import MeshcatAnimation
from pydrake.math import RigidTransform

from tcs.kernel.arrays import FloatArray


def interpolation_keys(values: Sequence[object]) -> list[int]:
    """Return the indices of the keys from which linear interpolation reproduces all values.

    >>> interpolation_keys([1, 1, 1, 2, 3, 3, 3])
    [0, 2, 3, 4, 6]
    """
    last = len(values) - 1
    return [
        i
        for i, value in enumerate(values)
        if i in (0, last) or value != values[i - 1] or value != values[i + 1]
    ]


def play_visible(animation: MeshcatAnimation, path: str, shown: Sequence[bool]) -> None:
    """Animate the visibility of an object, one value a frame; it switches without a transition."""
    for at, visible in enumerate(shown):
        if at in (0, len(shown) - 1) or visible != shown[at - 1]:
            animation.SetProperty(at, path, "visible", visible)


def play_poses(animation: MeshcatAnimation, shots: Sequence[Mapping[str, FloatArray]]) -> None:
    """Animate the poses of objects.

    Args:
        animation: The animation.
        shots: For each frame the pose of each path in its parent, shape (3, 4).
    """
    for path in shots[0]:
        poses = [shot[path] for shot in shots]
        for at in interpolation_keys([pose.tobytes() for pose in poses]):
            animation.SetTransform(at, path, RigidTransform(poses[at]))
