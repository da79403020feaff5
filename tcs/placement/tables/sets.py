"""Sets of configurations: rules which are kept, their groups by base cells, and the lattice.

Pairs of configurations come in tens of millions, so they are not listed. They
are grouped by the two base cells (x-y places) of their members, and for each
pair of cells the table holds how many pairs were kept and upper bounds on
their scores. This is sufficient to find the best pair exactly (see `tcs.select`),
because the score of a pair follows from the dexterity of its two members.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from tcs.errors import UnknownNameError
from tcs.placement.tables.columns import ArrayTable, Column, Columns, Form, require
from tcs.placement.tables.equations import tc_manipulability, tc_reachability

MOVES = ((1, 0), (0, 1), (1, 1), (1, -1))
"""Steps along x and y of the four types of moves; each also goes backward."""


@dataclass(frozen=True, kw_only=True, eq=False)
class BaseLattice(ArrayTable):
    """X by Y base positions, and the straight moves between neighbours.

    The lattice extends beyond the base positions of the grid. The area beyond the lattice is free.
    """

    start: tuple[float, float]
    """x and y of the first position in W [m]."""
    step: tuple[float, float]
    """Distance of neighbours along x and along y [m]; positive."""
    moves: NDArray[np.bool_]
    """Whether the base can move from position (i, j) by each of `MOVES`, shape (4, X, Y)."""

    WHAT = "base lattice"
    COLUMNS: ClassVar[Columns] = {"moves": Column(np.bool_, f"{len(MOVES)} X Y", Form.APART)}

    def __post_init__(self) -> None:
        """Check the lattice and make its array read-only.

        Raises:
            TcsError: If a number is not finite, a step not positive, there are fewer than two
                positions along an axis, or a move leaves the lattice.
        """
        self._check_arrays()
        numbers = (*self.start, *self.step)
        require(
            len(self.start) == len(self.step) == 2
            and all(isinstance(value, float) and abs(value) < np.inf for value in numbers)
            and min(self.step) > 0.0,
            "base lattice: start and step must be two finite numbers each, the steps positive.",
        )
        require(min(self.shape) >= 2, "base lattice: needs at least two positions along each axis.")
        for along, (dx, dy) in zip(self.moves, MOVES, strict=True):
            leaving = np.ones(self.shape, dtype=np.bool_)
            leaving[: self.shape[0] - dx, max(0, -dy) : self.shape[1] - max(0, dy)] = False
            require(not np.any(along & leaving), "base lattice: a move leaves the lattice.")

    @property
    def shape(self) -> tuple[int, int]:
        """Number of positions along x and y."""
        return self.moves.shape[1], self.moves.shape[2]


@dataclass(frozen=True, kw_only=True, eq=False)
class Groups(ArrayTable):
    """Kept sets of m members: K groups, each with the same m base cells; read-only.

    The score of any set follows from its members, so a group holds bounds only.
    """

    least: float = 0.0
    """Least P_M of a kept set of three; that of a pair follows from the rule: `SetTable.limits`."""
    cells: NDArray[np.int32]
    """Cells of the members, ascending, with at least one kept set; lexicographic, shape (K, m)."""
    count: NDArray[np.int64]
    """Number of kept sets in each group, shape (K,)."""
    reachability: NDArray[np.float64]
    """Greatest P_R of those sets, exact, shape (K,)."""
    manipulability: NDArray[np.float32]
    """Greatest P_M of those sets, rounded upward, shape (K,)."""
    total: NDArray[np.float32]
    """Greatest P_R + P_M of those sets, rounded upward, shape (K,)."""
    member_reachability: NDArray[np.float64]
    """Greatest P_R of the kept sets that a candidate is in, exact, 0 if in none, shape (C,)."""
    member_manipulability: NDArray[np.float32]
    """Greatest P_M of those sets, rounded upward, shape (C,)."""
    member_total: NDArray[np.float32]
    """Greatest P_R + P_M of those sets, rounded upward, shape (C,)."""

    WHAT = "groups of sets"
    COLUMNS: ClassVar[Columns] = {
        "cells": Column(np.int32, "K m", Form.APART),
        "count": Column(np.int64, "K", Form.SMALLEST),
        "reachability": Column(np.float64, "K", Form.APART, least=0.0),
        "manipulability": Column(np.float32, "K", least=0.0),
        "total": Column(np.float32, "K", least=0.0),
        "member_reachability": Column(np.float64, "C", least=0.0),
        "member_manipulability": Column(np.float32, "C", least=0.0),
        "member_total": Column(np.float32, "C", least=0.0),
    }

    def __post_init__(self) -> None:
        """Check the arrays against each other and make them read-only.

        Raises:
            TcsError: If an array has the wrong type, shape or range.
        """
        self._check_arrays()
        require(0.0 <= self.least < np.inf, "groups of sets: least must be finite and >= 0.")

    def check(self, size: NDArray[np.int64]) -> None:
        """Check the groups against the number of candidates of each cell.

        Args:
            size: Number of candidates of each cell, shape (N,).

        Raises:
            TcsError: If groups are out of order, of cells that do not exist, or have too many sets.
        """
        cells = self.cells.astype(np.int64)
        number = np.zeros(len(cells), dtype=np.int64)
        most = np.ones(len(cells))
        require(
            bool(np.all((cells >= 0) & (cells < size.size)))
            and bool(np.all(np.diff(cells, axis=1) >= 0)),
            f"groups of sets: cells must be ascending in each, within 0..{size.size - 1}.",
        )
        for column in cells.T:
            number = number * size.size + column
            most *= size[column]
        require(bool(np.all(np.diff(number) > 0)), "groups of sets: cells must be lexicographic.")
        require(
            bool(np.all((self.count > 0) & (self.count <= most))),
            "groups of sets: count does not fit the number of candidates in the cells.",
        )
        require(
            self.member_reachability.size == int(size.sum()),
            "groups of sets: needs a bound for each candidate.",
        )

    @property
    def kept(self) -> int:
        """Number of kept sets."""
        return int(self.count.sum())


RULES = ("paper", "code2015")
"""Names of the rules. "paper": singles that reach at least one goal; larger sets whose P_M is
greater than the best P_M of any smaller set (TCS section IV-A). "code2015": the rules of
hrl_base_selection in gt-ros-pkg/hrl-assistive (BSD), state of 30 April 2015; see `CODE2015`."""

FRACTION_TOLERANCE = 1e-9
"""Tolerance of a fraction of the goals: two fifths can add up to one bit less than 0.40."""


@dataclass(frozen=True, slots=True)
class Code2015:
    """The constants of hrl_base_selection that decide which sets are kept."""

    least_single: float = 0.40
    """Least P_R of a single."""
    reachability: float = 0.98
    """Least P_R of a pair, as a multiple of the best single's P_R."""
    manipulability: float = 1.01
    """Least P_M of a pair, as a multiple of the best single's P_M."""
    gain: float = 1.01
    """Least P_M of a pair, as a multiple of each member's own P_M."""
    decimals: int = 3
    """Number of decimals to which base x and y [m] are rounded before distances are computed."""


CODE2015 = Code2015()
"""The best single is the first in descending order of P_R, then P_M; so is the best set."""


@dataclass(frozen=True, slots=True)
class PairLimits:
    """Least scores of a kept pair; all three conditions must hold."""

    reachability: float
    """Least P_R."""
    manipulability: float
    """Least P_M."""
    gain: float
    """Least P_M, as a multiple of the P_M of either member."""


def check_rule(rule: str) -> None:
    """Check that a rule exists.

    Raises:
        UnknownNameError: If the rule is not one of `RULES`.
    """
    if rule not in RULES:
        raise UnknownNameError("rule", rule, RULES, where="sets")


def candidates_of(
    reached: NDArray[np.bool_], weights: NDArray[np.float64], rule: str
) -> NDArray[np.int32]:
    """Return the candidates: configurations kept as singles and in larger sets, shape (C,).

    Args:
        reached: Whether a goal is reached, shape (H, G).
        weights: Weights of the goals, sum 1, shape (G,).
        rule: One of `RULES`.
    """
    kept = reached.any(axis=1)
    if rule == "code2015":
        kept &= tc_reachability(reached, weights) >= CODE2015.least_single - FRACTION_TOLERANCE
    return np.flatnonzero(kept).astype(np.int32)


def pair_limits(
    rule: str, reachability: NDArray[np.float64], manipulability: NDArray[np.float64]
) -> PairLimits:
    """Return the least scores of a kept pair, given the scores of the singles, shapes (C,)."""
    if rule == "code2015":
        if not reachability.size:
            return PairLimits(0.0, 0.0, CODE2015.gain)
        best = np.lexsort((-manipulability, -reachability))[0]
        return PairLimits(
            CODE2015.reachability * float(reachability[best]) - FRACTION_TOLERANCE,
            CODE2015.manipulability * float(manipulability[best]),
            CODE2015.gain,
        )
    # Greater than the maximum means at least the next greater number.
    return PairLimits(0.0, float(np.nextafter(manipulability.max(initial=0.0), np.inf)), 0.0)


def order_keys(
    rule: str, reachability: NDArray[np.float64], manipulability: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the keys by which sets are ordered, first and second, greatest first."""
    if rule == "code2015":
        return reachability, manipulability
    return reachability + manipulability, np.zeros_like(manipulability)


def spaced_places(rule: str, xy: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the positions whose distances are compared with the least one, shape (N, 2) [m]."""
    return np.round(xy, CODE2015.decimals) if rule == "code2015" else xy


MOST_MEMBERS = 3
"""Greatest number of members of a set."""

DISTANCE_TOLERANCE = 1e-9
"""Tolerance of distances [m]. Grid steps such as 0.05 are not binary fractions: 8 of them can be
1e-16 short of 0.40 m, or 1e-15 far from the origin."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SetTable(ArrayTable):
    """All kept sets (tau in the TCS paper) of C candidates in N base cells; read-only.

    The candidates are all configurations that the rule keeps as singles, or of very many some that
    stand for the others.

    Order of the sets, which also breaks ties: the singles by configuration index, then the
    pairs (a, b), a < b, in lexicographic order, then the triples likewise.
    """

    rule: str
    """Which sets are kept: one of `RULES`."""
    max_members: int
    """Greatest number of members of the kept sets."""
    min_distance: float
    """Least base x-y distance between two members of a set [m]."""
    same_environment: bool
    """Whether all members of a set share the state of the environment, e.g. the bed's height."""
    state_size: int
    """Number of configurations per state of the environment: h // state_size is that of h."""
    weights: NDArray[np.float64]
    """Weights of the goals, sum 1, shape (G,)."""
    candidates: NDArray[np.int32]
    """Flat indices of the configurations kept as singles, ascending, shape (C,)."""
    reached: NDArray[np.bool_]
    """Whether a candidate reaches a goal, shape (C, G). Not the same as dexterity > 0, which
    a singular arm posture can have at a goal it does reach."""
    dexterity: NDArray[np.float32]
    """Dexterity of the candidates, 0 where not reached, shape (C, G)."""
    hand: NDArray[np.uint8] | None = None
    """Number of the hand that reaches a goal from a candidate, as in the scores, shape (C, G); None
    if there is only one."""
    cell: NDArray[np.int32]
    """Base cell of each candidate, shape (C,)."""
    cell_xy: NDArray[np.float64]
    """x and y of each base cell in W [m], shape (N, 2)."""
    pairs: Groups
    """Kept sets of two."""
    triples: Groups | None
    """Kept sets of three; None if `max_members` is less."""
    best: tuple[int, ...]
    """Configuration indices of the best set: greatest P_R + P_M, or P_R before P_M by the rule
    "code2015"; () without candidates."""
    best_single: tuple[int, ...]
    """Configuration index of the best set of one; () without candidates."""
    lattice: BaseLattice
    """Where the base can drive."""
    tile: float = 0.0
    """Side of the squares of the floor within which a candidate stands for others [m]; 0 if every
    configuration that the rule keeps is a candidate."""

    WHAT = "set table"
    COLUMNS: ClassVar[Columns] = {
        "weights": Column(np.float64, "G"),
        "candidates": Column(np.int32, "C", Form.STEPS, key="candidate_step"),
        "reached": Column(np.bool_, "C G", Form.FLAGS),
        "dexterity": Column(np.float32, "C G", Form.APART),
        "hand": Column(np.uint8, "C G", optional=True),
        "cell": Column(np.int32, "C", Form.SMALLEST),
        "cell_xy": Column(np.float64, "N 2", finite=True),
    }

    def __post_init__(self) -> None:
        """Check the arrays against each other and make them read-only.

        Raises:
            TcsError: If an array has the wrong type, shape or range.
        """
        self._check_arrays()
        require(
            self.rule in RULES, f"set table: unknown rule '{self.rule}'. Known: {', '.join(RULES)}."
        )
        require(
            1 <= self.max_members <= MOST_MEMBERS,
            f"set table: max_members must be 1 to {MOST_MEMBERS}.",
        )
        require(0.0 <= self.min_distance < np.inf, "set table: min_distance must be finite, >= 0.")
        require(0.0 <= self.tile < np.inf, "set table: tile must be finite, >= 0.")
        require(self.state_size > 0, "set table: state_size must be positive.")
        require(isinstance(self.lattice, BaseLattice), "set table: lattice must be a BaseLattice.")
        self._check_candidates()
        require(
            isinstance(self.pairs, Groups) and self.pairs.cells.shape[1] == 2,
            "set table: pairs must be groups of two.",
        )
        self.pairs.check(np.diff(self.cell_start))
        require(
            isinstance(self.triples, Groups) and self.triples.cells.shape[1] == MOST_MEMBERS
            if self.max_members == MOST_MEMBERS
            else self.triples is None,
            "set table: triples must be given if max_members is 3, and only then.",
        )
        if self.triples is not None:
            self.triples.check(np.diff(self.cell_start))

    def _check_candidates(self) -> None:
        """Check candidates, cells and best sets."""
        increasing = bool(np.all(np.diff(self.candidates) > 0)) and np.all(self.candidates >= 0)
        require(increasing, "set table: candidates must be ascending and >= 0.")
        require(
            bool(np.all((self.cell >= 0) & (self.cell < len(self.cell_xy)))),
            f"set table: cell outside 0..{len(self.cell_xy) - 1}.",
        )
        require(bool(np.all(np.diff(self.cell_start) > 0)), "set table: a cell has no candidate.")
        along = (self.cell_xy - self.lattice.start) / self.lattice.step
        inside = (np.rint(along) >= 0) & (np.rint(along) < self.lattice.shape)
        # A millionth of a step is far above the rounding of some dozen steps.
        require(
            bool(np.all(inside & (np.abs(along - np.rint(along)) < 1e-6))),
            "set table: cell_xy must be positions of the lattice.",
        )
        for name, size in (("best", self.max_members), ("best_single", 1)):
            members = getattr(self, name)
            require(
                isinstance(members, tuple)
                and (1 <= len(members) <= size if len(self.candidates) else members == ())
                and all(isinstance(h, int) for h in members)
                and bool(np.all(np.isin(np.array(members, dtype=np.int64), self.candidates))),
                f"set table: {name} must name one to {size} candidates.",
            )

    @property
    def kept_pairs(self) -> int:
        """Number of sets of two."""
        return self.pairs.kept

    @property
    def sets(self) -> int:
        """Number of sets: singles, kept pairs and kept triples."""
        triples = self.triples.kept if self.triples is not None else 0
        return len(self.candidates) + self.kept_pairs + triples

    @cached_property
    def single_reachability(self) -> NDArray[np.float64]:
        """P_R of each candidate by itself, TCS eq. (1), shape (C,)."""
        return tc_reachability(self.reached, self.weights)

    @cached_property
    def single_manipulability(self) -> NDArray[np.float64]:
        """P_M of each candidate by itself, TCS eq. (4), shape (C,)."""
        return tc_manipulability(self.dexterity, self.weights)

    @cached_property
    def limits(self) -> PairLimits:
        """The least scores of a kept pair."""
        return pair_limits(self.rule, self.single_reachability, self.single_manipulability)

    @cached_property
    def state(self) -> NDArray[np.int64]:
        """Number of the environment's state of each candidate, shape (C,)."""
        return self.candidates.astype(np.int64) // self.state_size

    @cached_property
    def served(self) -> NDArray[np.uint8]:
        """Number of the hand that reaches a goal from a candidate plus 1, 0 for none, (C, G)."""
        hand = np.zeros(self.reached.shape, np.uint8) if self.hand is None else self.hand
        return np.where(self.reached, hand + np.uint8(1), np.uint8(0))

    @cached_property
    def by_cell(self) -> NDArray[np.int64]:
        """Candidate numbers (rows of `candidates`) sorted by cell, then number, shape (C,)."""
        return np.argsort(self.cell, kind="stable").astype(np.int64)

    @cached_property
    def cell_start(self) -> NDArray[np.int64]:
        """Where each cell starts in `by_cell`, shape (N + 1,)."""
        sizes = np.bincount(self.cell, minlength=len(self.cell_xy))
        return np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)

    def scores_of(self, members: tuple[int, ...]) -> tuple[float, float]:
        """Return P_R and P_M of a set, TCS eq. (1) and (4), with the best member at each goal.

        Args:
            members: Flat configuration indices, all of them candidates.

        Raises:
            TcsError: If the set is empty or a member is not a candidate.
        """
        rows = np.searchsorted(self.candidates, members)
        require(
            len(members) > 0
            and bool(np.all(rows < len(self.candidates)))
            and bool(np.all(self.candidates[rows] == members)),
            f"Set {members}: every member must be a configuration that reaches a goal.",
        )
        reached = np.logical_or.reduce(self.reached[rows], axis=0)
        dexterity = np.maximum.reduce(self.dexterity[rows], axis=0)
        return (
            float(tc_reachability(reached, self.weights)),
            float(tc_manipulability(dexterity, self.weights)),
        )
