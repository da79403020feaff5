"""Selection of a stored set: the recommended one, or the one with the greatest utility."""

from __future__ import annotations

import itertools
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError
from tcs.model.grid import Grid, InitialConfiguration
from tcs.model.random_streams import check_draws, named_generator
from tcs.placement.constraints import Constraints, disliked_candidates
from tcs.placement.selection.admission import (
    Admitted,
    admitted_at_limbs,
    admitted_candidates,
    admitted_executable,
    motions_at,
)
from tcs.placement.selection.alternatives import Distinct, Top
from tcs.placement.selection.bounds import Bounds
from tcs.placement.selection.branch_and_bound import best_set
from tcs.placement.selection.choice import Choice, SelectionTables, changed_axes
from tcs.placement.selection.distances import ON_EDGE, LatticeDistances
from tcs.placement.selection.estimated import (
    Candidates,
    best_estimated,
    check_estimated,
    none_estimated,
)
from tcs.placement.selection.observed import Match, nearest_table
from tcs.placement.selection.penalties import Penalties, penalties_of
from tcs.placement.selection.ranking import Ranking, ranking_of
from tcs.placement.selection.refined import RefinedQuery, grid_only
from tcs.placement.selection.travel import Legs, TravelWeights, legs_from, shortest_tour
from tcs.placement.selection.utility import UtilityWeights, utility
from tcs.placement.store import MotionFile, ScoreFile
from tcs.placement.tables import tc_manipulability, tc_reachability
from tcs.placement.tables.sets import MOST_MEMBERS

_DEFAULT_TRAVEL = TravelWeights()
_NO_CONSTRAINTS = Constraints()
MOST_CHOSEN = 1000
"""Most sets whose members and scores are kept, a kilobyte each: few are the best from anywhere."""


def select(
    scores: ScoreFile | SelectionTables,
    here: InitialConfiguration | None = None,
    *,
    weights: UtilityWeights | None = None,
    travel: TravelWeights = _DEFAULT_TRAVEL,
    constraints: Constraints = _NO_CONSTRAINTS,
    top: Top | None = None,
    max_members: int | None = None,
    observed: Mapping[str, float] | None = None,
    frames: Mapping[str, Sequence[float]] | None = None,
    motions: MotionFile | None = None,
    refined: bool = True,
) -> Choice:
    """Return the recommended set, or with weights the stored set with the greatest utility.

    The recommended set is the most robust one where success under error was estimated
    (`tcs.placement.robustness`): that of the greatest lower confidence bound. Without estimates it
    is the set with the greatest utility from the current state by the default weights; and where
    the current state is not known either, the set that reaches most goals, of these one with the
    fewest members, of these the one with the greatest P_M.

    The result equals an exhaustive search of all stored sets; if delta is above 0, of all sets
    whose success under error was estimated. Ties go to the first set: singles by configuration
    index, then pairs and then triples in lexicographic order.

    Args:
        scores: A loaded score file; or its tables, which is faster for repeated selection.
        here: The current state of robot and environment, h_0, in the environment frame. The base
            may be anywhere; torso and environment axes must be within their scored range, with
            half a step to spare. None if it is not known: then neither travel nor moving the
            environment costs anything, and D is the distance between the members.
        weights: alpha, beta, gamma, delta of the utility; None for the recommended set.
        travel: Cost of each type of motion.
        constraints: What every member of the set must satisfy. The stored sets that satisfy them
            are compared; no set is added for those that are excluded.
        top: Number of sets to offer, and by how much they differ; by default the best alone.
        max_members: 1 to select a single configuration, 2 to allow a pair, 3 a triple; by default
            the greatest stored size.
        observed: Observed state of the person: values of the file's observed axes [m or rad]. The
            table scored for the nearest values is used; an axis that is not given counts as zero.
        frames: Positions of body frames in W [m], by name, in place of `observed`. With several,
            each goal also has to be reached in the table nearest to its own frame.
        motions: The motions of the score file, by `tcs.examine`: only goals to which one was found
            count, and only configurations that were examined are selected.
        refined: Whether the refined sets of the file, by `tcs.refine`, are compared too. They are
            not, and a warning says so, where something is requested that only the sets of the grid
            answer: obstacles, preferences, limbs in several tables, motions, success under error.

    Raises:
        StoreMismatchError: If the motions were planned for other scores.
        SelectionError: If no configuration reaches a goal, the current state is not finite, is out
            of range or lacks an axis with a weight, or is not given although `keep` needs it,
            `max_members` is not stored, no set is reachable around the furniture or satisfies the
            constraints, or delta is above 0 and no set has an estimate, or no triple although
            `max_members` is 3.
        UnknownNameError: If an axis has no such name.
        GridError: If a condition of the constraints has the unit of another axis, or excludes
            every value of its axis.

    Source:
        TCS eq. (5). The paper leaves D open; here it is the shortest tour through the members.
    """
    start = time.perf_counter()
    match, tables = _tables_of(scores, here, observed, frames)
    sets = tables.sets
    if max_members is None:
        max_members = sets.max_members
    elif weights is not None and weights.success > 0.0:
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
    if here is not None and not np.any(legs.reachable):
        raise SelectionError(
            f"From ({here.base_x:.2f}, {here.base_y:.2f}) m no path around the furniture leads to "
            "any candidate base pose. Check the position, or use straight lines."
        )
    found = None
    if constraints.exclude:
        found = admitted_candidates(constraints, here, tables)
    if match is not None and match.by_frame and isinstance(scores, ScoreFile):
        found = admitted_at_limbs(scores, match, constraints, found)
    if motions is not None:
        if match is None or not isinstance(scores, ScoreFile):
            raise SelectionError("Motions belong to a score file, not to a single table of it.")
        planned = motions_at(scores, motions, match)
        found = admitted_executable(planned, sets, constraints, found)
    ranked = partial(
        ranking_of,
        weights,
        is_known=here is not None,
        preferences=bool(constraints.prefer),
        most_dexterity=float(sets.dexterity.max(initial=0.0)),
    )
    # Estimates count every goal that a posture reaches.
    ranking = ranked(estimated=tables.success is not None and motions is None)
    query = _Query(
        tables, here, legs, ranking, max_members, found, _disliked(constraints.prefer, tables)
    )
    if weights is None and ranking.basis == "success" and not query.has_estimated:
        query = replace(query, ranking=ranked(estimated=False))
    both = _Both(query, None, constraints)
    warnings: tuple[str, ...] = ()
    if refined and tables.refined is not None:
        limbs = match is not None and len(match.by_frame) > 1
        only_grid = grid_only(
            tables.refined, constraints, query.ranking.weights, limbs=limbs,
            motions=motions is not None,
        )  # fmt: skip
        if only_grid:
            warnings = (f"Refined sets are not compared: {', '.join(only_grid)} need the grid.",)
        else:
            compared = RefinedQuery(tables, tables.refined, here, legs, travel, query.ranking)
            both = replace(both, refined=compared)
    offered = both.offered(top)
    if not offered:
        raise none_estimated(max_members)
    best, *others = offered
    outside = None
    if here is not None and best.refined is None:
        outside = warning_outside(legs, here, query.tour(best), tables.grid)
    if outside is not None:
        warnings = (outside, *warnings)
    return replace(
        best,
        warnings=(*best.warnings, *warnings),
        alternatives=tuple(others),
        fewer=both.with_fewer(best),
        basis=query.ranking.basis,
        match=match,
        seconds=time.perf_counter() - start,
    )


def _disliked(
    preferences: tuple[str, ...], tables: SelectionTables
) -> tuple[NDArray[np.bool_], ...]:
    """Return which candidates violate each preference, shapes (C,)."""
    frames = {} if not preferences or tables.read_frames is None else tables.read_frames()
    return tuple(
        disliked_candidates(text, tables.grid, tables.sets.candidates, frames)
        for text in preferences
    )


def _tables_of(
    scores: ScoreFile | SelectionTables,
    here: InitialConfiguration | None,
    observed: Mapping[str, float] | None,
    frames: Mapping[str, Sequence[float]] | None,
) -> tuple[Match | None, SelectionTables]:
    """Return the tables to select from, and their match with the observation for a file."""
    if isinstance(scores, ScoreFile):
        match = nearest_table(scores, here, observed, frames)
        return match, SelectionTables.of(scores, match.index)
    if observed or frames:
        raise SelectionError(
            "Observations select among the tables of a score file, but a single table is given. "
            "Give the file."
        )
    return None, scores


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


@dataclass(frozen=True)
class _Query:
    """One selection among the sets of the grid: the sets, the state and the request."""

    tables: SelectionTables
    here: InitialConfiguration | None
    legs: Legs
    ranking: Ranking
    max_members: int
    """Greatest number of members of a set."""
    found: Admitted | None
    """The candidates that satisfy the constraints; None without constraints."""
    disliked: tuple[NDArray[np.bool_], ...]
    """Whether a candidate violates each of the preferences, shapes (C,)."""

    def best(self, distinct: Distinct | None, max_members: int) -> tuple[int, ...] | None:
        """Return the candidate numbers of the best set, the first among equals.

        Args:
            distinct: Sets from which it must differ; None if there are none.
            max_members: Greatest number of its members.

        Returns:
            The set, or None if no set differs from those.
        """
        legs, weights, to_gain = self.legs, self.ranking.weights, self.ranking.to_gain
        if weights.success > 0.0:
            return self._best_estimated(distinct, max_members)
        singles = self.singles.copy()
        if distinct is not None:
            singles[~distinct.of_sets((np.arange(singles.size),))] = -np.inf
        single = int(np.argmax(singles))
        rows: tuple[int, ...] | None = (single,)
        best = float(singles[single])
        if best == -np.inf:
            # Excluded candidates have a bound of -inf, which must not suffice.
            rows, best = None, -sys.float_info.max
        for size, groups in enumerate(self.tables.index.groups[: max_members - 1], 2):
            bounds = Bounds(
                groups, legs, weights.of_size(size), self.found, self.penalties, distinct
            )
            found = best_set(bounds, best if rows is None else best + to_gain)
            if found is not None:
                rows, best = found.members, found.utility
        return rows

    def _best_estimated(
        self, distinct: Distinct | None, max_members: int
    ) -> tuple[int, ...] | None:
        """Return the best of the sets with an estimate; as `best`.

        Raises:
            SelectionError: If no set has an estimate.
        """
        sets, success = self.tables.sets, self.tables.success
        candidates = Candidates(self.admitted, *self.scores, self.penalties, distinct)
        weights = self.ranking.weights
        return best_estimated(sets, success, self.legs, weights, max_members, candidates)

    @property
    def has_estimated(self) -> bool:
        """Whether a set with an estimate may be selected."""
        return self._best_estimated(None, self.max_members) is not None

    @cached_property
    def singles(self) -> NDArray[np.float64]:
        """Utility less penalties of each candidate, -inf where it is not admitted, shape (C,)."""
        sets = self.tables.sets
        reachability, manipulability = sets.single_reachability, sets.single_manipulability
        if self.found is not None and self.found.has_lower_scores:
            reachability = tc_reachability(self.found.reached, sets.weights)
            manipulability = tc_manipulability(self.found.dexterity, sets.weights)
        singles = utility(reachability, manipulability, self.legs.from_here, self.ranking.weights)
        if self.penalties is not None:
            singles -= self.penalties.of_candidates
        singles[~self.admitted] = -np.inf
        return singles

    @cached_property
    def penalties(self) -> Penalties | None:
        """Penalties of the sets, if there are any."""
        return self._penalties_by(self.ranking.weights)

    @cached_property
    def stated_penalties(self) -> Penalties | None:
        """Penalties by the weights of the utility that is stated."""
        return self._penalties_by(self.ranking.stated)

    def _penalties_by(self, weights: UtilityWeights) -> Penalties | None:
        tables = self.tables
        return penalties_of(weights, self.here, tables.grid, tables.sets, self.disliked)

    @property
    def scores(self) -> tuple[NDArray[np.bool_], NDArray[np.float32]]:
        """What the candidates reach by solutions that are not blocked, and their dexterity."""
        if self.found is None:
            return self.tables.sets.reached, self.tables.sets.dexterity
        return self.found.reached, self.found.dexterity

    @cached_property
    def admitted(self) -> NDArray[np.bool_]:
        """Whether a candidate is reachable and satisfies the constraints, shape (C,).

        Raises:
            SelectionError: If none is.
        """
        reachable = self.legs.reachable[self.tables.sets.cell]
        if self.found is None:
            return reachable
        both = reachable & self.found.candidates
        if not np.any(both):
            raise SelectionError(
                "No path around the furniture leads to any of the "
                f"{np.count_nonzero(self.found.candidates):,} configurations that the constraints "
                "leave. Relax a constraint, or use straight lines."
            )
        return np.asarray(both)

    def tour(self, choice: Choice) -> tuple[int, ...]:
        """Return the base cells of a choice, in the order of its tour."""
        sets = self.tables.sets
        rows = np.searchsorted(sets.candidates, choice.indices)
        return tuple(int(sets.cell[rows[i]]) for i in choice.order)

    def choice(self, rows: tuple[int, ...]) -> Choice:
        """Return the choice of the set of candidates `rows`."""
        tables, legs = self.tables, self.legs
        member = np.array(rows)
        between = legs.between(member[:, None], member[None, :])
        cost, order = shortest_tour(legs.from_here_to(member).tolist(), between)
        chosen = self._chosen(rows)
        indices, members = chosen.indices, chosen.members
        reachability, manipulability = chosen.reachability, chosen.manipulability
        row = tables.success.row_of(indices) if tables.success is not None else None
        success, interval, low = None, None, None
        if tables.success is not None and row is not None:
            success = float(tables.success.success[row])
            interval = (float(tables.success.low[row]), float(tables.success.high[row]))
            low = interval[0]
        scores, weights = (reachability, manipulability, cost), self.ranking.stated
        net = utility(*scores, weights.of_size(len(rows)), low)
        ranked = utility(*scores, self.ranking.weights.of_size(len(rows)), low)
        columns = tuple(member[:, None])
        if self.stated_penalties is not None:
            net -= float(self.stated_penalties.of_sets(columns)[0])
        if self.penalties is not None:
            ranked -= float(self.penalties.of_sets(columns)[0])
        return Choice(
            members=members,
            indices=indices,
            order=order,
            reachability=reachability,
            manipulability=manipulability,
            cost=cost,
            utility=utility(*scores, weights, low),
            net_utility=net,
            ranked=ranked,
            moves=changed_axes(self.here, members),
            success=success,
            success_ci95=interval,
            unreachable=int(np.count_nonzero(~legs.reachable[tables.sets.cell])),
            constraints=self.found.left if self.found is not None else (),
            footprint=self.found.footprint if self.found is not None else None,
            warnings=self.found.warnings if self.found is not None else (),
            hands=tables.hands_of(np.where(self.scores[0], tables.sets.served, 0)[member])
            if tables.hand_names
            else (),
            seconds=0.0,
        )

    def _chosen(self, rows: tuple[int, ...]) -> _ChosenSet:
        """Return what a set of candidates is from any state; kept with the tables."""
        tables = self.tables
        kept: dict[tuple[int, ...], _ChosenSet] = tables.derived.setdefault("chosen sets", {})
        found = kept.get(rows) if self.found is None else None
        if found is None:
            member = np.array(rows)
            indices = tuple(int(h) for h in tables.sets.candidates[member])
            reached, dexterity = (of_all[member] for of_all in self.scores)
            of_goals = tables.sets.weights
            found = _ChosenSet(
                indices,
                tuple(tables.grid.configuration(h) for h in indices),
                float(tc_reachability(np.any(reached, axis=0), of_goals)),
                float(tc_manipulability(np.max(dexterity, axis=0), of_goals)),
            )
            if self.found is None and len(kept) < MOST_CHOSEN:
                kept[rows] = found
        return found


@dataclass(frozen=True)
class _Both:
    """One selection among the sets of the grid and the refined sets."""

    query: _Query
    refined: RefinedQuery | None
    """The refined sets; None without any, or if they are not compared."""
    constraints: Constraints

    def offered(self, top: Top | None) -> list[Choice]:
        """Return the best set, and further ones that differ from it and from each other."""
        offered: list[Choice] = []
        while len(offered) < (1 if top is None else top.count):
            distinct = None
            if top is not None and offered:
                taken = tuple(choice.placed(self.query.tables.grid) for choice in offered)
                distinct = Distinct(self.query.tables.sets, top.min_apart, taken)
            found = self.best(distinct, self.query.max_members)
            if found is None:
                break
            offered.append(found)
        return offered

    def with_fewer(self, best: Choice) -> Choice | None:
        """Return the best set with fewer members than another; None if there is none."""
        return self.best(None, len(best.members) - 1) if len(best.members) > 1 else None

    def best(self, distinct: Distinct | None, max_members: int) -> Choice | None:
        """Return the best set of the grid, or the best refined set if it is better."""
        query = self.query
        rows = query.best(distinct, max_members)
        best = None if rows is None else query.choice(rows)
        if self.refined is None:
            return best
        refined = self.refined.best(self.constraints, distinct, max_members)
        rank = query.ranking.rank
        if refined is None or (best is not None and rank(refined) <= rank(best)):
            return best
        if query.found is None:
            return refined
        # What a constraint leaves is counted on the grid.
        return replace(refined, constraints=query.found.left, footprint=query.found.footprint)


@dataclass(frozen=True, slots=True)
class _ChosenSet:
    """A set of candidates, without what depends on the current state."""

    indices: tuple[int, ...]
    members: tuple[InitialConfiguration, ...]
    reachability: float
    manipulability: float


def warning_outside(
    legs: Legs, here: InitialConfiguration, cells: tuple[int, ...], grid: Grid
) -> str | None:
    """Return a warning if the path around the furniture leaves the grid, else None.

    Args:
        legs: Travel from the current state, by either route; a straight path, which ignores the
            furniture, causes no warning.
        here: The current state.
        cells: Base cells of the members, in the order of the tour.
        grid: The scored grid.
    """
    distances = legs.distances
    if not isinstance(distances, LatticeDistances):
        return None
    axes = (grid.axis("base_x"), grid.axis("base_y"))
    low = np.array([axis.values[0] for axis in axes])
    high = np.array([axis.values[-1] for axis in axes])
    covered = f"x {low[0]:g} to {high[0]:g} m, y {low[1]:g} to {high[1]:g} m"
    start = np.array([here.base_x, here.base_y])
    if np.any((start < low - ON_EDGE) | (start > high + ON_EDGE)):
        return (
            f"The path around the furniture starts outside the scored grid ({covered}), where the "
            "scores do not show what blocks the base."
        )
    metres = [float(legs.here_to_cell[cells[0]]) / legs.metre if legs.metre else np.inf]
    metres += [
        float(distances.between(np.array(one), np.array(other)))
        for one, other in itertools.pairwise(cells)
    ]
    stops = np.concatenate([start[None], distances.cell_xy[list(cells)]])
    to_edge = np.minimum(stops - low, high - stops).min(axis=1)
    # A leg that is too short to reach the edge and return needs no search.
    if np.all(np.array(metres) <= to_edge[:-1] + to_edge[1:]):
        return None
    path = distances.path(float(start[0]), float(start[1]), cells, low, high)
    outside = np.any((path < low - ON_EDGE) | (path > high + ON_EDGE), axis=1)
    if not np.any(outside):
        return None
    x, y = path[int(np.argmax(outside))]
    return (
        f"The path around the furniture leaves the scored grid ({covered}) at ({x:.2f}, {y:.2f}) "
        "m; beyond it the scores do not show what blocks the base."
    )


def same_set(
    choose: Callable[[InitialConfiguration], Choice],
    here: InitialConfiguration,
    covariance: NDArray[np.float64],
    *,
    draws: int = 100,
    seed: int = 0,
) -> float:
    """Return the fraction of random current base poses from which the same set is selected.

    Args:
        choose: Returns the choice from a state.
        here: The estimated state.
        covariance: Covariance of x, y and yaw of the base in the environment frame [m, rad], shape
            (3, 3).
        draws: Number of base poses, drawn from a normal distribution.
        seed: Seed of the random numbers.

    Raises:
        SelectionError: If no set can be selected from `here`.
        TcsError: If the number of draws or the seed is out of range.
    """
    check_draws(draws, seed)
    selected = choose(here).indices
    values, axes = np.linalg.eigh(covariance)
    normal = named_generator(seed, "located base").standard_normal((draws, 3))
    same = 0
    for x, y, yaw in normal @ (axes * np.sqrt(np.maximum(values, 0.0))).T:
        moved = replace(
            here,
            base_x=here.base_x + float(x),
            base_y=here.base_y + float(y),
            base_yaw=here.base_yaw + float(yaw),
        )
        try:
            same += choose(moved).indices == selected
        except SelectionError:
            # From there, no set can be selected.
            continue
    return same / draws
