"""Engines: who scores the parts of a grid, to the same bytes.

In: the arrays of a grid (`Work`), and which of its configurations to score. Out: their scores, part
by part. `Threads` of this process are the default; `Dask` are the workers of a cluster.
"""

from __future__ import annotations

from tcs.errors import TcsError, UnknownNameError
from tcs.placement.scoring.engines.cluster import Dask
from tcs.placement.scoring.engines.work import SLICE, Part, ScoringEngine, Threads, Work

__all__ = [
    "ENGINES",
    "SLICE",
    "Dask",
    "Part",
    "ScoringEngine",
    "Threads",
    "Work",
    "engine_named",
]

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
