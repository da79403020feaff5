"""Whether a robot's primitives enclose its meshes, and how much room they take beyond them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcs.model.robots.fitting.bounding import hull_volume
from tcs.model.robots.primitives import Primitive, enclosed, union_volume
from tcs.model.robots.robot_file import RobotFile
from tcs.model.robots.urdf import Urdf
from tcs.model.robots.urdf.surfaces import body_triangles, welded_top

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class BodyEnclosure:
    """How one body's primitives sit around the surface they have to enclose.

    Attributes:
        body: The body that carries the primitives.
        members: Bodies whose surface they have to enclose: its own, and what is welded to it and
            carries none.
        triangles: How many triangles those surfaces have.
        outside: How many of them lie wholly in no primitive.
        farthest: How far the worst of these stands out of the primitive that holds it best [m];
            infinite where the body has no primitive.
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
        """Volume of the primitives together over that of the hull."""
        return self.union / self.hull


def enclosure(robot: RobotFile) -> tuple[BodyEnclosure, ...]:
    """Return how the primitives of every body with a surface enclose it.

    Raises:
        RobotError: If the URDF, a mesh or the primitives cannot be used.
    """
    return tuple(
        _measured(body, members, shapes, surface)
        for body, (members, shapes, surface) in surfaces_to_enclose(robot).items()
    )


def surfaces_to_enclose(
    robot: RobotFile,
) -> Mapping[str, tuple[tuple[str, ...], tuple[Primitive, ...], FloatArray]]:
    """Return what each body's primitives have to enclose.

    Returns:
        By body: the bodies concerned, its primitives, and the triangles in its frame [m], shape
        (n, 3, 3).

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
            np.concatenate([_seen_from(model, carrier, b, triangles[b]) for b in bodies]),
        )
        for carrier, bodies in members.items()
    }


def _carrier(model: Urdf, body: str, shapes: Mapping[str, object]) -> str:
    """Return the body whose primitives have to enclose a body: itself, or one welded to it."""
    if body in shapes:
        return body
    top, _, _ = welded_top(model, body)
    welded = (c for c in shapes if c in model.links and welded_top(model, c)[0] == top)
    return next(welded, body)


def _seen_from(model: Urdf, carrier: str, body: str, triangles: FloatArray) -> FloatArray:
    """Return a body's triangles in the frame of a body that it is welded to, or is."""
    if carrier == body:
        return triangles
    _, R_AB, p_AB = welded_top(model, body)
    _, R_AC, p_AC = welded_top(model, carrier)
    return np.asarray((triangles @ R_AB.T + p_AB - p_AC) @ R_AC)


def _measured(
    body: str, members: tuple[str, ...], shapes: tuple[Primitive, ...], surface: FloatArray
) -> BodyEnclosure:
    out = surface[~enclosed(shapes, surface)]
    farthest = 0.0
    if len(out):
        # A triangle is as far out of a convex shape as its farthest corner.
        beyond = [shape.distance(out).max(axis=1) for shape in shapes]
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
