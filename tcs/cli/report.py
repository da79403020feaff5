"""The command `tcs report`: a page about a score file."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from tcs.cli import options, pictures, view
from tcs.cli.options import expand_options
from tcs.cli.score import exported
from tcs.output import terminal


@expand_options
def report(
    file: options.File,
    *,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="PAGE",
            help="Page to write: .html, self-contained, or .md, text and tables only.",
            show_default="none, if single files are asked for",
        ),
    ] = None,
    map_: Annotated[
        Path | None,
        typer.Option("--map", help="Picture from above to write: .png, .pdf or .svg."),
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option(help="Picture of the robot at the base poses to write: .png, .pdf or .svg."),
    ] = None,
    csv: Annotated[Path | None, typer.Option(help="Table of the scores to write: .csv.")] = None,
    scene: Annotated[
        Path | None,
        typer.Option(help="Scene in 3-D to write: .html, self-contained."),
    ] = None,
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
    re-checked with Drake; if one is false, the page states it and the exit code is 1. Map, picture,
    table and scene are written as files of their own, without a page unless --out is given.
    """
    single = {
        path: write
        for path, write in (
            (map_, pictures.map_from_above),
            (picture, pictures.picture),
            (csv, _table),
            (scene, view.scene_page),
        )
        if path is not None
    }
    if out is None and not single:
        raise typer.BadParameter(
            "missing: the page to write, or one of --map, --picture, --csv, --scene.",
            param_hint="--out",
        )
    here = chosen.state()
    files = [write(file, path, chosen)["file"] for path, write in single.items()]
    if out is None:
        terminal.print_result(
            {"files": files, "bytes": [Path(name).stat().st_size for name in files]},
            _report_files,
            as_json=as_json,
        )
        return

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
    result["files"] += files
    result["bytes"] += [Path(name).stat().st_size for name in files]
    terminal.print_result(result, _report, as_json=as_json)
    if not answer.is_sound:
        terminal.note(f"some answers in '{file}' are false; do not use them.")
        raise typer.Exit(1)


def _table(file: Path, out: Path, chosen: options.ShownOptions) -> dict[str, Any]:
    """Write the scores as a table, in which all sets are."""
    return exported(file, out)


def _report_files(result: dict[str, Any]) -> None:
    """Print the files written."""
    for name, size in zip(result["files"], result["bytes"], strict=True):
        typer.echo(f"wrote {name}: {size / 1e6:.2f} MB")


def _report(result: dict[str, Any]) -> None:
    """Print the files written and the verdict."""
    _report_files(result)
    checked, shown = result["verification"]["checked"], result["shown_checked"]
    if not checked and not shown:
        typer.echo(result["verification"]["verdict"])
        return
    verdict = "every answer holds" if result["is_sound"] else "SOME ANSWERS ARE FALSE"
    typer.echo(f"{shown} answers shown and {checked:,} others re-checked with Drake: {verdict}")
