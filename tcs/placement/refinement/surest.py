"""The surest sets: pairs of all candidates under error, with a third member, and a local search."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import BoolArray, FloatArray, IntArray
from tcs.placement.refinement.local_search import (
    GAIN,
    TIE,
    Evaluated,
    Features,
    LocalSearch,
    Samples,
    ScoreObjective,
    ScoresPoints,
    Space,
    Walk,
)
from tcs.placement.refinement.success_under_error import RememberedSamples
from tcs.placement.robustness.kept_pairs import allowed_pairs
from tcs.placement.selection.alternatives import Distinct
from tcs.placement.tables import SetTable

ENDS = (32, 128, 512)
"""Samples after each stage but the last, which has all."""
CHUNK = 512
"""Configurations whose pairs are compared at a time: some ten megabytes."""


@dataclass(frozen=True, eq=False)
class StagedSamples:
    """Samples in parts, the largest changes first: there, sets differ the most."""

    parts: tuple[RememberedSamples, ...]
    """The samples that each stage adds."""
    weights: FloatArray
    """Weights of the goals, sum 1, shape (G,)."""

    @classmethod
    def of(cls, samples: Samples, weights: FloatArray) -> Self:
        """Return samples in parts."""
        ends = [0, *(end for end in ENDS if end < samples.samples), samples.samples]
        order = samples.order
        parts = [
            RememberedSamples(samples.only(order[start:end]))
            for start, end in itertools.pairwise(ends)
        ]
        return cls(tuple(parts), weights)

    @property
    def stages(self) -> int:
        """Number of stages."""
        return len(self.parts)

    def features(self, points: FloatArray, stage: int) -> NDArray[np.float32]:
        """Return what configurations reach up to a stage, one number for each sample and goal.

        Returns:
            The root of the goal's weight over the samples where it is reached, 0 elsewhere, so that
            the product of two rows is the success that both have: shape (n, samples * G).
        """
        found = [part.reached(points) for part in self.parts[: stage + 1]]
        reached = np.concatenate(found, axis=1)
        root = np.sqrt(self.weights / reached.shape[1]).astype(np.float32)
        return np.asarray((reached * root).reshape(len(reached), -1))

    def successes(self, sets: Sequence[FloatArray], stage: int) -> FloatArray:
        """Return the mean of P_R of sets up to a stage, shape (n,)."""
        found = []
        for points in sets:
            parts = [np.logical_or.reduce(part.reached(points)) for part in self.parts[: stage + 1]]
            found.append(np.concatenate(parts).mean(axis=0) @ self.weights)
        return np.array(found)


def best_pairs(
    first: NDArray[np.float32],
    second: NDArray[np.float32],
    allowed: BoolArray,
    preference: FloatArray,
    count: int,
) -> tuple[IntArray, IntArray]:
    """Return the pairs with the greatest success, the best first: every pair is compared.

    Args:
        first: Features of the first members, of `StagedSamples.features`, shape (n, F).
        second: Those of the second members, shape (m, F).
        allowed: Whether a pair is allowed, shape (n, m).
        preference: Decides among equals where greater, shape (n, m); small beside a lost goal.
        count: Greatest number of pairs.

    Returns:
        Rows of the first and of the second members, shape (k,).
    """
    of_second = np.einsum("ij,ij->i", second, second)
    rows, columns, values = np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0)
    for start in range(0, len(first), CHUNK):
        part = first[start : start + CHUNK]
        # The success of either is the sum of both less what they have in common.
        found = np.einsum("ij,ij->i", part, part)[:, None] + of_second - part @ second.T
        at = slice(start, start + len(part))
        value = np.where(allowed[at], found + preference[at], -np.inf).ravel()
        few = np.argpartition(-value, min(count, value.size) - 1)[:count]
        few = few[value[few] > -np.inf]
        row, column = np.unravel_index(few, found.shape)
        rows = np.concatenate([rows, row + start])
        columns = np.concatenate([columns, column])
        values = np.concatenate([values, value[few]])
        best = np.lexsort((columns, rows, -values))[:count]
        rows, columns, values = rows[best], columns[best], values[best]
    return rows, columns


MOST_CANDIDATES = 8000
"""Greatest number of candidates whose pairs are compared, those with the best scores."""
PAIRS = (20_000, 2000, 200, 50)
"""Pairs that remain after each stage of the choice of starts."""
THIRDS = (500, 50, 10, 1)
"""Third members of a pair that remain after each stage of the choice of sets of three."""
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
        allowed = np.triu(allowed_pairs(sets, members, members), 1)
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
        differs = Distinct(sets, apart, chosen).of_sets(pairs)
        differs[k] = False
    return [tuple(int(h) for h in sets.candidates[list(pair)]) for pair in chosen]


def surest_triples(
    staged: StagedSamples,
    search: LocalSearch,
    sets: SetTable,
    pairs: Sequence[tuple[int, ...]],
) -> list[tuple[int, ...]]:
    """Return pairs with the third member that recovers most of what they lose, in their order.

    Pairs without a third member that recovers something are left out.

    Args:
        staged: The samples.
        search: A search on the grid of the table.
        sets: The sets of the table.
        pairs: Flat grid indices of the members of each pair, which are candidates.
    """
    if sets.max_members < 3:
        return []
    scores = sets.single_reachability + sets.single_manipulability
    found = []
    for pair in pairs:
        points = search.points_of(pair)
        of_two = staged.successes([points], staged.stages - 1)[0]
        if of_two > 1.0 - GAIN:
            continue
        members = np.searchsorted(sets.candidates, pair)
        others = np.sort(np.argsort(-scores, kind="stable")[:MOST_CANDIDATES])
        others = others[np.all(allowed_pairs(sets, others, members), axis=1)]
        for stage, remaining in zip(range(staged.stages), THIRDS, strict=False):
            of_pair = staged.features(points, stage).max(axis=0)
            third = staged.features(search.points_of(sets.candidates[others].tolist()), stage)
            success = (np.maximum(third, of_pair) ** 2).sum(axis=1)
            order = np.argsort(-(success + PREFERENCE * scores[others]), kind="stable")
            others = others[order[:remaining]]
        triples = [(*pair, int(sets.candidates[third])) for third in others[:1]]
        found += [
            triple
            for triple in triples
            if staged.successes([search.points_of(triple)], staged.stages - 1)[0] > of_two + GAIN
        ]
    return found


@dataclass(frozen=True, eq=False)
class SurestSearch(LocalSearch):
    """Local search on the success in samples: few of them for most configurations around a set.

    A set that loses nothing in any sample stays where it is.
    """

    staged: StagedSamples | None = None
    """The samples."""

    @classmethod
    def of(
        cls, scorer: ScoresPoints, space: Space, staged: StagedSamples, rng: np.random.Generator
    ) -> Self:
        """Return a search for the greatest success; P_R + P_M decides among equals."""
        objective = ScoreObjective(staged.weights)
        return cls(scorer, space, objective, rng, screening_rounds=SCREENING_ROUNDS, staged=staged)

    def _valued(self, sets: Sequence[Evaluated]) -> FloatArray:
        """Return the success of sets in all samples, with P_R + P_M among equals, shape (n,)."""
        assert self.staged is not None
        success = self.staged.successes([one.values for one in sets], self.staged.stages - 1)
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
        if self.staged.successes([walk.present.values], last)[0] > 1.0 - GAIN:
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
            found = self.staged.successes([one.values for one in sets], stage)
            sets = [sets[k] for k in np.argsort(-found, kind="stable")[:remaining]]
        if not sets:
            return []
        values = self._valued(sets)
        best = int(np.argmax(values))
        better = float(values[best])
        return [(sets[best], better)] if better > walk.value + GAIN else []

    def _screened(self, choices: Sequence[Evaluated]) -> list[Evaluated]:
        """Return the combinations that are the surest in the first samples, the best first.

        Any two members change together, the others of a set of three stay.
        """
        assert self.staged is not None
        features = [self.staged.features(part.values, 0) for part in choices]
        preferences = [
            PREFERENCE
            * self.objective.values(Features(part.reached[:, None], part.dexterity[:, None]))
            for part in choices
        ]
        found = _Combinations(choices, features, preferences)
        if len(choices) == 1:
            which = np.arange(len(features[0]))[:, None]
        else:
            together = itertools.combinations(range(len(choices)), 2)
            which = np.concatenate([found.best(self.space, *both) for both in together])
            which = np.unique(which, axis=0) if len(choices) > 2 else which
        if len(choices) != 2:
            which = which[np.argsort(-found.values(which), kind="stable")[: SETS[0]]]
        return [
            Evaluated.joined(
                [part.rows(slice(k, k + 1)) for part, k in zip(choices, row, strict=True)]
            )
            for row in which
        ]


class _Combinations(NamedTuple):
    """Configurations around each member of a set, the present member first."""

    choices: Sequence[Evaluated]
    """The configurations."""
    features: Sequence[NDArray[np.float32]]
    """What they reach, of `StagedSamples.features`, shapes (n, F)."""
    preferences: Sequence[FloatArray]
    """Decide among equals where greater, shapes (n,)."""

    def best(self, space: Space, i: int, j: int) -> IntArray:
        """Return the surest sets in which no member but two differs from the present one.

        Args:
            space: Tells which sets are allowed.
            i: Number of the first member that differs.
            j: Number of the second.

        Returns:
            Number of the configuration of each member, shape (k, members).
        """
        shape = len(self.features[i]), len(self.features[j])
        which = np.zeros((shape[0] * shape[1], len(self.choices)), dtype=np.int64)
        which[:, i], which[:, j] = (at.ravel() for at in np.indices(shape))
        members = np.stack(
            [part.values[rows] for part, rows in zip(self.choices, which.T, strict=True)], axis=1
        )
        # What the others reach is reached whatever these two do.
        others = [of[0] for k, of in enumerate(self.features) if k not in (i, j)]
        rest = np.logical_or.reduce([of > 0.0 for of in others]) if others else np.False_
        first, second = (np.where(rest, np.float32(0.0), self.features[k]) for k in (i, j))
        preference = self.preferences[i][:, None] + self.preferences[j]
        allowed = space.allowed(members).reshape(shape)
        rows, columns = best_pairs(first, second, allowed, preference, SETS[0])
        return np.asarray(which[rows * shape[1] + columns])

    def values(self, which: IntArray) -> FloatArray:
        """Return the success of sets with the preferences, given as by `best`, shape (k,)."""
        of_members = list(zip(self.features, which.T, strict=True))
        success = (np.maximum.reduce([of[rows] for of, rows in of_members]) ** 2).sum(axis=1)
        liked = [of[rows] for of, rows in zip(self.preferences, which.T, strict=True)]
        return np.asarray(success + np.sum(liked, axis=0))
