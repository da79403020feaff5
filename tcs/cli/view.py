"""The command `tcs view`: show a score file in the browser."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from tcs.cli import options
from tcs.output import terminal


def view(
    file: options.File,
    here: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            metavar="X Y YAW_DEG",
            help="Start with the set selected from this base pose (m, m, deg); by default with "
            "the best set.",
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
    """Show a score file in the browser: its sets, every other base pose and each goal."""
    options.check_export(export, meshes=meshes, as_json=as_json)

    from tcs.cli.values import observed_settings, state_if_given
    from tcs.files.writing import check_page

    if export is not None:
        check_page(export)

    import tcs
    from tcs.output.view import make_score_view, show_score_view, write_score_view

    chosen_from = state_if_given(here, torso)
    loaded = tcs.load(file)
    shown = make_score_view(
        loaded,
        here=chosen_from,
        max_members=max_members,
        observed=observed_settings(observed or (), loaded.observed_axes),
        meshes=meshes or export is None,
    )
    if export is not None:
        terminal.print_result(write_score_view(shown, export), _report_page, as_json=as_json)
        return
    show_score_view(
        shown,
        port=port,
        browser=browser,
        duration=duration,
        on_line=typer.echo,
        on_note=terminal.note,
    )


def _report_page(result: dict[str, Any]) -> None:
    """Print the summary of a page, with the licence of the meshes in it."""
    typer.echo(f"wrote {result['file']}: {result['bytes'] / 1e6:.1f} MB")
    if result["meshes"]:
        typer.echo(
            "The page contains the robot's meshes; their licence applies when you share it. "
            f"Origin and licence, from the robot file: {result['source']}"
        )
