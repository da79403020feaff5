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
from tcs.model.tasks import Goal, Task


def goals_on_person(task: Task, environment: EnvironmentFile) -> Task:
    """Return a task with its goals moved to the body of the person of an environment.

    A goal on a link of the person belongs to the nearest point of the link's shapes. On the resized
    link it is beside where this point is mapped to, in the same direction, and as far in that
    direction from the padded shapes that enclose the mapped one; its orientation in the body frame
    and its straight motions stay.

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
    goals = []
    for goal in task.goals:
        link = environment.body_frames.get(goal.body_frame, "")
        if link not in scales:
            goals.append(goal)
            continue
        grown = padding_of(environment, link, scales) - padding_of(environment, link, {})
        covers = covers_of(environment, link, shapes[link], scales[link])
        position = Anchor.of(goal, shapes[link]).position(scales[link], covers, grown)
        goals.append(dataclasses.replace(goal, position=position))
    return dataclasses.replace(task, goals=tuple(goals))


@dataclasses.dataclass(frozen=True, eq=False)
class Anchor:
    """The point of a link's shapes that a goal belongs to."""

    shape: int
    """Number of the nearest shape of the link of the papers' man."""
    distance: float
    """Signed distance of the goal from it [m]."""
    surface: FloatArray
    """The point, in the frame of the link [m], shape (3,)."""
    normal: FloatArray
    """Outward normal there, in the frame of the link, shape (3,)."""

    @classmethod
    def of(cls, goal: Goal, shapes: Sequence[LinkShape]) -> Self:
        """Return the anchor of a goal on the shapes of its link."""
        near = [shape.nearest(goal.position) for shape in shapes]
        number = min(range(len(near)), key=lambda i: near[i][0])
        shape, (distance, surface, normal) = shapes[number], near[number]
        return cls(number, distance, shape.p_LoSo_L + shape.R_LS @ surface, shape.R_LS @ normal)

    def position(
        self, scale: ArrayLike, covers: Sequence[Sequence[LinkShape]], padding: ArrayLike
    ) -> FloatArray:
        """Return the position of the goal on a resized link [m], shape (..., 3).

        Args:
            scale: How the link is stretched, shape (..., 3): of one person or of many.
            covers: What encloses each of its shapes.
            padding: By how much the padding of the link grows [m], shape (...).
        """
        mapped = np.array(scale) * self.surface
        outward = np.max([shape.reach(self.normal) for shape in covers[self.shape]], axis=0)
        beyond = outward - np.vecdot(mapped, self.normal)
        distance = np.asarray(beyond + self.distance + padding)
        return np.asarray(mapped + distance[..., None] * self.normal)
