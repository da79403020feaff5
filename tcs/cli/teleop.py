"""The commands `tcs teleop ...`: teleoperate an arm, play a run back, run the experiment."""

from __future__ import annotations

import shlex
import time
import webbrowser
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tcs.cli import options
from tcs.output import terminal
from tcs.output.terminal import tables

if TYPE_CHECKING:
    from tcs.teleop.experiment.trial import LineResult

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
def live(
    ctx: typer.Context,
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
    port: options.Port = None,
    browser: options.Browser = True,
    duration: options.Duration = None,
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
        port=port, on_stop=typer.echo, record=save is not None,
    )  # fmt: skip
    title = session.arm.robot.title
    terminal.note(f"{title}, {condition}, limits as in {behaviour}. {_KEYS}")
    _open(session.url, browser)
    begun = time.perf_counter()
    try:
        session.page.run(duration)
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
        typer.echo(line_text(line_result(run, session.course.line)))
    terminal.note(session.page.timing())


def line_text(result: LineResult) -> str:
    """Return how accurately a line was followed, in one line."""
    from tcs.teleop.experiment.metrics import PLANES

    if result.time is None or result.accuracy is None:
        left = 1e3 * result.distance_left
        return f"the end of the line was not reached: {left:.0f} mm remain."
    worst, met = 1e3 * result.accuracy.worst, result.accuracy.planes_met
    return (
        f"the line took {result.time:.1f} s; the greatest error of the mean path was {worst:.1f} "
        f"mm ({met} of {PLANES} planes crossed)."
    )


@app.command()
def replay(
    run: Annotated[
        Path,
        typer.Argument(metavar="RUN", help="A run saved by `tcs teleop`.", show_default=False),
    ],
    robot: Annotated[
        str | None,
        typer.Option(help="Name or YAML file of the robot.", show_default="that of the run"),
    ] = None,
    export: options.Page = None,
    meshes: options.Meshes = False,
    port: options.Port = None,
    browser: options.Browser = True,
    duration: options.Duration = None,
    as_json: options.PageJson = False,
) -> None:
    """Play back a saved run in the browser, or write it as one page."""
    options.check_export(export, meshes=meshes, as_json=as_json)

    from tcs.files.writing import check_page

    if export is not None:
        from tcs.output.view.teleop.replay_page import export_run

        check_page(export)
        page = export_run(run, export, robot, meshes=meshes)
        result = {
            "file": str(export), "bytes": page.size, "samples": page.samples,
            "seconds": page.seconds, "meshes": meshes, "source": page.source if meshes else None,
        }  # fmt: skip
        terminal.print_result(result, _report_page, as_json=as_json)
        return

    from tcs.output.view import open_meshcat
    from tcs.output.view.teleop import Replay, RobotDisplay
    from tcs.output.view.teleop.replay import load_run_view

    view = load_run_view(run, robot)
    meshcat = open_meshcat(port)
    playback = Replay(meshcat, RobotDisplay(view.arm, meshes=True), view)
    typer.echo(f"{view.arm.robot.title}: {view.summary}")
    _open(meshcat.web_url(), browser)
    try:
        playback.run(duration)
    except KeyboardInterrupt:
        terminal.note("closed.")


def _open(url: str, browser: bool) -> None:
    terminal.note(f"open {url} in a browser; Ctrl-C ends.")
    if browser:
        webbrowser.open(url)


def _report_page(result: dict[str, Any]) -> None:
    """Print size and duration of a page, and the source of its meshes."""
    typer.echo(
        f"wrote {result['file']}: {result['bytes'] / 1e6:.1f} MB, {result['seconds']:.1f} s of "
        f"{result['samples']} samples"
    )
    if result["meshes"]:
        typer.echo(
            "The page contains the robot's meshes; their licence applies when you share it. "
            f"Origin and licence, from the robot file: {result['source']}"
        )


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
        int, typer.Option(min=1, help="Number of processes; does not change the results.")
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
    terminal.print_result(result, _report_experiment, as_json=as_json)


def _report_experiment(result: dict[str, Any]) -> None:
    """Print medians, tests and files."""
    from tcs.output.report.teleop_tables import NAMES, SCALE
    from tcs.teleop.experiment.within_subject import SCRIPTED

    out = terminal.results_console()
    out.print(f"{result['operators']} {SCRIPTED}, robot {result['robot']}, seed {result['seed']}")
    conditions = list(result["medians"])
    table = tables.new_table("median", *(f">{name}" for name in conditions), ">EE vs NV p", ">r")
    for name, text in NAMES.items():
        scale = SCALE.get(name, 1.0)
        cells = [f"{scale * result['medians'][c][name]:.3g}" for c in conditions]
        test = result["tests"].get(name)
        cells += ["", ""] if test is None else [f"{test['p']:.2g}", f"{test['effect']:.3f}"]
        table.add_row(text, *cells)
    out.print(table)
    for one in result["maps"] or ():
        best = one["best"]
        where = "no base pose reaches the grasp"
        if best is not None:
            pose = f"x {best['x']:.2f} m, y {best['y']:.2f} m, {best['yaw_deg']:.1f} deg"
            where = f"best base pose {pose}, score {best['score']:.3f}"
        out.print(f"map of {one['condition']}: {one['cells']:,} cells; {where}")
    out.print(f"wrote {', '.join(result['files'])}")
    if result["runs"]:
        out.print(f"runs in {result['runs']}")
