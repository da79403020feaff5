"""The command line: every command and its function."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated

import typer

from tcs.cli import (
    arplace,
    capability,
    check,
    drafts,
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
    epilog="`tcs list` prints the tasks, environments and robots that ship.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


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


def list_known(as_json: options.Json = False) -> None:
    """List the tasks, environments and robots included in tcs."""
    from tcs.model.catalogue import catalogue
    from tcs.output.terminal import tables

    terminal.print_result(catalogue(), tables.report_catalogue, as_json=as_json)


COMMANDS: dict[str, Callable[..., None]] = {
    "app": serve.app,
    "score": score.score,
    "place": select.select,
    "explain": select.explain,
    "plan": motion.plan,
    "report": report.report,
    "check": check.check,
    "serve": serve.serve,
}
"""The commands by name, in the order in which a newcomer needs them."""
STUDIES: dict[str, Callable[..., None]] = {
    "evaluate": robustness.evaluate,
    "robustify": robustness.robustify,
    "population": population.population,
    "refine": refinement.refine,
    "motions": motion.motions,
}
"""What is found out about the sets of a score file."""
MAPS: dict[str, Callable[..., None]] = {"locate": locate.locate, "check": capability.map_check}
OTHERS: dict[str, Callable[..., None]] = {
    "list": list_known,
    "select": select.select,
    "verify": score.verify,
    "export": score.export,
    "map": pictures.draw_map,
    "picture": pictures.draw_picture,
    "view": view.view,
    "locate": locate.locate,
    "map-check": capability.map_check,
    **STUDIES,
}
"""Names under which programs and habits call the same functions, or parts of them, which the help
does not list."""


def _group(help_text: str, commands: Mapping[str, Callable[..., None]]) -> typer.Typer:
    """Return a group of commands."""
    group = typer.Typer(help=help_text, no_args_is_help=True)
    for name, command in commands.items():
        group.command(name)(command)
    return group


def _studies() -> typer.Typer:
    """Return the group of studies."""
    group = _group("Studies of sets: errors, people, refinement; experiments, trials.", STUDIES)
    group.add_typer(study.app, name="trials")
    for name, command in teleop.EXPERIMENTS.items():
        group.command(name)(command)
    for command in (study.new, study.record, study.report):
        group.command(hidden=True)(command)
    return group


def _maps() -> typer.Typer:
    """Return the group of maps."""
    group = _group("Maps of base poses without an environment: capability, ARPlace.", MAPS)
    group.add_typer(capability.app, name="capability")
    group.add_typer(arplace.app, name="arplace")
    return group


for _name, _command in COMMANDS.items():
    app.command(_name)(_command)
app.add_typer(
    _group("Drafts of files of your own: a robot, an environment, a task.", drafts.COMMANDS),
    name="new",
)
app.add_typer(_studies(), name="study")
app.add_typer(teleop.app, name="arm")
app.add_typer(_maps(), name="maps")
for _name, _command in OTHERS.items():
    app.command(_name, hidden=True)(_command)
for _name, _typer in {
    "robot": robots.app,
    "environment": environments.app,
    "capability": capability.app,
    "arplace": arplace.app,
    "teleop": teleop.app,
}.items():
    app.add_typer(_typer, name=_name, hidden=True)
