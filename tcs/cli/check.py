"""The command `tcs check`: what files are, and whether they are whole."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from tcs.cli import options
from tcs.errors import TcsError
from tcs.output import terminal


def check(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE...",
            help="Scores, motions, capability and probability maps, ARPlace models, plans, runs, "
            "blocks (or manifest.json beside them, for all).",
        ),
    ],
    as_json: options.Json = False,
) -> None:
    """Check that files made by tcs are whole: checksums, versions, every part readable.

    Whether the answers in them are right, `tcs verify` finds. The exit code is 1 if a file is not
    whole.
    """
    from tcs.stored import check_file

    whole, damaged = [], []
    for path in files:
        try:
            whole.append(check_file(path).to_json())
        except TcsError as error:
            message = " ".join(str(error).splitlines())
            terminal.note(message)
            damaged.append({"path": str(path), "error": message})
    terminal.print_result({"whole": whole, "damaged": damaged}, _report, as_json=as_json)
    if damaged:
        raise typer.Exit(1)


def _report(result: dict[str, Any]) -> None:
    """Print a line for each file that is whole."""
    for file in result["whole"]:
        version = file["format_version"]
        made = file["made"]
        about = [f"format {version}"] if version is not None else []
        about += [made[key] for key in ("robot", "environment", "task") if key in made]
        typer.echo(f"{file['path']}: whole, a {file['kind']}" + ", ".join(["", *about]))
