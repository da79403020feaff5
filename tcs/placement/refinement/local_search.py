"""Local search from sets of the grid: the space around it, cells sampled finer and finer."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.model.grid import ROBOT_AXES, Grid
from tcs.placement.refinement.points import PointScores
from tcs.placement.tables import SetTable
from tcs.placement.tables.sets import DISTANCE_TOLERANCE

FULL_TURN = 2.0 * math.pi
LEAST_CELL = {"m": 0.15, "rad": 0.5}
"""Least half width of the first cells [m, rad]: a fine grid does not keep the search in a basin."""


@dataclass(frozen=True, eq=False)
class Space:
    """Every value between the first and the last one of each axis of a grid."""

    low: FloatArray
    """Least values [m or rad], shape (axes,)."""
    high: FloatArray
    """Greatest values, shape (axes,)."""
    cell: FloatArray
    """Half widths of the first cells, at least a step of the grid; 0 for an axis that keeps its
    values, shape (axes,)."""
    periodic: BoolArray
    """Whether an axis is a heading that the grid covers all around, shape (axes,)."""
    min_distance: float
    """Least base distance of two members of a set [m]."""
    same_environment: bool
    """Whether the members of a set share the state of the environment."""

    @classmethod
    def of(cls, grid: Grid, sets: SetTable | None = None, *, fixed: Collection[str] = ()) -> Self:
        """Return the space of a grid, with the rules of its sets if there are any.

        Args:
            grid: The grid.
            sets: Its sets.
            fixed: Axes that keep the values of the grid.
        """
        values = [axis.values for axis in grid.axes]
        cell = [
            max(v[1] - v[0], LEAST_CELL[axis.held_unit])
            if v.size > 1 and axis.name not in fixed
            else 0.0
            for v, axis in zip(values, grid.axes, strict=True)
        ]
        return cls(
            low=np.array([v[0] for v in values]),
            high=np.array([v[-1] for v in values]),
            cell=np.array(cell),
            periodic=np.array(
                [
                    axis.name == "base_yaw" and axis.count * axis.step >= 360.0 - 1e-6
                    for axis in grid.axes
                ]
            ),
            min_distance=0.0 if sets is None else sets.min_distance,
            same_environment=sets is not None and sets.same_environment,
        )

    @property
    def environment_axes(self) -> int:
        """Number of axes that move the environment; they come first."""
        return self.cell.size - len(ROBOT_AXES)

    def inside(self, values: FloatArray) -> FloatArray:
        """Return values moved into the ranges, headings by full turns, shape (..., axes)."""
        turned = self.low + np.mod(values - self.low, FULL_TURN)
        return np.where(self.periodic, turned, np.clip(values, self.low, self.high))

    def allowed(self, members: FloatArray) -> BoolArray:
        """Return which sets are allowed, given their members' values (n, m, axes), shape (n,)."""
        allowed = np.ones(len(members), dtype=np.bool_)
        x = len(ROBOT_AXES)  # counted from the end
        for a in range(members.shape[1]):
            for b in range(a):
                apart = members[:, a, -x : -x + 2] - members[:, b, -x : -x + 2]
                distance = np.hypot(apart[:, 0], apart[:, 1])
                allowed &= distance >= self.min_distance - DISTANCE_TOLERANCE
                if self.same_environment:
                    count = self.environment_axes
                    allowed &= np.all(members[:, a, :count] == members[:, b, :count], axis=1)
        return allowed


TIE = 1e-3
"""Weight of P_R + P_M beside the success: decides among sets of equal success, and is less than
the success of one goal in one of some hundred samples."""


class Features(NamedTuple):
    """What configurations contribute to the objective of a set: the best member counts at each."""

    reached: BoolArray
    """Shape (n, F)."""
    dexterity: NDArray[np.float32]
    """Shape (n, F)."""


@dataclass(frozen=True, eq=False)
class ScoreObjective:
    """P_R + P_M, TCS eq. (1) and (4): each goal is a feature."""

    weights: FloatArray
    """Weights of the goals, sum 1, shape (G,)."""

    def features(self, points: FloatArray, scores: PointScores) -> Features:
        """Return the goals that configurations reach, and their dexterity there."""
        return Features(scores.reached, scores.dexterity)

    def values(self, features: Features) -> FloatArray:
        """Return P_R + P_M of sets."""
        manipulability = features.dexterity.max(axis=1).astype(np.float64) @ self.weights
        return np.asarray(features.reached.any(axis=1) @ self.weights + manipulability)


class Samples(Protocol):
    """Random changes that are the same for all configurations (common random numbers)."""

    @property
    def samples(self) -> int:
        """Number of samples."""

    @property
    def order(self) -> NDArray[np.intp]:
        """Numbers of the samples, the largest changes first, shape (samples,)."""

    def hardest(self, count: int) -> Self:
        """Return the samples with the largest changes."""

    def only(self, rows: NDArray[np.intp]) -> Self:
        """Return some of the samples."""

    def reached(self, points: FloatArray) -> BoolArray:
        """Return which goals each configuration reaches in each sample, shape (n, samples, G)."""


POINTS_PER_AXIS = 8
"""Random configurations per axis around each member in a round."""
LEVELS = 5
"""Different states of the environment and torso heights among them: each costs a call of Drake."""
FINEST = 1.0 / 256.0
"""Fraction of the first cells at which the search ends: less than a millimetre of the base."""
SCREENING_ROUNDS = 6
"""Rounds after which only the best sets are refined further."""
REFINED_TO_THE_END = 3
"""Sets that are refined after the screening, and the best of one member."""
GAIN = 1e-9
"""Least gain of the objective that counts: above the rounding of its sum."""
CHUNK = 4096
"""Combinations of members whose objective is computed at a time."""
TRIED = (0, 4, 32)
"""Ranks, by the objective, of the better combinations that are tried against a condition."""


class Evaluated(NamedTuple):
    """Configurations with their scores and what they contribute to the objective, by rows."""

    values: NDArray[Any]
    """Values in the order of the axes [m or rad], shape (n, axes); the other arrays are those of
    `PointScores` and `Features`."""
    reached: NDArray[Any]
    dexterity: NDArray[Any]
    joints: NDArray[Any]
    hand: NDArray[Any]
    feature_reached: NDArray[Any]
    feature_dexterity: NDArray[Any]

    @classmethod
    def joined(cls, parts: Sequence[Evaluated]) -> Evaluated:
        """Return the rows of several, one after the other."""
        return cls(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))

    def rows(self, rows: NDArray[Any] | slice) -> Evaluated:
        """Return some rows."""
        return Evaluated(*(array[rows] for array in self))

    @property
    def features(self) -> Features:
        """What the configurations contribute to the objective."""
        return Features(self.feature_reached, self.feature_dexterity)


@dataclass(eq=False)
class Walk:
    """The refinement of one set: its present members, and the size of the cells around them."""

    origin: tuple[int, ...]
    """Flat grid indices of the set that it started from."""
    present: Evaluated
    """The present members."""
    value: float
    """The objective of the set."""
    width: float = 1.0
    """Half width of the cells around the members, as a fraction of the first ones."""
    passed: list[tuple[Evaluated, float]] = field(default_factory=list)
    """The members and objectives before each move, the start first."""

    def move(self, members: Evaluated, value: float) -> None:
        """Move to a better set."""
        self.passed.append((self.present, self.value))
        self.present, self.value = members, value

    def move_back(self, moves: int) -> None:
        """Return to where the walk was before its last moves."""
        for _ in range(moves):
            self.present, self.value = self.passed.pop()

    @property
    def course(self) -> list[tuple[Evaluated, float]]:
        """The members and objectives of all places, the start first, the present one last."""
        return [*self.passed, (self.present, self.value)]

    @property
    def members(self) -> int:
        """Number of members."""
        return len(self.origin)


SetCondition = Callable[[Sequence[FloatArray]], BoolArray]
"""Returns which of several sets satisfy a condition."""


class ScoresPoints(Protocol):
    """Scores configurations anywhere."""

    @property
    def grid(self) -> Grid:
        """The grid that the search starts from."""

    def score(self, points: FloatArray) -> PointScores:
        """Return the scores of configurations."""


@dataclass(frozen=True, eq=False)
class LocalSearch:
    """Refines sets together, so that a round prepares the scene once for all of them."""

    scorer: ScoresPoints
    space: Space
    objective: ScoreObjective
    rng: np.random.Generator
    keeps: SetCondition | None = None
    """SetCondition of the sets that walks move to, checked for few of them; None for none."""
    screening_rounds: int = SCREENING_ROUNDS
    """Rounds after which only the best sets are refined further."""

    def run(
        self,
        starts: Sequence[tuple[int, ...]],
        rounds: int,
        on_round: Callable[[int, int], None],
    ) -> tuple[list[Walk], int]:
        """Return the refined sets, best first, and the number of scored configurations.

        Args:
            starts: Flat grid indices of the members of each set.
            rounds: Greatest number of rounds.
            on_round: Called with the number of rounds done and their greatest number.
        """
        walks = self._started(starts)
        active, scored = walks, sum(walk.members for walk in walks)
        for number in range(rounds):
            if number == self.screening_rounds:
                active = _best_of(walks)
            active = [walk for walk in active if walk.width >= FINEST]
            if not active:
                break
            scored += self._round(active)
            on_round(number + 1, rounds)
        return sorted(walks, key=lambda walk: -walk.value), scored

    def points_of(self, flat: Sequence[int]) -> FloatArray:
        """Return the values of configurations of the grid, given by flat indices."""
        grid = self.scorer.grid
        at = grid.values(np.array(flat, dtype=np.int64))
        return np.stack([at[axis.name] for axis in grid.axes], axis=1)

    def _evaluated(self, points: FloatArray) -> Evaluated:
        """Return configurations with their scores and features."""
        scores = self.scorer.score(points)
        return Evaluated(points, *scores, *self.objective.features(points, scores))

    def _started(self, starts: Sequence[tuple[int, ...]]) -> list[Walk]:
        """Return walks that stand on the grid."""
        found = self._evaluated(self.points_of([h for start in starts for h in start]))
        walks, first = [], 0
        for start in starts:
            present = found.rows(slice(first, first + len(start)))
            reached, dexterity = present.features
            value = self.objective.values(Features(reached[None], dexterity[None]))
            walks.append(Walk(start, present, float(value[0])))
            first += len(start)
        return walks

    def _round(self, walks: Sequence[Walk]) -> int:
        """Move each walk to the best combination of configurations around its members.

        Returns:
            The number of scored configurations.
        """
        proposed = [part for walk in walks for part in self._around(walk)]
        found = self._evaluated(np.concatenate(proposed))
        ends = np.cumsum([len(part) for part in proposed])
        parts = [
            found.rows(slice(end - len(part), end))
            for part, end in zip(proposed, ends, strict=True)
        ]
        offered = []
        for walk in walks:
            offered.append(self._better(walk, parts[: walk.members]))
            parts = parts[walk.members :]
        self._move(walks, offered)
        return int(ends[-1])

    def _around(self, walk: Walk) -> list[FloatArray]:
        """Return configurations around each member of a set: random ones, and along each axis."""
        axes = self.space.cell.size
        reach = walk.width * self.space.cell
        count = POINTS_PER_AXIS * int(np.count_nonzero(reach))
        slow = np.r_[np.arange(self.space.environment_axes), axes - 1]
        # Members draw the same changes of the environment, so that those of a set can share it.
        levels = self.rng.uniform(-1.0, 1.0, (LEVELS, slow.size))
        levels[0] = 0.0
        along = np.concatenate([np.eye(axes), -np.eye(axes)])[np.tile(reach > 0.0, 2)]
        found = []
        for values in walk.present.values:
            drawn = self.rng.uniform(-1.0, 1.0, (count, axes))
            drawn[:, slow] = levels[np.arange(count) % LEVELS]
            found.append(self.space.inside(values + np.concatenate([drawn, along]) * reach))
        return found

    def _move(
        self, walks: Sequence[Walk], offered: Sequence[Sequence[tuple[Evaluated, float]]]
    ) -> None:
        """Move each walk to the first set offered that is allowed, or halve its cells if none is.

        Args:
            walks: The walks.
            offered: Better sets and their objectives, for each walk.
        """
        still = list(range(len(walks)))
        for rank in range(len(TRIED)):
            tried = [k for k in still if rank < len(offered[k])]
            if not tried:
                break
            sets = [offered[k][rank] for k in tried]
            keeps = (
                np.ones(len(sets), dtype=np.bool_)
                if self.keeps is None
                else self.keeps([members.values for members, _ in sets])
            )
            for k, (members, value), kept in zip(tried, sets, keeps, strict=True):
                if kept:
                    walks[k].move(members, value)
                    still.remove(k)
        for k in still:
            walks[k].width /= 2.0

    def _better(self, walk: Walk, around: Sequence[Evaluated]) -> list[tuple[Evaluated, float]]:
        """Return better combinations than a walk's present set, the best first: those to try.

        Args:
            walk: The walk.
            around: Configurations around each member.
        """
        # The present members come first, each among the configurations around it.
        choices = [
            Evaluated.joined([walk.present.rows(slice(i, i + 1)), part])
            for i, part in enumerate(around)
        ]
        shape = tuple(len(part.values) for part in choices)
        found = self._values(choices)
        better = np.flatnonzero(found > walk.value + GAIN)
        better = better[np.argsort(-found[better], kind="stable")]
        ranks = TRIED[:1] if self.keeps is None else TRIED
        sets = []
        for flat in better[[rank for rank in ranks if rank < better.size]]:
            which = np.unravel_index(flat, shape)
            chosen = [part.rows(slice(k, k + 1)) for part, k in zip(choices, which, strict=True)]
            sets.append((Evaluated.joined(chosen), float(found[flat])))
        return sets

    def _values(self, choices: Sequence[Evaluated]) -> NDArray[np.float64]:
        """Return the objective of each combination of one configuration per member, flat.

        Those that are not allowed have -inf.
        """
        shape = tuple(len(part.values) for part in choices)
        values = np.empty(int(np.prod(shape)))
        for start in range(0, values.size, CHUNK):
            flat = np.arange(start, min(start + CHUNK, values.size))
            pairs = list(zip(choices, np.unravel_index(flat, shape), strict=True))
            found = self.objective.values(
                Features(
                    np.stack([part.feature_reached[i] for part, i in pairs], axis=1),
                    np.stack([part.feature_dexterity[i] for part, i in pairs], axis=1),
                )
            )
            members = np.stack([part.values[i] for part, i in pairs], axis=1)
            found[~self.space.allowed(members)] = -np.inf
            values[flat] = found
        return values


def without_idle_members(
    walk: Walk, objective: ScoreObjective, keeps: SetCondition | None = None
) -> Walk:
    """Return a walk without members that add nothing to the objective; itself if all add something.

    Args:
        walk: The walk.
        objective: The objective.
        keeps: SetCondition of the sets with fewer members; None for none.
    """
    for i in range(walk.members if walk.members > 1 else 0):
        others = [k for k in range(walk.members) if k != i]
        present = walk.present.rows(np.array(others))
        reached, dexterity = present.features
        value = float(objective.values(Features(reached[None], dexterity[None]))[0])
        if value < walk.value - GAIN or not (keeps is None or keeps([present.values])[0]):
            continue
        fewer = Walk(tuple(walk.origin[k] for k in others), present, value, walk.width)
        return without_idle_members(fewer, objective, keeps)
    return walk


def _best_of(walks: Sequence[Walk]) -> list[Walk]:
    """Return the best walks, and the best of one member."""
    order = sorted(walks, key=lambda walk: -walk.value)
    singles = [walk for walk in order if walk.members == 1][:1]
    best = order[:REFINED_TO_THE_END]
    return best + [walk for walk in singles if walk not in best]
