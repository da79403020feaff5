"""The command `tcs check`: what files are, and whether they are whole and right."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from tcs.cli import environments, options, robots
from tcs.cli.options import expand_options
from tcs.cli.score import answers_checked
from tcs.errors import TcsError
from tcs.output import terminal
from tcs.output.terminal import environment_tables, robot_tables, set_tables, tables


@expand_options
def check(
    files: Annotated[
        list[str],
        typer.Argument(
            metavar="FILE...",
            help="Whatever tcs reads or wrote: scores, motions, plans, maps, models, runs, blocks; "
            "YAML files of robots, environments, tasks, tools and people, or their names.",
        ),
    ],
    answers: Annotated[
        bool,
        typer.Option("--answers", help="Also re-check the answers of scores and plans with Drake."),
    ] = False,
    *,
    sizes: options.CheckOptions,
    as_json: options.Json = False,
) -> None:
    """Check files: those that tcs wrote are whole, those of your own can be used.

    The exit code is 1 if one is not, or an answer is false.
    """
    found: dict[str, list[dict[str, Any]]] = {"whole": [], "damaged": []}
    is_sound = True
    for file in files:
        try:
            entry = _checked(file, sizes if answers else None)
        except TcsError as error:
            message = " ".join(str(error).splitlines())
            terminal.note(message)
            found["damaged"].append({"path": file, "error": message})
            continue
        found["whole"].append(entry)
        is_sound = is_sound and entry.get("is_sound", True)
    terminal.print_result(found, _report, as_json=as_json)
    if found["damaged"] or not is_sound:
        raise typer.Exit(1)


def _checked(file: str, sizes: options.CheckOptions | None) -> dict[str, Any]:
    """Return what a file is, and what was found about it."""
    from tcs.model.catalogue import kind_of
    from tcs.stored import check_file

    kind = kind_of(file)
    if kind is not None:
        is_sound, details = _MODELS[kind](file)
        return {"path": file, "kind": kind, "is_sound": is_sound, "details": details}
    stored = check_file(file).to_json()
    if sizes is not None and stored["kind"] in ("score file", "plan"):
        is_sound, details = answers_checked(Path(file), sizes)
        return {**stored, "is_sound": is_sound, "details": details}
    return stored


def _task(reference: str) -> tuple[bool, dict[str, Any]]:
    from tcs.model.tasks import load_task

    task = load_task(reference)
    goals = [
        {"name": goal.name, "body_frame": goal.body_frame, "free": goal.region or None}
        for goal in task.goals
    ]
    return True, {"name": task.name, "environments": list(task.environments), "goals": goals}


def _tool(reference: str) -> tuple[bool, dict[str, Any]]:
    from tcs.model.robots import load_tool

    return True, {"name": load_tool(reference).name}


def _person(reference: str) -> tuple[bool, dict[str, Any]]:
    from tcs.model.people import load_person

    person = load_person(reference)
    return True, {"angles_deg": dict(person.angles)}


_MODELS: dict[str, Callable[[str], tuple[bool, dict[str, Any]]]] = {
    "robot": robots.checked,
    "environment": environments.checked,
    "task": _task,
    "tool": _tool,
    "person": _person,
}
_TABLES: dict[str, Callable[[dict[str, Any]], None]] = {
    "robot": robot_tables.report_check,
    "environment": environment_tables.report_check,
    "score file": tables.report_verification,
    "plan": set_tables.report_plan_check,
}
"""How what was found is printed, by kind of file."""


def _report(result: dict[str, Any]) -> None:
    """Print a line for each file that is whole, and what was found about it."""
    for file in result["whole"]:
        kind = file["kind"]
        if "made" in file:
            version = file["format_version"]
            about = [f"format {version}"] if version is not None else []
            about += [file["made"][key] for key in _SAID if key in file["made"]]
            typer.echo(f"{file['path']}: whole, a {kind}" + ", ".join(["", *about]))
        elif kind == "task":
            details = file["details"]
            count, where = len(details["goals"]), ", ".join(details["environments"])
            goals = f"{count} goal{'' if count == 1 else 's'}"
            typer.echo(f"{file['path']}: a task with {goals}, for {where}")
        else:
            article = "an" if kind == "environment" else "a"
            verdict = "" if file["is_sound"] else ", which is not fit for scoring"
            typer.echo(f"{file['path']}: {article} {kind}{verdict}")
        if "details" in file and kind in _TABLES:
            _TABLES[kind](file["details"])


_SAID = ("robot", "environment", "task")
"""What stored files say of themselves that is printed."""
