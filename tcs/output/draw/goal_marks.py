"""Numbered marks of goals: a disc where a goal is reached, a square where it is not."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from tcs.output.draw.colours import CASING, REACHED, UNREACHED
from tcs.output.draw.solids import FloatArray
from tcs.output.words import goal_list

_LABEL_WIDTH = 74
"""Characters per line of the names in a legend."""
_LOOKS = {True: ("circle", "o", REACHED), False: ("square", "s", UNREACHED)}
"""Shape of a mark, as a box of a text and as a marker, and its colour; by whether it is reached."""

_WORDS = ((True, "reached"), (False, "not reached"))
_JOINED = {True: "round,rounding_size=0.5", False: "square"}
"""Shape of the mark of several goals."""


@dataclass(frozen=True, eq=False)
class GoalMark:
    """A goal of a picture."""

    number: int
    """Its number."""
    name: str
    """Where it is, as people say it; "" if it has no name."""
    position: FloatArray
    """Position in the frame of the picture [m], shape (3,)."""
    is_reached: bool
    """Whether it is reached."""


def draw_goal_marks(
    axes: Axes,
    marks: Sequence[GoalMark],
    places: FloatArray,
    *,
    apart: float,
    size: float = 1.0,
) -> None:
    """Draw the marks over everything else, the unreached ones last.

    Args:
        axes: The axes.
        marks: The goals.
        places: Place of each mark in the axes, shape (n, 2).
        apart: Distance in the axes below which goals share one mark, with all their numbers.
        size: Scale of the marks.
    """
    for is_reached, numbers in sorted(_groups(marks, places, apart), reverse=True):
        shape, _, colour = _LOOKS[is_reached]
        shape = shape if len(numbers) == 1 else _JOINED[is_reached]
        at = places[numbers].mean(axis=0)
        axes.text(
            at[0],
            at[1],
            # A goal may have several poses at one place.
            " ".join(dict.fromkeys(str(marks[i].number + 1) for i in numbers)),
            color="white",
            fontsize=6.5 * size,
            ha="center",
            va="center",
            zorder=9,
            clip_on=True,
            bbox={"boxstyle": f"{shape},pad=0.15", "facecolor": colour, "edgecolor": CASING,
                  "linewidth": 0.6},
        )  # fmt: skip


def _groups(
    marks: Sequence[GoalMark], places: FloatArray, apart: float
) -> list[tuple[bool, list[int]]]:
    """Return whether the goals of each group are reached, and their positions in the list."""
    groups: list[tuple[bool, list[int]]] = []
    for i, mark in enumerate(marks):
        for is_reached, numbers in groups:
            near = np.linalg.norm(places[numbers[0]] - places[i]) < apart
            if near and is_reached is mark.is_reached:
                numbers.append(i)
                break
        else:
            groups.append((mark.is_reached, [i]))
    return groups


def mark_handles(marks: Sequence[GoalMark]) -> list[Line2D]:
    """Return the legend of the marks that are shown."""
    return [
        _handle(is_reached, f"goal {what} from there")
        for is_reached, what in _WORDS
        if any(mark.is_reached is is_reached for mark in marks)
    ]


def goal_handles(marks: Sequence[GoalMark]) -> list[Line2D]:
    """Return a legend with the names of the goals, reached and not."""
    names = {mark.number: mark.name for mark in marks}
    known = [names.get(number, "") for number in range(max(names, default=-1) + 1)]
    handles = []
    for is_reached, what in _WORDS:
        goals = [mark.number for mark in marks if mark.is_reached is is_reached]
        if goals:
            label = textwrap.fill(f"{what}: {goal_list(goals, known)}", _LABEL_WIDTH)
            handles.append(_handle(is_reached, label))
    return handles


def _handle(is_reached: bool, label: str) -> Line2D:
    _, marker, colour = _LOOKS[is_reached]
    return Line2D([], [], ls="none", color=colour, marker=marker, label=label)
