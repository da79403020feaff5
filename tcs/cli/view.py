"""The command `tcs view`: open the page of a score file, or show it or a plan in Meshcat."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tcs.cli import options
from tcs.cli.options import expand_options
from tcs.cli.serve import open_page
from tcs.output import terminal
from tcs.output.terminal import tables

if TYPE_CHECKING:
    from tcs.output.view import ScoreView


@expand_options
def view(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="A file made by `tcs score`, or a plan.json by `tcs plan --out`."
        ),
    ],
    chosen: options.ShownOptions,
    page: options.ExportOptions,
    window: options.WindowOptions,
    swept: Annotated[
        bool,
        typer.Option("--swept", help="Of a plan: show the volume that the arm sweeps."),
    ] = False,
    meshcat: Annotated[
        bool,
        typer.Option(
            "--meshcat",
            help="Show the set with the robot's own meshes in Meshcat, in place of the page of "
            "`tcs app`; so do --max-members, --observed and --no-refined.",
        ),
    ] = False,
    jobs: options.Jobs = 2,
) -> None:
    """Open the page of a score file: any base pose, each goal, its sets; or play a plan."""
    page.check()
    if file.suffix == ".json":
        if chosen != options.ShownOptions():
            raise typer.BadParameter("a plan has its own stops.", param_hint="--here")
        _view_plan(file, page, window, swept)
        return
    if swept:
        raise typer.BadParameter("requires a plan.json.", param_hint="--swept")
    chosen.state()
    if page.export is None and not meshcat and not _names_a_set(chosen):
        open_page([file], window, jobs, command="view", first=_first_shown(chosen))
        return

    if page.export is not None:
        result = scene_page(file, page.export, chosen, meshes=page.meshes)
        terminal.print_result(result, tables.report_page, as_json=page.as_json)
        return

    from tcs.output.view import show_score_view

    shown = _score_view(file, chosen, meshes=True)
    show_score_view(
        shown,
        port=window.port,
        browser=window.browser,
        duration=window.duration,
        on_line=typer.echo,
        on_note=terminal.note,
    )


def scene_page(
    file: Path, out: Path, chosen: options.ShownOptions, *, meshes: bool = False
) -> dict[str, Any]:
    """Write the scene in 3-D as a self-contained page and return what was written."""
    from tcs.output.view import write_score_view

    return write_score_view(_score_view(file, chosen, meshes=meshes), out)


def _score_view(file: Path, chosen: options.ShownOptions, *, meshes: bool) -> ScoreView:
    """Return the scene of a score file with a set, to be shown or written."""
    import tcs
    from tcs.output.view import make_score_view

    loaded = tcs.load(file)
    return make_score_view(
        loaded,
        here=chosen.state(),
        max_members=chosen.max_members,
        observed=chosen.observation(loaded.observed_axes),
        refined=chosen.refined,
        meshes=meshes,
    )


def _names_a_set(chosen: options.ShownOptions) -> bool:
    """Return whether options choose another set than the page suggests by itself."""
    return chosen != options.ShownOptions(here=chosen.here, torso=chosen.torso)


def _first_shown(chosen: options.ShownOptions) -> dict[str, str]:
    """Return where the robot stands first, as in the address of the page."""
    if chosen.here is None:
        return {}
    return {
        key: f"{value:g}"
        for key, value in zip(("x", "y", "yaw", "torso"), (*chosen.here, chosen.torso), strict=True)
    }


def _view_plan(
    path: Path, page: options.ExportOptions, window: options.WindowOptions, swept: bool
) -> None:
    """Play a plan in the browser, or write it as a page."""
    from tcs.motion import load_plan
    from tcs.output.view import make_plan_view, show_plan_view, write_plan_view

    shown = make_plan_view(load_plan(path), meshes=page.meshes or page.export is None, swept=swept)
    if page.export is not None:
        result = write_plan_view(shown, page.export)
        terminal.print_result(result, tables.report_page, as_json=page.as_json)
        return
    show_plan_view(
        shown,
        port=window.port,
        browser=window.browser,
        duration=window.duration,
        on_line=typer.echo,
        on_note=terminal.note,
    )
