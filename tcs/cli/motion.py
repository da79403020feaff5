"""The commands `tcs plan` and `tcs motions`: motions that do a task, and what can be done."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tcs.cli import options
from tcs.cli.values import current_state, observed_settings, state_if_given
from tcs.output import terminal

if TYPE_CHECKING:
    from tcs.placement.store import ScoreFile


def plan(
    file: options.File,
    here: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            metavar="X Y YAW_DEG",
            help="Plan for the set selected from this base pose in the environment frame "
            "(m, m, deg).",
            show_default="the recommended set, wherever the robot is",
        ),
    ] = None,
    exactly: Annotated[
        bool,
        typer.Option(
            "--exactly", help="With --here: plan from that very base pose, on or off the grid."
        ),
    ] = False,
    torso: options.Torso = 0.0,
    at: options.At = None,
    max_members: Annotated[
        int | None,
        typer.Option(
            "--members",
            "--max-members",
            min=1,
            max=3,
            help="Greatest number of base poses in the set: 1, 2 or 3.",
            show_default="that of the file",
        ),
    ] = None,
    observed: options.Observed = None,
    configuration: Annotated[
        list[int] | None,
        typer.Option(
            help="Plan for this configuration instead, by its number in `tcs export`; several in "
            "the order of the visits."
        ),
    ] = None,
    order: Annotated[
        str,
        typer.Option(
            metavar="best|given",
            help="Order of the goals at a stop: that of the shortest tour, or their own.",
        ),
    ] = "best",
    jerk: Annotated[
        float | None,
        typer.Option(
            help="Greatest jerk of every joint [rad/s^3], beside those of the robot file.",
            show_default="those of the robot file",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="File to write the plan to: .json, .csv, .yaml (JointTrajectory of ROS 2), "
            ".ros1.yaml (of ROS 1) or .npz (arrays for Drake)."
        ),
    ] = None,
    seed: options.Seed = 0,
    as_json: options.Json = False,
) -> None:
    """Plan the motions that do the task from each stop: to the goals, straight in and out, back."""
    if configuration and (here is not None or max_members is not None):
        raise typer.BadParameter(
            "give --configuration, or --here and --members.", param_hint="--configuration"
        )
    if exactly and (here is None or max_members is not None):
        raise typer.BadParameter("requires --here, without --members.", param_hint="--exactly")
    if at and not exactly:
        raise typer.BadParameter("requires --exactly.", param_hint="--at")
    state = state_if_given(here, torso)

    import tcs
    from tcs.files.writing import check_writable
    from tcs.motion import save_plan
    from tcs.motion.plan_files import check_plan_path
    from tcs.motion.plans import exact_state
    from tcs.output.report.score.shown_set import ShownSet
    from tcs.output.terminal.set_tables import report_plan
    from tcs.placement.selection import nearest_table

    if out is not None:
        check_plan_path(out)
        check_writable(out, [file])
    loaded = tcs.load(file)
    settings = observed_settings(observed or (), loaded.observed_axes)
    members: Any
    if exactly and here is not None:
        members = exact_state(loaded, current_state(here, torso, at or ()), settings)
    elif configuration:
        members = _flat_indices(loaded, nearest_table(loaded, None, settings).index, configuration)
    else:
        shown = ShownSet.of(loaded, state, max_members, settings)
        members = shown.refined or _flat_indices(loaded, shown.table, shown.indices)
    with terminal.progress_bar("per cent") as on_progress:
        found = tcs.plan(
            loaded,
            members,
            order=order,
            jerk=jerk,
            seed=seed,
            on_progress=on_progress,
            on_compile=terminal.note_compiling,
        )
    if out is not None:
        save_plan(out, found)
        terminal.note(f"wrote {out}")
    terminal.print_result(found.to_json(), report_plan, as_json=as_json)


def _flat_indices(loaded: ScoreFile, table: int, indices: Sequence[int]) -> list[int]:
    """Return flat indices in all tables of configurations of one of them.

    Raises:
        typer.BadParameter: If there is no such configuration.
    """
    from tcs.model.grid import Grid

    size = Grid.from_dict(loaded.grid).size
    for h in indices:
        if not 0 <= h < size:
            raise typer.BadParameter(
                f"{h} is not a configuration; there are {size:,}, from 0.",
                param_hint="--configuration",
            )
    return [table * size + h for h in indices]


def motions(
    file: options.File,
    within: Annotated[
        float,
        typer.Option(
            help="Examine the configurations of sets whose P_R + P_M is at most this fraction "
            "below the best one."
        ),
    ] = 0.05,
    most: Annotated[
        int | None,
        typer.Option(
            help="Greatest number of configurations, those of the best sets first.",
            show_default="no bound",
        ),
    ] = None,
    pairs: Annotated[
        bool,
        typer.Option(
            "--pairs", help="Examine every configuration that reaches a goal, not only the best."
        ),
    ] = False,
    sample: Annotated[
        int | None,
        typer.Option(
            help="Examine this many of these configurations only, drawn at random.",
            show_default="all",
        ),
    ] = None,
    observed: options.Observed = None,
    out: Annotated[
        Path | None, typer.Option(help="File to write.", show_default="FILE.motions")
    ] = None,
    seed: options.Seed = 0,
    blocks: options.Blocks = None,
    restart: options.Restart = False,
    jobs: options.Jobs = 2,
    as_json: options.Json = False,
) -> None:
    """Find which goals can be done, in and out and back to rest, for `tcs select --executable`."""
    import tcs
    from tcs.files.writing import check_writable
    from tcs.motion.examine import examination
    from tcs.output.terminal.set_tables import report_motions
    from tcs.placement.selection import nearest_table
    from tcs.placement.store import motion_path, save_motions

    path = out or motion_path(file)
    kept = options.block_folder(blocks, restart)
    check_writable(path, [file])
    loaded = tcs.load(file)
    settings = observed_settings(observed or (), loaded.observed_axes)
    table = nearest_table(loaded, None, settings).index
    with terminal.progress_bar("configurations") as on_progress:
        found = tcs.examine(
            loaded,
            within=None if pairs else within,
            most=most,
            sample=sample,
            table=table,
            seed=seed,
            jobs=jobs,
            blocks=kept,
            on_progress=on_progress,
            on_compile=terminal.note_compiling,
        )
    save_motions(path, found)
    result = {"file": str(path), **examination(loaded, found, table)}
    terminal.print_result(result, report_motions, as_json=as_json)
