"""The command `tcs view`: show a score file in the browser."""

from __future__ import annotations

import typer

from tcs.cli import options
from tcs.cli.option_groups import expand_options
from tcs.output import terminal
from tcs.output.terminal import tables


@expand_options
def view(
    file: options.File,
    chosen: options.ShownOptions,
    page: options.ExportOptions,
    window: options.WindowOptions,
) -> None:
    """Show a score file in the browser: its sets, every other base pose and each goal."""
    page.check()
    here = chosen.state()

    import tcs
    from tcs.output.view import make_score_view, show_score_view, write_score_view

    loaded = tcs.load(file)
    shown = make_score_view(
        loaded,
        here=here,
        max_members=chosen.max_members,
        observed=chosen.observation(loaded.observed_axes),
        meshes=page.meshes or page.export is None,
    )
    if page.export is not None:
        result = write_score_view(shown, page.export)
        terminal.print_result(result, tables.report_page, as_json=page.as_json)
        return
    show_score_view(
        shown,
        port=window.port,
        browser=window.browser,
        duration=window.duration,
        on_line=typer.echo,
        on_note=terminal.note,
    )
