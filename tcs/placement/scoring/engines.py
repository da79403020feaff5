"""Engines: who scores the parts of a grid, to the same bytes.

In: the arrays of a grid (`Work`), and which of its configurations to score. Out: their scores, part
by part. `Threads` of this process are the default; `Dask` are the workers of a cluster.
"""

from __future__ import annotations

import contextlib
import hashlib
import pickle
import socket
from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from tcs.errors import TcsError, UnknownNameError
from tcs.kernel import cache
from tcs.kernel.arrays import GridArrays
from tcs.kernel.contacts import NO_CONTACT
from tcs.kernel.rows import grid_rows
from tcs.kernel.scores import joined, new_scores
from tcs.placement.scoring.blocks import Block
from tcs.placement.scoring.scorer import Scorer
from tcs.placement.tables import Reason

if TYPE_CHECKING:
    from distributed import Client


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


TIMEOUT = 10.0
"""Time to wait for the scheduler and a first worker [s]."""

PER_THREAD = 3
"""Parts requested for each thread of the workers, so that none waits for its next one."""


@dataclass(frozen=True, slots=True)
class Dask:
    """The workers of a Dask cluster.

    A part is scored again by another worker if its own ends; Dask gives up on one that ended three
    workers.
    """

    scheduler: str
    """Address of the scheduler, e.g. "tcp://10.0.0.1:8786"."""
    length: int = 8 * SLICE
    """As in `ScoringEngine`: some 50 ms of work, ten times what it takes to send the scores."""

    def scored(
        self, work: Work, parts: Sequence[Part]
    ) -> Generator[tuple[Part, Block], None, None]:
        """As in `ScoringEngine`."""
        with self._connected() as client:
            threads = sum(client.nthreads().values())
            # A task of its own and not scattered data, which would be lost with the worker that
            # holds it.
            packed = client.submit(_same, PackedWork.of(work))
            yield from _as_finished(client, packed, parts, PER_THREAD * threads)

    @contextlib.contextmanager
    def _connected(self) -> Iterator[Client]:
        """Yield a client of the scheduler, with a worker at least.

        Raises:
            TcsError: If Dask is not installed, or the cluster cannot be reached or is lost.
        """
        try:
            from distributed import Client
            from distributed.client import FutureCancelledError
            from distributed.scheduler import KilledWorker
        except ImportError as error:
            raise TcsError(
                "Engine dask: requires the package distributed. Install it with "
                "`pip install 'tcs[dask]'`, here and on the workers."
            ) from error
        lost = (
            f"Engine dask: scheduler '{self.scheduler}' or its workers were lost. Start them and "
            "run the same again; with --blocks it continues where it was."
        )
        try:
            # A client that failed to connect can block its process when it is collected.
            _check_reachable(self.scheduler)
            client = Client(self.scheduler, timeout=TIMEOUT, set_as_default=False)
        except (OSError, ValueError) as error:
            raise TcsError(
                f"Engine dask: scheduler '{self.scheduler}' cannot be reached. Start one with "
                "`dask scheduler`, and give the address it prints, e.g. tcp://10.0.0.1:8786."
            ) from error
        with client:
            try:
                client.wait_for_workers(1, timeout=TIMEOUT)
            except TimeoutError as error:
                raise TcsError(
                    f"Engine dask: scheduler '{self.scheduler}' has no worker. Start one with "
                    f"`dask worker {self.scheduler}`."
                ) from error
            try:
                yield client
            except (FutureCancelledError, KilledWorker, OSError) as error:
                raise TcsError(lost) from error


def _check_reachable(address: str) -> None:
    """Raise OSError or ValueError if nothing listens at an address, "tcp://host:port"."""
    from distributed.comm import get_address_host_port, parse_address

    scheme, _ = parse_address(address)
    if scheme != "inproc":
        socket.create_connection(get_address_host_port(address), timeout=TIMEOUT).close()


def _as_finished(
    client: Client, packed: Any, parts: Sequence[Part], width: int
) -> Generator[tuple[Part, Block], None, None]:
    """Yield the scores of parts as they are finished, with `width` of them under way at a time."""
    from distributed import as_completed

    waiting = iter(parts)

    def request(part: Part) -> Any:
        return client.submit(_score, packed, part, pure=False)

    requested = {request(part): part for _, part in zip(range(width), waiting, strict=False)}
    finished = as_completed(requested, loop=client.loop, with_results=True)
    for future, block in finished:
        # What is cancelled because the scheduler was lost has its exception as result.
        if isinstance(block, Exception):
            raise block
        following = next(waiting, None)
        if following is not None:
            asked = request(following)
            requested[asked] = following
            finished.add(asked)
        yield requested.pop(future), block


def _same(packed: PackedWork) -> PackedWork:
    return packed


def _score(packed: PackedWork, part: Part) -> Block:
    return packed.unpacked().score(part)


ENGINES = ("threads", "dask")


def engine_named(name: str, *, jobs: int, scheduler: str | None = None) -> ScoringEngine:
    """Return an engine.

    Args:
        name: One of `ENGINES`.
        jobs: Number of threads; Dask's workers have theirs.
        scheduler: Address of the scheduler of a Dask cluster.

    Raises:
        UnknownNameError: If there is no such engine.
        TcsError: If `jobs` is less than 1, or the scheduler is missing or given for another engine.
    """
    if name not in ENGINES:
        raise UnknownNameError("engine", name, ENGINES)
    if name == "threads":
        if scheduler is not None:
            raise TcsError("Engine threads: has no scheduler; --scheduler is for --engine dask.")
        return Threads(jobs)
    if scheduler is None:
        raise TcsError(
            "Engine dask: requires --scheduler ADDRESS, the address that `dask scheduler` prints."
        )
    return Dask(scheduler)
