"""The best kept sets by the base cell at which their tour starts: what selections share.

If only driving costs, the utility of a set is that of a tour which begins at one of its members,
less the cost of driving there. The first part does not depend on where the robot is: the best of it
is kept for each cell, as a bound until it is needed. A selection then compares a number for each
cell, and computes the utility of the few sets that may be the best, by the same operations as
the search.
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from tcs.placement.selection.bounds import Bounds
from tcs.placement.selection.index import SetIndex
from tcs.placement.selection.penalties import Penalties
from tcs.placement.selection.search import Found, near_best_sets, scores_of
from tcs.placement.selection.travel import Legs
from tcs.placement.selection.utility import UtilityWeights, utility

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

MARGIN = 1e-9
"""Difference of utilities below which sets are compared by their exact utility."""

MOST = 1e3
"""Greatest sum of weights and driving costs: some twenty roundings of it are below a hundredth of
`MARGIN`."""

MOST_NEAR = 64
"""Most sets that are kept for a cell; the search decides where more are near the best."""

MOST_OPENED = 8
"""Most cells whose sets are found for one selection, each by a search of a millisecond; where more
are in question, the whole search is faster."""

KEPT = 16
"""Most kinds of selections that are kept; each takes a kilobyte for each cell that was needed."""

FAR = 1e6
"""Cost of driving that no tour has."""


@dataclass(frozen=True, slots=True)
class KeptSet:
    """A set, and its utility from anywhere."""

    members: tuple[int, ...]
    """Candidate numbers of the members, ascending."""
    gain: float
    """alpha P_R + beta P_M."""
    penalty: float
    """What it pays."""
    tours: tuple[tuple[int, tuple[float, ...]], ...]
    """For each order of the members: the first cell, and the costs of the legs from there."""

    def net(self, here_to_cell: FloatArray, travel: float) -> float:
        """Return the utility less penalties, by the operations of the search.

        Args:
            here_to_cell: Cost of driving to each cell, shape (N,).
            travel: Weight of the travel cost, gamma.
        """
        least = FAR
        for first, legs in self.tours:
            cost = float(here_to_cell[first])
            for leg in legs:
                cost = cost + leg
            least = min(least, cost)
        return (self.gain - travel * least) - self.penalty


class StartCells:
    """The best sets of one size for one kind of selection, by the cell where their tour starts."""

    def __init__(self, most: FloatArray, sets_of: Callable[[int], list[KeptSet]]) -> None:
        """Keep nothing yet.

        Args:
            most: Bound on the utility from each cell, without the drive there, shape (N,).
            sets_of: Returns the sets whose utility from a cell is within `MARGIN` of the best.
        """
        self._most, self._sets_of = most, sets_of
        self._sets: dict[int, list[KeptSet]] = {}

    def near(self, here_to_cell: FloatArray, travel: float, to_beat: float) -> list[KeptSet] | None:
        """Return the sets that may have the greatest utility.

        Args:
            here_to_cell: Cost of driving to each cell, shape (N,).
            travel: Weight of the travel cost, gamma.
            to_beat: A utility; sets below it are not needed.

        Returns:
            The sets, some of them several times; None if the search has to decide.
        """
        drive = travel * here_to_cell
        for _ in range(MOST_OPENED + 1):
            from_cell = self._most - drive
            least = max(float(from_cell.max(initial=-np.inf)), to_beat) - MARGIN
            near = np.flatnonzero(from_cell >= least).tolist()
            unknown = [cell for cell in near if cell not in self._sets]
            if not unknown:
                found = [self._sets[cell] for cell in near]
                is_whole = all(len(sets) <= MOST_NEAR for sets in found)
                return [one for sets in found for one in sets] if is_whole else None
            # The others may be out of question then.
            self._open(max(unknown, key=lambda cell: float(from_cell[cell])), travel)
        return None

    def _open(self, cell: int, travel: float) -> None:
        """Find the sets of a cell."""
        found = self._sets_of(cell)
        start = np.full(self._most.size, FAR)
        start[cell] = 0.0
        # The sets first: another thread may look for them as soon as the bound is lower.
        self._sets[cell] = found[: MOST_NEAR + 1]
        self._most[cell] = max((one.net(start, travel) for one in found), default=-np.inf)


@dataclass(frozen=True, eq=False)
class Starts:
    """One kind of selection: weights, penalties and the cells that can be reached."""

    index: SetIndex
    legs: Legs
    """Legs from any position."""
    weights: UtilityWeights
    penalties: Penalties | None
    _sizes: dict[int, StartCells] = field(default_factory=dict, repr=False)

    def best(self, here_to_cell: FloatArray, most_members: int) -> tuple[int, ...] | None:
        """Return the candidate numbers of the best set, the first among equals.

        Args:
            here_to_cell: Cost of driving to each cell, shape (N,).
            most_members: Greatest number of members.

        Returns:
            The set; None if the search has to decide.
        """
        rows: tuple[int, ...] | None = None
        to_beat = -sys.float_info.max
        travel = float(self.weights.travel)
        for size in range(1, most_members + 1):
            if size not in self._sizes:
                self._sizes[size] = self._singles() if size == 1 else self._larger(size)
            near = self._sizes[size].near(here_to_cell, travel, to_beat)
            if near is None:
                return None
            best: Found | None = None
            for one in near:
                found = Found(one.net(here_to_cell, travel), one.members)
                if found.utility > to_beat and found.beats(best):
                    best = found
            if best is not None:
                rows, to_beat = best.members, best.utility
        return rows

    def _singles(self) -> StartCells:
        sets, start, size = self.index.sets, self.index.start, self.index.size
        scores = sets.single_reachability, sets.single_manipulability
        gain = utility(*scores, np.zeros(scores[0].size), self.weights)
        penalty = np.zeros(gain.size) if self.penalties is None else self.penalties.of_candidates
        net = gain - penalty
        most = np.maximum.reduceat(net[sets.by_cell], start)
        most[~self.legs.reachable] = -np.inf

        def sets_of(cell: int) -> list[KeptSet]:
            members = sets.by_cell[start[cell] : start[cell] + size[cell]]
            return [
                KeptSet((int(one),), float(gain[one]), float(penalty[one]), ((cell, ()),))
                for one in members[net[members] >= net[members].max() - MARGIN]
            ]

        return StartCells(most, sets_of)

    def _larger(self, size: int) -> StartCells:
        groups = self.index.groups[size - 2]
        bounds = Bounds(groups, self.legs, self.weights.of_size(size), None, self.penalties)

        def sets_of(cell: int) -> list[KeptSet]:
            part = groups.part(groups.groups_of(np.array([cell])))
            # Tours that start elsewhere are far: those are found with their own cell.
            start = np.full(self.legs.here_to_cell.size, FAR)
            start[cell] = 0.0
            legs = replace(self.legs, here_to_cell=start)
            of_cell = replace(bounds, index=part, legs=legs)
            return [self._kept(bounds, one) for one in near_best_sets(of_cell, MARGIN)]

        return StartCells(bounds.from_cells(), sets_of)

    def _kept(self, bounds: Bounds, members: tuple[int, ...]) -> KeptSet:
        """Return a set with what its utility is made of."""
        index, legs = self.index, self.legs
        of_set = tuple(np.array([one]) for one in members)
        scores = scores_of(index.dexterity, index.reached, index.sets.weights, of_set)
        gain = float(utility(*scores, np.zeros(1), bounds.weights)[0])
        penalty = 0.0
        if self.penalties is not None:
            penalty = float(self.penalties.of_sets(of_set)[0])
        tours = tuple(
            (
                int(index.sets.cell[members[order[0]]]),
                tuple(
                    float(legs.between(of_set[i], of_set[j])[0])
                    for i, j in itertools.pairwise(order)
                ),
            )
            for order in itertools.permutations(range(len(members)))
        )
        return KeptSet(members, gain, penalty, tours)


def starts_of(
    index: SetIndex, legs: Legs, weights: UtilityWeights, penalties: Penalties | None
) -> Starts | None:
    """Return what selections of this kind share; None at the first one, or if they share nothing.

    Most weights of a single selection are not used again: the search alone is faster for these.

    Args:
        index: The candidates.
        legs: Travel costs from the current state.
        weights: Weights of the utility.
        penalties: Penalties of the sets, if there are any.
    """
    sizes = float(weights.reachability) + float(weights.manipulability)
    sizes += float(weights.travel) * float(legs.here_to_cell.max())
    if penalties is not None:
        sizes += sum(penalties.amounts)
    if legs.level_weights or sizes > MOST:
        return None
    flags = (
        () if penalties is None else (*(f.tobytes() for f in penalties.flags), penalties.amounts)
    )
    key = (weights, legs.metre, type(legs.distances), legs.reachable.tobytes(), flags)
    kept = index.starts
    is_known = key in kept
    found: Starts | None = kept.pop(key, None)
    if is_known and found is None:
        found = Starts(index, legs, weights, penalties)
    for oldest in list(kept)[: max(0, len(kept) + 1 - KEPT)]:
        kept.pop(oldest, None)
    kept[key] = found
    return found
