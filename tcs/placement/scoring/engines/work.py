"""Scores of a part of the grid, wherever they are computed; threads compute them here."""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from tcs.errors import TcsError
from tcs.kernel import cache
from tcs.kernel.arrays import GridArrays
from tcs.kernel.contacts import NO_CONTACT
from tcs.kernel.rows import grid_rows
from tcs.kernel.scores import joined, new_scores
from tcs.placement.scoring.blocks import Block
from tcs.placement.scoring.scorer import Scorer
from tcs.placement.tables import Reason

SLICE = 1024
"""Configurations per call of the kernel: some milliseconds of work, with scratch memory that stays
in the processor's cache."""


class Part(NamedTuple):
    """Configurations start <= h < stop, in the flat order of the grid."""

    start: int
    stop: int


class Work(NamedTuple):
    """A grid to score."""

    scorer: Scorer
    """The scene and its goals."""
    grid: GridArrays
    """The configurations."""
    excluded: NDArray[np.bool_] | None = None
    """Configurations that are not scored, shape (configurations,); None for none."""

    def score(self, part: Part) -> Block:
        """Return the scores of a part."""
        slices = []
        for start in range(part.start, part.stop, SLICE):
            stop = min(start + SLICE, part.stop)
            rows = grid_rows(self.grid, start, stop)
            if self.excluded is None:
                slices.append(self.scorer.score(rows))
                continue
            out = self.excluded[start:stop]
            scores = new_scores(rows.number, self.scorer.problem.goals.number)
            scores.reason[out], scores.contact[out] = Reason.EXCLUDED, NO_CONTACT
            scores.put(~out, self.scorer.score(rows.at(~out)))
            slices.append(scores)
        reason, contact, dexterity, joints = joined(slices)
        # Only reached pairs, about one in ten, have joints to keep.
        return Block(reason, contact, dexterity, joints[reason == Reason.REACHED])


class ScoringEngine(Protocol):
    """Scores the parts of a grid. The scores are the same with every engine."""

    @property
    def length(self) -> int:
        """Configurations per part that keep its workers busy, if nothing else decides."""

    def scored(
        self, work: Work, parts: Sequence[Part]
    ) -> Generator[tuple[Part, Block], None, None]:
        """Yield the scores of parts as they are finished.

        Args:
            work: The grid.
            parts: What to score of it.

        Raises:
            TcsError: If the workers cannot be reached, or are lost with no part finished meanwhile.
        """


@dataclass(frozen=True, slots=True)
class Threads:
    """Threads of this process, in which the kernel runs side by side."""

    jobs: int
    """Number of threads."""
    length: int = SLICE
    """As in `ScoringEngine`."""

    def __post_init__(self) -> None:
        """Raise TcsError if there is no thread."""
        if self.jobs < 1:
            raise TcsError(f"jobs is {self.jobs}; must be 1 or more threads.")

    def scored(
        self, work: Work, parts: Sequence[Part]
    ) -> Generator[tuple[Part, Block], None, None]:
        """As in `ScoringEngine`."""
        blocks = Parallel(n_jobs=self.jobs, prefer="threads", return_as="generator")(
            delayed(work.score)(part) for part in parts
        )
        yield from zip(parts, blocks, strict=True)


class PackedWork(NamedTuple):
    """A grid to score, as it is sent to other processes."""

    content: bytes
    digest: str
    """SHA-256 of the content, as 64 hex digits."""
    kernel: str
    """Digest of the kernel's sources, of what compiles them, and of the processor."""

    @classmethod
    def of(cls, work: Work) -> PackedWork:
        """Pack a grid."""
        content = pickle.dumps(work, protocol=5)
        return cls(content, hashlib.sha256(content).hexdigest(), _kernel_digest())

    def unpacked(self) -> Work:
        """Return the grid; the last one is kept.

        Raises:
            TcsError: If it was changed on its way, or another kernel would score it.
        """
        if self.kernel != _kernel_digest():
            raise TcsError(
                "A worker has another kernel than the computer that asks: another version of tcs, "
                "numba or Python, or another processor, which may round differently. Use workers "
                "with the same."
            )
        return _unpacked(self)


@lru_cache(maxsize=1)
def _unpacked(packed: PackedWork) -> Work:
    if hashlib.sha256(packed.content).hexdigest() != packed.digest:
        raise TcsError("A worker was sent a damaged grid. Try again.")
    work: Work = pickle.loads(packed.content)
    return work


@lru_cache(maxsize=1)
def _kernel_digest() -> str:
    return cache.kernel_digest(Path(cache.__file__).parent)
