"""Drake diagrams, whose memory only a search for garbage frees."""

from __future__ import annotations

import gc
import itertools

from pydrake.systems.framework import DiagramBuilder

PERIOD = 8
"""Number of diagrams from one search for garbage to the next. Each holds up to 30 MB, and building
one takes longer than the search, some 0.2 s once all modules are imported."""
_numbers = itertools.count(1)


def diagram_builder() -> DiagramBuilder:
    """Return a new builder; every `PERIOD`-th time, free the diagrams that nobody holds any more.

    Builder, diagram, plant and scene graph refer to each other in pydrake, so that they outlive
    their last user until Python searches all objects for garbage. By its own thresholds it hardly
    ever does: it counts objects, among which a few hundred more are lost, however much they hold.
    """
    # Before the new one is built, so that its memory can be that of the old ones.
    if next(_numbers) % PERIOD == 0:
        gc.collect()
    return DiagramBuilder()
