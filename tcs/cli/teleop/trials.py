"""`tcs teleop experiment` and `pick-and-place`: the experiments with scripted operators."""

from __future__ import annotations

import shlex
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from tcs.cli import options
from tcs.cli.options import expand_options
from tcs.cli.teleop.groups import LatencyOf, LatencyOptions, TorsoHeight
from tcs.files.quantities import LATENCY
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


class SlaveControl(StrEnum):
    """Control of the redundancy of the arm in pick and place."""

    POSITION_FIRST = "position-first"
    NULL_SPACE = "null-space"
    ASSISTED = "assisted"


def pick_and_place(
    operators: Annotated[
        int,
        typer.Option(
            min=1, max=1000, help="Number of scripted operators; the thesis had 6 people."
        ),
    ] = 6,
    repetitions: Annotated[
        int,
        typer.Option(
            min=1,
            max=1000,
            help="Successful repetitions of each operator from each base pose.",
        ),
    ] = 7,
    training: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=1000,
            help="Successful training repetitions from each base pose.",
            show_default="as many as repetitions",
        ),
    ] = None,
    condition: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="Base pose of the thesis: Expert, ITCM-high or ITCM-low.",
            show_default="all three",
        ),
    ] = None,
    base: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            metavar="X Y YAW_DEG",
            help="Another base pose, given as the task in the frame of the robot (m, m, deg), as "
            "in the thesis's Table 1; condition 'given'.",
        ),
    ] = None,
    control: Annotated[
        SlaveControl, typer.Option(help="Control of the redundancy of the arm.")
    ] = SlaveControl.POSITION_FIRST,
    latency: Annotated[
        float,
        typer.Option(
            min=LATENCY.low,
            max=LATENCY.high,
            help="Latency between master and slave, in seconds, in whole periods of 0.02 s.",
        ),
    ] = 0.1,
    latency_of: Annotated[
        LatencyOf,
        typer.Option(
            help="What arrives late: commands at the arm, pictures at the operator, or both, each "
            "by the whole latency."
        ),
    ] = LatencyOf.BOTH,
    seed: options.Seed = 0,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder to write: page, table of all repetitions, pictures."),
    ] = None,
    jobs: Annotated[
        int,
        typer.Option(min=1, max=1024, help="Number of processes; does not change the results."),
    ] = 2,
    as_json: options.Json = False,
) -> None:
    """Pick and place a cup from three base poses of TIAGo: the experiment of the ITCM thesis."""
    from tcs.teleop.control.latency import Latency
    from tcs_studies.output.report.pick_and_place.files import write_pick_and_place
    from tcs_studies.output.terminal_tables import report_pick_and_place
    from tcs_studies.pick_and_place.master import Coupling
    from tcs_studies.pick_and_place.protocol import Plan
    from tcs_studies.pick_and_place.slave import Control
    from tcs_studies.pick_and_place.task import Condition, conditions_named

    given = () if base is None else (Condition("given", *base),)
    plan = Plan(
        operators=operators, repetitions=repetitions, training=training, seed=seed,
        conditions=(*conditions_named(tuple(condition or ())), *given),
        control=Control(control.value),
        coupling=Coupling(latency=Latency(latency, latency_of.value)),
    )  # fmt: skip
    words = ["tcs", "teleop", "pick-and-place", "--operators", str(operators)]
    words += ["--repetitions", str(repetitions), "--training", str(plan.practice)]
    for name in condition or ():
        words += ["--condition", name]
    words += [] if base is None else ["--base", *(f"{value:g}" for value in base)]
    words += ["--control", control, "--latency", f"{latency:g}", "--latency-of", latency_of]
    words += ["--seed", str(seed)]
    with terminal.progress_bar("operators") as on_progress:
        result = write_pick_and_place(
            plan, out, command=shlex.join(words), jobs=jobs, on_progress=on_progress
        )
    terminal.print_result(result, report_pick_and_place, as_json=as_json)
