"""The volume that an arm sweeps on a motion, as one mesh."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.tree import BodyIndex
from scipy.spatial import ConvexHull

from tcs.kernel.arrays import FloatArray
from tcs.model.scene import Scene
from tcs.model.scene.contacts import Group, shape_of
from tcs.output.draw import primitive_corners

SPACING = 0.05
"""Greatest motion of a corner of the arm between two postures of the mesh [m]."""

Mesh = tuple[FloatArray, NDArray[np.int32]]
"""Corners in W [m], shape (3, n), and triangles, shape (3, m)."""


def swept_mesh(scene: Scene, postures: Iterable[FloatArray]) -> Mesh:
    """Return the hulls of the arm's bodies at postures along a motion.

    Args:
        scene: The scene, at the stop; the arm is moved.
        postures: Joint angles along the motion [rad], each of shape (7,), far closer together than
            `SPACING`; those in between are left out.
    """
    hulls = _hulls(scene)
    corners: list[FloatArray] = []
    for q in postures:
        scene.set_arm(q)
        now = np.concatenate([_placed(scene, body, points) for body, points, _ in hulls])
        if not corners or np.linalg.norm(now - corners[-1], axis=1).max() >= SPACING:
            corners.append(now)
    sizes = np.cumsum([0, *(len(points) for _, points, _ in hulls)])
    faces = np.concatenate(
        [faces + first for (_, _, faces), first in zip(hulls, sizes[:-1], strict=True)]
    )
    all_faces = np.concatenate([faces + n * sizes[-1] for n in range(len(corners))])
    points = np.concatenate(corners)
    return np.asfortranarray(points.T), np.asfortranarray(all_faces.T.astype(np.int32))


def _hulls(scene: Scene) -> list[tuple[BodyIndex, FloatArray, NDArray[np.intp]]]:
    """Return for each body of the arm the corners [m] and triangles of a hull of its shapes."""
    inspector = scene.built.scene_graph.model_inspector()
    points: dict[BodyIndex, list[FloatArray]] = {}
    for part in scene.built.parts:
        if part.group is Group.ARM:
            X_LG = inspector.GetPoseInFrame(part.geometry)
            corners = primitive_corners(*shape_of(inspector, part))
            points.setdefault(part.body, []).append(X_LG.multiply(corners.T).T)
    hulls = []
    for body, parts in points.items():
        every = np.concatenate(parts)
        hull = ConvexHull(every)
        number = np.zeros(len(every), dtype=np.intp)
        number[hull.vertices] = np.arange(len(hull.vertices))
        hulls.append((body, every[hull.vertices], number[hull.simplices]))
    return hulls


def _placed(scene: Scene, body: BodyIndex, points: FloatArray) -> FloatArray:
    plant = scene.built.plant
    X_WL = plant.EvalBodyPoseInWorld(scene.plant_context, plant.get_body(body))
    return np.asarray(X_WL.multiply(points.T).T)
