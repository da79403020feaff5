"""The commands `tcs teleop ...`: driving a redundant arm."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tcs.cli import options, talk, teleop_live

app = typer.Typer()
app.callback(invoke_without_command=True)(teleop_live.live)
app.command()(teleop_live.replay)


@app.command()
def experiment(
    robot: options.Robot = "iiwa7",
    operators: Annotated[
        int, typer.Option(min=3, max=1000, help="Scripted operators; the paper had 26 people.")
    ] = 26,
    trials: Annotated[int, typer.Option(min=1, max=1000, help="Trials that count, each.")] = 3,
    training: Annotated[int, typer.Option(min=0, max=1000, help="Trials before those, each.")] = 4,
    lift: Annotated[
        float | None,
        typer.Option(help="Torso lift, in metres.", show_default="the middle of its range"),
    ] = None,
    line_seed: Annotated[int, typer.Option(min=0, help="Seed of the search for the line.")] = 0,
    seed: options.Seed = 0,
    out: Annotated[
        Path | None, typer.Option(help="Folder to write.", show_default="teleop-ROBOT")
    ] = None,
    runs: Annotated[bool, typer.Option("--runs", help="Also save each trial that counts.")] = False,
    runs_as: Annotated[str, typer.Option(help="csv, or parquet (extra `parquet` of tcs).")] = "csv",
    maps: Annotated[
        bool,
        typer.Option("--maps", help="Also the capability map of what was driven, by controller."),
    ] = False,
    jobs: Annotated[
        int, typer.Option(min=1, help="Number of processes; results are the same.")
    ] = 2,
    as_json: options.Json = False,
) -> None:
    """Let scripted operators, not people, follow a line that needs the arm reshaped."""
    from tcs.cli import teleop_work as work

    asked = work.Asked(
        robot=robot,
        operators=operators,
        trials=trials,
        training=training,
        lift=lift,
        line_seed=line_seed,
        seed=seed,
        out=out or Path(f"teleop-{Path(robot).stem}"),
        runs_as=f".{runs_as.removeprefix('.')}" if runs else None,
        maps=maps,
    )
    with talk.progress_bar("operators times controllers") as on_progress:
        result = work.experiment(asked, jobs=jobs, on_progress=on_progress)
    talk.print_result(result, work.report, as_json=as_json)
