"""Where the robot is relative to the person, in words."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from tcs.model.grid import InitialConfiguration
    from tcs.placement.store import ScoreFile

_LANDMARKS = {
    "head": "head",
    "chest": "chest",
    "mid_body": "waist",
    "lower_body": "hips",
    "calf": "knees",
    "foot": "feet",
}
"""Parts of the body by the start of the names of their frames; a calf begins at the knee."""
_MOST_KEPT = 1000
"""Most places of members whose words are kept with a table."""
_SEATED = ("hips", "knees", "feet")
"""Parts that a robot can be beside where the person sits."""
_BESIDE = 0.3
"""Distance from the middle of the body beyond which a place is on one side [m]: half the width of a
wheelchair, and more than half of a person."""
_SITS = 0.35
"""Height of the head above the hips beyond which a person sits [m]."""
_SIDES = {
    "left": "On the person's left",
    "right": "On the person's right",
    "front": "In front of the person",
    "behind": "Behind the person",
    "feet": "At the person's feet",
    "head": "At the person's head",
    "on": "Where the person is",
}
_FACINGS = {
    "towards": "facing them",
    "away": "facing away",
    "left": "with them on its left",
    "right": "with them on its right",
}


@dataclass(frozen=True, slots=True)
class RelativePlace:
    """Where the base is relative to the person."""

    side: str
    """One of left, right, front, behind, feet, head, on; left and right are the person's."""
    beside: str | None
    """The part of the body that it is beside: head, chest, waist, hips, knees or feet."""
    facing: str
    """Where the robot's front points: towards the person, away, or the side of the robot on which
    the person is, left or right."""

    @property
    def text(self) -> str:
        """The place as a sentence.

        >>> RelativePlace("right", "knees", "towards").text
        "On the person's right, beside the knees, facing them."
        """
        beside = [f"beside the {self.beside}"] if self.beside else []
        return f"{', '.join([_SIDES[self.side], *beside, _FACINGS[self.facing]])}."


@dataclass(frozen=True, slots=True)
class PersonOnFloor:
    """Where a person is on the floor, in the environment frame."""

    origin: tuple[float, float]
    """Middle of the frames of both sides of the body [m]."""
    to_left: tuple[float, float]
    """Unit vector to the person's left."""
    ahead: tuple[float, float]
    """Unit vector from the person's head to the feet."""
    parts: tuple[tuple[str, float], ...]
    """Parts of the body and their positions from `origin` along `ahead` [m]."""
    sits: bool
    """Whether the person sits."""

    @classmethod
    def of(cls, frames: Mapping[str, Sequence[float]]) -> PersonOnFloor | None:
        """Return the person of body frames; None without frames of both sides of a body.

        Args:
            frames: Positions of the body frames in the environment frame [m].
        """
        left, right = _middle(frames, "_left"), _middle(frames, "_right")
        if left is None or right is None or "head" not in frames:
            return None
        width = math.dist(left, right)
        if width < 1e-6:
            return None
        to_left = ((left[0] - right[0]) / width, (left[1] - right[1]) / width)
        ahead = (to_left[1], -to_left[0])
        origin = ((left[0] + right[0]) / 2.0, (left[1] + right[1]) / 2.0)
        parts = tuple(
            (part, _along(at, origin, ahead))
            for start, part in _LANDMARKS.items()
            if (at := _middle(frames, start, at_start=True)) is not None
        )
        height = frames["head"][2] - frames.get("lower_body", frames["head"])[2]
        return cls(origin, to_left, ahead, parts, height > _SITS)

    def place(self, x: float, y: float, yaw: float) -> RelativePlace:
        """Return where a base pose [m, rad] is relative to the person."""
        aside, forward = (_along((x, y), self.origin, axis) for axis in (self.to_left, self.ahead))
        low, high = min(at for _, at in self.parts), max(at for _, at in self.parts)
        side = _side(aside, forward - low, high - forward, self.sits)
        beside = None
        if side in ("left", "right"):
            # A sitting person's head and trunk are above the hips.
            seen = [one for one in self.parts if not self.sits or one[0] in _SEATED]
            beside, _ = min(seen or self.parts, key=lambda one: abs(one[1] - forward))
        nearest = min(max(forward, low), high)
        target = tuple(o + nearest * a for o, a in zip(self.origin, self.ahead, strict=True))
        bearing = math.atan2(target[1] - y, target[0] - x) - yaw
        return RelativePlace(side, beside, _facing(math.remainder(bearing, 2.0 * math.pi)))


def frames_of_state(file: ScoreFile, table: int, state: int) -> dict[str, list[float]]:
    """Return the positions of the body frames in a state of the environment [m].

    Args:
        file: A score file.
        table: Number of its table.
        state: Number of the state, in C order over the axes of the environment.
    """
    count = len(file.tables)
    return {
        name: np.reshape(at, (count, -1, 3))[table, state].tolist()
        for name, at in file.body_frames.items()
    }


def member_places(
    file: ScoreFile,
    table: int,
    indices: Sequence[int],
    members: Sequence[InitialConfiguration] = (),
) -> list[str]:
    """Return for each member of a set where it is relative to the person; "" without a person.

    Args:
        file: A score file.
        table: Number of the table.
        indices: Flat indices of the configurations.
        members: The members of a refined set, which are off the grid: `indices` are the
            configurations that they were refined from, whose state of the environment is taken.
    """
    grid = file.configurations
    # The members of the best sets are few: from most places they are the same.
    kept = file.tables[table].derived.setdefault("places in words", {})
    texts = []
    for member, index in zip(
        members or [grid.configuration(h) for h in indices], indices, strict=True
    ):
        pose = (member.base_x, member.base_y, member.base_yaw)
        text = kept.get((*pose, index))
        if text is None:
            person = _person_of(file, table, int(grid.state_of(index)))
            text = "" if person is None else person.place(*pose).text
            if len(kept) < _MOST_KEPT:
                kept[(*pose, index)] = text
        texts.append(text)
    return texts


def place_of_state(file: ScoreFile, table: int, here: InitialConfiguration) -> str:
    """Return where a base that need not be on the grid is relative to the person; "" without one.

    The person is where the scored state of the environment nearest to the stated one has them.

    Args:
        file: A score file.
        table: Number of the table.
        here: The state of robot and environment; axes that it lacks count as at their first value.
    """
    grid, now, state = file.configurations, dict(here.environment), 0
    for axis in grid.environment_axes:
        away = [abs(axis.value(i) - now.get(axis.name, axis.value(0))) for i in range(axis.count)]
        state = state * axis.count + away.index(min(away))
    person = _person_of(file, table, state)
    return "" if person is None else person.place(here.base_x, here.base_y, here.base_yaw).text


def _person_of(file: ScoreFile, table: int, state: int) -> PersonOnFloor | None:
    """Return where the person is in a state of the environment; kept with the table."""
    kept = file.tables[table].derived.setdefault("persons on the floor", {})
    if state not in kept:
        kept[state] = PersonOnFloor.of(frames_of_state(file, table, state))
    found: PersonOnFloor | None = kept[state]
    return found


def place_in_line(place: str) -> str:
    """Return a place within a line: without a capital letter and a full stop.

    >>> place_in_line("In front of the person, facing them.")
    'in front of the person, facing them'
    """
    return f"{place[:1].lower()}{place[1:].removesuffix('.')}"


def stop_places(places: Sequence[str]) -> list[str]:
    """Return a sentence for each stop of a set with a place relative to the person.

    >>> stop_places(["In front of the person, facing them.", ""])
    ['Stop 1: in front of the person, facing them.']
    """
    return [
        f"Stop {number}: {place_in_line(place)}."
        for number, place in enumerate(places, start=1)
        if place
    ]


def relative_place(
    x: float, y: float, yaw: float, frames: Mapping[str, Sequence[float]]
) -> RelativePlace | None:
    """Return where a base is relative to the person; None without frames of both sides of a body.

    Args:
        x: x of the base in the environment frame [m].
        y: y of the base [m].
        yaw: Heading of the base [rad].
        frames: Positions of the body frames in the environment frame [m].

    >>> frames = {"head": (0.45, 0.0, 1.2), "lower_body": (0.44, 0.0, 0.6),
    ...           "calf_left": (0.9, 0.1, 0.6), "calf_right": (0.9, -0.1, 0.6)}
    >>> relative_place(0.9, -0.8, math.pi / 2, frames)
    RelativePlace(side='right', beside='knees', facing='towards')
    """
    person = PersonOnFloor.of(frames)
    return None if person is None else person.place(x, y, yaw)


def _along(point: Sequence[float], origin: tuple[float, float], axis: tuple[float, float]) -> float:
    """Return the coordinate of a point along an axis from an origin [m]."""
    return (point[0] - origin[0]) * axis[0] + (point[1] - origin[1]) * axis[1]


def _side(aside: float, after_head: float, before_feet: float, sits: bool) -> str:
    """Return the side of the person; distances along the body are positive within it [m]."""
    beyond = max(-after_head, -before_feet)
    if beyond > 0.0 and beyond > abs(aside) - _BESIDE:
        if -before_feet > 0.0:
            return "front" if sits else "feet"
        return "behind" if sits else "head"
    if abs(aside) <= _BESIDE:
        return "on"
    return "left" if aside > 0.0 else "right"


def _facing(bearing: float) -> str:
    """Return where the front points, given the direction to the person in the base frame [rad]."""
    if abs(bearing) <= math.pi / 4.0:
        return "towards"
    if abs(bearing) >= 3.0 * math.pi / 4.0:
        return "away"
    return "left" if bearing > 0.0 else "right"


def _middle(
    frames: Mapping[str, Sequence[float]], part: str, *, at_start: bool = False
) -> tuple[float, float] | None:
    """Return the mean position on the floor of the frames whose names end or start with a part."""
    names = [n for n in frames if (n.startswith(part) if at_start else n.endswith(part))]
    if not names:
        return None
    return (
        sum(frames[name][0] for name in names) / len(names),
        sum(frames[name][1] for name in names) / len(names),
    )
