"""`tcs teleop replay` and `work`: play back a saved run, and the operator's work in it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tcs.cli import options
from tcs.cli.options import expand_options
from tcs.cli.teleop.groups import open_page
from tcs.output import terminal
from tcs.output.terminal import tables


@expand_options
def replay(
    run: Annotated[
        Path,
        typer.Argument(metavar="RUN", help="A run saved by `tcs teleop`.", show_default=False),
    ],
    *,
    robot: Annotated[
        str | None,
        typer.Option(help="Name or YAML file of the robot.", show_default="that of the run"),
    ] = None,
    page: options.ExportOptions,
    window: options.WindowOptions,
) -> None:
    """Play back a saved run in the browser, or write it as one page."""
    page.check()
    if page.export is not None:
        from tcs.output.view.teleop.replay_page import export_run

        written = export_run(run, page.export, robot, meshes=page.meshes)
        result = {
            "file": str(page.export), "bytes": written.size, "samples": written.samples,
            "seconds": written.seconds, "meshes": page.meshes,
            "source": written.source if page.meshes else None,
        }  # fmt: skip
        terminal.print_result(result, tables.report_page, as_json=page.as_json)
        return

    from tcs.output.view import open_meshcat
    from tcs.output.view.scene_page import ScenePage
    from tcs.output.view.teleop import Replay, RobotDisplay
    from tcs.output.view.teleop.replay import load_run_view

    view = load_run_view(run, robot)
    meshcat = open_meshcat(hidden=True)
    scene = ScenePage(meshcat, window.port)
    playback = Replay(meshcat, RobotDisplay(view.arm, meshes=True), view)
    typer.echo(f"{view.arm.robot.title}: {view.summary}")
    open_page(scene.url, window.browser)
    try:
        playback.run(window.duration)
    except KeyboardInterrupt:
        terminal.note("closed.")
    finally:
        scene.close()


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
