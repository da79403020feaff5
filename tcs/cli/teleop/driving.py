"""`tcs teleop`: teleoperate an arm in the browser."""

from __future__ import annotations

import time
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from tcs.cli import options
from tcs.cli.options import expand_options
from tcs.cli.teleop.groups import LatencyOptions, TorsoHeight, open_page
from tcs.output import terminal

_KEYS = (
    "W/S forward, A/D sideways, R/F up and down, U/O roll, I/K pitch, J/L yaw; M next mode, "
    "1-4 joint group, Q/E move it; C clutch, space all to zero, X back to the start."
)


class Limits(StrEnum):
    """Behaviour at a joint limit."""

    PAPER = "paper"
    CLAMPED = "clamped"


class Condition(StrEnum):
    """Control modes that the operator has."""

    END_EFFECTOR = "end-effector"
    NOVEL = "novel"
    ASSISTED = "assisted"
    DRAKE = "drake"
    JOINT = "joint"


@expand_options
def live(
    ctx: typer.Context,
    *,
    robot: options.Robot = "iiwa7",
    behaviour: Annotated[
        Limits,
        typer.Option(
            help="At a joint limit or singularity: paper ends the motion, clamped continues with "
            "the other joints."
        ),
    ] = Limits.CLAMPED,
    condition: Annotated[
        Condition,
        typer.Option(
            help="Control of the tool alone (end-effector), or with manual null-space control "
            "(novel); assisted and drake avoid joint limits automatically; joint has a slider for "
            "each joint."
        ),
    ] = Condition.NOVEL,
    start_deg: Annotated[
        tuple[float, float, float, float, float, float, float] | None,
        typer.Option(
            metavar="Q1 ... Q7",
            help="Joint positions at the start, in degrees.",
            show_default="a posture far from limits and singularities",
        ),
    ] = None,
    torso_height: TorsoHeight = None,
    line: Annotated[
        bool,
        typer.Option(
            "--line",
            help="Show the line of the experiment, begin at its start, and print how accurately "
            "it was followed.",
        ),
    ] = False,
    save: Annotated[
        Path | None,
        typer.Option(metavar="RUN", help="Write the run at the end, a .csv."),
    ] = None,
    cameras: Annotated[
        bool,
        typer.Option("--cameras", help="Show pictures of the head and wrist cameras on the page."),
    ] = False,
    xr: Annotated[
        bool,
        typer.Option(
            "--xr",
            help="Offer WebXR: the tool follows an XR controller 1:1 while its trigger is held.",
        ),
    ] = False,
    delay: LatencyOptions,
    window: options.WindowOptions,
) -> None:
    """Teleoperate an arm in the browser by keys, sliders or gamepad."""
    if ctx.invoked_subcommand is not None:
        sources = {name: ctx.get_parameter_source(name) for name in ctx.params}
        given = [name for name, one in sources.items() if one and one.name == "COMMANDLINE"]
        if given:
            raise typer.BadParameter(
                f"belongs to the live page; give the options of '{ctx.invoked_subcommand}' after "
                "its name.",
                param_hint="--" + given[0].replace("_", "-"),
            )
        return
    if line and start_deg is not None:
        raise typer.BadParameter("--line sets the start posture.", param_hint="--start-deg")

    from tcs.files.writing import check_writable
    from tcs.output.view.teleop.session import LiveOptions, LiveSession
    from tcs.teleop.runs.run_files import check_suffix, save_run

    if save is not None:
        check_suffix(save)
        check_writable(save)
    course = None
    if line:
        from tcs.model.robots import load_robot
        from tcs.teleop.arm import load_arm, torso_height_of
        from tcs_studies.experiment.course import find_course

        terminal.note("searching for a line that requires null-space motion, some seconds.")
        file = load_robot(robot)
        course = find_course(load_arm(file, torso_height=torso_height_of(file, torso_height)))
    latency = delay.value()
    session = LiveSession(
        LiveOptions(
            robot=robot, behaviour=behaviour.value, condition=condition.value,
            start_deg=start_deg, torso_height=torso_height, course=course,
            latency=latency, cameras=cameras, xr=xr,
        ),
        port=window.port, on_stop=typer.echo, record=save is not None,
    )  # fmt: skip
    title = session.arm.robot.title
    terminal.note(f"{title}, {condition}, limits as in {behaviour}. {_KEYS}")
    if latency.seconds:
        terminal.note(f"latency: {latency.summary}.")
    open_page(session.url, window.browser)
    begun = time.perf_counter()
    try:
        session.page.run(window.duration)
    except KeyboardInterrupt:
        terminal.note(f"closed after {time.perf_counter() - begun:.0f} s.")
    finally:
        session.close()
        run = session.run()
        if save is not None and run is None:
            terminal.note(f"no browser was connected, so '{save}' is not written.")
        elif save is not None and run is not None:
            save_run(save, run)
            typer.echo(f"wrote {save}: {len(run)} samples, {run.time[-1] - run.time[0]:.1f} s")
    if course is not None and run is not None:
        from tcs_studies.experiment.trial import line_result
        from tcs_studies.output.terminal_tables import line_text

        typer.echo(line_text(line_result(run, course.line)))
    terminal.note(session.page.timing())
