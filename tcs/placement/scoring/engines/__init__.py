"""Engines: who scores the parts of a grid, to the same bytes.

In: the arrays of a grid (`Work`), and which of its configurations to score. Out: their scores, part
by part. `Threads` of this process are the default; `Processes` are of this machine, `Dask` are the
workers of a cluster.
"""

from __future__ import annotations

from tcs.placement.scoring.engines.choice import ENGINES, engine_named
from tcs.placement.scoring.engines.cluster import Dask
from tcs.placement.scoring.engines.local import Processes, Threads
from tcs.placement.scoring.engines.work import SLICE, Part, ScoringEngine, Work

__all__ = [
    "ENGINES",
    "SLICE",
    "Dask",
    "Part",
    "Processes",
    "ScoringEngine",
    "Threads",
    "Work",
    "engine_named",
]
