"""`tcs teleop pick-and-place`: the experiment of the ITCM thesis with scripted operators."""

from __future__ import annotations

import shlex
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from tcs.cli import options
from tcs.cli.teleop.groups import LatencyOf
from tcs.files.quantities import LATENCY
from tcs.output import terminal


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
