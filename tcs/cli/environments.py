"""The command `tcs environment check`."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from tcs.cli import options
from tcs.output import terminal
from tcs.output.terminal import environment_tables

app = typer.Typer(help="Environments: check a file of your own.", no_args_is_help=True)


@app.callback()
def environments() -> None:
    """Environments: check a file of your own."""


@app.command()
def check(
    environment: Annotated[
        str, typer.Argument(metavar="FILE", help="Name or YAML file of an environment.")
    ],
    as_json: options.Json = False,
) -> None:
    """Check an environment without a robot: what touches what, what is outside the grid."""
    is_sound, found = checked(environment)
    terminal.print_result(found, environment_tables.report_check, as_json=as_json)
    if not is_sound:
        raise typer.Exit(1)


def checked(environment: str) -> tuple[bool, dict[str, Any]]:
    """Return whether an environment can be used, and what was found."""
    from tcs.model.scene import load_environment
    from tcs.model.scene.environment.check import check_environment

    found = check_environment(load_environment(environment))
    return found.is_sound, found.to_json()
