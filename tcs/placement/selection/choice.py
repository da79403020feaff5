"""The tables that selection reads, and the choice that it returns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError
from tcs.model.grid import Grid, InitialConfiguration
from tcs.placement.constraints import SAME_VALUE, Footprint, Postures
from tcs.placement.selection.index import SetIndex
from tcs.placement.selection.observed import Match
from tcs.placement.store import ScoreFile
from tcs.placement.store.robot_shapes import RobotShapes
from tcs.placement.tables import RefinedTable, ScoreTable, SetTable, SuccessTable, Window

Basis = Literal["success", "goals", "utility"]
"""What decides: the success under error; most goals, fewest members, greatest P_M; the utility."""

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class SelectionTables:
    """The sets of one table, their grid and their estimates.

    Caches what the search derives from the sets, so that later selections from the same tables are
    faster than the first.
    """

    sets: SetTable
    """The kept sets."""
    grid: Grid
    """The grid of initial configurations."""
    success: SuccessTable | None = None
    """Estimated success under error of some of the sets, if any."""
    read_shapes: Callable[[int], RobotShapes | None] | None = None
    """Returns the robot's shapes with a hand, given its number, if they are known."""
    read_scores: Callable[[], ScoreTable] | None = None
    """Returns the stored solutions."""
    read_frames: Callable[[], dict[str, FloatArray]] | None = None
    """Returns the positions of the body frames in W for each environment state [m], (states, 3)."""
    refined: RefinedTable | None = None
    """Sets refined between the grid points, if any."""
    derived: dict[str, Any] = field(default_factory=dict, repr=False)
    """What was derived from the sets, by name; of a file, kept for its next selection."""
    hand_names: tuple[str, ...] = ()
    """Name of each hand, in a file of several."""

    @classmethod
    def of(cls, file: ScoreFile, table: int | None = None) -> SelectionTables:
        """Return one of the tables of a loaded score file, the nominal one by default."""
        number = file.nominal_index if table is None else table
        chosen = file.tables[number]
        return cls(
            chosen.sets,
            file.configurations,
            chosen.success,
            file.shapes_of_hand,
            partial(getattr, chosen, "scores"),
            partial(_frames, file, number),
            chosen.refined,
            chosen.derived,
            file.hand_names,
        )

    @cached_property
    def shapes(self) -> RobotShapes | None:
        """The robot's shapes with the first hand, None if they are not known."""
        return None if self.read_shapes is None else self.read_shapes(0)

    @cached_property
    def postures(self) -> tuple[Postures, ...]:
        """Where the robot's shapes are with each hand, prepared for obstacles.

        Raises:
            SelectionError: If the robot's shapes are not known.
        """
        kept: tuple[Postures, ...] | None = self.derived.get("postures")
        if kept is not None and kept[0].shapes is self.shapes:
            return kept
        shapes = [
            None if self.read_shapes is None else self.read_shapes(hand)
            for hand in range(max(1, len(self.hand_names)))
        ]
        if self.read_scores is None or None in shapes:
            raise SelectionError(
                "The score file does not hold the robot's shapes, so nothing is known about "
                "contact with an obstacle. Score the task again, or forbid the region instead."
            )
        scores = self.read_scores()
        found = tuple(
            Postures(of_hand, self.sets, self.grid, scores, hand)
            for hand, of_hand in enumerate(shapes)
            if of_hand is not None
        )
        self.derived["postures"] = found
        return found

    def hands_of(self, served: NDArray[np.uint8]) -> tuple[tuple[str | None, ...], ...]:
        """Return the name of the hand that serves each goal from each member; () for one hand.

        Args:
            served: Number of the hand plus 1, 0 for none, shape (m, G).
        """
        if not self.hand_names:
            return ()
        names = (None, *self.hand_names)
        return tuple(tuple(names[hand] for hand in member) for member in served.tolist())

    @property
    def index(self) -> SetIndex:
        """The sets, the refined ones included, prepared for the search."""
        return self._kept_index("index", self.refined)

    @property
    def grid_index(self) -> SetIndex:
        """The sets of the grid alone, prepared for the search."""
        return self.index if self.refined is None else self._kept_index("grid index", None)

    def _kept_index(self, name: str, refined: RefinedTable | None) -> SetIndex:
        found = self.derived.get(name)
        if not isinstance(found, SetIndex) or found.refined is not refined:
            found = self.derived[name] = SetIndex(self.sets, self.grid, refined)
        return found


def changed_axes(
    here: InitialConfiguration | None, members: tuple[InitialConfiguration, ...]
) -> tuple[str, ...]:
    """Return the environment axes that change from the present state, or between members."""
    now = {} if here is None else dict(here.environment)
    return tuple(
        name
        for name, first in members[0].environment
        if any(
            abs(dict(member.environment)[name] - now.get(name, first)) > SAME_VALUE
            for member in members
        )
    )


def _frames(file: ScoreFile, table: int) -> dict[str, FloatArray]:
    """Return the positions of the body frames of a table [m], shapes (states, 3)."""
    count = len(file.tables)
    return {name: np.reshape(at, (count, -1, 3))[table] for name, at in file.body_frames.items()}


@dataclass(frozen=True, slots=True)
class Left:
    """What a constraint and those before it leave."""

    constraint: str
    """The constraint, e.g. "keep bed_height"."""
    configurations: int
    """Number of candidates."""
    solutions: int | None = None
    """Number of their stored solutions, for obstacles."""

    def to_json(self) -> dict[str, Any]:
        """Return the numbers as plain containers."""
        plain: dict[str, Any] = {
            "constraint": self.constraint,
            "configurations": self.configurations,
        }
        return plain if self.solutions is None else {**plain, "solutions": self.solutions}


@dataclass(frozen=True, slots=True)
class Parked:
    """What windows were requested, and how they were met."""

    least: Window
    """What the windows of all stops hold."""
    sets: int
    """Number of sets whose windows were looked at, the selected one included."""

    def to_json(self) -> dict[str, Any]:
        """Return it as plain containers."""
        return {**self.least.to_json(), "sets_looked_at": self.sets}


@dataclass(frozen=True, kw_only=True)
class Choice:
    """The set with the greatest utility, with its scores and cost."""

    members: tuple[InitialConfiguration, ...]
    """The members, in the order of their configuration indices."""
    indices: tuple[int, ...]
    """Flat configuration indices of the members, ascending; of a refined set, those of the grid
    from which it was refined."""
    order: tuple[int, ...]
    """Order in which to visit `members`: the shortest tour."""
    reachability: float
    """P_R of the set, TCS eq. (1)."""
    manipulability: float
    """P_M of the set, TCS eq. (4)."""
    cost: float
    """D of the set from the current state; between its members alone where that is not known."""
    utility: float
    """alpha P_R + beta P_M - gamma D, TCS eq. (5), plus delta P_S if delta is not 0; P_S is the
    lower end of `success_ci95`."""
    success: float | None
    """Estimated success of the set under error; None if it was not estimated."""
    success_ci95: tuple[float, float] | None
    """95 % confidence interval of the success."""
    rooms_done: float | None = None
    """Estimated fraction of rooms in which all goals are done; None if it was not estimated."""
    unreachable: int
    """Number of candidates to which no path leads from the current position."""
    seconds: float
    """Duration of the selection [s]."""
    match: Match | None = None
    """The table of the file that was used, and its distance from the observation."""
    constraints: tuple[Left, ...] = ()
    """Each constraint, and what it and those before it leave."""
    footprint: Footprint | None = None
    """The floor that the robot covers, for forbidden regions; None without any."""
    net_utility: float
    """The utility less the penalties for further members, for moving the environment and for
    violated preferences, by which sets are compared where weights were given."""
    moves: tuple[str, ...]
    """Environment axes that change from the present state to the members, or between these."""
    alternatives: tuple[Choice, ...] = ()
    """Further sets, the best first, if they were requested."""
    fewer: Choice | None = None
    """The best set with fewer members, which this one is better than; None without any."""
    basis: Basis = "utility"
    """By what it was chosen."""
    refined: int | None = None
    """Number of the refined set; None for a set of the grid."""
    warnings: tuple[str, ...] = ()
    """What the user should know about the choice, one sentence each."""
    hands: tuple[tuple[str | None, ...], ...] = ()
    """For each of `members` the name of the hand that serves each goal, None for a goal it does not
    reach; () in a file of one hand."""
    windows: tuple[Window | None, ...] = ()
    """For each of `members` how far it may be off so that it still serves its goals, None where
    that is not known; () where it is of none."""
    parking: Parked | None = None
    """What windows were requested, if any."""

    def to_json(self, measure: str) -> dict[str, Any]:
        """Return the choice as plain containers, as printed by `tcs select --json`.

        Members and their configuration indices are in the order of the tour. Keys of success,
        observation, refined set, constraints and warnings are there only if success was estimated,
        the file has observed axes, a refined set is chosen, windows were requested, there are
        constraints or warnings;
        `fewer`, the best set with fewer members, only beside a set of several.

        Args:
            measure: Name of the dexterity measure behind the manipulability.
        """
        plain: dict[str, Any] = {
            "measure": measure,
            "members": self.members_to_json(),
            "configurations": [self.indices[i] for i in self.order],
            # The sum of seven sevenths is 1 only after rounding.
            "reachability": round(self.reachability, 12),
            "manipulability": round(self.manipulability, 12),
            "cost": self.cost,
            "utility": self.utility,
            "net_utility": self.net_utility,
            "moves": list(self.moves),
            "basis": self.basis,
            "unreachable": self.unreachable,
            "seconds": self.seconds,
        }
        if self.success is not None and self.success_ci95 is not None:
            plain |= {"success": self.success, "success_ci95": list(self.success_ci95)}
        if self.rooms_done is not None:
            plain["rooms_done"] = self.rooms_done
        if self.match is not None and self.match.state:
            plain |= self.match.to_json()
        if self.refined is not None:
            plain["refined"] = self.refined
        if self.parking is not None:
            plain["parking"] = self.parking.to_json()
        if self.constraints:
            plain["constraints"] = [left.to_json() for left in self.constraints]
        if self.footprint is not None:
            plain["footprint"] = self.footprint.to_json()
        if self.fewer is not None:
            plain["fewer"] = self.fewer.compared_with(self)
        if self.alternatives:
            plain["alternatives"] = [other.compared_with(self) for other in self.alternatives]
        if self.warnings:
            plain["warnings"] = list(self.warnings)
        return plain

    def members_to_json(self) -> list[dict[str, Any]]:
        """Return the members as plain containers, in the order of the tour.

        In a file of several hands `hand` is, for each goal, the name of the hand that serves it
        from there, null where it is not reached. `window` is there if the window is known.
        """
        plain: list[dict[str, Any]] = [{**self.members[i].to_json()} for i in self.order]
        for member, i in zip(plain, self.order, strict=True):
            if self.hands:
                member["hand"] = list(self.hands[i])
            if self.windows and (window := self.windows[i]) is not None:
                member["window"] = window.to_json()
        return plain

    def compared_with(self, best: Choice) -> dict[str, Any]:
        """Return an alternative as plain containers, with what it trades against the best set.

        Args:
            best: The best set; `trades` are the differences from it.
        """
        names = ("reachability", "manipulability", "cost", "utility", "net_utility")
        return {
            "members": self.members_to_json(),
            **{name: round(getattr(self, name), 12) for name in names},
            "moves": list(self.moves),
            **({} if self.success is None else {"success": self.success}),
            "trades": {
                **{name: round(getattr(self, name) - getattr(best, name), 12) for name in names},
                "places": len(self.members) - len(best.members),
            },
        }
