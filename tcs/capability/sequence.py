"""Sequences of base poses for a task that no single base pose reaches."""

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
    """One base pose of a sequence, which reaches the positions first .. last."""

    first: int
    last: int
    base: BasePose

    def to_json(self) -> dict[str, Any]:
        """Return the stop as plain containers."""
        return {"positions": list(range(self.first, self.last + 1)), **self.base.to_json()}


def split(
    capability: CapabilityMap | MapVolume,
    task: GraspTask,
    *,
    scale: str = FIXED,
    torso_height: float | None = None,
) -> tuple[Stop, ...]:
    """Return the fewest base poses that reach the positions in their order.

    Of the sequences with the fewest stops, the one with the greatest lowest score is returned.

    Args:
        capability: As in `merge`.
        task: The positions, in order.
        scale: As in `merge`.
        torso_height: As in `merge`.

    Raises:
        SelectionError: If no base pose reaches a position.
    """
    volume = capability if isinstance(capability, MapVolume) else MapVolume(capability, scale)
    count = len(task.positions)
    # Best sequence up to each position: number of stops, negated lowest score, stops.
    best: list[tuple[int, float, tuple[Stop, ...]]] = [(0, -math.inf, ())]
    for last in range(count):
        options = []
        for first in range(last, -1, -1):
            part = GraspTask(task.name, task.positions[first : last + 1])
            try:
                base = merge(volume, part, torso_height=torso_height).best()
            except SelectionError:
                if first == last:
                    raise
                # A longer part of the task is infeasible as well.
                break
            stops, cost, before = best[first]
            options.append((stops + 1, max(cost, -base.score), (*before, Stop(first, last, base))))
        best.append(min(options, key=lambda option: option[:2]))
    return best[count][2]
