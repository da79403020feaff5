"""Requests about score files: answered at once where that is quick, else in the order they came."""

from __future__ import annotations

import asyncio
import time
from collections import OrderedDict
from collections.abc import Callable, Hashable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from typing import TypeVar

QUEUES = 4
"""Number of queues: a request that takes seconds delays those about a quarter of the files."""
QUICK = 0.003
"""Longest time of the processor that a quick answer takes [s]."""
STREAK = 8
"""Quick answers after which the next one of that kind is expected to be quick too."""
_KINDS = 256
"""Most kinds of requests about a file that are known."""
_DIGITS = 8
"""First digits of a digest by which a file has its queue."""
Answer = TypeVar("Answer")


@dataclass(slots=True)
class _Queue:
    """A thread, and the answers of unknown duration that it has still to give."""

    thread: ThreadPoolExecutor
    slow: int = 0


@dataclass(slots=True)
class _Pace:
    """How quickly the latest requests of one kind were answered."""

    streak: int = field(default=0)
    """Quick answers since the last one that was not."""

    @property
    def is_quick(self) -> bool:
        return self.streak >= STREAK

    def timed(self, answer: Callable[[], Answer]) -> Answer:
        """Return an answer, and note its duration."""
        # Time of the processor: the wait for another thread says nothing about the next answer.
        begun = time.thread_time()
        try:
            answered = answer()
        except BaseException:
            # A refusal says nothing about the time of an answer.
            if time.thread_time() - begun > QUICK:
                self.streak = 0
            raise
        self.streak = self.streak + 1 if time.thread_time() - begun <= QUICK else 0
        return answered


class FileQueues:
    """Some queues with a thread each; the requests about one score file are in one of them.

    The engine answers them one after the other anyhow. A thread that takes its next request from a
    queue needs no other thread to run in between, and none waits for a lock: with many clients the
    last of them waits hardly longer than the others. Answers that are expected to be quick are
    given without the thread while nothing slow is in its queue: two threads that run by turns take
    twice the time of the processor.
    """

    def __init__(self) -> None:
        """Start with empty queues; their threads begin with the first request."""
        self._queues = [_Queue(ThreadPoolExecutor(1, f"tcs-queue-{i}")) for i in range(QUEUES)]
        self._paces: OrderedDict[Hashable, _Pace] = OrderedDict()

    async def run(self, file: str, kind: Hashable | None, answer: Callable[[], Answer]) -> Answer:
        """Return the answer to a request about a file.

        Args:
            file: Digest of the file, in hexadecimal digits.
            kind: What requests that take equally long have in common; None if that is not known.
            answer: Answers the request.
        """
        queue = self._queues[int(file[:_DIGITS], 16) % QUEUES]
        pace = _Pace() if kind is None else self._pace((file, kind))
        is_slow = not pace.is_quick
        if not is_slow and not queue.slow:
            return pace.timed(answer)
        queue.slow += is_slow
        try:
            loop = asyncio.get_running_loop()
            return await loop.run_in_executor(queue.thread, partial(pace.timed, answer))
        finally:
            queue.slow -= is_slow

    def _pace(self, kind: Hashable) -> _Pace:
        """Return how quickly requests of a kind are answered; the least recent ones are dropped."""
        pace = self._paces.setdefault(kind, _Pace())
        self._paces.move_to_end(kind)
        if len(self._paces) > _KINDS:
            self._paces.popitem(last=False)
        return pace
