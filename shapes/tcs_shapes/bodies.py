"""Fit primitives to every body of a robot."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
from joblib import delayed
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tcs.errors import UnknownNameError
from tcs.model.robots.primitives import Primitive, enclosed, read_primitives, union_volume
from tcs.model.robots.robot_file import RobotFile
from tcs.model.robots.triangles import cut
from tcs.model.robots.urdf import Urdf
from tcs.model.robots.urdf.surfaces import (
    body_triangles,
    geometry_triangles,
    place,
    surface_geometries,
    welded_top,
)
from tcs_shapes.bounding import corner_points, enclose, hull_volume, moved
from tcs_shapes.covering import Fit, Part, Target, fit_triangles, refit_part
from tcs_shapes.processes import unordered

FloatArray = NDArray[np.float64]

# Random postures among boxes of 2 to 40 cm show how close the shapes must be: about 0.3 % of those
# that the meshes leave free are blocked for every millimetre by which the arm protrudes on average.
HAND = Target(protrusion=0.0035, max_shapes=48)
"""Goals are 1-4 cm from the skin: a bulky hand would block goals that the real one reaches."""
ARM = Target(protrusion=0.005, max_shapes=40)
"""Links that the arm joints move."""
REST = Target(protrusion=0.008, max_shapes=40)
"""Base, torso and head: large and not convex."""
COARSE = {
    HAND: Target(protrusion=0.008, max_shapes=16),
    ARM: Target(protrusion=0.012, max_shapes=12),
    REST: Target(protrusion=0.02, max_shapes=12),
}
"""What replaces each of these for a quick draft."""

_SPACING = 0.01
"""Spacing of the points that measure how far a surface protrudes [m]."""


@dataclass(frozen=True, slots=True)
class BodyFit:
    """Primitives of one body, or of several that are welded together.

    Attributes:
        body: The body that carries the primitives.
        enclosed: Bodies whose triangles they enclose.
        fit: The primitives and their excess.
    """

    body: str
    enclosed: tuple[str, ...]
    fit: Fit


def fit_robot(
    robot: RobotFile,
    on_progress: Callable[[int, int], None] | None = None,
    chosen: Mapping[str, Target | None] = MappingProxyType({}),
    *,
    coarse: bool = False,
    jobs: int = 1,
) -> tuple[BodyFit, ...]:
    """Return primitives that enclose every triangle of a robot, body by body.

    The root and the bodies welded to it (a base with its wheels) are enclosed as one body. Bodies
    of the same shape, such as those of a left and a right arm, get the same primitives. A body that
    the URDF describes by a few boxes keeps them.

    Args:
        robot: The robot.
        on_progress: Called with the bodies done and all bodies.
        chosen: How closely some bodies are fitted if not as usual; None keeps the shapes that the
            primitives file has for a body.
        coarse: Whether a few shapes that protrude farther do for all other bodies.
        jobs: Number of processes; does not change the results.

    Raises:
        UnknownNameError: If `chosen` has a body that is not fitted, or one to keep without shapes.
        RobotError: If a mesh, or the primitives of a body to keep, cannot be read.
    """
    model = robot.model()
    triangles = body_triangles(model)
    apart = {body for body, target in chosen.items() if target is not None}
    groups = _groups(robot, model, triangles, apart)
    for body in chosen:
        if body not in groups:
            raise UnknownNameError("body", body, groups, where=f"bodies to fit of '{robot.name}'")
    kept = _shapes_by_body(robot) if None in chosen.values() else {}
    targets = _targets(robot, model, groups, chosen, coarse=coarse)
    own = {body: _welded_triangles(model, body, m, triangles) for body, m in groups.items()}
    keys = {
        body: _shape_key(model, body) if len(members) == 1 else body
        for body, members in groups.items()
    }
    first: dict[object, str] = {}
    for body, key in keys.items():
        if not (body in chosen and chosen[body] is None):
            first.setdefault(key, body)
    fits: dict[str, Fit] = {}
    tasks: list[tuple[str, FloatArray, Target]] = []
    for key, body in first.items():
        target = targets.get(key, COARSE[REST] if coarse else REST)
        boxes = _boxes_of_urdf(model, body, groups[body], target)
        if boxes is None:
            tasks.append((body, own[body], target))
        else:
            fits[body] = boxes
    fits |= _fitted(tasks, len(groups), on_progress, jobs)
    results = []
    for body, members in groups.items():
        source = first.get(keys[body])
        if body in chosen and chosen[body] is None:
            fit = _kept(robot, kept, body, own[body])
        elif source == body:
            fit = fits[body]
        else:
            assert source is not None
            known = (fits[source], *_key_frame(model, source))
            fit = _transferred(known, body, *_key_frame(model, body))
        results.append(BodyFit(body=body, enclosed=tuple(members), fit=fit))
    if on_progress is not None:
        on_progress(len(groups), len(groups))
    return tuple(results)


def _fitted(
    tasks: list[tuple[str, FloatArray, Target]],
    total: int,
    on_progress: Callable[[int, int], None] | None,
    jobs: int,
) -> dict[str, Fit]:
    """Return fits to triangles by body, the largest surfaces first."""
    tasks = sorted(tasks, key=lambda task: -len(task[1]))
    fits: dict[str, Fit] = {}
    done = total - len(tasks)
    if on_progress is not None:
        on_progress(done, total)
    calls = (delayed(_named_fit)(*task) for task in tasks)
    for body, fit in unordered(jobs, calls):
        fits[body] = fit
        if on_progress is not None:
            on_progress(done + len(fits), total)
    return fits


def _named_fit(body: str, triangles: FloatArray, target: Target) -> tuple[str, Fit]:
    return body, fit_triangles(body, triangles, target)


def refit(robot: RobotFile, targets: Mapping[str, Target]) -> tuple[Primitive, ...]:
    """Return the primitives of a robot's file, those of some bodies fitted again.

    More shapes follow a body more closely, and block fewer postures that its surface allows.

    Args:
        robot: The robot.
        targets: How closely each body to fit again is fitted.

    Raises:
        UnknownNameError: If the file has no primitive of a body.
        RobotError: If a mesh or the primitives cannot be read.
    """
    found = _shapes_by_body(robot)
    surfaces = surfaces_to_enclose(robot)
    for body, target in targets.items():
        _check_has_shapes(robot, found, body)
        _, _, surface = surfaces[body]
        found[body] = fit_triangles(body, surface, target).primitives
    return tuple(shape for fitted in found.values() for shape in fitted)


def refit_parts(
    robot: RobotFile,
    shapes: Sequence[Primitive],
    parts: Mapping[str, Sequence[Part]],
) -> tuple[Primitive, ...]:
    """Return primitives that enclose a robot, parts of some bodies fitted again one by one.

    Args:
        robot: The robot.
        shapes: Primitives that enclose it.
        parts: Parts by body.

    Raises:
        UnknownNameError: If a body has no primitive.
        RobotError: If a mesh cannot be read.
    """
    found = _by_body(shapes)
    surfaces = surfaces_to_enclose(robot)
    for body, some in parts.items():
        _check_has_shapes(robot, found, body)
        for part in some:
            found[body] = refit_part(body, surfaces[body][2], found[body], part)
    return tuple(shape for fitted in found.values() for shape in fitted)


def _targets(
    robot: RobotFile,
    model: Urdf,
    groups: Mapping[str, list[str]],
    chosen: Mapping[str, Target | None],
    *,
    coarse: bool,
) -> dict[object, Target]:
    """Return how closely bodies are fitted, by the key of their shape."""
    targets: dict[object, Target] = {}
    for body in groups:
        key = _shape_key(model, body)
        # The target of the scored arm holds for the other arm, which has the same shapes.
        targets[key] = min(
            targets.get(key, REST), _target(robot, model, body), key=lambda t: t.protrusion
        )
    if coarse:
        targets = {key: COARSE[target] for key, target in targets.items()}
    return targets | {_shape_key(model, body): target for body, target in chosen.items() if target}


def target_of(robot: RobotFile, body: str, most: int, patches: int = 0) -> Target:
    """Return how closely up to `most` shapes fit a body, with so many patches.

    Above the usual number, the more shapes, the less they may protrude.
    """
    usual = _target(robot, robot.model(), body)
    return Target(usual.protrusion * min(1.0, usual.max_shapes / most), most, patches)


def _shapes_by_body(robot: RobotFile) -> dict[str, tuple[Primitive, ...]]:
    """Return the shapes of the primitives file by body."""
    return _by_body(read_primitives(Path(robot.primitives)))


def _by_body(shapes: Iterable[Primitive]) -> dict[str, tuple[Primitive, ...]]:
    """Return shapes by body."""
    found: dict[str, tuple[Primitive, ...]] = {}
    for shape in shapes:
        found[shape.body] = (*found.get(shape.body, ()), shape)
    return found


def _check_has_shapes(robot: RobotFile, found: Mapping[str, object], body: str) -> None:
    """Raise UnknownNameError if the primitives file has no shape of a body."""
    if body not in found:
        raise UnknownNameError("body", body, found, where=f"primitives '{robot.primitives}'")


def _kept(
    robot: RobotFile, found: Mapping[str, tuple[Primitive, ...]], body: str, triangles: FloatArray
) -> Fit:
    """Return the fit that a body has in the primitives file."""
    _check_has_shapes(robot, found, body)
    shapes = found[body]
    return Fit(primitives=shapes, hull=hull_volume(triangles), union=union_volume(shapes))


def _target(robot: RobotFile, model: Urdf, body: str) -> Target:
    """Return how closely a body is fitted."""
    first, *_, last = robot.arm_joints
    if body in model.links_moved_by(last):
        return HAND
    return ARM if body in model.links_moved_by(first) else REST


def _groups(
    robot: RobotFile, model: Urdf, triangles: dict[str, FloatArray], apart: set[str]
) -> dict[str, list[str]]:
    """Return the bodies that are enclosed together, by the body that carries the primitives.

    Bodies welded to the root are enclosed as one, but for those to keep `apart`.
    """
    groups: dict[str, list[str]] = {}
    standing = [body for body in triangles if welded_top(model, body)[0] == robot.root_body]
    standing = [body for body in standing if body not in apart]
    if standing:
        volume = {body: float(np.ptp(triangles[body], axis=(0, 1)).prod()) for body in standing}
        groups[max(standing, key=lambda body: volume[body])] = standing
    return groups | {body: [body] for body in triangles if body not in standing}


def _welded_triangles(
    model: Urdf, body: str, members: list[str], triangles: dict[str, FloatArray]
) -> FloatArray:
    """Return the triangles of bodies welded together in the frame of one [m], shape (n, 3, 3)."""
    _, R_AB, p_AB = welded_top(model, body)
    pieces = []
    for member in members:
        _, R_AM, p_AM = welded_top(model, member)
        in_top = triangles[member] @ R_AM.T + p_AM
        pieces.append(triangles[member] if member == body else (in_top - p_AB) @ R_AB)
    return np.concatenate(pieces)


def _boxes_of_urdf(model: Urdf, body: str, members: list[str], target: Target) -> Fit | None:
    """Return the boxes of the URDF if it has only a few boxes for a body, else None."""
    # Each box once: visual and collision geometry are often the same.
    drawn = {
        (member, g.shape, g.size, g.xyz, g.rpy): (member, g)
        for member in members
        for g in surface_geometries(model, member)
    }.values()
    if len(drawn) > target.max_shapes or any(g.shape != "box" for _, g in drawn):
        return None
    shapes, pieces = [], []
    _, R_AB, _ = welded_top(model, body)
    for member, geometry in drawn:
        own = place(geometry_triangles(geometry), geometry.xyz, geometry.rpy)
        triangles = _welded_triangles(model, body, [member], {member: own})
        _, R_AM, _ = welded_top(model, member)
        R_BG = R_AB.T @ R_AM @ Rotation.from_euler("xyz", geometry.rpy).as_matrix()
        shapes.append(enclose(body, corner_points(triangles), "box", R_BG))
        pieces.append(triangles)
    hull = hull_volume(np.concatenate(pieces))
    return Fit(primitives=tuple(shapes), hull=hull, union=union_volume(shapes))


def _key_frame(model: Urdf, body: str) -> tuple[FloatArray, FloatArray]:
    """Return the pose of the first geometry in its body: R of shape (3, 3), p of shape (3,)."""
    first = surface_geometries(model, body)[0]
    return Rotation.from_euler("xyz", first.rpy).as_matrix(), np.array(first.xyz)


def _shape_key(model: Urdf, body: str) -> object:
    """Return a key that is equal for bodies of the same shape, wherever their frame is."""
    R, p = _key_frame(model, body)
    keys = set()
    for geometry in surface_geometries(model, body):
        corners = place(geometry_triangles(geometry)[:1], geometry.xyz, geometry.rpy)
        in_key_frame = np.round((corners - p) @ R, 6) + 0.0
        keys.add((geometry.shape, geometry.mesh, geometry.size, in_key_frame.tobytes()))
    return frozenset(keys)


def _transferred(
    known: tuple[Fit, FloatArray, FloatArray], body: str, R: FloatArray, p: FloatArray
) -> Fit:
    """Return the fit of a body of the same shape, rotated to this body."""
    fit, R_known, p_known = known
    R_step = R @ R_known.T
    shapes = (moved(shape, body, R_step, p - R_step @ p_known) for shape in fit.primitives)
    return replace(fit, primitives=tuple(shapes))


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
