"""Drake, the compiler and what draws: imported by one thread at a time.

Two threads that import the same large package for the first time may each find it half-imported.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from importlib import import_module

_LOCK = threading.Lock()
_SCORING = "tcs.placement.scoring"
_DRAWING = ("tcs.output.report.score.pictures", "tcs.output.view.scene_objects")


def import_scoring() -> None:
    """Import what scenes are built and scored with; returns at once the next time."""
    _import(_SCORING)


def import_heavy() -> None:
    """Import what scenes are built, scored and drawn with; returns at once the next time."""
    import_scoring()
    for step in drawing_steps():
        step()


def drawing_steps() -> tuple[Callable[[], None], ...]:
    """Return functions that import what scenes are drawn with, after `import_scoring`."""
    return tuple(partial(_import, name) for name in _DRAWING)


def _import(name: str) -> None:
    with _LOCK:
        import_module(name)
