"""The state of the viewer and its controls, independent of a browser."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

from tcs.model.grid import Axis
from tcs.output.view.floor import colourings
from tcs.output.view.viewed_set import ViewedSet
from tcs.output.words import axis_title

MEMBER, GOAL, COLOUR = "set member", "goal", "floor colour"
NEXT_MEMBER, NEXT_GOAL = "next set member", "next goal"
NEXT_COLOUR, BACK = "next floor colour", "back to the set"
KEYS: Mapping[str, str] = {
    NEXT_MEMBER: "KeyM",
    NEXT_GOAL: "KeyG",
    NEXT_COLOUR: "KeyC",
    BACK: "KeyB",
}
"""Buttons, with the key of each in the browser."""
_PARTS = 1_000_000
"""Parts of a metre or degree: finer than the step of any grid."""


@dataclasses.dataclass(frozen=True)
class ViewState:
    """State of the viewer."""

    along: tuple[int, ...]
    """Index of the configuration along each axis of the grid."""
    goal: int
    """Number of the goal."""
    colouring: str
    """Quantity that the floor shows."""
    member: int
    """Number of the member of the set that was shown last."""
    is_member: bool = False
    """Whether this member is shown: off the grid, no sliders say so."""


@dataclasses.dataclass(frozen=True)
class Slider:
    """A slider with the values low, low + step, ... high."""

    name: str
    low: float
    high: float
    step: float

    @property
    def tick(self) -> float:
        """The step for Meshcat, which rounds to its multiples regardless of the lowest value.

        >>> Slider("base x [m]", 0.1, 0.5, 0.2).tick
        0.1
        """
        low, step = (round(abs(value) * _PARTS) for value in (self.low, self.step))
        return math.gcd(low, step) / _PARTS


class Controls:
    """The controls of one file: names, ranges, and their effect on the state."""

    def __init__(self, viewed: ViewedSet) -> None:
        """Create the controls.

        Args:
            viewed: The scores and the set.
        """
        self._viewed = viewed
        self._colourings = colourings(viewed)
        # An axis of one value needs no slider.
        self._axes = {
            label_of(axis): (number, axis)
            for number, axis in enumerate(viewed.grid.axes)
            if axis.count > 1
        }

    @property
    def sliders(self) -> tuple[Slider, ...]:
        """Every slider with more than one value, in the order in which they are shown."""
        counted = (
            Slider(MEMBER, 1.0, float(len(self._viewed.members)), 1.0),
            Slider(GOAL, 1.0, float(self._viewed.goals), 1.0),
            Slider(COLOUR, 0.0, float(len(self._colourings) - 1), 1.0),
        )
        moving = (
            Slider(label, axis.start, axis.start + (axis.count - 1) * axis.step, axis.step)
            for label, (_, axis) in self._axes.items()
        )
        return tuple(slider for slider in (*counted, *moving) if slider.high > slider.low)

    def first(self) -> ViewState:
        """Return the first state: the first member of the set at a goal it serves."""
        state = ViewState((0,) * len(self._viewed.grid.axes), 0, self._colourings[0], 0)
        return self._at_member(state, 0) if self._viewed.members else state

    def values(self, state: ViewState) -> dict[str, float]:
        """Return the value of every slider in a state, by name [m or deg]."""
        counted = {
            MEMBER: state.member + 1.0,
            GOAL: state.goal + 1.0,
            COLOUR: float(self._colourings.index(state.colouring)),
        }
        moving = {
            label: axis.start + state.along[number] * axis.step
            for label, (number, axis) in self._axes.items()
        }
        return {slider.name: {**counted, **moving}[slider.name] for slider in self.sliders}

    def moved(self, state: ViewState, name: str, value: float) -> ViewState:
        """Return the state after a slider was moved.

        Args:
            state: The state before.
            name: Name of the slider.
            value: Its value; rounded to the nearest step within its range.
        """
        slider = next(one for one in self.sliders if one.name == name)
        last = round((slider.high - slider.low) / slider.step)
        step = min(max(round((value - slider.low) / slider.step), 0), last)
        if name == MEMBER:
            return self._at_member(state, step)
        if name == GOAL:
            return dataclasses.replace(state, goal=step)
        if name == COLOUR:
            return dataclasses.replace(state, colouring=self._colourings[step])
        along = list(state.along)
        along[self._axes[name][0]] = step
        return dataclasses.replace(state, along=tuple(along), is_member=False)

    def clicked(self, state: ViewState, name: str) -> ViewState:
        """Return the state after a button was clicked.

        Args:
            state: The state before.
            name: One of `KEYS`.
        """
        if name == NEXT_GOAL:
            return dataclasses.replace(state, goal=(state.goal + 1) % self._viewed.goals)
        if name == NEXT_COLOUR:
            after = (self._colourings.index(state.colouring) + 1) % len(self._colourings)
            return dataclasses.replace(state, colouring=self._colourings[after])
        if not self._viewed.members:
            return state
        ahead = 1 if name == NEXT_MEMBER else 0
        return self._at_member(state, (state.member + ahead) % len(self._viewed.members))

    def index(self, state: ViewState) -> int:
        """Return the flat index of the configuration."""
        if state.is_member:
            return self._viewed.members[state.member]
        return int(self._viewed.grid.flat(state.along))

    def environment_state(self, state: ViewState) -> int:
        """Return the number of the environment's state, in C order over its axes."""
        return self._viewed.environment_state(self.index(state))

    def heading(self, state: ViewState) -> str:
        """Return whether the configuration is a member of the set, as text."""
        members = self._viewed.members
        if members and members[state.member] == self.index(state):
            return f"member {state.member + 1} of {len(members)}"
        return "other configuration"

    def _at_member(self, state: ViewState, number: int) -> ViewState:
        """Return the state at a member; a goal it does not reach is replaced by one it serves."""
        index = self._viewed.members[number]
        along = tuple(self._viewed.grid.indices(self._viewed.on_grid(index)).tolist())
        goal = state.goal
        reached = self._viewed.result(index).reached
        if goal not in reached:
            goal = (*self._viewed.served(number), *reached, goal)[0]
        return dataclasses.replace(state, along=along, member=number, goal=goal, is_member=True)


def label_of(axis: Axis) -> str:
    """Return the name of the slider of an axis, with its unit.

    >>> label_of(Axis("head_rest", "deg", 0.0, 40.0, 3))
    'head rest [deg]'
    """
    return axis_title(f"{axis.name}_deg" if axis.unit == "deg" else axis.name)
