"""Keep what was read from a file for as long as the file does not change."""

from __future__ import annotations

import functools
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Concatenate, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")
F = TypeVar("F", bound=Path | tuple[Path, ...])
_Status = tuple[int, int, int, int, int]

YOUNG = 100_000_000
"""Time after a change for which nothing of a file is kept [ns].

File systems note the time of a change in steps of some milliseconds: of two changes within one step
the second would not show.
"""


def kept_while_unchanged(
    files: int,
) -> Callable[[Callable[Concatenate[F, P], R]], Callable[Concatenate[F, P], R]]:
    """Return a decorator for functions of the content of files and hashable further arguments.

    A process that runs for days, such as the service, must not answer with a mesh or a URDF that
    has been replaced since. A file counts as unchanged while its place on the disk, its size and
    its times are the same.

    Args:
        files: Most results to keep; the one that was not asked for the longest goes first.

    Returns:
        A decorator for functions whose first argument is the path, or a tuple of paths. Results
        are shared between callers, which must not change them.
    """

    def decorated(
        function: Callable[Concatenate[F, P], R],
    ) -> Callable[Concatenate[F, P], R]:
        @functools.lru_cache(maxsize=files)
        def kept(_: tuple[_Status, ...], path: F, *args: P.args, **kwargs: P.kwargs) -> R:
            return function(path, *args, **kwargs)

        @functools.wraps(function)
        def wrapped(path: F, /, *args: P.args, **kwargs: P.kwargs) -> R:
            statuses = []
            for file in path if isinstance(path, tuple) else (path,):
                status = _status(file)
                if status is None:
                    return function(path, *args, **kwargs)
                statuses.append(status)
            return kept(tuple(statuses), path, *args, **kwargs)  # type: ignore[arg-type]

        return wrapped

    return decorated


def _status(path: Path) -> _Status | None:
    """Return what tells a file from a changed one; None if nothing of it may be kept."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return None
    changed = max(found.st_mtime_ns, found.st_ctime_ns)
    if abs(time.time_ns() - changed) < YOUNG:
        return None
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns
