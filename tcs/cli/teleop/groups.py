"""Options and functions that the commands of teleoperation share."""

from __future__ import annotations

import webbrowser
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from tcs.files.quantities import LATENCY
from tcs.output import terminal

if TYPE_CHECKING:
    from tcs.teleop.control.latency import Latency

TorsoHeight = Annotated[
    float | None,
    typer.Option(
        "--torso-height",
        "--lift",
        help="Height of the torso joint, in metres.",
        show_default="the middle of its range",
    ),
]


class LatencyOf(StrEnum):
    """What arrives late."""

    COMMAND = "command"
    PICTURE = "picture"
    BOTH = "both"


@dataclass(frozen=True, kw_only=True)
class LatencyOptions:
    """Latency between operator and arm."""

    latency: Annotated[
        float,
        typer.Option(
            min=LATENCY.low,
            max=LATENCY.high,
            help="Latency between operator and arm, in seconds, in whole periods of 0.01 s.",
        ),
    ] = 0.0
    latency_of: Annotated[
        LatencyOf,
        typer.Option(
            help="What arrives late: commands at the arm, pictures at the operator, or both, each "
            "by the whole latency."
        ),
    ] = LatencyOf.BOTH

    def value(self) -> Latency:
        """Return the latency."""
        from tcs.teleop.control.latency import Latency

        return Latency(self.latency, self.latency_of.value)


def open_page(url: str, browser: bool) -> None:
    """Print the address of a page, and open it in a browser if requested."""
    terminal.note(f"open {url} in a browser; Ctrl-C ends.")
    if browser:
        webbrowser.open(url)
