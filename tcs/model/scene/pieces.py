"""Pieces of furniture that can be added to an environment: a few boxes each."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass

from tcs.errors import UnknownNameError
from tcs.model.scene.environment.environment_file import EnvironmentFile, Obstacle

Size = tuple[float, float, float]

PIECES: dict[str, tuple[tuple[Size, Size], ...]] = {
    # Size along x, y, z and centre [m]; x points where the piece faces. The space below a seat is
    # closed: a base must not count on the legs being elsewhere. Below a table are knees.
    "chair": (((0.45, 0.45, 0.46), (0.0, 0.0, 0.23)), ((0.05, 0.45, 0.44), (-0.2, 0.0, 0.68))),
    "table": (
        ((0.8, 1.2, 0.04), (0.0, 0.0, 0.72)),
        *(((0.06, 0.06, 0.7), (x, y, 0.35)) for x in (0.37, -0.37) for y in (0.57, -0.57)),
    ),
    "cabinet": (((0.45, 0.45, 0.6), (0.0, 0.0, 0.3)),),
    "wall": (((0.1, 2.0, 2.5), (0.0, 0.0, 1.25)),),
    # A clear width of 0.9 m, as for wheelchairs.
    "door": (((0.1, 0.55, 2.5), (0.0, 0.725, 1.25)), ((0.1, 0.55, 2.5), (0.0, -0.725, 1.25))),
}
"""Boxes of each piece; its origin is on the floor. The sizes are round figures of common furniture.
A door is an opening between two pieces of wall."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacedPiece:
    """A piece of furniture on the floor."""

    piece: str
    """One of `PIECES`."""
    x: float
    """Its origin along x of the environment [m]."""
    y: float
    """Its origin along y [m]."""
    yaw: float = 0.0
    """Where it faces [rad]."""


def with_pieces(environment: EnvironmentFile, pieces: Iterable[PlacedPiece]) -> EnvironmentFile:
    """Return an environment with pieces of furniture among its obstacles.

    Args:
        environment: The environment.
        pieces: The pieces; the boxes of the first chair are named chair_1 and chair_1_b.

    Raises:
        UnknownNameError: If there is no such piece.
    """
    taken = {entry.name for entry in environment.placed}
    added: list[Obstacle] = []
    for placed in pieces:
        if placed.piece not in PIECES:
            where = f"environment '{environment.name}'"
            raise UnknownNameError("piece of furniture", placed.piece, PIECES, where=where)
        names = (f"{placed.piece}_{i}" for i in itertools.count(1))
        name = next(name for name in names if name not in taken)
        cos, sin = math.cos(placed.yaw), math.sin(placed.yaw)
        for letter, (size, (x, y, z)) in zip("abcde", PIECES[placed.piece], strict=False):
            whole = name if letter == "a" else f"{name}_{letter}"
            taken.add(whole)
            added.append(
                Obstacle(
                    name=whole,
                    box=size,
                    xyz=(placed.x + cos * x - sin * y, placed.y + sin * x + cos * y, z),
                    rpy_deg=(0.0, 0.0, math.degrees(placed.yaw)),
                )
            )
    return environment.model_copy(update={"obstacles": (*environment.obstacles, *added)})
