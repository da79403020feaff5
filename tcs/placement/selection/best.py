"""Selection of a stored set: the recommended one, or the one with the greatest utility."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError
from tcs.model.grid import InitialConfiguration
from tcs.model.random_streams import check_draws, named_generator
from tcs.placement.constraints import Constraints, disliked_candidates
from tcs.placement.selection.admission import (
    Admitted,
    admitted_at_limbs,
    admitted_candidates,
    admitted_executable,
    motions_at,
)
from tcs.placement.selection.alternatives import AmongSets, Distinct, Top
from tcs.placement.selection.bounds import Bounds
from tcs.placement.selection.branch_and_bound import best_set, tour_costs
from tcs.placement.selection.choice import Choice, Parked, SelectionTables, changed_axes
from tcs.placement.selection.index import SetIndex
from tcs.placement.selection.listed import (
    ListedSets,
    answered_by_grid,
    check_estimated,
    none_estimated,
)
from tcs.placement.selection.observed import Match, nearest_table
from tcs.placement.selection.parked import (
    FindsWindows,
    ParkablePairs,
    ServedStop,
    Windows,
    first_parked,
    none_parked,
    served_stops,
)
from tcs.placement.selection.penalties import Penalties, penalties_of
from tcs.placement.selection.ranking import Ranking, ranking_of
from tcs.placement.selection.travel import (
    Legs,
    TravelWeights,
    legs_from,
    shortest_tour,
    warning_outside,
)
from tcs.placement.selection.utility import UtilityWeights, utility
from tcs.placement.store import MotionFile, ScoreFile
from tcs.placement.tables import (
    Estimates,
    RefinedTable,
    Window,
    tc_manipulability,
    tc_reachability,
)
from tcs.placement.tables.sets import MOST_MEMBERS
from tcs.placement.tables.success import NO_MEMBER

FloatArray = NDArray[np.float64]

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
    parking: Sequence[float] | None = None,
    find_windows: FindsWindows | None = None,
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
        parking: By how much the base may be off at every stop, in x [m], y [m] and heading [deg]:
            only sets are selected from each of whose stops the goals that it serves are still
            reached (and approached) then, as found by scoring base poses around it. Of three times
            0 the windows are found and none is required; None to find none.
        find_windows: Who finds parking windows that the file does not hold yet; None for nobody.
            `tcs.select` scores them.

    Raises:
        StoreMismatchError: If the motions were planned for other scores.
        SelectionError: If no configuration reaches a goal, the current state is not finite, is out
            of range or lacks an axis with a weight, or is not given although `keep` needs it,
            `max_members` is not stored, no set is reachable around the furniture or satisfies the
            constraints, or delta is above 0 and no set has an estimate, or no triple although
            `max_members` is 3, or no set holds the parking window, or it is requested together
            with what it was not scored for.
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
    limbs = match is not None and len(match.by_frame) > 1
    of_grid = answered_by_grid(constraints, limbs=limbs, motions=motions is not None)
    index = tables.index if refined and not of_grid else tables.grid_index
    legs = legs_from(
        here, tables.grid, sets.candidates, index.cell, index.distances[travel.route], travel,
        index.off_grid,
    )  # fmt: skip
    if here is not None and not np.any(legs.reachable):
        raise SelectionError(
            f"From ({here.base_x:.2f}, {here.base_y:.2f}) m no path around the furniture leads to "
            "any candidate base pose. Check the position, or use straight lines."
        )
    found = None
    if constraints.exclude:
        found = admitted_candidates(constraints, here, tables, index)
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
    disliked = _disliked(constraints.prefer, tables)
    windows = None
    # Windows are of the scene as it was scored.
    if match is not None and isinstance(scores, ScoreFile) and not _is_changed(constraints, limbs):
        windows = Windows(scores, match.index, find_windows)
    query = _Query(tables, index, here, legs, ranking, max_members, found, disliked, windows)
    if weights is None and ranking.basis == "success" and not query.has_estimated:
        query = replace(query, ranking=ranked(estimated=False))
    if tables.refined is not None and refined and query.lacks_estimates(tables.refined):
        of_grid = [*of_grid, "success under error"]
    parked = None
    if parking is not None:
        if top is not None:
            raise SelectionError("parking selects one set. Leave 'top' out, or the parking window.")
        query = replace(query, least=Window.wanted(parking) if any(parking) else None)
        parked, offered = query.parked()
    else:
        offered = query.offered(top)
    if not offered:
        raise none_estimated(max_members)
    best, *others = (query.choice(rows) for rows in offered)
    warnings: tuple[str, ...] = ()
    if tables.refined is not None and refined and of_grid:
        warnings = (f"Refined sets are not compared: {', '.join(of_grid)} need the grid.",)
    outside = None
    if here is not None and best.refined is None:
        cells = tuple(int(index.cell[offered[0][i]]) for i in best.order)
        outside = warning_outside(legs, here, cells, tables.grid)
    if outside is not None:
        warnings = (outside, *warnings)
    fewer = None
    # One with fewer members need not have the windows.
    if len(best.members) > 1 and parking is None:
        fewer = query.best(None, len(best.members) - 1)
    return replace(
        best,
        parking=parked,
        warnings=(*best.warnings, *warnings),
        alternatives=tuple(others),
        fewer=None if fewer is None else query.choice(fewer),
        basis=query.ranking.basis,
        match=match,
        seconds=time.perf_counter() - start,
    )


def _is_changed(constraints: Constraints, limbs: bool) -> bool:
    """Return whether a selection is in another scene than the one that was scored."""
    return limbs or bool(constraints.blocked or constraints.forbid)


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
    """One selection: the candidates, the state and the request."""

    tables: SelectionTables
    index: SetIndex
    """The candidates."""
    here: InitialConfiguration | None
    legs: Legs
    ranking: Ranking
    max_members: int
    """Greatest number of members of a set."""
    found: Admitted | None
    """The candidates that satisfy the constraints; None without constraints."""
    disliked: tuple[NDArray[np.bool_], ...]
    """Whether a candidate violates each of the preferences, shapes (C,)."""
    windows: Windows | None = None
    """Parking windows of the stops; None where they are not of this scene."""
    least: Window | None = None
    """The window that every stop must have."""

    def parked(self) -> tuple[Parked, list[tuple[int, ...]]]:
        """Return what was requested, and the best set whose stops have the window, [] without any.

        Raises:
            SelectionError: If none has, or windows are not of this scene.
        """
        if self.windows is None:
            raise SelectionError(
                "parking: windows are of the scene as it was scored, without further obstacles and "
                "forbidden regions, the person as in one table. Score it with these, then select."
            )
        if (least := self.least) is None:
            offered = self.offered(None)
            for stop in self.stops_of(offered[0]) if offered else ():
                if stop.goals.any():
                    self.windows.window(stop)
            return Parked(Window(0.0, 0.0, 0.0), 1), offered
        pairs = ParkablePairs.of(self.index, self.scores, self.windows.known, least)
        walk = first_parked(
            lambda found, among: replace(self, found=found).best(among, self.max_members),
            self.stops_of,
            pairs,
            self.found,
            self.windows,
            least,
        )
        if walk.rows is not None:
            return Parked(least, walk.looked), [walk.rows]
        nearest = walk.nearest or next(iter(self.offered(None)), None)
        raise none_parked(walk.looked, nearest, self.windows, least, self.stops_of)

    def stops_of(self, rows: tuple[int, ...]) -> list[ServedStop]:
        """Return the stops of a set of candidates with the goals that they serve."""
        member, legs = np.array(rows), self.legs
        between = legs.between(member[:, None], member[None, :])
        _, order = shortest_tour(legs.from_here_to(member).tolist(), between)
        reached, dexterity = (of_all[member] for of_all in self.scores)
        return served_stops(self.index.values_of(member), reached, dexterity, order)

    def offered(self, top: Top | None) -> list[tuple[int, ...]]:
        """Return the best set, and further ones that differ from it and from each other."""
        offered: list[tuple[int, ...]] = []
        while len(offered) < (1 if top is None else top.count):
            distinct = None
            if top is not None and offered:
                distinct = Distinct(self.index, top.min_apart, offered)
            found = self.best(distinct, self.max_members)
            if found is None:
                break
            offered.append(found)
        return offered

    def best(self, distinct: AmongSets | None, max_members: int) -> tuple[int, ...] | None:
        """Return the candidate numbers of the best set, the first among equals.

        Args:
            distinct: Sets from which it must differ; None if there are none.
            max_members: Greatest number of its members.

        Returns:
            The set, or None if no set differs from those.

        Raises:
            SelectionError: If the success decides, and no set has an estimate.
        """
        if self.ranking.weights.success > 0.0:
            listed = ListedSets.estimated(self.tables.success, self.index)
            best = self._best_listed(listed, distinct, max_members)
        else:
            best = self._best_kept(distinct, max_members)
        refined = self.index.refined
        if refined is None or self.lacks_estimates(refined):
            return best
        listed = ListedSets.refined(self.index)
        return self._best_listed(listed, distinct, max_members, to_beat=best)

    def lacks_estimates(self, refined: RefinedTable) -> bool:
        """Return whether the success decides, and that of the refined sets is not known."""
        return self.ranking.weights.success > 0.0 and refined.success is None

    def _best_kept(self, distinct: AmongSets | None, max_members: int) -> tuple[int, ...] | None:
        """Return the best of the kept sets of the grid; as `best`."""
        legs, weights, to_gain = self.legs, self.ranking.weights, self.ranking.to_gain
        singles = self.singles.copy()
        if distinct is not None:
            singles[~distinct.of_sets((np.arange(singles.size),))] = -np.inf
        single = int(np.argmax(singles))
        rows: tuple[int, ...] | None = (single,)
        best = float(singles[single])
        if best == -np.inf:
            # Excluded candidates have a bound of -inf, which must not suffice.
            rows, best = None, -sys.float_info.max
        for size, groups in enumerate(self.index.groups[: max_members - 1], 2):
            bounds = Bounds(
                groups, legs, weights.of_size(size), self.found, self.penalties, distinct
            )
            found = best_set(bounds, best if rows is None else best + to_gain)
            if found is not None:
                rows, best = found.members, found.utility
        return rows

    def _best_listed(
        self,
        listed: ListedSets,
        distinct: AmongSets | None,
        max_members: int,
        to_beat: tuple[int, ...] | None = None,
    ) -> tuple[int, ...] | None:
        """Return the best of some listed sets; as `best`.

        Args:
            listed: The sets.
            distinct: As for `best`.
            max_members: As for `best`.
            to_beat: A set that is returned unless one of them is better.
        """
        keys = np.full((3, len(listed.members)), -np.inf)
        for size in range(1, max_members + 1):
            rows, members = listed.of_size(size)
            feasible = np.logical_and.reduce([self.admitted[column] for column in members])
            if distinct is not None:
                feasible &= distinct.of_sets(members)
            rows, members = rows[feasible], tuple(column[feasible] for column in members)
            if rows.size:
                keys[:, rows] = self._keys(
                    members, None if listed.low is None else listed.low[rows]
                )
        best = int(np.lexsort(-keys[::-1])[0]) if keys.size else 0
        if not keys.size or keys[0, best] == -np.inf:
            return to_beat
        if to_beat is not None:
            low = self._low_of(to_beat)
            columns = tuple(np.array([member]) for member in to_beat)
            key = self._keys(columns, None if low is None else np.array([low]))
            if tuple(keys[:, best]) <= tuple(key[:, 0]):
                return to_beat
        return tuple(int(i) for i in listed.members[best] if i != NO_MEMBER)

    def _keys(self, members: tuple[NDArray[np.int64], ...], low: FloatArray | None) -> FloatArray:
        """Return the keys by which sets of one size are compared, of `Ranking.rank`, shape (3, n).

        Args:
            members: Candidate numbers of their members, shapes (n,).
            low: Lower confidence bound of their success, shape (n,); None if that is not known.
        """
        of_goals, (reached, dexterity) = self.index.sets.weights, self.scores
        scores = (
            tc_reachability(np.logical_or.reduce([reached[c] for c in members]), of_goals),
            tc_manipulability(np.maximum.reduce([dexterity[c] for c in members]), of_goals),
        )
        weights = self.ranking.weights.of_size(len(members))
        value = utility(*scores, tour_costs(self.legs, members), weights, low)
        if self.penalties is not None:
            value = value - self.penalties.of_sets(members)
        return self.ranking.rank(*scores, len(members), value)

    @property
    def has_estimated(self) -> bool:
        """Whether a set of the grid with an estimate may be selected."""
        listed = ListedSets.estimated(self.tables.success, self.index)
        return self._best_listed(listed, None, self.max_members) is not None

    @cached_property
    def singles(self) -> FloatArray:
        """Utility less penalties of each candidate, -inf where it is not admitted, shape (C,)."""
        sets, on_grid = self.index.sets, slice(self.index.on_grid)
        reachability, manipulability = sets.single_reachability, sets.single_manipulability
        if self.found is not None and self.found.has_lower_scores:
            reachability = tc_reachability(self.found.reached, sets.weights)
            manipulability = tc_manipulability(self.found.dexterity, sets.weights)
        cost = self.legs.from_here[on_grid]
        singles = utility(reachability, manipulability, cost, self.ranking.weights)
        if self.penalties is not None:
            singles -= self.penalties.of_candidates[on_grid]
        singles[~self.admitted[on_grid]] = -np.inf
        return singles

    @cached_property
    def penalties(self) -> Penalties | None:
        """Penalties of the sets, if there are any."""
        return penalties_of(self.ranking.weights, self.here, self.index, self.disliked)

    @cached_property
    def stated_penalties(self) -> Penalties | None:
        """Penalties by the weights of the utility that is stated."""
        return penalties_of(self.ranking.stated, self.here, self.index, self.disliked)

    @property
    def scores(self) -> tuple[NDArray[np.bool_], NDArray[np.float32]]:
        """What the candidates reach by solutions that are not blocked, and their dexterity."""
        if self.found is None:
            return self.index.reached_goals, self.index.dexterity_at
        return self.found.reached, self.found.dexterity

    @cached_property
    def admitted(self) -> NDArray[np.bool_]:
        """Whether a candidate is reachable and satisfies the constraints, shape (C + M,).

        Raises:
            SelectionError: If none of the grid is.
        """
        reachable = self.legs.reachable[self.index.cell]
        if self.found is None:
            return reachable
        both, on_grid = reachable & self.found.candidates, slice(self.index.on_grid)
        if not np.any(both[on_grid]):
            raise SelectionError(
                "No path around the furniture leads to any of the "
                f"{np.count_nonzero(self.found.candidates[on_grid]):,} configurations that the "
                "constraints leave. Relax a constraint, or use straight lines."
            )
        return np.asarray(both)

    def choice(self, rows: tuple[int, ...]) -> Choice:
        """Return the choice of the set of candidates `rows`."""
        tables, legs, index = self.tables, self.legs, self.index
        member = np.array(rows)
        between = legs.between(member[:, None], member[None, :])
        cost, order = shortest_tour(legs.from_here_to(member).tolist(), between)
        chosen = self._chosen(rows)
        indices, members = chosen.indices, chosen.members
        reachability, manipulability = chosen.reachability, chosen.manipulability
        success = self._success_of(rows)
        low = None if success is None else success[1]
        scores, weights = (reachability, manipulability, cost), self.ranking.stated
        net = utility(*scores, weights.of_size(len(rows)), low)
        if self.stated_penalties is not None:
            net -= float(self.stated_penalties.of_sets(tuple(member[:, None]))[0])
        return Choice(
            members=members,
            indices=indices,
            order=order,
            reachability=reachability,
            manipulability=manipulability,
            cost=cost,
            utility=utility(*scores, weights, low),
            net_utility=net,
            moves=changed_axes(self.here, members),
            success=None if success is None else success[0],
            success_ci95=None if success is None else success[1:],
            rooms_done=self._rooms_of(rows),
            unreachable=int(np.count_nonzero(~legs.reachable[index.sets.cell])),
            constraints=self.found.left if self.found is not None else (),
            footprint=self.found.footprint if self.found is not None else None,
            refined=index.refined_set(rows[0]),
            warnings=self.found.warnings if self.found is not None else (),
            hands=tables.hands_of(np.where(self.scores[0][member], index.served[member], 0))
            if tables.hand_names
            else (),
            windows=()
            if self.windows is None or self.windows.known is None
            else tuple(self.windows.known_window(stop, self.least) for stop in self.stops_of(rows)),
            seconds=0.0,
        )

    def _estimate_of(self, rows: tuple[int, ...]) -> tuple[Estimates, int] | None:
        """Return the table with the estimate of a set, and its row; None without an estimate."""
        number, refined = self.index.refined_set(rows[0]), self.index.refined
        if refined is not None and number is not None:
            return None if refined.success is None else (refined.success, number)
        known = self.tables.success
        number = None if known is None else known.row_of(self._chosen(rows).indices)
        return None if known is None or number is None else (known, number)

    def _success_of(self, rows: tuple[int, ...]) -> tuple[float, float, float] | None:
        """Return mean, lower and upper end of the success of a set; None without an estimate."""
        found = self._estimate_of(rows)
        return None if found is None else found[0].at(found[1])

    def _rooms_of(self, rows: tuple[int, ...]) -> float | None:
        """Return in which fraction of rooms a set does all goals; None without an estimate."""
        found = self._estimate_of(rows)
        return None if found is None else found[0].rooms_at(found[1])

    def _low_of(self, rows: tuple[int, ...]) -> float | None:
        """Return the lower confidence bound of the success of a set; None without an estimate."""
        found = self._success_of(rows)
        return None if found is None else found[1]

    def _chosen(self, rows: tuple[int, ...]) -> _ChosenSet:
        """Return what a set of candidates is from any state; kept with the candidates."""
        index = self.index
        found: _ChosenSet | None = index.chosen.get(rows) if self.found is None else None
        if found is None:
            member = np.array(rows)
            reached, dexterity = (of_all[member] for of_all in self.scores)
            of_goals = index.sets.weights
            found = _ChosenSet(
                tuple(int(h) for h in index.flat[member]),
                tuple(index.configuration(row) for row in rows),
                float(tc_reachability(np.any(reached, axis=0), of_goals)),
                float(tc_manipulability(np.max(dexterity, axis=0), of_goals)),
            )
            if self.found is None and len(index.chosen) < MOST_CHOSEN:
                index.chosen[rows] = found
        return found


@dataclass(frozen=True, slots=True)
class _ChosenSet:
    """A set of candidates, without what depends on the current state."""

    indices: tuple[int, ...]
    members: tuple[InitialConfiguration, ...]
    reachability: float
    manipulability: float


def same_set(
    choose: Callable[[InitialConfiguration], Choice],
    here: InitialConfiguration,
    covariance: FloatArray,
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
