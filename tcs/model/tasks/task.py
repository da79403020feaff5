"""What a task is: goal poses of the tool, each fixed to a part of the body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tcs.errors import TaskError, UnknownNameError

UNIT_TOLERANCE = 1e-5
"""How far a quaternion's length may be from 1: six written digits round by less than this."""

MAX_DISTANCE = 2.0
"""Farthest a goal may be from its body frame [m]; beyond it, the figures are no metres."""


@dataclass(frozen=True, slots=True, eq=False)
class Goal:
    """A pose the tool has to take, fixed to a part of the body (frame H).

    Poses are those of the tool frame T: x forward out of the fingers, y the way they open.
    """

    body_frame: str
    """Name of frame H, e.g. "head"."""
    position: NDArray[np.float64]
    """p_HoGo_H: the tool's place in H [m], shape (3,)."""
    quaternion: NDArray[np.float64]
    """R_HG: the tool's orientation in H, wxyz, unit, shape (4,)."""
    weight: float = 1.0
    """How much this goal counts beside the others; `Task.weights` sums to 1."""

    def __post_init__(self) -> None:
        """Check each value, normalise the quaternion, and make the arrays read-only.

        Raises:
            TaskError: If a value is not finite, of a wrong shape or unit, or not positive where
                it has to be.
        """
        if not self.body_frame:
            raise TaskError("field 'body_frame' is empty. Name the part of the body, e.g. 'head'.")
        position = _finite("position", self.position, ("x", "y", "z"))
        distance = float(np.linalg.norm(position))
        if distance > MAX_DISTANCE:
            raise TaskError(
                f"field 'position' is {distance:.6g} m from frame '{self.body_frame}', "
                f"but a goal on the body is at most {MAX_DISTANCE:g} m away. Write metres."
            )
        quaternion = _finite("quaternion_wxyz", self.quaternion, ("w", "x", "y", "z"))
        length = float(np.linalg.norm(quaternion))
        if abs(length - 1.0) > UNIT_TOLERANCE:
            raise TaskError(
                f"field 'quaternion_wxyz' has length {length:.6g}, but must be a unit quaternion "
                f"(1 within {UNIT_TOLERANCE:g})."
            )
        if not (np.isfinite(self.weight) and self.weight > 0):
            raise TaskError(f"field 'weight' is {self.weight}, but must be a positive number.")
        quaternion = quaternion / length
        for array in (position, quaternion):
            array.flags.writeable = False
        object.__setattr__(self, "position", position)
        object.__setattr__(self, "quaternion", quaternion)
        object.__setattr__(self, "weight", float(self.weight))

    def __eq__(self, other: object) -> bool:
        return self._key() == other._key() if isinstance(other, Goal) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._key())

    def _key(self) -> tuple[object, ...]:
        return (self.body_frame, *self.position.tolist(), *self.quaternion.tolist(), self.weight)


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """Something to be done on the body, as the tool poses it takes.

    Goals count one by one and standing still: a task says nothing of the way to a goal, nor of
    the order of the goals.
    """

    name: str
    title: str
    """What it is, in a few words for a person."""
    goals: tuple[Goal, ...]
    environments: tuple[str, ...]
    """Names of the environments it was written for."""
    source: str
    """Where its figures come from."""
    tool: str = ""
    """Which frame the goals are poses of, in words."""
    allowed_contacts: tuple[tuple[str, str], ...] = ()
    """Pairs of bodies that may touch."""
    grids: Mapping[str, Mapping[str, Mapping[str, object]]] = field(
        default_factory=dict, hash=False
    )
    """For an environment, the axes of its grid that this task changes: new values of some of
    start, step and count."""

    def __post_init__(self) -> None:
        """Check that there is something to do, and somewhere to do it.

        Raises:
            TaskError: If there are no goals or environments, or an environment comes twice.
            UnknownNameError: If a grid is changed in an environment the task is not for.
        """
        if not self.name:
            raise TaskError("field 'name' is empty.")
        for key, what in (("goals", "goal"), ("environments", "environment")):
            if not getattr(self, key):
                raise TaskError(f"field '{key}' is empty. A task needs at least one {what}.")
        for name in self.environments:
            if self.environments.count(name) > 1:
                raise TaskError(f"field 'environments': '{name}' is there twice.")
        for name in self.grids:
            if name not in self.environments:
                raise UnknownNameError(
                    "environment", name, self.environments, where="field 'grids'"
                )

    @property
    def weights(self) -> NDArray[np.float64]:
        """How much each goal counts, summing to 1, shape (goals,)."""
        raw = np.array([goal.weight for goal in self.goals], dtype=np.float64)
        return np.asarray(raw / raw.sum(), dtype=np.float64)

    def grid_changes(self, environment: str) -> Mapping[str, Mapping[str, object]]:
        """Return the axes this task changes in that environment; none for one it does not name."""
        return self.grids.get(environment, {})


def _finite(field: str, numbers: ArrayLike, names: Sequence[str]) -> NDArray[np.float64]:
    """Return the numbers as a new array, refusing a wrong count or one that is not finite."""
    wanted = f"{len(names)} finite numbers ({', '.join(names)})"
    try:
        array = np.array(numbers, dtype=np.float64)
    except (TypeError, ValueError):
        raise TaskError(f"field '{field}' is {numbers!r}, but must be {wanted}.") from None
    if array.shape != (len(names),) or not np.all(np.isfinite(array)):
        raise TaskError(f"field '{field}' is {array.tolist()}, but must be {wanted}.")
    return array
