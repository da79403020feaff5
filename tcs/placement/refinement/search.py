"""Local search from sets of the grid: the cells around the members, sampled finer and finer."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from tcs.model.grid import Grid
from tcs.placement.refinement.objectives import Features, Objective, values_of
from tcs.placement.refinement.points import Points, PointScores
from tcs.placement.refinement.space import Space

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


class Evaluated(NamedTuple):
    """Configurations with their scores and what they contribute to the objective, by rows."""

    values: NDArray[Any]
    """As of `Points`; so are the other arrays of `Points`, `PointScores` and `Features`."""
    arm: NDArray[Any]
    reached: NDArray[Any]
    dexterity: NDArray[Any]
    joints: NDArray[Any]
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

    @property
    def members(self) -> int:
        """Number of members."""
        return len(self.origin)


class Scorer(Protocol):
    """Scores configurations anywhere."""

    @property
    def grid(self) -> Grid:
        """The grid that the search starts from."""

    def score(self, points: Points) -> PointScores:
        """Return the scores of configurations."""


@dataclass(frozen=True, eq=False)
class LocalSearch:
    """Refines sets together, so that a round prepares the scene once for all of them."""

    scorer: Scorer
    space: Space
    objective: Objective
    rng: np.random.Generator

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
            if number == SCREENING_ROUNDS:
                active = _best_of(walks)
            active = [walk for walk in active if walk.width >= FINEST]
            if not active:
                break
            scored += self._round(active)
            on_round(number + 1, rounds)
        return sorted(walks, key=lambda walk: -walk.value), scored

    def points_of(self, flat: Sequence[int]) -> Points:
        """Return configurations of the grid, given by flat indices."""
        grid, indices = self.scorer.grid, np.array(flat, dtype=np.int64)
        at = grid.values(indices)
        return Points(
            np.stack([at[axis.name] for axis in grid.axes], axis=1), indices // grid.arm_size
        )

    def _evaluated(self, points: Points) -> Evaluated:
        """Return configurations with their scores and features."""
        scores = self.scorer.score(points)
        return Evaluated(*points, *scores, *self.objective.features(points, scores))

    def _started(self, starts: Sequence[tuple[int, ...]]) -> list[Walk]:
        """Return walks that stand on the grid."""
        found = self._evaluated(self.points_of([h for start in starts for h in start]))
        walks, first = [], 0
        for start in starts:
            present = found.rows(slice(first, first + len(start)))
            reached, dexterity = present.features
            value = values_of(self.objective, Features(reached[None], dexterity[None]))
            walks.append(Walk(start, present, float(value[0])))
            first += len(start)
        return walks

    def _round(self, walks: Sequence[Walk]) -> int:
        """Move each walk to the best combination of configurations around its members.

        Returns:
            The number of scored configurations.
        """
        proposed = [part for walk in walks for part in self._around(walk)]
        found = self._evaluated(
            Points(
                np.concatenate([part.values for part in proposed]),
                np.concatenate([part.arm for part in proposed]),
            )
        )
        ends = np.cumsum([len(part.values) for part in proposed])
        parts = [
            found.rows(slice(end - len(part.values), end))
            for part, end in zip(proposed, ends, strict=True)
        ]
        for walk in walks:
            self._move(walk, parts[: walk.members])
            parts = parts[walk.members :]
        return int(ends[-1])

    def _around(self, walk: Walk) -> list[Points]:
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
        for values, arm in zip(walk.present.values, walk.present.arm, strict=True):
            drawn = self.rng.uniform(-1.0, 1.0, (count, axes))
            drawn[:, slow] = levels[np.arange(count) % LEVELS]
            around = self.space.inside(values + np.concatenate([drawn, along]) * reach)
            found.append(Points(around, np.full(len(around), arm)))
        return found

    def _move(self, walk: Walk, around: Sequence[Evaluated]) -> None:
        """Move a walk to the best combination, or halve the cells if there is none.

        Args:
            walk: The walk.
            around: Configurations around each member.
        """
        # The present members come first, each among the configurations around it.
        choices = [
            Evaluated.joined([walk.present.rows(slice(i, i + 1)), part])
            for i, part in enumerate(around)
        ]
        best, value = self._best_combination(choices)
        if value <= walk.value + GAIN:
            walk.width /= 2.0
            return
        chosen = [part.rows(slice(k, k + 1)) for part, k in zip(choices, best, strict=True)]
        walk.present, walk.value = Evaluated.joined(chosen), value

    def _best_combination(self, choices: Sequence[Evaluated]) -> tuple[tuple[int, ...], float]:
        """Return the best allowed combination of one configuration per member, and its value."""
        shape = tuple(len(part.values) for part in choices)
        best, most = (0,) * len(shape), -np.inf
        for start in range(0, int(np.prod(shape)), CHUNK):
            flat = np.arange(start, min(start + CHUNK, int(np.prod(shape))))
            which = np.unravel_index(flat, shape)
            pairs = list(zip(choices, which, strict=True))
            found = values_of(
                self.objective,
                Features(
                    np.stack([part.feature_reached[i] for part, i in pairs], axis=1),
                    np.stack([part.feature_dexterity[i] for part, i in pairs], axis=1),
                ),
            )
            members = np.stack([part.values[i] for part, i in pairs], axis=1)
            found[~self.space.allowed(members)] = -np.inf
            first = int(np.argmax(found))
            if found[first] > most:
                most = float(found[first])
                best = tuple(int(i[first]) for i in which)
        return best, most


def _best_of(walks: Sequence[Walk]) -> list[Walk]:
    """Return the best walks, and the best of one member."""
    order = sorted(walks, key=lambda walk: -walk.value)
    singles = [walk for walk in order if walk.members == 1][:1]
    best = order[:REFINED_TO_THE_END]
    return best + [walk for walk in singles if walk not in best]
