"""Drake, the compiler and what draws: imported by one thread at a time.

Two threads that import the same large package for the first time may each find it half-imported.
"""

from __future__ import annotations

import threading
from importlib import import_module

_LOCK = threading.Lock()
_MODULES = (
    "tcs.placement.scoring",
    "tcs.output.report.score.pictures",
    "tcs.output.view.scene_objects",
)


def import_heavy() -> None:
    """Import what scenes are built and drawn with; returns at once the next time."""
    with _LOCK:
        for name in _MODULES:
            import_module(name)
