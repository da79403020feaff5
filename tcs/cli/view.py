"""The command `tcs view`: look at a score file in the browser."""

from __future__ import annotations

from typing import Annotated

import typer

from tcs.cli import options
from tcs.output import terminal


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
    export: options.Page = None,
    meshes: options.Meshes = False,
    port: options.Port = None,
    browser: options.Browser = True,
    duration: options.Duration = None,
    as_json: options.PageJson = False,
) -> None:
    """Look at it in the browser: step through set and goals, or stand elsewhere."""
    options.check_export(export, meshes=meshes, as_json=as_json)

    from tcs.cli.values import state_if_given
    from tcs.files.writing import check_page

    if export is not None:
        check_page(export)

    from tcs.cli import view_work as work

    chosen_from = state_if_given(here, torso)
    as_meshes = meshes or export is None
    staged = work.stage(file, chosen_from, max_members, observed or (), meshes=as_meshes)
    if export is not None:
        result = work.export(staged, export, meshes=meshes)
        terminal.print_result(result, work.report_page, as_json=as_json)
        return
    work.show_live(staged, port=port, browser=browser, duration=duration)
