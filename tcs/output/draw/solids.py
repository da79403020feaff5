"""Convex solids of pictures, each of a category with a colour."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from tcs.errors import TcsError
from tcs.kernel.arrays import BOX, CAPSULE, SPHERE
from tcs.output.draw import colours

FloatArray = NDArray[np.float64]

_ROUND = 16
"""Corners around a round shape: no visible edges at the size of a limb."""


class Category(Enum):
    """Category of a solid, with its name in a legend and its colour."""

    FURNITURE = ("furniture", colours.FURNITURE)
    PERSON = ("person", colours.PERSON)
    ROBOT = ("robot", colours.ROBOT)
    ARM = ("scored arm", colours.ARM)
    GOAL = ("goals", colours.GOAL)
    CURRENT_GOAL = ("goal shown", colours.CURRENT_GOAL)

    @property
    def label(self) -> str:
        """Name in a legend."""
        return self.value[0]

    @property
    def colour(self) -> str:
        """Colour, as matplotlib reads it."""
        return self.value[1]


@dataclass(frozen=True, eq=False)
class Solid:
    """The convex hull of some corners."""

    category: Category
    corners: FloatArray
    """Corners in the frame of the picture [m], shape (n, 3), not all in one plane."""

    @classmethod
    def placed(cls, category: Category, corners: FloatArray, R: FloatArray, p: FloatArray) -> Solid:
        """Return the solid of corners given in their own frame S.

        Args:
            category: The category.
            corners: Corners in their own frame S [m], shape (n, 3).
            R: R_WS, orientation of S in the frame of the picture, shape (3, 3).
            p: p_WoSo_W, origin of S there [m], shape (3,).
        """
        return cls(category, corners @ np.asarray(R).T + np.asarray(p))

    @cached_property
    def triangles(self) -> FloatArray:
        """The surface as triangles, counter-clockwise from outside [m], shape (m, 3, 3)."""
        hull = ConvexHull(self.corners)
        triangles = self.corners[hull.simplices]
        edges = triangles[:, 1:] - triangles[:, :1]
        inward = np.einsum("ij,ij->i", np.cross(edges[:, 0], edges[:, 1]), hull.equations[:, :3])
        triangles[inward < 0.0] = triangles[inward < 0.0][:, ::-1]
        return np.asarray(triangles)

    @cached_property
    def footprint(self) -> FloatArray:
        """Its outline from above: corners of a convex polygon [m], in order, shape (k, 2)."""
        return outline(self.corners[:, :2])


def outline(points: FloatArray) -> FloatArray:
    """Return the corners of the convex hull of points in the plane, in order, shape (k, 2)."""
    return np.asarray(points[ConvexHull(points).vertices])


def primitive_corners(shape: int, size: tuple[float, float, float]) -> FloatArray:
    """Return corners of a collision shape in its own frame [m], shape (n, 3).

    Args:
        shape: `SPHERE`, `CAPSULE` or `BOX` of the kernel.
        size: Its sizes in the kernel's terms: radius; radius, half length; half sizes [m].

    Raises:
        TcsError: If there is no such shape.

    >>> primitive_corners(BOX, (1.0, 2.0, 3.0)).max(axis=0).tolist()
    [1.0, 2.0, 3.0]
    """
    if shape == BOX:
        signs = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T
        return np.asarray(signs * np.array(size))
    if shape not in (SPHERE, CAPSULE):
        raise TcsError(f"shape {shape} cannot be drawn; must be a sphere, capsule or box.")
    half_length = size[1] if shape == CAPSULE else 0.0
    sphere = size[0] * _unit_sphere()
    cap = sphere[sphere[:, 2] >= 0.0] + np.array([0.0, 0.0, half_length])
    return np.concatenate([cap, cap * np.array([1.0, 1.0, -1.0])])


def _unit_sphere() -> FloatArray:
    """Return points on a unit sphere along circles of latitude, poles included."""
    around = np.linspace(0.0, 2.0 * np.pi, _ROUND, endpoint=False)
    up = np.linspace(0.0, np.pi / 2.0, _ROUND // 4 + 1)
    rings = [
        np.stack([np.cos(a) * np.cos(around), np.cos(a) * np.sin(around), np.full(_ROUND, s)], 1)
        for a, s in zip(up[:-1], np.sin(up[:-1]), strict=True)
    ]
    upper = np.concatenate([*rings, [[0.0, 0.0, 1.0]]])
    return np.concatenate([upper, upper * np.array([1.0, 1.0, -1.0])])
