"""Goals on the body of a resized person: as far from the skin as on the papers' average man."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from tcs.kernel.arrays import FloatArray
from tcs.model.scene.environment.environment_file import EnvironmentFile
from tcs.model.scene.person.resized import covers_of, padding_of, person_shapes, scales_of
from tcs.model.scene.person.shapes import LinkShape
from tcs.model.tasks import GoalPose, Task

CLEAR = 0.002
"""How much farther than the nearest shape of its link the others have to stay from a goal [m]."""
STIFF = 0.01
"""Weight of the motion along the skin against what is missing to these distances: a tenth of it is
left where normals differ by 20 degrees."""


def goals_on_person(task: Task, environment: EnvironmentFile) -> Task:
    """Return a task with its goals moved to the body of the person of an environment.

    A goal on a link of the person belongs to the nearest point of the link's shapes. On the resized
    link it is beside where this point is mapped to, in the same direction, and as far in that
    direction from the padded shapes that enclose the mapped one. Where another shape of the link
    would be nearer, so that the skin beside the goal would be another, the goal moves along the
    skin, away from that shape. Its orientation in the body frame and its straight motions stay.

    Args:
        task: A task for the papers' man.
        environment: An environment; without a resized person the task itself is returned.

    Raises:
        TcsError: If the person or their model is not valid.
    """
    scales = scales_of(environment)
    if not scales:
        return task
    shapes = person_shapes(environment)

    def on_person(pose: GoalPose) -> GoalPose:
        link = environment.body_frames.get(pose.body_frame, "")
        if link not in scales:
            return pose
        grown = padding_of(environment, link, scales) - padding_of(environment, link, {})
        covers = covers_of(environment, link, shapes[link], scales[link])
        position = Anchor.of(pose, shapes[link]).position(scales[link], covers, grown)
        return dataclasses.replace(pose, position=position)

    goals = tuple(goal.at([on_person(pose) for pose in goal.poses]) for goal in task.goals)
    return dataclasses.replace(task, goals=goals)


@dataclasses.dataclass(frozen=True, eq=False)
class Anchor:
    """The place of a goal among the shapes of its link, of which it belongs to the nearest."""

    shape: int
    """Number of the nearest shape of the link of the papers' man."""
    distances: FloatArray
    """Signed distances of the goal from all shapes of the link [m], shape (shapes,)."""
    surface: FloatArray
    """The nearest point, in the frame of the link [m], shape (3,)."""
    normals: FloatArray
    """Outward normals at the nearest points of all shapes, in the frame of the link, shape
    (shapes, 3)."""

    @classmethod
    def of(cls, goal: GoalPose, shapes: Sequence[LinkShape]) -> Self:
        """Return the anchor of a goal on the shapes of its link."""
        near = [shape.nearest(goal.position) for shape in shapes]
        distances = np.array([distance for distance, _, _ in near])
        number = int(np.argmin(distances))
        surface = shapes[number].p_LoSo_L + shapes[number].R_LS @ near[number][1]
        normals = [shape.R_LS @ normal for shape, (_, _, normal) in zip(shapes, near, strict=True)]
        return cls(number, distances, surface, np.array(normals))

    def position(
        self, scale: ArrayLike, covers: Sequence[Sequence[LinkShape]], padding: ArrayLike
    ) -> FloatArray:
        """Return the position of the goal on a resized link [m], shape (..., 3).

        Args:
            scale: How the link is stretched, shape (..., 3): of one person or of many.
            covers: What encloses each of its shapes.
            padding: By how much the padding of the link grows [m], shape (...).
        """
        normal, mapped = self.normals[self.shape], np.array(scale) * self.surface
        # Height of the goal over the origin of the link, along the normal of each shape.
        outward = [
            np.max([one.reach(along) for one in cover], axis=0)
            for along, cover in zip(self.normals, covers, strict=True)
        ]
        least = np.minimum(self.distances, self.distances[self.shape] + CLEAR)
        height = np.stack(np.broadcast_arrays(*outward), axis=-1) + least
        height = height + np.asarray(padding)[..., None]
        beyond = height[..., self.shape] - np.vecdot(mapped, normal)
        position = mapped + beyond[..., None] * normal
        # Least squares along the skin, over the shapes that are nearer than they may be.
        missing = np.maximum(height - np.matvec(self.normals, position), 0.0)
        across = self.normals - np.outer(self.normals @ normal, normal)
        away = np.where(missing[..., None] > 0.0, across, 0.0)
        lhs = np.swapaxes(away, -1, -2) @ away + STIFF * np.eye(3)
        along = np.linalg.solve(lhs, np.vecmat(missing, away)[..., None])
        return np.asarray(position + along[..., 0])
