"""Tasks and goals: poses of the tool, each fixed to a body frame."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from tcs.errors import TaskError, UnknownNameError
from tcs.files.quantities import GOALS, SIZE, UNIT_TOLERANCE, WEIGHT
from tcs.model.tasks.freedom import Freedom
from tcs.model.tasks.hand import Hand
from tcs.model.tasks.surface import Surface
from tcs.model.tasks.tool_line import (
    DEFAULT_APPROACH,
    DEFAULT_RETREAT,
    ToolLine,
    finite,
)

MAX_DISTANCE = 2.0
"""Greatest distance of a goal from its body frame [m]; a larger number is not in metres."""


LONGEST_NAME = 60
"""Greatest length of the name of a goal [characters]: it has to fit into a table."""

MOST_POSES = 100
"""Greatest number of poses of one goal; each takes the time of a goal of its own."""

UNIT_ROUNDING = 1e-15
"""By how much the length of a normalised quaternion may differ from 1: four times rounding."""

TOOL_SPEED = 0.1
"""Speed of the tool on straight motions [m/s], at which the velocity limits must be kept: a hand's
width in a second, slow enough for a person to turn away."""


@dataclass(frozen=True, slots=True)
class KeepOut:
    """A box fixed to a body frame H that the arm enters on straight motions to a goal alone."""

    body_frame: str
    """Name of frame H, that of a goal, e.g. "head"."""
    position: tuple[float, float, float]
    """p_HoKo_H: centre of the box in H [m]."""
    box: tuple[float, float, float]
    """Full sizes along the axes of H [m]."""

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            TaskError: If a value is not finite, or a size is out of its physical range.
        """
        if not self.body_frame:
            raise TaskError("field 'body_frame' is empty. Name a body frame, e.g. 'head'.")
        position = finite("position", self.position, ("x", "y", "z"))
        if math.hypot(*position) > MAX_DISTANCE:
            raise TaskError(f"field 'position' is beyond {MAX_DISTANCE:g} m. Write metres.")
        for size in finite("box", self.box, ("x", "y", "z")):
            SIZE.check(float(size), "field 'box'", TaskError)


@dataclass(frozen=True, slots=True, eq=False)
class GoalPose:
    """A pose of the tool frame T at which a goal is reached, fixed to a body frame H.

    In T, x points forward out of the fingers, and y along their opening direction.
    """

    body_frame: str
    """Name of frame H, e.g. "head"."""
    position: NDArray[np.float64]
    """p_HoGo_H: position of the goal in H [m], shape (3,)."""
    quaternion: NDArray[np.float64]
    """R_HG: orientation of the goal in H, unit quaternion wxyz, shape (4,)."""
    free: Freedom | None = None
    """Tool poses that serve as well as this one, None for none."""

    def __post_init__(self) -> None:
        """Check each value, normalise the quaternion, and make the arrays read-only.

        Raises:
            TaskError: If a value is not finite, has a wrong shape or unit, or is out of its
                physical range.
        """
        if not self.body_frame:
            raise TaskError("field 'body_frame' is empty. Name a body frame, e.g. 'head'.")
        position = finite("position", self.position, ("x", "y", "z"))
        # Unlike numpy's norm, this does not overflow, for which numpy would print a warning.
        distance = math.hypot(*position)
        if distance > MAX_DISTANCE:
            raise TaskError(
                f"field 'position' is {distance:.6g} m from frame '{self.body_frame}', "
                f"but a goal on the body is at most {MAX_DISTANCE:g} m away. Write metres."
            )
        quaternion = finite("quaternion_wxyz", self.quaternion, ("w", "x", "y", "z"))
        length = math.hypot(*quaternion)
        if abs(length - 1.0) > UNIT_TOLERANCE:
            raise TaskError(
                f"field 'quaternion_wxyz' has length {length:.6g}, but must be a unit quaternion "
                f"(1 within {UNIT_TOLERANCE:g})."
            )
        # Dividing again would turn the pose by a last digit: what is copied keeps every bit.
        if abs(length - 1.0) > UNIT_ROUNDING:
            quaternion = quaternion / length
        for array in (position, quaternion):
            array.flags.writeable = False
        object.__setattr__(self, "position", position)
        object.__setattr__(self, "quaternion", quaternion)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, GoalPose) or type(self) is not type(other):
            return NotImplemented
        return self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def _key(self) -> tuple[object, ...]:
        position, quaternion = self.position.tolist(), self.quaternion.tolist()
        return self.body_frame, *position, *quaternion, self.free


@dataclass(frozen=True, slots=True, eq=False)
class Goal(GoalPose):
    """A goal of the tool: its pose, or the first of several of which any one counts."""

    weight: float = 1.0
    """Weight of this goal relative to the others; `Task.weights` sums to 1."""
    approach: ToolLine = DEFAULT_APPROACH
    """Straight motion that ends at the goal."""
    retreat: ToolLine = DEFAULT_RETREAT
    """Straight motion that begins at the goal."""
    name: str = ""
    """Where the goal is, as people say it, e.g. "left cheek"; "" for no name."""
    arm: str = ""
    """Name of the arm that reaches it, as the robot file names its arms; "" for the scored one."""
    tool: str = ""
    """Name of the tool that it needs, one of `Task.tools` or one that ships; "" for none."""
    together_with: str = ""
    """Name of the goal that another arm reaches at the same time; "" for none."""
    alternatives: tuple[GoalPose, ...] = ()
    """Further poses: the goal is reached at any one of them."""

    def __post_init__(self) -> None:
        """Check each value as a pose does.

        Raises:
            TaskError: As of a pose, or if a name, weight or number of poses is out of its range.
        """
        GoalPose.__post_init__(self)
        if len(self.name) > LONGEST_NAME or not all(c.isprintable() for c in self.name):
            raise TaskError(
                f"field 'name' is {self.name[:LONGEST_NAME]!r}, but must be at most {LONGEST_NAME} "
                "printable characters, e.g. 'left cheek'."
            )
        WEIGHT.check(self.weight, "field 'weight'", TaskError)
        if len(self.poses) > MOST_POSES:
            raise TaskError(
                f"field 'alternatives': the goal has {len(self.poses)} poses, but may have at most "
                f"{MOST_POSES}. Say with 'free' what is free about one of them."
            )
        object.__setattr__(self, "weight", float(self.weight))

    @property
    def poses(self) -> tuple[GoalPose, ...]:
        """All poses at which it is reached, the goal's own first."""
        return (self, *self.alternatives)

    def at(self, poses: Sequence[GoalPose]) -> Goal:
        """Return the goal with other poses."""
        first = poses[0]
        return replace(
            self,
            body_frame=first.body_frame,
            position=first.position,
            quaternion=first.quaternion,
            free=first.free,
            alternatives=tuple(poses[1:]),
        )

    @property
    def region(self) -> str:
        """What poses serve beside the goal's own one, in words; "" for none.

        E.g. "any rotation about x", or "any of 2 poses, y within 20 deg at one of them".
        """
        frees = [str(pose.free) if pose.free is not None else "" for pose in self.poses]
        if not self.alternatives:
            return frees[0]
        text = f"any of {len(frees)} poses"
        if all(free == frees[0] for free in frees):
            return f"{text}, {frees[0]} at each" if frees[0] else text
        named = [f"{free} at pose {i + 1}" for i, free in enumerate(frees) if free]
        return ", ".join([text, *named])

    def _key(self) -> tuple[object, ...]:
        others = (self.weight, self.approach, self.retreat, self.name)
        hand = (self.arm, self.tool, self.together_with)
        return *GoalPose._key(self), *others, *hand, self.alternatives


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """A task as a set of goal poses of the tool.

    Scoring evaluates goals one by one and at rest; `tcs.motion` plans paths to them in an order.
    """

    name: str
    title: str
    """Title for readers, a few words."""
    goals: tuple[Goal, ...]
    environments: tuple[str, ...]
    """Names of the environments for which the task is made."""
    source: str
    """Source of the numbers."""
    tool: str = ""
    """Description of the tool frame that the goals refer to."""
    tools: Mapping[str, str] = field(default_factory=dict, hash=False)
    """Tools of its own that goals may name: name or path of the tool file, by the name in goals."""
    allowed_contacts: tuple[tuple[str, str], ...] = ()
    """Pairs (robot body, environment body) that may touch."""
    keep_out: tuple[KeepOut, ...] = ()
    """Virtual walls: boxes that paths of the arm keep out of; scoring does not know them."""
    grids: Mapping[str, Mapping[str, Mapping[str, object]]] = field(
        default_factory=dict, hash=False
    )
    """By environment, changes to the axes of its grid: new values of start, step or count."""
    surfaces: tuple[Surface, ...] = ()
    """Surfaces covered with further goals, which the environment gives their places."""

    def __post_init__(self) -> None:
        """Check the fields.

        Raises:
            TaskError: If there are no goals or environments, or an environment is repeated.
            UnknownNameError: If `grids` names an environment that is not one of `environments`.
        """
        if not self.name:
            raise TaskError("field 'name' is empty.")
        for key, what in (("goals", "goal"), ("environments", "environment")):
            if not getattr(self, key) and not (key == "goals" and self.surfaces):
                raise TaskError(f"field '{key}' is empty. A task needs at least one {what}.")
        if self.goals:
            GOALS.check(len(self.goals), "field 'goals': its number of goals", TaskError)
        for name in self.environments:
            if self.environments.count(name) > 1:
                raise TaskError(f"field 'environments': '{name}' is repeated. Remove one of them.")
        frames = {pose.body_frame for pose in self.poses}
        frames |= {name for surface in self.surfaces for name in surface.frames}
        for one in self.keep_out:
            if one.body_frame not in frames:
                raise UnknownNameError(
                    "frame", one.body_frame, frames, where="field 'keep_out', frames of the goals"
                )
        for name in self.grids:
            if name not in self.environments:
                raise UnknownNameError(
                    "environment", name, self.environments, where="field 'grids'"
                )

    @property
    def weights(self) -> NDArray[np.float64]:
        """Weight of each goal, summing to 1, shape (goals,)."""
        raw = np.array([goal.weight for goal in self.goals], dtype=np.float64)
        return np.asarray(raw / raw.sum(), dtype=np.float64)

    def goals_by_hand(self) -> dict[Hand, tuple[int, ...]]:
        """Return the numbers of the goals of each hand, in the order of the first of them.

        Raises:
            TaskError: If goals name each other in a way that is not a pair of two arms.
            UnknownNameError: If a goal names a goal that does not exist.
        """
        found: dict[Hand, tuple[int, ...]] = {}
        for number, hand in enumerate(hands(self.goals)):
            found[hand] = (*found.get(hand, ()), number)
        return found

    @property
    def poses(self) -> tuple[GoalPose, ...]:
        """The poses of all goals, those of one goal after those of the one before."""
        return tuple(pose for goal in self.goals for pose in goal.poses)

    @property
    def has_freedom(self) -> bool:
        """Whether a goal is free: reached at more than one pose of the tool."""
        frees = [*(pose.free for pose in self.poses), *(one.free for one in self.surfaces)]
        several = any(goal.alternatives for goal in self.goals)
        return several or any(free is not None for free in frees)

    def exact(self) -> Task:
        """Return the task with each goal at its own pose alone, as the papers score tasks."""
        return replace(
            self,
            goals=tuple(replace(goal, free=None, alternatives=()) for goal in self.goals),
            surfaces=tuple(replace(surface, free=None) for surface in self.surfaces),
        )

    def grid_changes(self, environment: str) -> Mapping[str, Mapping[str, object]]:
        """Return the changes to the axes of an environment's grid, empty if there are none."""
        return self.grids.get(environment, {})


def partners(goals: Sequence[Goal]) -> tuple[int | None, ...]:
    """Return the number of the goal that is reached together with each goal, None for none.

    Raises:
        TaskError: If a goal belongs to two pairs, or both goals of a pair are of one arm.
        UnknownNameError: If no goal, or more than one, has the name of a partner.
    """
    found: list[int | None] = [None] * len(goals)
    names = [goal.name for goal in goals]
    for i, goal in enumerate(goals):
        if not goal.together_with:
            continue
        where = f"goals[{i}], field 'together_with'"
        named = [j for j, name in enumerate(names) if name == goal.together_with and j != i]
        if not named:
            known = {name for j, name in enumerate(names) if name and j != i}
            raise UnknownNameError("goal", goal.together_with, known, where=where)
        if len(named) > 1:
            raise TaskError(
                f"{where}: {len(named)} goals are called '{goal.together_with}'. Give each a name "
                "of its own."
            )
        j = named[0]
        if {found[i], found[j]} - {None} and (found[i], found[j]) != (j, i):
            raise TaskError(
                f"{where}: '{goal.together_with}' or this goal is in another pair already. A pair "
                "is two goals: write a goal twice, with two names, to have it in two pairs."
            )
        if not goal.arm or not goals[j].arm or goal.arm == goals[j].arm:
            arms = [one.arm or "no arm" for one in (goal, goals[j])]
            raise TaskError(
                f"{where}: the two goals name {' and '.join(arms)}, but two arms reach them at "
                "once. Give each goal its own 'arm'."
            )
        found[i], found[j] = j, i
    return tuple(found)


def hands(goals: Sequence[Goal]) -> tuple[Hand, ...]:
    """Return the hand of each goal.

    Raises:
        TaskError: As `partners`.
        UnknownNameError: As `partners`.
    """
    others = (None if j is None else (goals[j].arm, goals[j].tool) for j in partners(goals))
    return tuple(
        Hand(goal.arm, goal.tool, other) for goal, other in zip(goals, others, strict=True)
    )
