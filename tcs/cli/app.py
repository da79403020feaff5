"""The command line: every command and its function."""

from __future__ import annotations

from typing import Annotated

import typer

from tcs.cli import (
    arplace,
    capability,
    check,
    environments,
    locate,
    motion,
    options,
    pictures,
    population,
    refinement,
    report,
    robots,
    robustness,
    score,
    select,
    serve,
    study,
    teleop,
    view,
)
from tcs.cli.commands import Commands
from tcs.output import terminal

app = typer.Typer(
    cls=Commands,
    help="Where should an assistive robot stand? Score a task once, then select in milliseconds.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.add_typer(robots.app, name="robot")
app.add_typer(environments.app, name="environment")
app.add_typer(capability.app, name="capability")
app.add_typer(arplace.app, name="arplace")
app.add_typer(teleop.app, name="teleop")
app.add_typer(study.app, name="study")


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
    """List the tasks, environments and robots included in tcs."""
    from tcs.model.catalogue import catalogue
    from tcs.output.terminal import tables

    terminal.print_result(catalogue(), tables.report_catalogue, as_json=as_json)


for command in (
    score.score,
    select.select,
    select.explain,
    motion.plan,
    motion.motions,
    score.verify,
    score.export,
    robustness.evaluate,
    robustness.robustify,
    population.population,
    refinement.refine,
    view.view,
    check.check,
    locate.locate,
    serve.serve,
    serve.app,
):
    app.command()(command)
app.command("map")(pictures.draw_map)
app.command("picture")(pictures.draw_picture)
app.command()(report.report)
app.command("map-check")(capability.map_check)
