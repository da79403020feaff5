"""`tcs teleop experiment`: the trajectory-following experiment with scripted operators."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import typer

from tcs.cli import options
from tcs.cli.option_groups import expand_options
from tcs.cli.teleop.groups import LatencyOptions, TorsoHeight
from tcs.output import terminal


@expand_options
def experiment(
    *,
    robot: options.Robot = "iiwa7",
    operators: Annotated[
        int,
        typer.Option(
            min=3, max=1000, help="Number of scripted operators; the paper had 26 people."
        ),
    ] = 26,
    trials: Annotated[
        int,
        typer.Option(min=1, max=1000, help="Evaluated trials of each operator and controller."),
    ] = 3,
    training: Annotated[
        int,
        typer.Option(min=0, max=1000, help="Training trials of each operator and controller."),
    ] = 4,
    delay: LatencyOptions,
    torso_height: TorsoHeight = None,
    line_seed: Annotated[int, typer.Option(min=0, help="Seed of the search for the line.")] = 0,
    seed: options.Seed = 0,
    out: Annotated[
        Path | None, typer.Option(help="Folder to write.", show_default="teleop-ROBOT")
    ] = None,
    runs: Annotated[
        bool, typer.Option("--runs", help="Also save the run of each evaluated trial.")
    ] = False,
    maps: Annotated[
        bool, typer.Option("--maps", help="Also write a capability map of each controller.")
    ] = False,
    jobs: Annotated[
        int,
        typer.Option(min=1, max=1024, help="Number of processes; does not change the results."),
    ] = 2,
    as_json: options.Json = False,
) -> None:
    """Compare controllers: scripted operators follow a line that requires null-space motion."""
    from tcs.files.writing import check_writable
    from tcs.model.robots import load_robot
    from tcs.teleop.arm import load_arm, torso_height_of
    from tcs_studies.experiment.within_subject import ExperimentPlan
    from tcs_studies.output.report.experiment.files import (
        FILES,
        make_experiment_folder,
        write_experiment,
    )
    from tcs_studies.output.terminal_tables import report_experiment

    words = ["tcs", "teleop", "experiment", "--robot", robot, "--operators", str(operators)]
    words += ["--trials", str(trials), "--training", str(training), "--seed", str(seed)]
    words += ["--line-seed", str(line_seed)]
    words += [] if torso_height is None else ["--torso-height", f"{torso_height:g}"]
    words += ["--maps"] if maps else []
    latency = delay.value()
    if latency.seconds:
        words += ["--latency", f"{latency.seconds:g}", "--latency-of", latency.path]
    folder = out or Path(f"teleop-{Path(robot).stem}")
    plan = ExperimentPlan(
        operators=operators, trials=trials, training=training, seed=seed, latency=latency
    )
    file = load_robot(robot)
    arm = load_arm(file, torso_height=torso_height_of(file, torso_height))
    make_experiment_folder(arm, folder, runs=runs, maps=maps)
    for name in FILES:
        check_writable(folder / name)
    with terminal.progress_bar("operators and controllers") as on_progress:
        result = write_experiment(
            arm, plan, folder, line_seed=line_seed, runs=runs, maps=maps,
            command=shlex.join(words), jobs=jobs, on_progress=on_progress,
        )  # fmt: skip
    terminal.print_result(result, report_experiment, as_json=as_json)
