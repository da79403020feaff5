"""Whether the primitives of a robot enclose its meshes, and how much volume they add."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcs.model.robots.cutting import cut
from tcs.model.robots.fitting.bounding import hull_volume
from tcs.model.robots.primitives import Primitive, enclosed, union_volume
from tcs.model.robots.robot_file import RobotFile
from tcs.model.robots.urdf import Urdf
from tcs.model.robots.urdf.surfaces import body_triangles, welded_top

FloatArray = NDArray[np.float64]

_SPACING = 0.01
"""Spacing of the points that measure how far a surface protrudes [m]."""


@dataclass(frozen=True, slots=True)
class BodyEnclosure:
    """How well the primitives of one body enclose the surface assigned to them.

    Attributes:
        body: The body that carries the primitives.
        members: Bodies whose surface they must enclose: the body itself, and bodies that are welded
            to it and have no primitives of their own.
        triangles: Number of triangles of those surfaces.
        outside: Number of triangles that do not lie wholly in the union of the primitives.
        farthest: Largest distance of a point of such a triangle from the primitive nearest to it,
            with points at most a centimetre apart [m]; infinite if the body has no primitive.
        hull: Volume of the convex hull of the surfaces [m^3].
        union: Volume of the primitives together [m^3].
    """

    body: str
    members: tuple[str, ...]
    triangles: int
    outside: int
    farthest: float
    hull: float
    union: float

    @property
    def excess(self) -> float:
        """Volume of the union of the primitives over that of the hull."""
        return self.union / self.hull


def enclosure(robot: RobotFile) -> tuple[BodyEnclosure, ...]:
    """Return how well the primitives of every body with a surface enclose it.

    Raises:
        RobotError: If the URDF, a mesh or the primitives cannot be used.
    """
    return tuple(
        _body_enclosure(body, members, shapes, surface)
        for body, (members, shapes, surface) in surfaces_to_enclose(robot).items()
    )


def surfaces_to_enclose(
    robot: RobotFile,
) -> Mapping[str, tuple[tuple[str, ...], tuple[Primitive, ...], FloatArray]]:
    """Return the surface that the primitives of each body must enclose.

    Returns:
        By body: the bodies whose surface it is, the primitives, and the triangles in the frame of
        the body [m], shape (n, 3, 3).

    Raises:
        RobotError: If the URDF, a mesh or the primitives cannot be used.
    """
    model = robot.model()
    shapes: dict[str, tuple[Primitive, ...]] = {}
    for shape in robot.load_primitives():
        shapes[shape.body] = (*shapes.get(shape.body, ()), shape)
    members: dict[str, list[str]] = {}
    triangles = body_triangles(model)
    for body in triangles:
        members.setdefault(_carrier(model, body, shapes), []).append(body)
    return {
        carrier: (
            tuple(bodies),
            shapes.get(carrier, ()),
            np.concatenate([_in_frame_of(model, carrier, b, triangles[b]) for b in bodies]),
        )
        for carrier, bodies in members.items()
    }


def _carrier(model: Urdf, body: str, shapes: Mapping[str, object]) -> str:
    """Return the body whose primitives must enclose a body: itself, or one welded to it."""
    if body in shapes:
        return body
    top, _, _ = welded_top(model, body)
    welded = (c for c in shapes if c in model.links and welded_top(model, c)[0] == top)
    return next(welded, body)


def _in_frame_of(model: Urdf, carrier: str, body: str, triangles: FloatArray) -> FloatArray:
    """Return the triangles of a body in the frame of a carrier welded to it, or of itself."""
    if carrier == body:
        return triangles
    _, R_AB, p_AB = welded_top(model, body)
    _, R_AC, p_AC = welded_top(model, carrier)
    return np.asarray((triangles @ R_AB.T + p_AB - p_AC) @ R_AC)


def _body_enclosure(
    body: str, members: tuple[str, ...], shapes: tuple[Primitive, ...], surface: FloatArray
) -> BodyEnclosure:
    out = surface[~enclosed(shapes, surface)]
    farthest = 0.0
    if len(out):
        points = np.unique(cut(out, _SPACING).reshape(-1, 3), axis=0)
        beyond = [shape.distance(points) for shape in shapes]
        farthest = float(np.min(beyond, axis=0).max()) if beyond else float("inf")
    return BodyEnclosure(
        body=body,
        members=members,
        triangles=len(surface),
        outside=len(out),
        farthest=farthest,
        hull=hull_volume(surface),
        union=union_volume(shapes),
    )
