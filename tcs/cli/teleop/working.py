"""`tcs teleop work`: the work of the operator in a saved run, over time and by phase."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tcs.cli import options
from tcs.output import terminal


def work(
    run: Annotated[
        Path,
        typer.Argument(
            metavar="RUN", help="A run at the line of the experiment.", show_default=False
        ),
    ],
    picture: Annotated[
        Path | None,
        typer.Option(help="Draw the work over time: .png, .pdf or .svg."),
    ] = None,
    as_json: options.Json = False,
) -> None:
    """Print the work on the device in a run along the line, before, in and after the solution."""
    from tcs.teleop.line import GOAL_RADIUS
    from tcs.teleop.runs.run_files import load_run
    from tcs_studies.experiment.phases import attempt_work
    from tcs_studies.output.terminal_tables import report_work

    found = attempt_work(load_run(run), GOAL_RADIUS)
    result = {"file": str(run), **found.to_json(), "picture": picture and str(picture)}
    if picture is not None:
        from tcs.output.draw import save_figure
        from tcs_studies.output.draw.tool_paths import WorkCurve, draw_work_over_time

        curve = WorkCurve(run.name, found.time, found.work, found.solution)
        save_figure(picture, draw_work_over_time([curve]))
    terminal.print_result(result, report_work, as_json=as_json)
