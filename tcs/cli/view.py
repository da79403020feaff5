"""The command `tcs view`: look at a score file in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tcs.cli import options, talk


def view(
    file: options.File,
    here: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            metavar="X Y YAW_DEG",
            help="Start with the set chosen from here (m, m, deg) instead of the best one.",
        ),
    ] = None,
    torso: options.Torso = 0.0,
    max_members: options.Members = None,
    observed: options.Observed = None,
    export: Annotated[
        Path | None,
        typer.Option(
            metavar="PAGE",
            help="Write one self-contained .html page that plays through the set, and end.",
        ),
    ] = None,
    meshes: Annotated[
        bool,
        typer.Option(
            "--meshes",
            help="With --export: the robot's meshes in place of its collision shapes; mind their "
            "licence, which is told.",
        ),
    ] = False,
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
    as_json: Annotated[
        bool, typer.Option("--json", help="With --export: print one JSON object.")
    ] = False,
) -> None:
    """Look at it in the browser: step through set and goals, or stand elsewhere."""
    if export is None and (meshes or as_json):
        raise typer.BadParameter("--meshes and --json need --export.", param_hint="--export")

    from tcs.cli.places import check_page, place_told

    if export is not None:
        check_page(export)

    from tcs.cli import view_work as work

    chosen_from = place_told(here, torso)
    as_meshes = meshes or export is None
    staged = work.stage(file, chosen_from, max_members, observed or (), meshes=as_meshes)
    if export is not None:
        result = work.export(staged, export, meshes=meshes)
        talk.print_result(result, work.report_page, as_json=as_json)
        return
    work.show_live(staged, port=port, browser=browser, duration=duration)
