"""The surest sets: pairs of all candidates under error, and a local search from the best."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from tcs.kernel.arrays import BoolArray, FloatArray, IntArray
from tcs.placement.refinement.objectives import TIE, Features, ScoreObjective
from tcs.placement.refinement.search import GAIN, Evaluated, LocalSearch, Scorer, Walk
from tcs.placement.refinement.space import Space
from tcs.placement.refinement.staged import StagedSamples, best_pairs
from tcs.placement.selection.alternatives import Distinct
from tcs.placement.tables import SetTable

MOST_CANDIDATES = 8000
"""Greatest number of candidates whose pairs are compared, those with the best scores."""
PAIRS = (20_000, 2000, 200, 50)
"""Pairs that remain after each stage of the choice of starts."""
SETS = (32, 12, 4, 1)
"""Sets around a set that remain after each stage of a round of the search."""
SCREENING_ROUNDS = 2
"""Rounds after which only the best sets are refined further: each costs thousands of trials."""
PREFERENCE = 1e-6
"""Weight of P_R + P_M of each member among pairs of equal success."""


def surest_pairs(
    staged: StagedSamples, search: LocalSearch, sets: SetTable, count: int, apart: float
) -> list[tuple[int, ...]]:
    """Return the surest pairs of a table that differ, by flat grid indices, the surest first.

    Each stage evaluates the members of the pairs that remain in more of the samples, and compares
    all of their pairs again.

    Args:
        staged: The samples.
        search: A search on the grid of the table.
        sets: The sets of the table.
        count: Number of pairs.
        apart: Distance of base positions [m] at which pairs count as different.
    """
    if sets.max_members < 2 or len(sets.candidates) < 2:
        return []
    scores = sets.single_reachability + sets.single_manipulability
    members = np.sort(np.argsort(-scores, kind="stable")[:MOST_CANDIDATES])
    pairs = (np.empty(0, np.int64), np.empty(0, np.int64))
    for stage, remaining in zip(range(staged.stages), PAIRS, strict=False):
        points = search.points_of(sets.candidates[members].tolist())
        features = staged.features(points, stage)
        allowed = np.triu(_allowed(sets, members), 1)
        preference = PREFERENCE * (scores[members][:, None] + scores[members])
        first, second = best_pairs(features, features, allowed, preference, remaining)
        pairs = members[first], members[second]
        if not first.size:
            return []
        members = np.unique(np.concatenate(pairs))
    chosen: list[tuple[int, ...]] = []
    differs = np.ones(pairs[0].size, dtype=np.bool_)
    while len(chosen) < count and np.any(differs):
        k = int(np.argmax(differs))
        chosen.append((int(pairs[0][k]), int(pairs[1][k])))
        differs = Distinct(sets, apart, tuple(chosen)).of_sets(pairs)
        differs[k] = False
    return [tuple(int(h) for h in sets.candidates[list(pair)]) for pair in chosen]


def _allowed(sets: SetTable, members: IntArray) -> BoolArray:
    """Return which pairs of candidates keep the rules of the table's sets, shape (n, n)."""
    at = sets.cell_xy[sets.cell[members]]
    distance = np.hypot(*(at[:, None] - at).transpose(2, 0, 1))
    allowed = distance >= sets.min_distance - 1e-9
    if sets.same_environment:
        allowed &= sets.state[members][:, None] == sets.state[members]
    return np.asarray(allowed)


@dataclass(frozen=True, eq=False)
class SurestSearch(LocalSearch):
    """Local search on the success in samples: few of them for most configurations around a set.

    A set that loses nothing in any sample stays where it is.
    """

    staged: StagedSamples | None = None
    """The samples."""

    @classmethod
    def of(
        cls, scorer: Scorer, space: Space, staged: StagedSamples, rng: np.random.Generator
    ) -> Self:
        """Return a search for the greatest success; P_R + P_M decides among equals."""
        objective = ScoreObjective(staged.weights)
        return cls(scorer, space, objective, rng, screening_rounds=SCREENING_ROUNDS, staged=staged)

    def _valued(self, sets: Sequence[Evaluated]) -> FloatArray:
        """Return the success of sets in all samples, with P_R + P_M among equals, shape (n,)."""
        assert self.staged is not None
        success = self.staged.successes([one.points for one in sets], self.staged.stages - 1)
        scores = [
            self.objective.values(Features(one.reached[None], one.dexterity[None]))[0]
            for one in sets
        ]
        return np.asarray(success + TIE * np.array(scores))

    def _started(self, starts: Sequence[tuple[int, ...]]) -> list[Walk]:
        """Return walks that stand on the grid."""
        walks = super()._started(starts)
        for walk, value in zip(walks, self._valued([w.present for w in walks]), strict=True):
            walk.value = float(value)
            self._rest(walk)
        return walks

    def _move(
        self, walks: Sequence[Walk], offered: Sequence[Sequence[tuple[Evaluated, float]]]
    ) -> None:
        """Move each walk to the better set offered, or halve its cells if there is none."""
        super()._move(walks, offered)
        for walk in walks:
            self._rest(walk)

    def _rest(self, walk: Walk) -> None:
        """End a walk that loses nothing: a greater P_R + P_M would lead it to an edge."""
        assert self.staged is not None
        last = self.staged.stages - 1
        if self.staged.successes([walk.present.points], last)[0] > 1.0 - GAIN:
            walk.width = 0.0

    def _better(self, walk: Walk, around: Sequence[Evaluated]) -> list[tuple[Evaluated, float]]:
        """Return the surest combination of configurations around a set if it is better."""
        assert self.staged is not None
        choices = []
        for i, part in enumerate(around):
            some = part.rows(np.flatnonzero(part.reached.any(axis=1)))
            choices.append(Evaluated.joined([walk.present.rows(slice(i, i + 1)), some]))
        sets = self._screened(choices)
        for stage, remaining in zip(range(1, self.staged.stages), SETS[1:], strict=False):
            found = self.staged.successes([one.points for one in sets], stage)
            sets = [sets[k] for k in np.argsort(-found, kind="stable")[:remaining]]
        if not sets:
            return []
        values = self._valued(sets)
        best = int(np.argmax(values))
        better = float(values[best])
        return [(sets[best], better)] if better > walk.value + GAIN else []

    def _screened(self, choices: Sequence[Evaluated]) -> list[Evaluated]:
        """Return the combinations that are the surest in the first samples, the best first."""
        assert self.staged is not None
        features = [self.staged.features(part.points, 0) for part in choices]
        scores = [
            PREFERENCE
            * self.objective.values(Features(part.reached[:, None], part.dexterity[:, None]))
            for part in choices
        ]
        if len(choices) == 2:
            allowed = self.space.allowed(_grid_of(choices)).reshape(len(features[0]), -1)
            preference = scores[0][:, None] + scores[1]
            first, second = features
            pairs = best_pairs(first, second, allowed, preference, SETS[0])
            which = np.stack(pairs, axis=1)
        else:
            which = self._one_by_one(choices, features, scores)
        return [
            Evaluated.joined(
                [part.rows(slice(k, k + 1)) for part, k in zip(choices, row, strict=True)]
            )
            for row in which
        ]

    def _one_by_one(
        self,
        choices: Sequence[Evaluated],
        features: Sequence[np.ndarray],
        scores: Sequence[FloatArray],
    ) -> IntArray:
        """Return the surest of the sets in which a single member differs from the present one."""
        present = [part[0] for part in features]
        rows, values = [], []
        for i, part in enumerate(features):
            others = [present[k] for k in range(len(present)) if k != i]
            together = np.maximum.reduce([part, *(np.broadcast_to(o, part.shape) for o in others)])
            for k, value in enumerate((together**2).sum(axis=1) + scores[i]):
                row = [0] * len(choices)
                row[i] = k
                rows.append(row)
                values.append(float(value))
        which = np.array(rows)
        members = np.stack([part.values[which[:, i]] for i, part in enumerate(choices)], axis=1)
        order = np.argsort(-np.where(self.space.allowed(members), values, -np.inf), kind="stable")
        order = order[self.space.allowed(members)[order]]
        return np.asarray(which[order[: SETS[0]]])


def _grid_of(choices: Sequence[Evaluated]) -> FloatArray:
    """Return the values of every combination of two choices, shape (n * m, 2, axes)."""
    first, second = (part.values for part in choices)
    pairs = itertools.product(range(len(first)), range(len(second)))
    rows = np.array(list(pairs))
    return np.stack([first[rows[:, 0]], second[rows[:, 1]]], axis=1)
