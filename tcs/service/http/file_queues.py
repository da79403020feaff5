"""Requests about score files, answered in the order in which they came."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

QUEUES = 4
"""Number of queues: a request that takes seconds delays those about a quarter of the files."""
_DIGITS = 8
"""First digits of a digest by which a file has its queue."""
Answer = TypeVar("Answer")


class FileQueues:
    """Some queues with a thread each; the requests about one score file are in one of them.

    The engine answers them one after the other anyhow. A thread that takes its next request from a
    queue needs no other thread to run in between, and none waits for a lock: with many clients the
    last of them waits hardly longer than the others.
    """

    def __init__(self) -> None:
        """Start with empty queues; their threads begin with the first request."""
        self._queues = [ThreadPoolExecutor(1, f"tcs-queue-{i}") for i in range(QUEUES)]

    async def run(self, file: str, answer: Callable[[], Answer]) -> Answer:
        """Return the answer to a request about a file, once those before it are answered.

        Args:
            file: Digest of the file, in hexadecimal digits.
            answer: Answers the request.
        """
        queue = self._queues[int(file[:_DIGITS], 16) % QUEUES]
        return await asyncio.get_running_loop().run_in_executor(queue, answer)
