"""Samples in parts: a few for every configuration, all for those that may be the surest."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import BoolArray, FloatArray, IntArray
from tcs.placement.refinement.floor import RememberedSamples
from tcs.placement.refinement.objectives import Samples

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
