"""Table of parking windows: how far a stop may be off so that it still serves its goals."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError
from tcs.placement.tables.columns import ArrayTable, Column, Columns, Form, require

MARGIN = 0.1
"""Fraction of the box that was checked that is left off on every side to give the window: a lattice
misses what reaches less than about half its distance into the box."""
MOST_PARKING = (0.5, 0.5, 180.0)
"""Greatest half widths [m, m, deg]: half a metre is the farthest that a navigation stack is off."""
LEAST_PARKING = (0.005, 0.005, 0.3)
"""Least half widths that can be requested [m, m, deg]: less than any base is placed by."""
NARROWEST = 0.003
"""Least half width in x and y that is looked for [m]: no base is placed better."""
SAME = 1e-9
"""Rounding of values of axes and of half widths [m or rad]."""


class Window(NamedTuple):
    """Half widths of a box around a stop, along the axes of the environment frame."""

    x: float
    """[m]."""
    y: float
    """[m]."""
    yaw: float
    """[rad]."""

    def holds(self, other: Window) -> bool:
        """Return whether another window is inside this one."""
        return all(mine >= theirs - SAME for mine, theirs in zip(self, other, strict=True))

    @classmethod
    def wanted(cls, parking: Sequence[float]) -> Self:
        """Return the window that holds half widths in x [m], y [m] and heading [deg].

        Where one hardly matters and is less than 5 mm or 0.3 degrees, it is that.

        Raises:
            SelectionError: If they are not three numbers from 0 to 0.5 m, 0.5 m and 180 degrees.
        """
        if len(parking) != 3 or not all(
            0.0 <= value <= most for value, most in zip(parking, MOST_PARKING, strict=True)
        ):
            raise SelectionError(
                f"parking is {','.join(f'{value:g}' for value in parking)}; must be half widths "
                "in x, y and heading: three numbers of 0 to 0.5 m, 0.5 m and 180 degrees."
            )
        x, y, yaw_deg = map(max, parking, LEAST_PARKING)
        return cls(x, y, math.radians(yaw_deg))

    @property
    def volume(self) -> float:
        """Product of the half widths, by which windows are compared [m^2 rad]."""
        return self.x * self.y * self.yaw

    def to_json(self) -> dict[str, float]:
        """Return the half widths as plain numbers [m, m, deg], rounded down."""
        return {
            "x": _down(self.x, 1e-4),
            "y": _down(self.y, 1e-4),
            "yaw_deg": _down(math.degrees(self.yaw), 1e-2),
        }


def window_text(window: Mapping[str, float]) -> str:
    """Return the half widths of a window in words, rounded down.

    Args:
        window: They, as `Window.to_json` returns them.

    >>> window_text({"x": 0.0462, "y": 0.062, "yaw_deg": 5.73})
    '4 cm off in x, 6 cm in y, 5 degrees in heading'
    >>> window_text({"x": 0.008, "y": 0.5, "yaw_deg": 0.69})
    '8 mm off in x, 50 cm in y, 0.6 degrees in heading'
    >>> window_text({"x": 0.0, "y": 0.0, "yaw_deg": 0.0})
    'less than 3 mm off'
    """
    if not any(window.values()):
        return f"less than {1000.0 * NARROWEST:g} mm off"
    x, y = (
        f"{math.floor(100.0 * half + 1e-6)} cm"
        if half >= 0.01
        else f"{math.floor(1000.0 * half + 1e-6)} mm"
        for half in (window["x"], window["y"])
    )
    yaw = window["yaw_deg"]
    turn = (
        f"{math.floor(yaw + 1e-6)}" if yaw >= 1.0 else f"{math.floor(10.0 * yaw + 1e-6) / 10.0:g}"
    )
    return f"{x} off in x, {y} in y, {turn} degree{'' if turn == '1' else 's'} in heading"


def _down(value: float, step: float) -> float:
    # A half width that was asked for must not fall below it by rounding.
    return round(math.floor(value / step + 1e-6) * step, 9)


@dataclass(frozen=True, kw_only=True, eq=False)
class WindowTable(ArrayTable):
    """What is known of n boxes around stops; arrays are read-only.

    Whether all goals of a stop are reached from everywhere in the box, or each of some goals is
    missed from a place whose distances from the stop are those of the box.
    """

    values: NDArray[np.float64]
    """The stop: values of the grid's axes in their order [m or rad], shape (n, axes)."""
    goals: NDArray[np.bool_]
    """The goals that the box is about, shape (n, G)."""
    half: NDArray[np.float64]
    """Half widths in x and y [m] and in heading [rad], shape (n, 3)."""
    held: NDArray[np.bool_]
    """Whether the goals are reached from everywhere inside, shape (n,)."""

    WHAT = "window table"
    COLUMNS: ClassVar[Columns] = {
        "values": Column(np.float64, "n axes", finite=True),
        "goals": Column(np.bool_, "n G", Form.FLAGS),
        "half": Column(np.float64, "n 3", least=0.0),
        "held": Column(np.bool_, "n", Form.FLAGS),
    }

    def __post_init__(self) -> None:
        """Check the arrays against each other and make them read-only.

        Raises:
            TcsError: If an array has the wrong type, shape or range.
        """
        self._check_arrays()
        require(bool(np.all(self.goals.any(axis=1))), "window table: boxes must be about goals.")

    @classmethod
    def empty(cls, axes: int, goals: int) -> Self:
        """Return the table in which nothing is known."""
        return cls(
            values=np.empty((0, axes)),
            goals=np.empty((0, goals), np.bool_),
            half=np.empty((0, 3)),
            held=np.empty(0, np.bool_),
        )

    def __len__(self) -> int:
        """Return the number of boxes."""
        return len(self.held)

    def added(
        self,
        values: NDArray[np.float64],
        goals: NDArray[np.bool_],
        half: Sequence[float],
        *,
        held: bool,
    ) -> Self:
        """Return the table with one more box."""
        return type(self)(
            values=np.concatenate([self.values, values[None]]),
            goals=np.concatenate([self.goals, goals[None]]),
            half=np.concatenate([self.half, np.asarray(half, dtype=np.float64)[None]]),
            held=np.append(self.held, held),
        )

    def joined(self, other: Self) -> Self:
        """Return this table with the boxes of another one behind its own."""
        return type(self)(
            **{
                name: np.concatenate([getattr(self, name), getattr(other, name)])
                for name in self.COLUMNS
            }
        )

    def window(
        self,
        values: NDArray[np.float64],
        goals: NDArray[np.bool_],
        least: Window | None = None,
    ) -> Window | None:
        """Return the greatest known window of a stop for some goals; None if none is known.

        Args:
            values: The stop.
            goals: Whether it serves a goal, shape (G,).
            least: What the window has to hold, if anything.
        """
        found = self._at(values) & self.held & np.all(self.goals | ~goals, axis=1)
        windows = [Window(*half) for half in self.half[found].tolist()]
        enough = [one for one in windows if least is None or one.holds(least)]
        return max(enough, key=lambda one: one.volume, default=None)

    def misses(self, least: Window) -> Self:
        """Return the places from which goals are missed so that no window of a stop holds a box.

        Args:
            least: The box.
        """
        # What is checked is wider than the window.
        inside = np.all(self.half <= np.array(least) / (1.0 - MARGIN) + SAME, axis=1)
        rows = np.flatnonzero(~self.held & inside)
        return type(self)(**{name: getattr(self, name)[rows] for name in self.COLUMNS})

    def missed(self, values: NDArray[np.float64], least: Window) -> NDArray[np.bool_]:
        """Return the goals for which no window of a stop holds what it has to, shape (G,).

        Args:
            values: The stop.
            least: What the window has to hold.
        """
        misses = self.misses(least)
        return np.asarray(misses.goals[misses._at(values)].any(axis=0))

    def _at(self, values: NDArray[np.float64]) -> NDArray[np.bool_]:
        same: NDArray[np.bool_] = np.all(np.abs(self.values - values) <= SAME, axis=1)
        return same
