"""The commands `tcs study ...`: trials and questionnaires of people, and their report."""

from __future__ import annotations

import webbrowser
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tcs.cli import options
from tcs.cli.options import expand_options
from tcs.cli.teleop.groups import TorsoHeight
from tcs.output import terminal

if TYPE_CHECKING:
    from tcs_studies.output.study.session import StudySession

app = typer.Typer(help="Trials and questionnaires of people: plan, record, report.")
Folder = Annotated[
    Path, typer.Argument(metavar="FOLDER", help="Folder of the study.", show_default=False)
]


class Weights(StrEnum):
    """When the pairs of NASA-TLX are compared."""

    EACH = "each"
    ONCE = "once"


@app.command()
def new(
    folder: Folder,
    title: Annotated[str, typer.Option(help="Title of the study.")] = "Following a line",
    robot: options.Robot = "iiwa7",
    torso_height: TorsoHeight = None,
    conditions: Annotated[
        str,
        typer.Option(
            metavar="NAME,NAME,...",
            help="Conditions to compare: end-effector, novel, assisted, drake, joint are driven in "
            "the browser; NAME=TITLE is another one, whose trials are given as run files.",
        ),
    ] = "end-effector,novel",
    training: Annotated[
        int, typer.Option(min=0, max=100, help="Training trials with each condition.")
    ] = 4,
    trials: Annotated[
        int, typer.Option(min=1, max=100, help="Evaluated trials with each condition.")
    ] = 3,
    time_limit: Annotated[
        float, typer.Option(min=1, max=3600, help="Time limit of a trial, in seconds.")
    ] = 120.0,
    participants: Annotated[
        int, typer.Option(min=1, max=10_000, help="Planned number of participants.")
    ] = 26,
    questionnaires: Annotated[
        str,
        typer.Option(
            metavar="NAME,NAME,...",
            help="Questionnaires after each condition, or none: those of the default.",
        ),
    ] = "van-der-laan,nasa-tlx,difficulty",
    tlx_weights: Annotated[
        Weights, typer.Option(help="Pairs of NASA-TLX after each condition, or the first one only.")
    ] = Weights.EACH,
    line_seed: Annotated[int, typer.Option(min=0, help="Seed of the search for the line.")] = 0,
) -> None:
    """Make the folder of a study: its plan, with the line that all participants follow."""
    from tcs_studies.study.study_file import new_study

    study = new_study(
        folder,
        {
            "title": title, "robot": robot, "torso_height": torso_height, "training": training,
            "trials": trials, "time_limit": time_limit, "participants": participants,
            "questionnaires": [] if questionnaires == "none" else questionnaires.split(","),
            "tlx_weights": tlx_weights.value,
        },
        conditions=conditions.split(","),
        line_seed=line_seed,
    )  # fmt: skip
    typer.echo(f"wrote {study.folder / 'study.yaml'}: {', '.join(study.conditions)}")
    typer.echo(f"next: tcs study record {study.folder}")


@app.command()
@expand_options
def record(
    folder: Folder,
    *,
    participant: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Participant to continue; with --new the name of a new one.",
            show_default="the unfinished one, or a new one",
        ),
    ] = None,
    new: Annotated[bool, typer.Option("--new", help="Begin a new participant.")] = False,
    run: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="Run file of the next trial, in place of driving it; may be repeated.",
        ),
    ] = None,
    answers: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="YAML or JSON file with answers, in place of the page."),
    ] = None,
    skip: Annotated[
        str | None,
        typer.Option(metavar="REASON", help="Record that the next step is missing, and exit."),
    ] = None,
    drop: Annotated[
        str | None,
        typer.Option(metavar="REASON", help="Leave the participant out of the results, and exit."),
    ] = None,
    window: options.WindowOptions,
) -> None:
    """Record the next trials and questionnaires of a participant, and resume after a break."""
    if skip is not None and drop is not None:
        raise typer.BadParameter("excludes --skip.", param_hint="--drop")
    from tcs_studies.output.study.session import Given, open_session

    given = Given(runs=tuple(run or ()), answers=answers)
    with open_session(folder, participant, new=new, given=given, report=typer.echo) as session:
        if drop is not None:
            session.drop(drop)
        elif skip is not None:
            session.skip(skip)
        else:
            _walk(session, window)


def _walk(session: StudySession, window: options.WindowOptions) -> None:
    """Record step by step until nothing is left that can be recorded here."""
    from tcs_studies.output.study.session import Screen

    def show(url: str) -> None:
        terminal.note(f"open {url} in a browser; Ctrl-C ends, and every finished step is saved.")
        if window.browser:
            webbrowser.open(url)

    session.record(
        Screen(show=show, note=terminal.note, port=window.port, duration=window.duration)
    )


@app.command()
def report(
    folder: Folder,
    out: Annotated[
        Path | None,
        typer.Option(metavar="PAGE", help="Page to write.", show_default="FOLDER/report.html"),
    ] = None,
    as_json: options.Json = False,
) -> None:
    """Compare the conditions: the papers' tables and pictures, with every table as CSV."""
    from tcs_studies.output.report.study.files import write_study_report
    from tcs_studies.output.terminal_tables import report_study
    from tcs_studies.study.study_file import load_study

    study = load_study(folder)
    with terminal.progress_bar("participants") as on_progress:
        result = write_study_report(study, out, on_progress=on_progress)
    terminal.print_result(result, report_study, as_json=as_json)
