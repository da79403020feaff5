"""Table files: a table whose legs a laser scanner can find."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, model_validator

from tcs.errors import EnvironmentFileError
from tcs.files.documents import Document, Position, Size, read_document
from tcs.files.paths import DataFiles
from tcs.perception.planar_pose import PlanarPose


class Leg(Document):
    """A leg that stands on the floor, its sides parallel to the axes of F."""

    name: str = Field(min_length=1)
    xy: tuple[Position, Position]
    """Centre in F [m]."""
    size: tuple[Size, Size]
    """Full sizes along x and y [m]."""


class TableFile(Document):
    """Content of a table file.

    F is the frame of the table: on the floor below the middle of the front edge, x into the table,
    y along the edge to the left, z up.
    """

    name: str = Field(min_length=1)
    title: str
    source: str
    size: tuple[Size, Size, Size]
    """Depth, width and height [m]."""
    thickness: Size
    """Thickness of the table top [m]."""
    legs: Annotated[tuple[Leg, ...], Field(min_length=2, max_length=16)]

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        names = [leg.name for leg in self.legs]
        if len(set(names)) < len(names):
            raise ValueError("two legs have the same name; rename one")
        if self.thickness >= self.size[2]:
            raise ValueError("the table top is thicker than the table is high")
        return self

    def boxes(self, pose: PlanarPose) -> list[dict[str, object]]:
        """Return top and legs as obstacles of an environment file.

        Args:
            pose: X_WF, the pose of the table in the environment.
        """
        depth, width, height = self.size
        below = height - self.thickness
        top = ("table top", (0.5 * depth, 0.0), (depth, width), below + 0.5 * self.thickness)
        parts = [(*top, self.thickness)]
        parts += [(leg.name, leg.xy, leg.size, 0.5 * below, below) for leg in self.legs]
        obstacles: list[dict[str, object]] = []
        for name, xy, size, middle, tall in parts:
            at = pose @ PlanarPose(*xy, 0.0)
            obstacles.append(
                {
                    "name": name if name == "table top" else f"table leg {name}",
                    "box": (*size, tall),
                    "xyz": (at.x, at.y, middle),
                    "rpy_deg": (0.0, 0.0, math.degrees(at.yaw)),
                }
            )
        return obstacles


TABLES = DataFiles("table", "models/tables/*.yaml")


def load_table(name_or_path: str | Path) -> TableFile:
    """Return a table.

    Args:
        name_or_path: Name of a table that ships with `tcs`, or the path of a file: a text that ends
            in `.yaml` or contains a path separator.

    Raises:
        UnknownNameError: If no table of that name ships, or a key in the file is unknown.
        EnvironmentFileError: If the file cannot be used.

    >>> len(load_table("thesis").legs)
    4
    """
    path = TABLES.path(name_or_path)
    return read_document(path, TableFile, f"table file '{path}'", EnvironmentFileError)
