"""Drake, the compiler and what draws: imported by one thread at a time.

Two threads that import the same large package for the first time may each find it half-imported.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from importlib import import_module

_LOCK = threading.Lock()
_MODULES = (
    "tcs.placement.scoring",
    "tcs.output.report.score.pictures",
    "tcs.output.view.scene_objects",
)


def import_heavy() -> None:
    """Import what scenes are built and drawn with; returns at once the next time."""
    for step in import_steps():
        step()


def import_steps() -> tuple[Callable[[], None], ...]:
    """Return functions that do together what `import_heavy` does."""
    return tuple(partial(_import, name) for name in _MODULES)


def _import(name: str) -> None:
    with _LOCK:
        import_module(name)
