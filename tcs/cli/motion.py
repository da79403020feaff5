"""The command `tcs plan`: the motions that do a task from the stops of a set."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tcs.cli import options
from tcs.cli.values import observed_settings, state_if_given
from tcs.output import terminal


def plan(
    file: options.File,
    here: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            metavar="X Y YAW_DEG",
            help="Plan for the set selected from this base pose in the environment frame "
            "(m, m, deg).",
            show_default="the set with the best scores",
        ),
    ] = None,
    torso: options.Torso = 0.0,
    max_members: options.Members = None,
    observed: options.Observed = None,
    configuration: Annotated[
        list[int] | None,
        typer.Option(
            help="Plan for this configuration instead, by its number in `tcs export`; several in "
            "the order of the visits."
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="File to write the plan to: .json or .csv.")
    ] = None,
    seed: options.Seed = 0,
    as_json: options.Json = False,
) -> None:
    """Plan the motions that do the task from each stop: to the goals, straight in and out, back."""
    if configuration and (here is not None or max_members is not None):
        raise typer.BadParameter(
            "give --configuration, or --here and --max-members.", param_hint="--configuration"
        )
    state = state_if_given(here, torso)

    import tcs
    from tcs.files.writing import check_writable
    from tcs.model.grid import Grid
    from tcs.motion import save_plan
    from tcs.motion.files import check_plan_path
    from tcs.output.report.shown_set import ShownSet
    from tcs.output.terminal.motion_tables import report_plan
    from tcs.placement.selection import nearest_table

    if out is not None:
        check_plan_path(out)
        check_writable(out, [file])
    loaded = tcs.load(file)
    settings = observed_settings(observed or (), loaded.observed_axes)
    if configuration:
        table, indices = nearest_table(loaded, None, settings).index, tuple(configuration)
    else:
        shown = ShownSet.of(loaded, state, max_members, settings)
        table, indices = shown.table, shown.indices
    size = Grid.from_dict(loaded.grid).size
    for h in indices:
        if not 0 <= h < size:
            raise typer.BadParameter(
                f"{h} is not a configuration; there are {size:,}, from 0.",
                param_hint="--configuration",
            )
    with terminal.progress_bar("stops") as on_progress:
        found = tcs.plan(
            loaded,
            [table * size + h for h in indices],
            seed=seed,
            on_progress=on_progress,
            on_compile=terminal.note_compiling,
        )
    if out is not None:
        save_plan(out, found)
        terminal.note(f"wrote {out}")
    terminal.print_result(found.to_json(), report_plan, as_json=as_json)
