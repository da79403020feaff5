"""Options and functions that the commands of teleoperation share."""

from __future__ import annotations

import webbrowser
from typing import Annotated

import typer

from tcs.output import terminal

TorsoHeight = Annotated[
    float | None,
    typer.Option(
        "--torso-height",
        "--lift",
        help="Height of the torso joint, in metres.",
        show_default="the middle of its range",
    ),
]


def open_page(url: str, browser: bool) -> None:
    """Print the address of a page, and open it in a browser if requested."""
    terminal.note(f"open {url} in a browser; Ctrl-C ends.")
    if browser:
        webbrowser.open(url)
