"""Goals all over a surface: points on the shapes of a body that the tool can be next to."""

from __future__ import annotations

import dataclasses
import math
from typing import NamedTuple

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from scipy.spatial import cKDTree

from tcs.errors import TaskError, UnknownNameError
from tcs.files.quantities import GOALS
from tcs.kernel.arrays import BOX, SPHERE, FloatArray, IntArray
from tcs.model.diagrams import diagram_builder
from tcs.model.scene.contacts import shape_of
from tcs.model.scene.environment.environment_file import WORLD, EnvironmentFile
from tcs.model.scene.environment.plant import add_environment, environment_parts
from tcs.model.tasks import Goal, Surface, Task
from tcs.model.tasks.surface import FACING, PARTS

FINER = 3
"""Candidates are this many times as close as goals, so that these can be as close as asked for."""
FREE = 0.5
"""Goals are at least this part of their distance from the surface away from other shapes."""
OPPOSITE = -0.5
"""Cosine of the angle between normals from which on two places are on opposite sides."""
_ALONG = np.array([0.0, 0.0, 1.0])


class _Solid(NamedTuple):
    """A shape of the environment, in the state of its file."""

    type: int
    size: FloatArray
    """Sizes as in the kernel [m], shape (3,)."""
    pad: float
    link: str
    X_WS: RigidTransform


class _Candidates(NamedTuple):
    """Points on a surface, shapes (n, 3)."""

    p_W: FloatArray
    """Positions in W [m]."""
    n_W: FloatArray
    """Outward unit normals."""


def with_surface_goals(task: Task, environment: EnvironmentFile) -> Task:
    """Return a task whose surfaces are covered with goals; one without surfaces is unchanged.

    The goals of a surface are on the padded shapes of its body frames, off them by `distance`, with
    x of the tool along the normal and y across the z axis of W. No two are closer than the spacing,
    but on opposite sides of something thin, and no place is farther than that from one. Places
    within another shape, or whose goal is close to another one, get none: what is covered by other
    parts, a seat or a mattress in the state of the environment's file is not wiped.

    Args:
        task: The task.
        environment: The environment, its person of any size.

    Raises:
        UnknownNameError: If a body frame does not exist.
        TaskError: If a surface has no exposed place, or there are too many goals.
    """
    if not task.surfaces:
        return task
    where = f"task '{task.name}', environment '{environment.name}', surface"
    solids, X_WL = _solids(environment)
    goals = list(task.goals)
    for number, surface in enumerate(task.surfaces):
        here = f"{where} '{surface.body}'"
        known = (*environment.body_frames, *PARTS)
        for name in surface.frames:
            if name not in environment.body_frames:
                raise UnknownNameError("body frame", name, known, where=f"{where} {number}")
        goals += _goals_on(surface, environment, solids, X_WL, here)
    if len(goals) > GOALS.high:
        wider = max(s.spacing for s in task.surfaces) * math.sqrt(len(goals) / GOALS.high)
        raise TaskError(
            f"{where}: {len(goals):,} goals, but at most {int(GOALS.high):,} are allowed. Take "
            f"a spacing of {math.ceil(wider * 1.05e3) / 1e3:g} m or more, or a smaller part."
        )
    return dataclasses.replace(task, goals=tuple(goals), surfaces=())


def _goals_on(
    surface: Surface,
    environment: EnvironmentFile,
    solids: list[_Solid],
    X_WL: dict[str, RigidTransform],
    where: str,
) -> list[Goal]:
    """Return the goals of one surface."""
    links = {environment.body_frames[name]: name for name in surface.frames}
    own = [solid for solid in solids if solid.link in links and solid.link != WORLD]
    found: list[tuple[str, _Candidates]] = []
    for solid in own:
        points = _surface_of(solid, surface.spacing / FINER)
        at = points.p_W + surface.distance * points.n_W
        exposed = np.ones(len(at), dtype=np.bool_)
        if surface.facing is not None:
            facing = X_WL[solid.link].rotation().matrix() @ surface.facing
            exposed = points.n_W @ facing >= math.cos(FACING) - 1e-9
        for other in solids:
            if other is not solid:
                # Shapes overlap where they join: a place there belongs to the outer one.
                exposed &= distances(other, points.p_W) > -1e-9
                nearest = distances(other, at[exposed])
                exposed[exposed] = nearest >= FREE * surface.distance
        found.append((links[solid.link], _Candidates(points.p_W[exposed], points.n_W[exposed])))
    p_W = np.concatenate([p for _, (p, _) in found] or [np.empty((0, 3))])
    n_W = np.concatenate([n for _, (_, n) in found] or [np.empty((0, 3))])
    chosen = _apart(_Candidates(p_W, n_W), surface.spacing)
    if not chosen.size:
        raise TaskError(
            f"{where}: nothing of it is exposed by {surface.distance:g} m. Give a smaller "
            "'distance', or another body frame."
        )
    frames = np.repeat([name for name, _ in found], [len(p) for _, (p, _) in found])
    sign = -1.0 if surface.normal == "inward" else 1.0
    goals = []
    for i in chosen:
        X_WG = RigidTransform(_tool(sign * n_W[i]), p_W[i] + surface.distance * n_W[i])
        X_LG = X_WL[environment.body_frames[frames[i]]].inverse() @ X_WG
        goals.append(
            Goal(
                body_frame=str(frames[i]),
                position=X_LG.translation(),
                quaternion=X_LG.rotation().ToQuaternion().wxyz(),
                weight=surface.weight / chosen.size,
                free=surface.free,
                arm=surface.arm,
                tool=surface.tool,
                approach=surface.approach,
                retreat=surface.retreat,
            )
        )
    return goals


def _solids(environment: EnvironmentFile) -> tuple[list[_Solid], dict[str, RigidTransform]]:
    """Return the shapes of an environment in the state of its file, and the poses of its links."""
    builder = diagram_builder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    added = add_environment(plant, environment)
    plant.Finalize()
    inspector = scene_graph.model_inspector()
    parts = environment_parts(plant, inspector, added, environment)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    query = scene_graph.get_query_output_port().Eval(scene_graph.GetMyContextFromRoot(context))
    state = plant.GetMyContextFromRoot(context)
    link_of = {body.index(): name for name, body in added.links.items()}
    solids = [
        _Solid(
            *_typed(shape_of(inspector, part)),
            part.pad,
            link_of.get(part.body, WORLD),
            query.GetPoseInWorld(part.geometry),
        )
        for part in parts
    ]
    poses = {name: plant.EvalBodyPoseInWorld(state, body) for name, body in added.links.items()}
    return solids, {**poses, WORLD: RigidTransform()}


def _typed(found: tuple[int, tuple[float, float, float]]) -> tuple[int, FloatArray]:
    return found[0], np.array(found[1])


def _surface_of(solid: _Solid, step: float) -> _Candidates:
    """Return points of a padded surface about a step apart [m]."""
    if solid.type == BOX:
        p, n = _on_box(solid.size, solid.pad, step)
    else:
        half = 0.0 if solid.type == SPHERE else float(solid.size[1])
        p, n = _on_capsule(float(solid.size[0]) + solid.pad, half, step)
    R = solid.X_WS.rotation().matrix()
    return _Candidates(p @ R.T + solid.X_WS.translation(), n @ R.T)


def _on_box(half: FloatArray, pad: float, step: float) -> tuple[FloatArray, FloatArray]:
    """Return points on the faces of a box moved outward by its padding, and their normals."""
    points, normals = [], []
    # Large faces first: a thin edge gets a goal only where theirs leave a gap.
    for axis in np.argsort(half):
        others = [k for k in range(3) if k != axis]
        lines = [_spaced(float(half[k]), step) for k in others]
        grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 2)
        for side in (-1.0, 1.0):
            face = np.empty((len(grid), 3))
            face[:, others], face[:, axis] = grid, side * (half[axis] + pad)
            normal = np.zeros((len(grid), 3))
            normal[:, axis] = side
            points.append(face)
            normals.append(normal)
    return np.concatenate(points), np.concatenate(normals)


def _on_capsule(radius: float, half: float, step: float) -> tuple[FloatArray, FloatArray]:
    """Return points on a capsule along z, a sphere if it has no length, and their normals."""
    normals, centres = [], []
    rings = max(2, math.ceil(0.5 * math.pi * radius / step))
    for k, height in enumerate(np.linspace(0.0, 0.5 * math.pi, rings + 1)):
        across = radius * math.cos(height)
        count = max(1, math.ceil(2.0 * math.pi * across / step)) if k < rings else 1
        angle = 2.0 * math.pi * np.arange(count) / count
        c, s = math.cos(height), math.sin(height)
        ring = np.stack([c * np.cos(angle), c * np.sin(angle), np.full(count, s)], axis=1)
        for side in (-1.0, 1.0):
            normals.append(ring * [1.0, 1.0, side])
            centres.append(np.full(count, side * half))
        if k == 0:
            for z in _spaced(half, step)[1:-1]:
                normals.append(ring)
                centres.append(np.full(count, z))
    n = np.concatenate(normals)
    return radius * n + np.concatenate(centres)[:, None] * _ALONG, n


def _spaced(half: float, step: float) -> FloatArray:
    """Return values from -half to half, both included, at most a step apart [m]."""
    return np.linspace(-half, half, max(1, math.ceil(2.0 * half / step)) + 1)


def distances(solid: _Solid, p_W: FloatArray) -> FloatArray:
    """Return the signed distances of points from a padded shape [m], shape (n,)."""
    X_SW = solid.X_WS.inverse()
    p = p_W @ X_SW.rotation().matrix().T + X_SW.translation()
    if solid.type == BOX:
        beyond = np.abs(p) - solid.size
        outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
        return np.asarray(outside + np.minimum(beyond.max(axis=1), 0.0) - solid.pad)
    half = 0.0 if solid.type == SPHERE else solid.size[1]
    p[:, 2] -= np.clip(p[:, 2], -half, half)
    return np.asarray(np.linalg.norm(p, axis=1) - solid.size[0] - solid.pad)


def _apart(points: _Candidates, spacing: float) -> IntArray:
    """Return the indices of points that are a spacing apart, and leave none farther than that.

    Points on opposite sides of something thin may be closer.
    """
    near = cKDTree(points.p_W)
    free = np.ones(len(points.p_W), dtype=np.bool_)
    chosen = []
    for i in range(len(free)):
        if free[i]:
            chosen.append(i)
            close = np.array(near.query_ball_point(points.p_W[i], spacing * (1.0 - 1e-9)))
            free[close[points.n_W[close] @ points.n_W[i] > OPPOSITE]] = False
    return np.array(chosen, dtype=np.int64)


def _tool(x: FloatArray) -> RotationMatrix:
    """Return a rotation with that x axis, and y across the z axis of W or, along it, across x."""
    across = np.cross(_ALONG, x)
    if float(np.linalg.norm(across)) < 0.1:
        across = np.cross([1.0, 0.0, 0.0], x)
    y = across / np.linalg.norm(across)
    return RotationMatrix(np.column_stack([x, y, np.cross(x, y)]))
