"""The workers of a Dask cluster as an engine."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from tcs.errors import TcsError
from tcs.placement.scoring.blocks import Block
from tcs.placement.scoring.engines.work import SLICE, PackedWork, Part, Work

if TYPE_CHECKING:
    from distributed import Client

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
