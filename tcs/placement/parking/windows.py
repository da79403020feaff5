"""Windows of the stops of a score file: found by scoring, and kept with the file."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import partial, wraps
from typing import TYPE_CHECKING, ParamSpec

import numpy as np

from tcs.model.random_streams import named_generator
from tcs.placement import selection
from tcs.placement.selection import Choice, ServedStop
from tcs.placement.store import ScoreFile
from tcs.placement.tables import Window, WindowTable

if TYPE_CHECKING:
    from tcs.placement.parking.stop import StopScorers

JOBS = 2
"""Threads that score base poses; the windows do not depend on their number."""
PREPARED = "stops around which base poses are scored"
"""Name of what scores base poses among what is derived from a table."""

P = ParamSpec("P")


def find_windows(
    file: ScoreFile,
    table: int,
    stop: ServedStop,
    least: Window | None,
    on_compile: Callable[[], None] | None = None,
) -> WindowTable:
    """Return what is found of a stop: a window, or what it misses within the one it has to hold.

    Args:
        file: The score file.
        table: Number of the table.
        stop: The stop, and the goals that it serves.
        least: What the window has to hold; None for the largest window that is found, 0 where none
            of 3 mm is.
        on_compile: Called first if the kernel has to be compiled.

    Raises:
        StoreMismatchError: If the file was made from other models.
        RobotError: If the file was scored with approach, and a velocity limit is unknown.
    """
    from tcs.placement.parking.search import WindowSearch

    goals = np.flatnonzero(stop.goals)
    scored = _prepared(file, table, on_compile).at(stop.values, goals.tolist())
    confirming = partial(scored.missed, thorough=True)
    search = WindowSearch(scored.missed, confirming, named_generator(0, "parking"))
    window = search.window(least)
    found = WindowTable.empty(stop.values.size, stop.goals.size)
    if window is None and least is None:
        window = Window(0.0, 0.0, 0.0)
    if window is not None:
        return found.added(stop.values, stop.goals, window, held=True)
    for number, goal in enumerate(goals.tolist()):
        of_goal = [miss for miss in search.misses if number in miss.goals]
        if of_goal:
            nearest = min(of_goal, key=lambda miss: miss.ratio(least))
            mask = np.arange(stop.goals.size) == goal
            found = found.added(stop.values, mask, nearest.at, held=False)
    return found


def _prepared(file: ScoreFile, table: int, on_compile: Callable[[], None] | None) -> StopScorers:
    """Return what scores base poses around the stops of a table; kept with it."""
    from concurrent.futures import ThreadPoolExecutor

    from tcs.placement.parking.stop import StopScorers
    from tcs.placement.refinement import PointScorer

    derived = file.tables[table].derived
    if PREPARED not in derived:
        scorer = PointScorer.of(file, table, JOBS)
        scorer.warm_up(on_compile)
        derived[PREPARED] = StopScorers(scorer, ThreadPoolExecutor(JOBS))
    found: StopScorers = derived[PREPARED]
    return found


def with_windows(file: ScoreFile) -> ScoreFile:
    """Return a score file with the windows that were found since it was read, to be saved."""
    return dataclasses.replace(
        file, tables=tuple(table.with_known_windows() for table in file.tables)
    )


def _finding_windows(choose: Callable[P, Choice]) -> Callable[P, Choice]:
    """Return the selection that scores base poses where it needs windows that are not known."""

    @wraps(choose)
    def choose_and_find(*args: P.args, **kwargs: P.kwargs) -> Choice:
        kwargs.setdefault("find_windows", find_windows)
        return choose(*args, **kwargs)

    return choose_and_find


select = _finding_windows(selection.select)
"""`tcs.placement.selection.select`, which finds the parking windows that the file lacks."""
