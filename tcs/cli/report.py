"""The command `tcs report`: a page about a score file."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from tcs.cli import options
from tcs.cli.options import expand_options
from tcs.output import terminal


@expand_options
def report(
    file: options.File,
    *,
    out: Annotated[
        Path,
        typer.Option(
            metavar="PAGE",
            help="Page to write: .html, self-contained, or .md, text and tables only.",
        ),
    ],
    chosen: options.ShownOptions,
    markdown: Annotated[
        bool, typer.Option("--md", help="Also write text and tables as .md, under the same name.")
    ] = False,
    sizes: options.CheckOptions,
    motions: Annotated[
        bool,
        typer.Option(
            "--motions", help="Also plan the motions of the set, and show the tour of each stop."
        ),
    ] = False,
    as_json: options.Json = False,
) -> None:
    """Write a page about a score file: base poses, scores, reasons and verification.

    The page shows the set selected from --here, or the recommended one. Answers are
    re-checked with Drake; if one is false, the page states it and the exit code is 1.
    """
    here = chosen.state()

    import tcs
    from tcs.output.report import CheckSizes, make_score_report, report_paths, write_score_report

    paths = report_paths(out, markdown=markdown)
    found = chosen.observation(tcs.load(file).observed_axes)
    with terminal.progress_bar("pairs re-checked") as on_progress:
        answer = make_score_report(
            file,
            here=here,
            max_members=chosen.max_members,
            observed=found,
            refined=chosen.refined,
            sizes=CheckSizes(pairs=sizes.pairs, dense=sizes.dense, seed=sizes.seed),
            tours=motions,
            on_progress=on_progress,
        )
    result = write_score_report(answer, paths, command=shlex.join(["tcs", *sys.argv[1:]]))
    terminal.print_result(result, _report, as_json=as_json)
    if not answer.is_sound:
        terminal.note(f"some answers in '{file}' are false; do not use them.")
        raise typer.Exit(1)


def _report(result: dict[str, Any]) -> None:
    """Print the files written and the verdict."""
    for name, size in zip(result["files"], result["bytes"], strict=True):
        typer.echo(f"wrote {name}: {size / 1e6:.2f} MB")
    checked, shown = result["verification"]["checked"], result["shown_checked"]
    if not checked and not shown:
        typer.echo(result["verification"]["verdict"])
        return
    verdict = "every answer holds" if result["is_sound"] else "SOME ANSWERS ARE FALSE"
    typer.echo(f"{shown} answers shown and {checked:,} others re-checked with Drake: {verdict}")
