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
from tcs.output.view.shapes import TriangleMesh, joined

SPACING = 0.05
"""Greatest motion of a corner of a body between two places at which the mesh has it [m]."""


def swept_mesh(scene: Scene, postures: Iterable[FloatArray]) -> TriangleMesh:
    """Return the hulls of the arm's bodies in W at postures along a motion.

    Each body is left out where none of its corners has moved by `SPACING` since it was last shown:
    the shoulder, which has most corners, moves least.

    Args:
        scene: The scene, at the stop; the arm is moved.
        postures: Joint angles along the motion [rad], each of shape (7,), far closer together than
            `SPACING`.
    """
    hulls = _hulls(scene)
    places: list[list[FloatArray]] = [[] for _ in hulls]
    for q in postures:
        scene.set_arm(q)
        for (body, corners, _), shown in zip(hulls, places, strict=True):
            now = _placed(scene, body, corners)
            if not shown or np.linalg.norm(now - shown[-1], axis=0).max() >= SPACING:
                shown.append(now)
    return joined(
        [
            (corners, faces)
            for (_, _, faces), shown in zip(hulls, places, strict=True)
            for corners in shown
        ]
    )


def _hulls(scene: Scene) -> list[tuple[BodyIndex, FloatArray, NDArray[np.int32]]]:
    """Return each body of the arm with the surface of a hull of its shapes in its frame."""
    inspector = scene.built.scene_graph.model_inspector()
    points: dict[BodyIndex, list[FloatArray]] = {}
    for part in scene.built.parts:
        if part.group is Group.ARM:
            X_LG = inspector.GetPoseInFrame(part.geometry)
            corners = primitive_corners(*shape_of(inspector, part))
            points.setdefault(part.body, []).append(X_LG.multiply(corners.T))
    hulls = []
    for body, parts in points.items():
        every = np.concatenate(parts, axis=1)
        hull = ConvexHull(every.T)
        number = np.zeros(every.shape[1], dtype=np.int32)
        number[hull.vertices] = np.arange(len(hull.vertices))
        hulls.append((body, every[:, hull.vertices], number[hull.simplices].T))
    return hulls


def _placed(scene: Scene, body: BodyIndex, points: FloatArray) -> FloatArray:
    plant = scene.built.plant
    X_WL = plant.EvalBodyPoseInWorld(scene.plant_context, plant.get_body(body))
    return np.asarray(X_WL.multiply(points))
