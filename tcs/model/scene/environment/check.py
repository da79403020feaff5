"""Check an environment without a robot: what touches what, and what no robot of its grid meets."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import BOX, CAPSULE, FloatArray
from tcs.kernel.collide import BOUND, CENTRE, ROTATION, SIZE, TYPE, closer, pack
from tcs.model.grid import Grid
from tcs.model.robots.primitives import union_volume
from tcs.model.scene.environment.environment_file import FLOOR, EnvironmentFile, Obstacle
from tcs.model.scene.environment.obstacle_shapes import (
    obstacle_shapes,
    open_surface,
    solid_volume,
)
from tcs.model.scene.environment.shapes import named_shapes

REACH = 2.0
"""Distance from the base positions of a grid beyond which no arm reaches anything [m]."""
SUNK = 0.005
"""Depth below the floor that counts [m]: legs may stand in it a little."""


@dataclass(frozen=True)
class ObstacleShapes:
    """Shapes of an obstacle.

    Attributes:
        name: Its name.
        type: What it is, e.g. "mesh".
        count: Number of shapes.
        volume: Volume of the shapes together [m^3], None for a model.
        excess: That volume over the obstacle's own, None for a model, a point cloud or a mesh that
            is not closed.
        open_edges: Edges of a mesh that do not join two triangles; 0 for all else.
        thickness: Volume of the shapes over the area of such a mesh [m], None for all else.
    """

    name: str
    type: str
    count: int
    volume: float | None
    excess: float | None
    open_edges: int = 0
    thickness: float | None = None

    def to_json(self) -> dict[str, Any]:
        """Return the values as plain containers."""
        return {
            "name": self.name,
            "type": self.type,
            "shapes": self.count,
            "volume_m3": self.volume,
            "excess": self.excess,
            "open_edges": self.open_edges,
            "thickness_m": self.thickness,
        }


@dataclass(frozen=True)
class EnvironmentCheck:
    """What was found in an environment.

    Attributes:
        environment: Its name.
        touching: Pairs of an obstacle and another part that are closer than contacts allow.
        below_floor: Obstacles that reach below the floor.
        outside: Obstacles and models that are farther than `REACH` from every base position.
        obstacles: Shapes of each obstacle.
        shapes: Number of all shapes.
        person: Name of the model that is the person, None without one.
    """

    environment: str
    touching: tuple[tuple[str, str], ...]
    below_floor: tuple[str, ...]
    outside: tuple[str, ...]
    obstacles: tuple[ObstacleShapes, ...]
    shapes: int
    person: str | None

    @property
    def problems(self) -> tuple[str, ...]:
        """What makes answers wrong or impossible, one sentence each."""
        found = []
        for obstacle, other in self.touching:
            if self.person is not None and other.split("::")[0] == self.person:
                found.append(
                    f"obstacle '{obstacle}' touches the person ('{other}'): move it, or the goals "
                    "there are answered for a body that is inside it."
                )
        found += [
            f"obstacle '{name}' reaches below the floor: place it by its centre, or by the origin "
            "of its file."
            for name in self.below_floor
        ]
        return tuple(found)

    @property
    def notes(self) -> tuple[str, ...]:
        """What to review, one sentence each."""
        found = [
            f"'{name}' is more than {REACH:g} m from every base position of the grid, so it has "
            "no effect."
            for name in self.outside
        ]
        found += [
            f"the mesh of '{obstacle.name}' is not closed ({obstacle.open_edges:,} edges): its "
            f"surface counts as solid, {(obstacle.thickness or 0.0) * 1e3:.0f} mm thick on "
            "average, and what it surrounds as free."
            for obstacle in self.obstacles
            if obstacle.open_edges
        ]
        return tuple(found)

    @property
    def is_sound(self) -> bool:
        """Whether there are no problems."""
        return not self.problems

    def to_json(self) -> dict[str, Any]:
        """Return the result as plain containers."""
        return {
            "environment": self.environment,
            "sound": self.is_sound,
            "problems": list(self.problems),
            "notes": list(self.notes),
            "touching": [list(pair) for pair in self.touching],
            "below_floor": list(self.below_floor),
            "outside_grid": list(self.outside),
            "obstacles": [obstacle.to_json() for obstacle in self.obstacles],
            "shapes": self.shapes,
        }


def check_environment(environment: EnvironmentFile) -> EnvironmentCheck:
    """Return what touches what in an environment, and what no robot of its grid meets.

    Shapes touch if they are closer than the contact margin or the sum of their paddings, as for the
    robot. Contacts of the models among themselves are left out: a person sits on a chair.

    Args:
        environment: The environment, in the state of its file.

    Raises:
        EnvironmentFileError: If a model, mesh or point cloud cannot be used.
        UnknownNameError: If the file names something that does not exist.
        GridError: If its grid lacks the axes of the base.
    """
    names, shapes = named_shapes(environment)
    rows = np.asarray(pack(shapes)[0])
    own = {obstacle.name for obstacle in environment.obstacles}
    owner = np.array([name.split("::")[0] for name in names])
    touching = set()
    for i in np.flatnonzero(np.isin(owner, list(own))):
        others = np.flatnonzero((owner != owner[i]) & (owner != FLOOR))
        gaps = np.maximum(environment.contact_margin, shapes.pad[i] + shapes.pad[others])
        offsets = rows[others, CENTRE : CENTRE + 3] - rows[i, CENTRE : CENTRE + 3]
        away = np.linalg.norm(offsets, axis=1)
        near = away < rows[others, BOUND] + rows[i, BOUND] + gaps
        for j, gap in zip(others[near], gaps[near], strict=True):
            pair = names[i], names[j]
            if pair not in touching and pair[::-1] not in touching:
                if closer(rows, int(i), rows, int(j), float(gap)):
                    touching.add(pair)
    lows, highs = _extents(rows)
    sunk = {owner[i] for i in range(len(names)) if owner[i] in own and lows[i, 2] < -SUNK}
    outside = _outside(environment, owner, lows, highs)
    person = environment.person_model
    return EnvironmentCheck(
        environment=environment.name,
        touching=tuple(sorted(touching)),
        below_floor=tuple(sorted(sunk)) if environment.floor else (),
        outside=outside,
        obstacles=tuple(
            _described(o, int(np.sum(owner == o.name)), f"environment '{environment.name}'")
            for o in environment.obstacles
        ),
        shapes=len(names),
        person=person if environment.is_person(person) else None,
    )


def _described(obstacle: Obstacle, count: int, where: str) -> ObstacleShapes:
    """Return the number and the volumes of an obstacle's shapes."""
    here = f"{where}, '{obstacle.name}'"
    shapes, solid = obstacle_shapes(obstacle, here), solid_volume(obstacle, here)
    volume = union_volume(shapes) if shapes else None
    excess = volume / solid if volume is not None and solid else None
    edges, area = open_surface(obstacle, here) or (0, 0.0)
    thickness = volume / area if volume is not None and area else None
    return ObstacleShapes(obstacle.name, obstacle.type, count, volume, excess, edges, thickness)


def _extents(rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the least and greatest coordinates of packed shapes in W [m], shapes (n, 3)."""
    R = np.abs(rows[:, ROTATION:].reshape(-1, 3, 3))
    half = np.where(rows[:, TYPE, None] == BOX, rows[:, SIZE : SIZE + 3], 0.0)
    half[:, 2] += np.where(rows[:, TYPE] == CAPSULE, rows[:, SIZE + 1], 0.0)
    radius = np.where(rows[:, TYPE] == BOX, 0.0, rows[:, SIZE])
    reach = np.einsum("nij,nj->ni", R, half) + radius[:, None]
    centre = rows[:, CENTRE : CENTRE + 3]
    return centre - reach, centre + reach


def _outside(
    environment: EnvironmentFile, owner: NDArray[np.str_], lows: FloatArray, highs: FloatArray
) -> tuple[str, ...]:
    """Return what is farther than `REACH` from every base position, by the axes of the grid.

    Nothing is said of a robot on a mount, whose base positions are in the mount's frame.
    """
    if environment.mount is not None:
        return ()
    grid = Grid.from_spec(environment.grid, where=f"environment '{environment.name}', field 'grid'")
    axes = {axis.name: axis.values for axis in grid.axes}
    if not {"base_x", "base_y"} <= axes.keys():
        return ()
    found = []
    for entry in environment.placed:
        rows = owner == entry.name
        if not rows.any():
            continue
        gaps = []
        for k, name in enumerate(("base_x", "base_y")):
            low, high = float(axes[name].min()), float(axes[name].max())
            least, greatest = float(lows[rows, k].min()), float(highs[rows, k].max())
            gaps.append(max(least - high, low - greatest, 0.0))
        if math.hypot(*gaps) > REACH:
            found.append(entry.name)
    return tuple(found)
