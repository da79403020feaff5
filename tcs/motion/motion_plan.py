"""Plans as values: segments, the tour of each stop, and what became of each goal."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tcs.errors import TcsError
from tcs.model.grid import InitialConfiguration
from tcs.motion.curves import Curve
from tcs.motion.stops import BodyPair
from tcs.motion.timing import DECIMALS, Timed

INTERPOLATION = "cubic Hermite"
"""What a motion is between its samples: the cubics through their positions and velocities."""


@dataclass(frozen=True, eq=False)
class Segment:
    """One motion of a tour."""

    type: str
    """"move", past everything; "approach" or "retreat", straight."""
    start: int | None
    """Goal near which it begins; None for rest. A straight motion begins and ends near one goal."""
    end: int | None
    """Goal near which it ends; None for rest."""
    timing: Timed

    @property
    def curve(self) -> Curve:
        """The motion as a curve: joint angles by the time [s]."""
        return Curve(self.timing.times, self.timing.positions, self.timing.velocities)

    @property
    def edges(self) -> int:
        """Number of pieces between samples."""
        return self.curve.pieces

    def to_json(self) -> dict[str, Any]:
        """Return the segment as plain containers, angles in radians."""
        return {
            "type": self.type,
            "from": "rest" if self.start is None else self.start,
            "to": "rest" if self.end is None else self.end,
            "duration": self.timing.duration,
            "edges": self.edges,
            "times": self.timing.times.tolist(),
            # Not rounded: limits are kept by the curve through these very numbers.
            "positions": self.timing.positions.tolist(),
            "velocities": self.timing.velocities.tolist(),
        }


@dataclass(frozen=True)
class GoalResult:
    """What became of one goal."""

    goal: int
    stop: int | None
    """Number of the stop that was to do it; None if no stop reaches it."""
    done: bool
    reason: str
    """"" if done; "unreached", "rest_blocked", "approach_limits", "approach_blocked" or
    "no_path"."""
    pair: BodyPair | None = None
    """The bodies whose contact stood in the way most often."""
    segment: str = ""
    """The segment without a motion, e.g. "rest to goal 3"."""
    seconds: float = field(default=0.0, compare=False)
    """How long it was tried [s]."""

    def to_json(self) -> dict[str, Any]:
        """Return the result as plain containers."""
        plain: dict[str, Any] = {"goal": self.goal, "stop": self.stop, "done": self.done}
        if not self.done:
            plain |= {
                "reason": self.reason,
                "pair": None if self.pair is None else list(self.pair),
                "segment": self.segment,
                "seconds": self.seconds,
            }
        return plain


@dataclass(frozen=True, eq=False)
class StopPlan:
    """The motions at one stop."""

    at: InitialConfiguration
    index: int | None
    """Flat configuration index; None off the grid."""
    segments: tuple[Segment, ...]
    """In order, from rest to rest; empty if no goal can be done."""
    returns: bool
    """Whether a motion back to rest was found."""
    hand: str = ""
    """Name of the hand that makes the tour; "" in a plan of one."""
    joints: tuple[str, ...] = ()
    """Names of its joints, in a plan of several hands."""

    @property
    def goals(self) -> tuple[int, ...]:
        """Goals that are done, in order."""
        return tuple(s.end for s in self.segments if s.type == "approach" and s.end is not None)

    @property
    def duration(self) -> float:
        """Duration of all segments [s]."""
        return sum(segment.timing.duration for segment in self.segments)

    def samples(self) -> Timed:
        """Return all segments one after the other; a sample where two meet is there once.

        Raises:
            TcsError: If there are no segments.
        """
        if not self.segments:
            raise TcsError("Nothing can be done from this stop, so it has no trajectory.")
        return joined([segment.timing for segment in self.segments])

    def to_json(self) -> dict[str, Any]:
        """Return the stop as plain containers."""
        return {
            **self.at.to_json(),
            **({"hand": self.hand, "joints": list(self.joints)} if self.hand else {}),
            "configuration": self.index,
            "goals": list(self.goals),
            "returns": self.returns,
            "duration": self.duration,
            "segments": [segment.to_json() for segment in self.segments],
        }


@dataclass(frozen=True, eq=False)
class MotionPlan:
    """The motions that do a task from the stops of a set."""

    made_from: Mapping[str, Any]
    """The scene, as plain containers: `task`, `environment`, `robot`, `scene_digest`, `observed`
    and, if it was scored under any, `constraints`."""
    joints: tuple[str, ...]
    """Names of the joints, in the order of all joint arrays."""
    stops: tuple[StopPlan, ...]
    results: tuple[GoalResult, ...]
    """What became of each goal of the task, in order."""
    edges: int
    """Number of pieces of curves that Drake re-checked."""
    false: int
    """Number of these that Drake refutes."""
    seed: int
    seconds: float
    """Duration of planning, timing and re-check [s]."""
    jerk_limits: tuple[float, ...] | None = None
    """Greatest jerk of each joint [rad/s^3], inf where there is none; None without limits."""

    def joints_of(self, stop: StopPlan) -> tuple[str, ...]:
        """Return the names of the joints of a stop, in the order of its joint arrays."""
        return stop.joints or self.joints

    @property
    def goals_done(self) -> int:
        """Number of goals done."""
        return sum(result.done for result in self.results)

    def to_json(self) -> dict[str, Any]:
        """Return the plan as plain containers, as `tcs plan --json` prints it."""
        return {
            "made_from": dict(self.made_from),
            "joints": list(self.joints),
            "interpolation": INTERPOLATION,
            "stops": [stop.to_json() for stop in self.stops],
            "goals": len(self.results),
            "goals_reached": sum(result.stop is not None for result in self.results),
            "goals_done": self.goals_done,
            "results": [result.to_json() for result in self.results],
            "verified": {"edges": self.edges, "false": self.false},
            "seed": self.seed,
            "seconds": self.seconds,
            "jerk_limits": self._jerk_limits(),
        }

    def _jerk_limits(self) -> list[float | None] | None:
        """Return the jerk limits as JSON knows numbers: null where there is none."""
        if self.jerk_limits is None:
            return None
        return [limit if math.isfinite(limit) else None for limit in self.jerk_limits]


def joined(parts: Sequence[Timed]) -> Timed:
    """Return timed curves one after the other; a sample where two meet is there once."""
    times, positions, velocities = [parts[0].times], [parts[0].positions], [parts[0].velocities]
    for part in parts[1:]:
        times.append((times[-1][-1] + part.times[1:]).round(DECIMALS))
        positions.append(part.positions[1:])
        velocities.append(part.velocities[1:])
    return Timed(np.concatenate(times), np.concatenate(positions), np.concatenate(velocities))
