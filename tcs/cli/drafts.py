"""The commands `tcs new ...`: drafts of a robot, an environment and a task."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from tcs.cli import options, robots
from tcs.output import terminal

Out = Annotated[Path, typer.Argument(metavar="FILE", help="YAML file to write; a new one.")]


def environment(
    out: Out,
    based_on: Annotated[
        str, typer.Option(help="Name or YAML file of the environment that it changes.")
    ] = "wheelchair",
    as_json: options.Json = False,
) -> None:
    """Draft an environment: one that exists, with a table, to be changed in an editor."""
    from tcs.model.drafts import draft_environment

    terminal.print_result(draft_environment(out, based_on), _report, as_json=as_json)


def task(
    out: Out,
    environment: Annotated[
        str, typer.Option(help="Name or YAML file of the environment of the task.")
    ] = "wheelchair",
    as_json: options.Json = False,
) -> None:
    """Draft a task: one goal on the person's body, and what is free about it."""
    from tcs.model.drafts import draft_task

    terminal.print_result(draft_task(out, environment), _report, as_json=as_json)


def _report(result: dict[str, str]) -> None:
    """Print what was written and what to do next."""
    file = result["file"]
    typer.echo(f"wrote {file}: complete it in an editor, then check it: tcs check {file}")


COMMANDS: dict[str, Callable[..., None]] = {
    "robot": robots.new,
    "environment": environment,
    "task": task,
}
"""The drafts by name."""
