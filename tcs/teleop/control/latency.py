"""Latency between operator and arm: commands that arrive late, pictures that arrive late."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Generic, Literal, TypeVar

from tcs.errors import TcsError
from tcs.files.quantities import LATENCY

T = TypeVar("T")
LatencyPath = Literal["command", "picture", "both"]
"""What arrives late: the operator's commands at the arm, what the operator sees of the arm
(posture, limits, reason of a stop), or both, each by the whole latency."""


@dataclass(frozen=True, slots=True)
class Latency:
    """A constant latency between operator and arm.

    Attributes:
        seconds: The latency of each path that has one [s].
        path: What arrives late.
    """

    seconds: float = 0.0
    path: LatencyPath = "both"

    def __post_init__(self) -> None:
        """Check the latency.

        Raises:
            TcsError: If it is not a number in its range.
        """
        LATENCY.check(self.seconds, "latency", TcsError)

    @property
    def command(self) -> float:
        """Latency of the commands [s]."""
        return 0.0 if self.path == "picture" else self.seconds

    @property
    def picture(self) -> float:
        """Latency of the pictures [s]."""
        return 0.0 if self.path == "command" else self.seconds

    @property
    def summary(self) -> str:
        """The latency as text, empty if there is none.

        >>> Latency(0.2).summary
        '0.2 s for commands and 0.2 s for pictures'
        """
        each = (("commands", self.command), ("pictures", self.picture))
        return " and ".join(f"{seconds:g} s for {name}" for name, seconds in each if seconds)

    def to_json(self) -> dict[str, float]:
        """Return the latency of commands and pictures [s] as plain values; empty without one."""
        if not self.seconds:
            return {}
        return {"command_latency": self.command, "picture_latency": self.picture}


NO_LATENCY = Latency()
"""The latency where none is given."""


class DelayLine(Generic[T]):
    """A line of values of which each comes out a fixed number of periods after it went in."""

    def __init__(self, latency: float, period: float, initial: T) -> None:
        """Fill the line.

        Args:
            latency: Time from in to out [s], rounded to whole periods; 0 passes each value on.
            period: Time from one value to the next [s].
            initial: What comes out until the first value arrives.
        """
        self._count = round(latency / period)
        self.reset(initial)

    def reset(self, initial: T) -> None:
        """Drop all values on their way; `initial` comes out until the next one arrives."""
        self._values = deque([initial] * self._count)

    def send(self, value: T) -> T:
        """Put a value in, and return the one that comes out now."""
        self._values.append(value)
        return self._values.popleft()
