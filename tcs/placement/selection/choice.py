"""Selection of the stored set with the greatest utility from the current state."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from tcs.errors import SelectionError
from tcs.model.grid import Grid, InitialConfiguration
from tcs.placement.selection.estimated import best_estimated, check_estimated
from tcs.placement.selection.index import SetIndex
from tcs.placement.selection.observed import Match, nearest_table
from tcs.placement.selection.search import best_set
from tcs.placement.selection.travel import Legs, TravelWeights, legs_from, shortest_tour
from tcs.placement.selection.utility import UtilityWeights, utility
from tcs.placement.store import ScoreFile
from tcs.placement.tables import SetTable, SuccessTable
from tcs.placement.tables.sets import MOST_MEMBERS

_DEFAULT_WEIGHTS = UtilityWeights()
_DEFAULT_TRAVEL = TravelWeights()


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

    @classmethod
    def of(cls, file: ScoreFile, table: int | None = None) -> SelectionTables:
        """Return one of the tables of a loaded score file, the nominal one by default."""
        chosen = file.nominal if table is None else file.tables[table]
        return cls(chosen.sets, Grid.from_dict(file.grid), chosen.success)

    @cached_property
    def index(self) -> SetIndex:
        """The sets, prepared for the search."""
        return SetIndex(self.sets)


@dataclass(frozen=True, kw_only=True)
class Choice:
    """The set with the greatest utility, with its scores and cost."""

    members: tuple[InitialConfiguration, ...]
    """The members, in the order of their configuration indices."""
    indices: tuple[int, ...]
    """Flat configuration indices of the members, ascending."""
    order: tuple[int, ...]
    """Order in which to visit `members`: the shortest tour."""
    reachability: float
    """P_R of the set, TCS eq. (1)."""
    manipulability: float
    """P_M of the set, TCS eq. (4)."""
    cost: float
    """D of the set from the current state."""
    utility: float
    """alpha P_R + beta P_M - gamma D, TCS eq. (5), plus delta P_S if delta is not 0; P_S is the
    lower end of `success_ci95`."""
    success: float | None
    """Estimated success of the set under error; None if it was not estimated."""
    success_ci95: tuple[float, float] | None
    """95 % confidence interval of the success."""
    unreachable: int
    """Number of candidates to which no path leads from the current position."""
    seconds: float
    """Duration of the selection [s]."""
    match: Match | None = None
    """The table of the file that was used, and its distance from the observation."""

    def to_json(self, measure: str) -> dict[str, Any]:
        """Return the choice as plain containers, as printed by `tcs select --json`.

        Members are in the order of the tour. Keys of success and observation are there only if
        success was estimated, or the file has observed axes.

        Args:
            measure: Name of the dexterity measure behind the manipulability.
        """
        plain: dict[str, Any] = {
            "measure": measure,
            "members": [self.members[i].to_json() for i in self.order],
            # The sum of seven sevenths is 1 only after rounding.
            "reachability": round(self.reachability, 12),
            "manipulability": round(self.manipulability, 12),
            "cost": self.cost,
            "utility": self.utility,
            "unreachable": self.unreachable,
            "seconds": self.seconds,
        }
        if self.success is not None and self.success_ci95 is not None:
            plain |= {"success": self.success, "success_ci95": list(self.success_ci95)}
        if self.match is not None and self.match.state:
            plain |= self.match.to_json()
        return plain


def select(
    scores: ScoreFile | SelectionTables,
    here: InitialConfiguration,
    *,
    weights: UtilityWeights = _DEFAULT_WEIGHTS,
    travel: TravelWeights = _DEFAULT_TRAVEL,
    max_members: int | None = None,
    observed: Mapping[str, float] | None = None,
    frames: Mapping[str, Sequence[float]] | None = None,
) -> Choice:
    """Return the stored set with the greatest utility from the current state.

    The result equals an exhaustive search of all stored sets; if delta is above 0, of all sets
    whose success under error was estimated (`tcs.placement.robustness`). Ties go to the first set:
    singles by configuration index, then pairs and then triples in lexicographic order.

    Args:
        scores: A loaded score file; or its tables, which is faster for repeated selection.
        here: The current state of robot and environment, h_0, in the environment frame. The base
            may be anywhere; torso and environment axes must be within their scored range, with
            half a step to spare.
        weights: alpha, beta, gamma, delta.
        travel: Cost of each type of motion.
        max_members: 1 to select a single configuration, 2 to allow a pair, 3 a triple; by default
            the greatest stored size.
        observed: Observed state of the person: values of the file's observed axes [m or rad]. The
            table scored for the nearest values is used; an axis that is not given counts as zero.
        frames: Positions of body frames in W [m], by name, in place of `observed`.

    Raises:
        SelectionError: If no configuration reaches a goal, the current state is not finite, is out
            of range or lacks an axis with a weight, `max_members` is not stored, no set is
            reachable around the furniture, or delta is above 0 and no set has an estimate, or no
            triple although `max_members` is 3.
        UnknownNameError: If an environment axis has no such name.

    Source:
        TCS eq. (5). The paper leaves D open; here it is the shortest tour through the members.
    """
    start = time.perf_counter()
    match = None
    if isinstance(scores, ScoreFile):
        match = nearest_table(scores, here, observed, frames)
        tables = SelectionTables.of(scores, match.index)
    elif observed or frames:
        raise SelectionError(
            "Observations select among the tables of a score file, but a single table is given. "
            "Give the file."
        )
    else:
        tables = scores
    sets = tables.sets
    if max_members is None:
        max_members = sets.max_members
    elif weights.success > 0.0:
        check_estimated(sets, tables.success, max_members)
    _check_members(max_members, sets.max_members)
    if not len(sets.candidates):
        raise SelectionError(
            "Nothing to select: no initial configuration reaches a goal. See the reasons with "
            "`tcs explain`, then change the task, the grid or the environment."
        )
    legs = legs_from(
        here, tables.grid, sets.candidates, sets.cell, tables.index.distances[travel.route], travel
    )
    if not np.any(legs.reachable):
        raise SelectionError(
            f"From ({here.base_x:.2f}, {here.base_y:.2f}) m no path around the furniture leads to "
            "any candidate base pose. Check the position, or use straight lines."
        )
    if weights.success > 0.0:
        chosen = best_estimated(sets, tables.success, legs, weights, max_members)
        return _choice(tables, legs, weights, chosen, start, match)
    singles = utility(sets.single_reachability, sets.single_manipulability, legs.from_here, weights)
    singles[~legs.reachable[sets.cell]] = -np.inf
    single = int(np.argmax(singles))
    rows: tuple[int, ...] = (single,)
    best = float(singles[single])
    for groups in tables.index.groups[: max_members - 1]:
        found = best_set(groups, legs, weights, best)
        if found is not None:
            rows, best = found.members, found.utility
    return _choice(tables, legs, weights, rows, start, match)


def _check_members(requested: int, stored: int) -> None:
    """Refuse a number of members below 1, or greater than the table holds."""
    if requested < 1:
        raise SelectionError(f"max_members is {requested}; must be 1 or more.")
    if requested > stored:
        sizes = " and ".join(str(n) for n in range(1, stored + 1))
        raise SelectionError(
            f"max_members is {requested}, but the table holds sets of {sizes} only. "
            + (
                f"Score the task again: tcs score ... --max-members {requested}."
                if requested <= MOST_MEMBERS
                else f"No set has more than {MOST_MEMBERS}."
            )
        )


def _choice(
    tables: SelectionTables,
    legs: Legs,
    weights: UtilityWeights,
    rows: tuple[int, ...],
    start: float,
    match: Match | None,
) -> Choice:
    """Return the choice of the set of candidates `rows`; `start` is when selection began."""
    member = np.array(rows)
    between = legs.between(member[:, None], member[None, :])
    cost, order = shortest_tour([float(leg) for leg in legs.from_here[member]], between)
    indices = tuple(int(h) for h in tables.sets.candidates[member])
    reachability, manipulability = tables.sets.scores_of(indices)
    row = tables.success.row_of(indices) if tables.success is not None else None
    success, interval, low = None, None, None
    if tables.success is not None and row is not None:
        success = float(tables.success.success[row])
        interval = (float(tables.success.low[row]), float(tables.success.high[row]))
        low = interval[0]
    return Choice(
        members=tuple(tables.grid.configuration(h) for h in indices),
        indices=indices,
        order=order,
        reachability=reachability,
        manipulability=manipulability,
        cost=cost,
        utility=utility(reachability, manipulability, cost, weights, low),
        success=success,
        success_ci95=interval,
        unreachable=int(np.count_nonzero(~legs.reachable[tables.sets.cell])),
        seconds=time.perf_counter() - start,
        match=match,
    )
