"""The commands: what they are called with, and which function each of them calls."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from tcs.cli import (
    capability,
    options,
    pictures,
    report,
    reports,
    robots,
    robustness,
    talk,
    teleop,
    view,
)

app = typer.Typer(
    cls=talk.Commands,
    help="Where should an assistive robot stand? Score a task once, then choose in milliseconds.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.add_typer(robots.app, name="robot")
app.add_typer(capability.app, name="capability")
app.add_typer(teleop.app, name="teleop")


def main() -> None:
    """Run the command line."""
    app(prog_name="tcs")


@app.callback(invoke_without_command=True)
def _top(
    version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False,
) -> None:
    if version:
        import tcs

        typer.echo(tcs.__version__)
        raise typer.Exit


@app.command("list")
def list_known(as_json: options.Json = False) -> None:
    """List the tasks, environments and robots there are."""
    from tcs.cli.catalogue import catalogue

    talk.print_result(catalogue(), reports.report_catalogue, as_json=as_json)


@app.command()
def score(
    task: Annotated[
        str | None,
        typer.Argument(metavar="TASK", help="Name or YAML file of a task.", show_default=False),
    ] = None,
    environment: Annotated[
        str | None,
        typer.Option(help="Name or YAML file of an environment.", show_default="wheelchair"),
    ] = None,
    everything: Annotated[
        bool,
        typer.Option(
            "--all", help="Every task in every environment it is for, or in the one named."
        ),
    ] = False,
    robot: options.Robot = "pr2",
    measure: Annotated[
        str,
        typer.Option(
            help="What the best arm posture is best in: isotropy or inverse-condition; with "
            "-limited less near joint limits, with -limited-thesis as the ITCM thesis has it."
        ),
    ] = "isotropy",
    jobs: options.Jobs = 2,
    out: Annotated[
        Path | None,
        typer.Option(
            help="File to write; with --all, the folder.",
            show_default="<task>-<environment>-<robot>.tcs",
        ),
    ] = None,
    rules: Annotated[
        str, typer.Option(help="Which sets are kept: paper, or code2015 as the original did.")
    ] = "paper",
    same_environment: Annotated[
        bool,
        typer.Option(
            "--same-environment", help="Only sets for which the bed need not be moved in between."
        ),
    ] = False,
    max_members: Annotated[
        int, typer.Option(min=1, max=3, help="Most members of a set; 3 takes seconds more.")
    ] = 2,
    observed: Annotated[
        list[str] | None,
        typer.Option(
            metavar="JOINT=VALUE",
            help="Score the room as it is found now, e.g. person_x=0.025 (m; JOINT_deg=VALUE).",
        ),
    ] = None,
    seen: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FRAME=X,Y,Z",
            help="The same from where a part of the body or the furniture is seen, in the "
            "environment frame (m; a quaternion ,QW,QX,QY,QZ may follow).",
        ),
    ] = None,
    at: options.At = None,
    as_json: options.Json = False,
) -> None:
    """Score every initial configuration of a grid and build the sets to choose from."""
    if (task is None) != everything:
        raise typer.BadParameter("name a task, or give --all for every one.", param_hint="TASK")
    if task is None and (observed or seen):
        raise typer.BadParameter("needs one task, not --all.", param_hint="--observed")
    if at and not seen:
        raise typer.BadParameter("tells how the room was set for --seen.", param_hint="--at")

    from tcs.cli import live, rows
    from tcs.placement.scoring import default_path

    kept: dict[str, Any] = {
        "measure": measure,
        "rule": rules,
        "same_environment": same_environment,
        "max_members": max_members,
    }
    if task is None:
        results = rows.score_all(environment, robot, out or Path(), jobs=jobs, **kept)
        talk.print_result({"rows": results}, reports.report_rows, as_json=as_json)
        return
    environment = environment or "wheelchair"
    if observed or seen:
        path = out or live.live_path(task, environment, robot)
        found = {"observed": observed or (), "seen": seen or (), "at": at or ()}
        result = live.score_found(task, environment, robot, path, jobs=jobs, **found, **kept)
        talk.print_result(result, live.report_found, as_json=as_json)
        return
    path = out or default_path(task, environment, robot)
    result = rows.score_one(task, environment, robot, path, jobs=jobs, **kept)
    talk.print_result(result, reports.report_scores, as_json=as_json)


@app.command()
def select(
    file: options.File,
    here: Annotated[tuple[float, float, float], options.HERE],
    torso: options.Torso = 0.0,
    at: options.At = None,
    alpha: Annotated[float, typer.Option(help="Weight of the goals reached, P_R.")] = 1.0,
    beta: Annotated[float, typer.Option(help="Weight of the manipulability, P_M.")] = 1.0,
    gamma: Annotated[float, typer.Option(help="Weight of the travel cost.")] = 0.05,
    delta: robustness.Delta = 0.0,
    metre_weight: Annotated[float, typer.Option(help="Cost of a metre of driving.")] = 1.0,
    turn_weight: Annotated[float, typer.Option(help="Cost of a radian of turning.")] = 0.0,
    torso_weight: Annotated[float, typer.Option(help="Cost of a metre of torso lift.")] = 0.0,
    axis_weight: Annotated[
        list[str] | None,
        typer.Option(
            metavar="AXIS=COST",
            help="Cost of a metre or radian along an axis of the environment.",
        ),
    ] = None,
    travel: Annotated[
        str,
        typer.Option(
            help="How the base drives: straight, as in the paper, or around the furniture."
        ),
    ] = "straight",
    max_members: options.Members = None,
    observed: options.Observed = None,
    seen: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FRAME=X,Y,Z",
            help="Where a part of the body is seen, in the environment frame (m); tells how the "
            "person is found, in place of --observed.",
        ),
    ] = None,
    as_json: options.Json = False,
) -> None:
    """Choose where to stand now: the set with the greatest utility from here."""
    import tcs
    from tcs.cli.places import axis_values, frame_places, observed_settings, place

    loaded = tcs.load(file)
    choice = tcs.select(
        loaded,
        place(here, torso, at or ()),
        weights=tcs.UtilityWeights(
            reachability=alpha, manipulability=beta, travel=gamma, success=delta
        ),
        travel=tcs.TravelWeights(
            metre=metre_weight,
            turn=turn_weight,
            torso=torso_weight,
            environment=axis_values(axis_weight or (), "--axis-weight"),
            route=travel,
        ),
        max_members=max_members,
        observed=observed_settings(observed or (), loaded.observed_axes),
        frames=frame_places(seen or ()),
    )
    result = choice.to_json(loaded.metadata["measure"])
    talk.print_result(result, reports.report_choice, as_json=as_json)


@app.command()
def explain(
    file: options.File,
    goal: Annotated[int, typer.Option(help="Number of the goal, from 0.", show_default=False)],
    configuration: Annotated[
        int | None,
        typer.Option(
            help="Number of a configuration, as in `tcs export`.",
            show_default="the best member of the best set",
        ),
    ] = None,
    here: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            metavar="X Y YAW_DEG",
            help="A place instead, in the environment frame (m, m, deg); see --torso, --at.",
        ),
    ] = None,
    torso: options.Torso = 0.0,
    at: options.At = None,
    metre_weight: Annotated[float, typer.Option(help="Cost of a metre of driving.")] = 1.0,
    turn_weight: Annotated[float, typer.Option(help="Cost of a radian of turning.")] = 0.3,
    torso_weight: Annotated[float, typer.Option(help="Cost of a metre of torso lift.")] = 1.0,
    axis_weight: Annotated[
        list[str] | None,
        typer.Option(
            metavar="AXIS=COST",
            help="Cost of a metre (else 2) or radian (else 1) along an axis of the environment.",
        ),
    ] = None,
    travel: Annotated[
        str,
        typer.Option(metavar="straight|around", help="How the base drives: around the furniture?"),
    ] = "around",
    observed: options.Observed = None,
    as_json: options.Json = False,
) -> None:
    """Say why a goal is not reached, and the least change that would reach it."""
    if configuration is not None and here is not None:
        raise typer.BadParameter("give --configuration or --here, not both.", param_hint="--here")
    if here is None and (at or torso):
        raise typer.BadParameter("--torso and --at need --here.", param_hint="--here")

    import tcs
    from tcs.cli.explanations import report_explanation
    from tcs.cli.places import axis_values, observed_settings, place
    from tcs.model.grid import Grid
    from tcs.placement.reasons import fix_weights

    loaded = tcs.load(file)
    explanation = tcs.explain(
        loaded,
        goal,
        place(here, torso, at or ()) if here is not None else configuration,
        weights=fix_weights(
            Grid.from_dict(loaded.grid),
            metre=metre_weight,
            turn=turn_weight,
            torso=torso_weight,
            environment=axis_values(axis_weight or (), "--axis-weight"),
            route=travel,
        ),
        observed=observed_settings(observed or (), loaded.observed_axes),
    )
    result = {**explanation.to_json(), "measure": loaded.metadata["measure"]}
    talk.print_result(result, report_explanation, as_json=as_json)


@app.command()
def verify(
    file: options.File,
    pairs: Annotated[int, typer.Option(min=0, help="Reached pairs to re-check.")] = 500,
    dense: Annotated[
        int, typer.Option(min=0, help="Unreached and reached pairs to scan densely.")
    ] = 200,
    seed: options.Seed = 0,
    as_json: options.Json = False,
) -> None:
    """Re-check answers with Drake, and look for answers that were missed."""
    import tcs

    loaded = tcs.load(file)
    with talk.progress_bar("pairs") as on_progress:
        found = tcs.verify(loaded, pairs=pairs, dense=dense, seed=seed, on_progress=on_progress)
    talk.print_result(found.to_json(), reports.report_verification, as_json=as_json)
    if not found.is_sound:
        talk.say(f"some answers in '{file}' are false; do not use them.")
        raise typer.Exit(1)


@app.command()
def export(
    file: options.File,
    out: Annotated[Path, typer.Option(help="CSV file to write.")],
    everything: Annotated[
        bool, typer.Option("--all", help="Also configurations that reach no goal.")
    ] = False,
    as_json: options.Json = False,
) -> None:
    """Write scores as a table: a row for each configuration that reaches a goal."""
    import tcs
    from tcs.cli.places import check_writable

    check_writable(out)
    loaded = tcs.load(file)

    from tcs.cli.export import score_frame, write_csv

    frame = score_frame(loaded, everything=everything)
    write_csv(out, frame)
    result = {"file": str(out), "rows": len(frame), "columns": list(frame.columns)}
    talk.print_result(
        result, lambda _: typer.echo(f"wrote {out}: {len(frame):,} rows"), as_json=as_json
    )


for command in (robustness.evaluate, robustness.robustify, view.view):
    app.command()(command)
app.command("map")(pictures.draw_map)
app.command("picture")(pictures.draw_picture)
app.command()(report.report)
app.command("map-check")(capability.map_check)
