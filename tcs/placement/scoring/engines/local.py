"""Engines of this machine: threads of this process, or other processes."""

from __future__ import annotations

import logging
from collections.abc import Generator, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial

from joblib import Parallel, delayed
from joblib.externals.loky import ProcessPoolExecutor
from joblib.externals.loky.process_executor import BrokenProcessPool

from tcs.errors import TcsError
from tcs.placement.scoring.blocks import Block
from tcs.placement.scoring.engines.window import finished_parts
from tcs.placement.scoring.engines.work import SLICE, PackedWork, Part, Work

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Threads:
    """Threads of this process, in which the kernel runs side by side."""

    jobs: int
    """Number of threads."""
    length: int = SLICE
    """As in `ScoringEngine`."""

    def __post_init__(self) -> None:
        """Raise TcsError if there is no thread."""
        _check_jobs(self.jobs, "threads")

    def scored(
        self, work: Work, parts: Sequence[Part]
    ) -> Generator[tuple[Part, Block], None, None]:
        """As in `ScoringEngine`."""
        yield from Parallel(n_jobs=self.jobs, prefer="threads", return_as="generator")(
            delayed(_with_part)(work, part) for part in parts
        )


def _with_part(work: Work, part: Part) -> tuple[Part, Block]:
    return part, work.score(part)


@dataclass(frozen=True, slots=True)
class Processes:
    """Processes of this machine, which are started anew if one of them ends."""

    jobs: int
    """Number of processes."""
    length: int = 8 * SLICE
    """As in `ScoringEngine`: some 50 ms of work, ten times what it takes to send the scores."""

    def __post_init__(self) -> None:
        """Raise TcsError if there is no process."""
        _check_jobs(self.jobs, "processes")

    def scored(
        self, work: Work, parts: Sequence[Part]
    ) -> Generator[tuple[Part, Block], None, None]:
        """As in `ScoringEngine`."""
        packed = PackedWork.of(work)
        left = dict.fromkeys(parts)
        while left:
            before = len(left)
            pool = ProcessPoolExecutor(
                max_workers=min(self.jobs, len(left)), initializer=_receive, initargs=(packed,)
            )
            try:
                for part, block in finished_parts(
                    partial(_submitted, pool), list(left), 2 * self.jobs
                ):
                    del left[part]
                    yield part, block
            except BrokenProcessPool as error:
                if len(left) == before:
                    raise TcsError(
                        "Scoring: the processes ended before one of them had finished a part, for "
                        "example for want of memory. Use fewer with --jobs, or --engine threads."
                    ) from error
                _log.warning("A process that was scoring ended; its part is scored again.")
            finally:
                pool.shutdown(wait=True, kill_workers=True)


def _check_jobs(jobs: int, what: str) -> None:
    if jobs < 1:
        raise TcsError(f"jobs is {jobs}; must be 1 or more {what}.")


_received: list[PackedWork] = []
"""In a process of `Processes`: the grid that it was sent at its start."""


def _receive(packed: PackedWork) -> None:
    _received[:] = [packed]


def _score_received(part: Part) -> Block:
    return _received[0].unpacked().score(part)


def _submitted(pool: ProcessPoolExecutor, part: Part) -> Future[Block]:
    future: Future[Block] = pool.submit(_score_received, part)
    return future
