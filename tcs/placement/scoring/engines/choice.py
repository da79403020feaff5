"""Engines by name."""

from __future__ import annotations

from tcs.errors import TcsError, UnknownNameError
from tcs.placement.scoring.engines.cluster import Dask
from tcs.placement.scoring.engines.local import Processes, Threads
from tcs.placement.scoring.engines.work import ScoringEngine

ENGINES = ("threads", "processes", "dask")


def engine_named(name: str, *, jobs: int, scheduler: str | None = None) -> ScoringEngine:
    """Return an engine.

    Args:
        name: One of `ENGINES`.
        jobs: Number of threads or processes; Dask's workers have theirs.
        scheduler: Address of the scheduler of a Dask cluster.

    Raises:
        UnknownNameError: If there is no such engine.
        TcsError: If `jobs` is less than 1, or the scheduler is missing or given for another engine.
    """
    if (scheduler is not None) != (name == "dask") and name in ENGINES:
        raise TcsError(
            "Engine dask: requires --scheduler ADDRESS, the address that `dask scheduler` prints."
            if name == "dask"
            else f"Engine {name}: has no scheduler; --scheduler is for --engine dask."
        )
    if name == "threads":
        return Threads(jobs)
    if name == "processes":
        return Processes(jobs)
    if scheduler is not None:
        return Dask(scheduler)
    raise UnknownNameError("engine", name, ENGINES)
