"""Several base poses for a task that no single one reaches, in the order of its positions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from tcs.capability.map import FIXED, CapabilityMap
from tcs.capability.merge import BasePose, merge
from tcs.capability.tasks import GraspTask
from tcs.capability.volume import MapVolume
from tcs.errors import SelectionError


@dataclass(frozen=True, slots=True)
class Stop:
    """One base pose of a sequence: positions first .. last are reached from there."""

    first: int
    last: int
    base: BasePose

    def to_json(self) -> dict[str, Any]:
        """Return it as plain containers."""
        return {"positions": list(range(self.first, self.last + 1)), **self.base.to_json()}


def split(
    capability: CapabilityMap | MapVolume,
    task: GraspTask,
    *,
    scale: str = FIXED,
    lift: float | None = None,
) -> tuple[Stop, ...]:
    """Return base poses that reach the positions in their order, one after the other.

    As few stops as there can be, and of those sequences the one whose lowest score is highest.

    Args:
        capability: As in `merge`.
        task: The positions, in order.
        scale: As in `merge`.
        lift: As in `merge`.

    Raises:
        SelectionError: If a position is reached from nowhere.
    """
    volume = capability if isinstance(capability, MapVolume) else MapVolume(capability, scale)
    count = len(task.positions)
    # Best sequence up to each position: stops, minus the lowest score, the stops themselves.
    best: list[tuple[int, float, tuple[Stop, ...]]] = [(0, -math.inf, ())]
    for last in range(count):
        options = []
        for first in range(last, -1, -1):
            part = GraspTask(task.name, task.positions[first : last + 1])
            try:
                base = merge(volume, part, lift=lift).best()
            except SelectionError:
                if first == last:
                    raise
                # What a stretch cannot do, a longer one cannot do either.
                break
            stops, cost, before = best[first]
            options.append((stops + 1, max(cost, -base.score), (*before, Stop(first, last, base))))
        best.append(min(options, key=lambda option: option[:2]))
    return best[count][2]
