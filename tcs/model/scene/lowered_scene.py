"""A scene as plain arrays, with the names that the indices refer to, and a digest."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from tcs.kernel.arrays import BoolArray, Chain, GridArrays, SceneArrays, Shapes

T = TypeVar("T", SceneArrays, GridArrays)

_DIGEST_DECIMALS = 9
"""Decimals of the hashed arrays: a nanometre or nanoradian is far below any change of a model and
far above the rounding differences between processors."""


@dataclass(frozen=True, slots=True)
class LoweredScene:
    """A scene, its goals and its grid as plain arrays, with the names that indices refer to.

    Attributes:
        arrays: Scene and goals, as the kernel reads them.
        grid: The configurations to score.
        robot_bodies: Names of the bodies of the robot, by the index `body` of its shapes.
        environment_bodies: Names of the bodies of the environment, by the index `body` of its
            shapes.
        goals: Names of the goals, in order.
        body_shapes: Whether a shape of the robot that is not of the scored arm is in the arrays,
            None for all.
    """

    arrays: SceneArrays
    grid: GridArrays
    robot_bodies: tuple[str, ...]
    environment_bodies: tuple[str, ...]
    goals: tuple[str, ...]
    body_shapes: BoolArray | None = None

    def digest(self) -> str:
        """Return the SHA-256 of all arrays and names, as hexadecimal digits.

        Scenes with the same digest have the same scores.
        """
        sha = hashlib.sha256()
        for item in _flat((self.arrays, self.grid)):
            array = np.asarray(item)
            if array.dtype.kind == "f":
                # Adding 0.0 turns -0.0 into 0.0, which is equal and must have the same hash.
                array = np.round(array.astype("<f8"), _DIGEST_DECIMALS) + 0.0
            elif array.dtype != np.uint8:
                array = array.astype("<i8")
            sha.update(repr(array.shape).encode())
            sha.update(array.tobytes())
        sha.update(repr((self.robot_bodies, self.environment_bodies, self.goals)).encode())
        return sha.hexdigest()


def without_bodies(lowered: LoweredScene, names: Collection[str]) -> LoweredScene:
    """Return a scene in which some bodies of the robot, not of the scored arm, are not there.

    Args:
        lowered: The scene.
        names: Names of the bodies.
    """
    arrays = lowered.arrays
    gone = [number for number, name in enumerate(lowered.robot_bodies) if name in names]
    kept = ~np.isin(arrays.body.body, gone)
    body = arrays.body
    fewer = Shapes(
        type=body.type[kept],
        size=body.size[kept],
        pad=body.pad[kept],
        body=body.body[kept],
        frame=body.frame[kept],
        R=body.R[:, kept],
        p=body.p[:, kept],
    )
    return replace(
        lowered,
        arrays=arrays._replace(
            body=fewer,
            arm_vs_body=arrays.arm_vs_body[:, kept],
            body_vs_environment=arrays.body_vs_environment[kept],
        ),
        body_shapes=kept,
    )


def _flat(item: object) -> Iterator[object]:
    """Yield the leaves of nested named tuples, in order."""
    absent: set[str] = set()
    if isinstance(item, Chain) and not np.any(item.slides):
        # Scenes of revolute joints keep the digests that files were written with.
        absent = {"slides", "coupled"} | ({"joints"} if item.joints == 7 else set())
    if isinstance(item, SceneArrays):
        # So do scenes without free goals, alternatives, tables of distances, and rest postures.
        counts = {
            "freedom": len(item.freedom),
            "first_pose": len(item.first_pose),
            "distances": len(item.distances.corners),
            "rest": len(item.rest),
        }
        absent = {name for name, count in counts.items() if not count}
    if isinstance(item, tuple):
        names = getattr(item, "_fields", ("",) * len(item))
        for name, member in zip(names, item, strict=True):
            if name not in absent:
                yield from _flat(member)
    else:
        yield item


def read_only(arrays: T) -> T:
    """Make arrays read-only, in place, and return them."""
    for leaf in _flat(arrays):
        if isinstance(leaf, np.ndarray):
            leaf.flags.writeable = False
    return arrays
