"""Goals on the body of a resized person: as far from the skin as on the papers' average man."""

from __future__ import annotations

import dataclasses
from typing import Self

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.model.people import Scale
from tcs.model.scene.environment import EnvironmentFile
from tcs.model.scene.person_shapes import LinkShape
from tcs.model.scene.resized_person import padding_of, person_shapes, scales_of
from tcs.model.tasks import Goal, Task


def goals_on_person(task: Task, environment: EnvironmentFile) -> Task:
    """Return a task with its goals moved to the body of the person of an environment.

    A goal on a link of the person belongs to the nearest point of the link's shapes. On the resized
    link it is beside the same point of the same shape, in the same direction, as far from the
    padded surface; its orientation in the body frame and its straight motions stay.

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
        padding = padding_of(environment, link, scales, shapes)
        padding -= padding_of(environment, link, {}, shapes)
        position = Anchor.of(goal, shapes[link]).position(scales[link], padding)
        goals.append(dataclasses.replace(goal, position=position))
    return dataclasses.replace(task, goals=tuple(goals))


@dataclasses.dataclass(frozen=True, eq=False)
class Anchor:
    """The point of a link's shapes that a goal belongs to."""

    shape: LinkShape
    """The nearest shape of the link of the papers' man."""
    distance: float
    """Signed distance of the goal from it [m]."""
    surface: FloatArray
    """The point, in the frame of the shape [m], shape (3,)."""
    normal: FloatArray
    """Outward normal there, shape (3,)."""

    @classmethod
    def of(cls, goal: Goal, shapes: list[LinkShape]) -> Self:
        """Return the anchor of a goal on the shapes of its link."""
        near = [(shape, *shape.nearest(goal.position)) for shape in shapes]
        return cls(*min(near, key=lambda found: found[1]))

    def position(self, scale: Scale, padding: float) -> FloatArray:
        """Return the position of the goal on a resized link [m], shape (3,).

        Args:
            scale: How the link is stretched.
            padding: By how much the padding of the link grows [m].
        """
        stretched = self.shape.stretch(scale)
        at = self.shape.follow(self.surface, self.normal, stretched)
        return np.asarray(at + (self.distance + padding) * (stretched.R_LS @ self.normal))
