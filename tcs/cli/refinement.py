"""The command `tcs refine`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from tcs.cli import options
from tcs.cli.robustness import BodyCollisions, table_of
from tcs.output import terminal


def refine(
    file: options.File,
    out: Annotated[
        Path | None, typer.Option(help="File to write.", show_default="FILE itself")
    ] = None,
    objective: Annotated[
        str,
        typer.Option(
            metavar="score|success",
            help="What to maximise: P_R + P_M, or the success under the errors of the environment.",
        ),
    ] = "score",
    starts: Annotated[
        int, typer.Option(help="Number of different sets to start from, the best ones.")
    ] = 6,
    rounds: Annotated[int, typer.Option(help="Greatest number of rounds of the search.")] = 40,
    samples: Annotated[
        int | None,
        typer.Option(
            help="Number of samples of the success.",
            show_default="64; with the objective success 2000",
        ),
    ] = None,
    keep_success: Annotated[
        bool,
        typer.Option(
            help="With the objective score, whether a set must be as sure under the errors of the "
            "environment as the best set of the grid."
        ),
    ] = True,
    body_collisions: BodyCollisions = None,
    seed: options.Seed = 0,
    observed: options.Observed = None,
    jobs: options.Jobs = 2,
    as_json: options.Json = False,
) -> None:
    """Refine the best sets between the grid points.

    Without --observed, the sets of the nominal state are refined.
    """
    import tcs
    from tcs.files.writing import check_writable
    from tcs.output.terminal.set_tables import report_refined
    from tcs.placement.refinement import refinement_summary

    path = out or file
    check_writable(path)
    loaded = tcs.load(file)
    table = table_of(loaded, observed)
    with terminal.progress_bar("rounds") as on_progress:
        done = tcs.refine(
            loaded,
            objective=objective,
            starts=starts,
            rounds=rounds,
            samples=samples,
            keep_success=keep_success,
            body_collisions=body_collisions,
            seed=seed,
            table=table,
            jobs=jobs,
            on_progress=on_progress,
            on_compile=terminal.note_compiling,
        )
        tcs.save(path, done)
    result = {"file": str(path), **refinement_summary(done, table)}
    terminal.print_result(result, report_refined, as_json=as_json)


def refined_in_place(path: Path, jobs: int) -> dict[str, Any]:
    """Refine the sets of a score file with the default options; return what that gained."""
    import tcs
    from tcs.placement.refinement import refinement_summary

    with terminal.progress_bar("rounds") as on_progress:
        file = tcs.refine(tcs.load(path), jobs=jobs, on_progress=on_progress)
    tcs.save(path, file)
    return refinement_summary(file)
