"""The commands `tcs teleop ...`: teleoperate an arm, play a run back, run the experiment."""

from __future__ import annotations

import shlex
import time
import webbrowser
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from tcs.cli import options
from tcs.cli.option_groups import expand_options
from tcs.output import terminal
from tcs.output.terminal import tables, teleop_tables

app = typer.Typer()
TorsoHeight = Annotated[
    float | None,
    typer.Option(
        "--torso-height",
        "--lift",
        help="Height of the torso joint, in metres.",
        show_default="the middle of its range",
    ),
]
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


@app.callback(invoke_without_command=True)
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
            "(novel); assisted and drake avoid joint limits automatically."
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
        typer.Option(metavar="RUN", help="Write the run at the end: .csv or .parquet."),
    ] = None,
    window: options.WindowOptions,
) -> None:
    """Teleoperate an arm in the browser by keys, sliders or gamepad; `experiment` and `replay`."""
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
    from tcs.teleop.experiment.trial import line_result
    from tcs.teleop.runs.files import check_format, save_run

    if save is not None:
        check_format(save)
        check_writable(save)
    if line:
        terminal.note("searching for a line that requires null-space motion, some seconds.")
    session = LiveSession(
        LiveOptions(
            robot=robot, behaviour=behaviour.value, condition=condition.value,
            start_deg=start_deg, torso_height=torso_height, line=line,
        ),
        port=window.port, on_stop=typer.echo, record=save is not None,
    )  # fmt: skip
    title = session.arm.robot.title
    terminal.note(f"{title}, {condition}, limits as in {behaviour}. {_KEYS}")
    _open(session.url, window.browser)
    begun = time.perf_counter()
    try:
        session.page.run(window.duration)
    except KeyboardInterrupt:
        terminal.note(f"closed after {time.perf_counter() - begun:.0f} s.")
    finally:
        run = session.run()
        if save is not None and run is None:
            terminal.note(f"no browser was connected, so '{save}' is not written.")
        elif save is not None and run is not None:
            save_run(save, run)
            typer.echo(f"wrote {save}: {len(run)} samples, {run.time[-1] - run.time[0]:.1f} s")
    if session.course is not None and run is not None:
        typer.echo(teleop_tables.line_text(line_result(run, session.course.line)))
    terminal.note(session.page.timing())


@app.command()
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
    from tcs.output.view.teleop import Replay, RobotDisplay
    from tcs.output.view.teleop.replay import load_run_view

    view = load_run_view(run, robot)
    meshcat = open_meshcat(window.port)
    playback = Replay(meshcat, RobotDisplay(view.arm, meshes=True), view)
    typer.echo(f"{view.arm.robot.title}: {view.summary}")
    _open(meshcat.web_url(), window.browser)
    try:
        playback.run(window.duration)
    except KeyboardInterrupt:
        terminal.note("closed.")


def _open(url: str, browser: bool) -> None:
    terminal.note(f"open {url} in a browser; Ctrl-C ends.")
    if browser:
        webbrowser.open(url)


@app.command()
def experiment(
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
    torso_height: TorsoHeight = None,
    line_seed: Annotated[int, typer.Option(min=0, help="Seed of the search for the line.")] = 0,
    seed: options.Seed = 0,
    out: Annotated[
        Path | None, typer.Option(help="Folder to write.", show_default="teleop-ROBOT")
    ] = None,
    runs: Annotated[
        bool, typer.Option("--runs", help="Also save the run of each evaluated trial.")
    ] = False,
    runs_as: Annotated[
        str, typer.Option(help="Format of the runs: csv, or parquet (extra `parquet` of tcs).")
    ] = "csv",
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
    from tcs.output.report.teleop_files import FILES, make_experiment_folder, write_experiment
    from tcs.teleop.arm import load_arm, torso_height_of
    from tcs.teleop.experiment.within_subject import ExperimentPlan

    words = ["tcs", "teleop", "experiment", "--robot", robot, "--operators", str(operators)]
    words += ["--trials", str(trials), "--training", str(training), "--seed", str(seed)]
    words += ["--line-seed", str(line_seed)]
    words += [] if torso_height is None else ["--torso-height", f"{torso_height:g}"]
    words += ["--maps"] if maps else []
    folder = out or Path(f"teleop-{Path(robot).stem}")
    suffix = f".{runs_as.removeprefix('.')}" if runs else None
    plan = ExperimentPlan(operators=operators, trials=trials, training=training, seed=seed)
    file = load_robot(robot)
    arm = load_arm(file, torso_height=torso_height_of(file, torso_height))
    make_experiment_folder(arm, folder, runs_as=suffix, maps=maps)
    for name in FILES:
        check_writable(folder / name)
    with terminal.progress_bar("operators and controllers") as on_progress:
        result = write_experiment(
            arm, plan, folder, line_seed=line_seed, runs_as=suffix, maps=maps,
            command=shlex.join(words), jobs=jobs, on_progress=on_progress,
        )  # fmt: skip
    terminal.print_result(result, teleop_tables.report_experiment, as_json=as_json)
