"""Sets whose stops may be off: the walk through the sets, in their order, to the first of these."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError
from tcs.placement.selection.admission import Admitted
from tcs.placement.selection.index import SetIndex
from tcs.placement.store import ScoreFile
from tcs.placement.tables import Window, WindowTable, members_by_dexterity, window_text

MOST_SETS = 100
"""Most sets whose windows are looked for; one that has none takes a tenth of a second."""

BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]
FloatArray = NDArray[np.float64]


class ServedStop(NamedTuple):
    """A stop of a set, and the goals that it serves there."""

    values: FloatArray
    """Values of the grid's axes in their order [m or rad], shape (axes,)."""
    goals: BoolArray
    """Whether it serves a goal, shape (G,)."""


class FindsWindows(Protocol):
    """Finds parking windows by scoring, which needs simulator and compiler."""

    def __call__(
        self, file: ScoreFile, table: int, stop: ServedStop, least: Window | None
    ) -> WindowTable:
        """Return what is found of a stop: a window that holds what it has to, or what is missed.

        Args:
            file: The score file.
            table: Number of the table.
            stop: The stop.
            least: What the window has to hold; None for the largest window.
        """


@dataclass(frozen=True)
class Windows:
    """The windows of one table of a score file: those that are known, and who finds others."""

    file: ScoreFile
    table: int
    find: FindsWindows | None = None
    """None to use only windows that are known."""

    @property
    def axes(self) -> list[str]:
        """Names of the axes of the grid."""
        return [axis.name for axis in self.file.configurations.axes]

    @property
    def known(self) -> WindowTable | None:
        """Those that are known."""
        return self.file.tables[self.table].known_windows

    def window(self, stop: ServedStop, least: Window | None = None) -> Window | None:
        """Return the window of a stop, looked for if it is not known.

        Raises:
            SelectionError: If it is not known, and cannot be looked for.
        """
        known = self.known
        found = None if known is None else known.window(*stop, least)
        if found is not None or self._is_missed(stop, least):
            return found
        if self.find is None:
            raise SelectionError(
                "parking: windows of these stops are not known yet. Find them: tcs select FILE "
                "--parking."
            )
        new = self.find(self.file, self.table, stop, least)
        self.file.tables[self.table].keep_windows(new if known is None else known.joined(new))
        return new.window(*stop, least)

    def known_window(self, stop: ServedStop, least: Window | None) -> Window | None:
        """Return the window of a stop if one is known that holds what it has to."""
        return None if self.known is None else self.known.window(*stop, least)

    def missed(self, stop: ServedStop, least: Window) -> BoolArray:
        """Return the goals of a stop for which its window is known to be less, shape (G,)."""
        known = self.known
        if known is None:
            return np.zeros_like(stop.goals)
        return known.missed(stop.values, least) & stop.goals

    def _is_missed(self, stop: ServedStop, least: Window | None) -> bool:
        return least is not None and bool(self.missed(stop, least).any())


def served_stops(
    values: FloatArray, reached: BoolArray, dexterity: NDArray[np.float32], order: Sequence[int]
) -> list[ServedStop]:
    """Return the stops of a set with the goals they serve, as plans assign them.

    Args:
        values: Values of the grid's axes of the members, shape (m, axes).
        reached: Whether a member reaches a goal, shape (m, G).
        dexterity: Its dexterity there, shape (m, G).
        order: Order of the visits: of equal members the first one serves.
    """
    visits = list(order)
    able = members_by_dexterity(reached[visits], dexterity[visits])
    server = np.array([visits[one[0]] if one else -1 for one in able])
    return [ServedStop(at, server == member) for member, at in enumerate(values)]


@dataclass(eq=False)
class ParkablePairs:
    """Candidates and goals that they may serve also when they are off by what is wanted.

    A set can be parked only if each goal is served by one of these: the greatest dexterity of its
    members is that of the greatest of them.
    """

    reached: BoolArray
    """What the candidates reach, shape (C + M, G)."""
    dexterity: NDArray[np.float32]
    """Their dexterity there, shape (C + M, G)."""
    kept: BoolArray
    """The pairs that are left, shape (C + M, G)."""
    refused: list[tuple[int, ...]] = field(default_factory=list)
    """Sets that cannot be parked."""

    def __post_init__(self) -> None:
        """Note the dexterity of all pairs, and of those that are left, -1 where there is none."""
        self._of_all = np.where(self.reached, self.dexterity, np.float32(-1.0))
        self._left = np.where(self.kept, self._of_all, np.float32(-1.0))

    @classmethod
    def of(
        cls,
        index: SetIndex,
        scores: tuple[BoolArray, NDArray[np.float32]],
        known: WindowTable | None,
        least: Window,
    ) -> Self:
        """Return the pairs that the neighbours on the grid and known misses leave.

        Args:
            index: The candidates.
            scores: What they reach, and their dexterity there.
            known: What is known of the windows.
            least: The window that every stop must have.
        """
        reached, dexterity = scores
        kept = reached.copy()
        if index.sets.rule == "paper":
            kept[: index.on_grid] &= _held_by_neighbours(index, least)
        if known is not None:
            misses = known.misses(least)
            for row, goals in zip(index.rows_at(misses.values), misses.goals, strict=True):
                kept[row] &= ~goals
        return cls(reached, dexterity, kept)

    def refuse(self, rows: tuple[int, ...], lost: Sequence[BoolArray]) -> None:
        """Leave out a set, and the pairs of its members with the goals they lost, shapes (G,)."""
        self.refused.append(rows)
        for row, goals in zip(rows, lost, strict=True):
            self.kept[row] &= ~goals
            self._left[row, goals] = -1.0

    def admitted(self, found: Admitted | None) -> Admitted:
        """Return what the candidates reach of the pairs that are left."""
        reached = self.reached & self.kept
        if found is None:
            found = Admitted(np.ones(len(reached), np.bool_), reached, self.dexterity, (), (), None)
        return replace(
            found,
            candidates=found.candidates & reached.any(axis=1),
            reached=reached,
            dexterity=np.where(reached, self.dexterity, np.float32(0.0)),
            has_lower_scores=True,
        )

    def of_sets(self, members: tuple[IntArray, ...]) -> BoolArray:
        """Return which sets may be parked, given their members of shapes (n,), shape (n,)."""
        greatest = np.maximum.reduce([self._of_all[column] for column in members])
        possible = np.maximum.reduce([self._left[column] for column in members])
        parkable = np.all(greatest == possible, axis=1)
        for rows in self.refused:
            if len(rows) == len(members):
                columns = zip(members, rows, strict=True)
                parkable &= ~np.logical_and.reduce([column == row for column, row in columns])
        return np.asarray(parkable)


def _held_by_neighbours(index: SetIndex, least: Window) -> BoolArray:
    """Return which goals the neighbours of candidates on the grid reach too, shape (C, G).

    They are the configurations within the window that differ in base position and heading alone.
    """
    sets, grid = index.sets, index.grid
    every = np.zeros((grid.size, sets.weights.size), np.bool_)
    every[sets.candidates] = sets.reached
    along = grid.indices(sets.candidates)
    strides = [int(np.prod(grid.shape[i + 1 :])) for i in range(len(grid.shape))]
    names = [axis.name for axis in grid.axes]
    held, choices = sets.reached.copy(), []
    for name, half in zip(("base_x", "base_y", "base_yaw"), least, strict=True):
        values = grid.axis(name).values
        most = int(half / (values[1] - values[0]) + 1e-9) if len(values) > 1 else 0
        choices.append(sorted({-most, -min(most, 1), 0, min(most, 1), most}))
    for steps in itertools.product(*choices):
        to = sets.candidates.astype(np.int64)
        inside = np.ones(len(to), np.bool_)
        for name, by in zip(("base_x", "base_y", "base_yaw"), steps, strict=True):
            axis = names.index(name)
            at = along[:, axis] + by
            inside &= (at >= 0) & (at < grid.shape[axis])
            to += by * strides[axis]
        held[inside] &= every[to[inside]]
    return held


@dataclass(frozen=True)
class ParkedSet:
    """The set to which the walk led."""

    rows: tuple[int, ...] | None
    """Candidate numbers of its members; None if no set has the windows."""
    looked: int
    """Number of sets whose windows were looked at."""
    nearest: tuple[int, ...] | None
    """The set that comes nearest to having them, if none has."""


def first_parked(
    best: Callable[[Admitted, ParkablePairs], tuple[int, ...] | None],
    stops_of: Callable[[tuple[int, ...]], list[ServedStop]],
    pairs: ParkablePairs,
    found: Admitted | None,
    windows: Windows,
    least: Window,
) -> ParkedSet:
    """Return the best set whose stops all have windows that hold what is wanted.

    What a stop misses within the wanted window is left out of what it reaches, and the best set of
    what is left is looked at next: the order of the sets that have the windows does not change.

    Args:
        best: Returns the best set of admitted candidates that may be parked, None without any.
        stops_of: Returns the stops of a set with the goals they serve.
        pairs: The pairs that may be served; changed.
        found: The candidates that satisfy the constraints; None without constraints.
        windows: The windows.
        least: What is wanted.
    """
    nearest, fewest = None, np.inf
    for looked in range(MOST_SETS):
        admitted = pairs.admitted(found)
        rows = best(admitted, pairs) if np.any(admitted.candidates) else None
        if rows is None:
            return ParkedSet(None, looked, nearest)
        stops = stops_of(rows)
        held = [not stop.goals.any() or windows.window(stop, least) is not None for stop in stops]
        if all(held):
            return ParkedSet(rows, looked + 1, None)
        lost = [windows.missed(stop, least) for stop in stops]
        if (count := float(np.sum(lost))) < fewest:
            nearest, fewest = rows, count
        pairs.refuse(rows, lost)
    return ParkedSet(None, MOST_SETS, nearest)


def none_parked(
    looked: int,
    nearest: tuple[int, ...] | None,
    windows: Windows,
    least: Window,
    stops_of: Callable[[tuple[int, ...]], list[ServedStop]],
) -> SelectionError:
    """Return the error that no set has the windows.

    Args:
        looked: Number of sets that were looked at.
        nearest: The set whose windows are named; None for none.
        windows: The windows.
        least: What is wanted.
        stops_of: Returns the stops of a set with the goals they serve.
    """
    seen = ""
    if nearest is not None:
        found = []
        for values, goals in stops_of(nearest):
            if (window := windows.window(ServedStop(values, goals))) is None:
                continue
            x, y = (values[windows.axes.index(name)] for name in ("base_x", "base_y"))
            found.append(f"({x:.2f}, {y:.2f}) m may be {window_text(window.to_json())}")
        seen = f" Of the nearest to it, the stop at {'; that at '.join(found)}."
    return SelectionError(
        f"parking: no set may be {window_text(least.to_json())} at every stop; {looked} were "
        f"looked at, neighbours on the grid exclude others.{seen} Ask for less."
    )
