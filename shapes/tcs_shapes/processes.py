"""Calls that several processes share."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator
from typing import Any

from joblib import Parallel

_REPLACED = "A worker stopped while some jobs were given to the executor"
"""What joblib warns of when it replaces a process whose memory has grown."""


def unordered(jobs: int, calls: Iterable[Any]) -> Iterator[Any]:
    """Yield the results of calls of `joblib.delayed` as they are done, in any order.

    Args:
        jobs: Number of processes; with one, this process makes the calls.
        calls: The calls, begun in their order: the longest first leave the least to wait for.
    """
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=_REPLACED, category=UserWarning)
        yield from Parallel(jobs, return_as="generator_unordered")(calls)


def ordered(jobs: int, calls: Iterable[Any]) -> list[Any]:
    """Return the results of calls of `joblib.delayed` in their order; arguments as `unordered`."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=_REPLACED, category=UserWarning)
        return list(Parallel(jobs)(calls))
