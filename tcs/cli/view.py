"""The command `tcs view`: look at a score file in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def view(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A file made by `tcs score`.")],
    here: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            metavar="X Y YAW_DEG",
            help="Start with the set chosen from here (m, m, deg) instead of the best one.",
        ),
    ] = None,
    torso: Annotated[float, typer.Option(help="How high the torso is now, in metres.")] = 0.0,
    max_members: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=3,
            help="At most so many places to stand at: 1, 2 or 3.",
            show_default="what the file holds",
        ),
    ] = None,
    observed: Annotated[
        list[str] | None,
        typer.Option(
            metavar="AXIS=VALUE",
            help="How the person is found, e.g. person_y=0.03 (m; AXIS_deg=VALUE for angles).",
        ),
    ] = None,
    port: Annotated[
        int | None,
        typer.Option(
            min=1024,
            max=65535,
            help="Where the browser finds the viewer.",
            show_default="the first free one from 7000 on",
        ),
    ] = None,
    browser: Annotated[bool, typer.Option(help="Whether to open a browser.")] = True,
    duration: Annotated[
        float | None,
        typer.Option(min=0.0, help="Close after so many seconds.", show_default="at Ctrl-C"),
    ] = None,
) -> None:
    """Look at it in the browser: step through set and goals, or stand elsewhere."""
    from tcs.cli import view_work as work
    from tcs.cli.places import place

    chosen_from = place(here, torso) if here else None
    staged = work.stage(file, chosen_from, max_members, observed or (), meshes=True)
    work.show_live(staged, port=port, browser=browser, duration=duration)
