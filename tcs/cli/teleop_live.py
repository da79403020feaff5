"""The commands `tcs teleop` and `tcs teleop replay`: drive an arm in the browser, look at a run."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from tcs.cli import options, talk


class Limits(StrEnum):
    """What happens at an invalid configuration."""

    PAPER = "paper"
    CLAMPED = "clamped"


class Condition(StrEnum):
    """What the person can do with the arm."""

    END_EFFECTOR = "end-effector"
    NOVEL = "novel"
    ASSISTED = "assisted"
    DRAKE = "drake"


def live(
    ctx: typer.Context,
    robot: options.Robot = "iiwa7",
    behaviour: Annotated[
        Limits,
        typer.Option(
            help="At a limit or singularity: paper ends the motion, clamped goes on with the "
            "other joints."
        ),
    ] = Limits.CLAMPED,
    condition: Annotated[
        Condition,
        typer.Option(
            help="What moves the tool, and whether joint groups can be turned: end-effector alone; "
            "novel adds null-space control; assisted and drake let the arm look after itself."
        ),
    ] = Condition.NOVEL,
    start_deg: Annotated[
        tuple[float, float, float, float, float, float, float] | None,
        typer.Option(
            metavar="Q1 ... Q7",
            help="Where the joints stand at first, in degrees.",
            show_default="a posture with room to move",
        ),
    ] = None,
    lift: Annotated[
        float | None,
        typer.Option(help="Torso lift, in metres.", show_default="the middle of its range"),
    ] = None,
    line: Annotated[
        bool,
        typer.Option(
            "--line",
            help="Show the experiment's line to follow, begin at its start, and tell how well it "
            "was followed.",
        ),
    ] = False,
    save: Annotated[
        Path | None,
        typer.Option(metavar="RUN", help="Write what was driven when it ends: .csv or .parquet."),
    ] = None,
    port: options.Port = None,
    browser: options.Browser = True,
    duration: options.Duration = None,
) -> None:
    """Drive an arm in the browser by keys, sliders or gamepad, or see `experiment` and `replay`."""
    if ctx.invoked_subcommand is not None:
        sources = {name: ctx.get_parameter_source(name) for name in ctx.params}
        given = [name for name, one in sources.items() if one and one.name == "COMMANDLINE"]
        if given:
            raise typer.BadParameter(
                f"is for the live page; write what '{ctx.invoked_subcommand}' takes behind it.",
                param_hint="--" + given[0].replace("_", "-"),
            )
        return

    if line and start_deg is not None:
        raise typer.BadParameter("the line has a start of its own.", param_hint="--start-deg")

    from tcs.cli import teleop_live_work as work

    asked = work.Asked(
        robot=robot,
        behaviour=behaviour.value,
        condition=condition.value,
        start_deg=start_deg,
        lift=lift,
        line=line,
        save=save,
    )
    work.drive(asked, port=port, browser=browser, duration=duration)


def replay(
    run: Annotated[
        Path,
        typer.Argument(metavar="RUN", help="A run that `tcs teleop` saved.", show_default=False),
    ],
    robot: Annotated[
        str | None,
        typer.Option(help="Name or YAML file of its robot.", show_default="what the run says"),
    ] = None,
    export: options.Page = None,
    meshes: options.Meshes = False,
    port: options.Port = None,
    browser: options.Browser = True,
    duration: options.Duration = None,
    as_json: options.PageJson = False,
) -> None:
    """Play a saved run back in the browser, or write it as one page."""
    options.check_export(export, meshes=meshes, as_json=as_json)

    from tcs.cli import teleop_live_work as work

    if export is None:
        work.play(run, robot, port=port, browser=browser, duration=duration)
        return
    result = work.export(run, robot, export, meshes=meshes)
    talk.print_result(result, work.report_page, as_json=as_json)
