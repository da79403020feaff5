"""Arguments and options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

File = Annotated[Path, typer.Argument(metavar="FILE", help="A file made by `tcs score`.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
Robot = Annotated[str, typer.Option(help="Name or YAML file of a robot.")]
Jobs = Annotated[int, typer.Option(min=1, help="Number of threads; results are the same.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of everything random.")]
HERE = typer.Option(
    "--here",
    metavar="X Y YAW_DEG",
    help="Where the robot is now, in the environment frame (m, m, deg).",
)
Torso = Annotated[float, typer.Option(help="How high the torso is now, in metres.")]
At = Annotated[
    list[str] | None,
    typer.Option(
        metavar="AXIS=VALUE",
        help="How an axis of the environment is set now, in metres; AXIS_deg=VALUE for angles.",
    ),
]
Observed = Annotated[
    list[str] | None,
    typer.Option(
        metavar="AXIS=VALUE",
        help="How the person is found, e.g. person_y=0.03 (m; AXIS_deg=VALUE for angles); the "
        "nearest state that was scored is used.",
    ),
]
Members = Annotated[
    int | None,
    typer.Option(
        min=1,
        max=3,
        help="At most so many places to stand at: 1, 2 or 3.",
        show_default="what the file holds",
    ),
]
Page = Annotated[
    Path | None,
    typer.Option(
        metavar="PAGE",
        help="Write one self-contained .html page that plays all of it, and end.",
    ),
]
Meshes = Annotated[
    bool,
    typer.Option(
        "--meshes",
        help="With --export: the robot's meshes in place of its collision shapes; mind their "
        "licence, which is told.",
    ),
]
PageJson = Annotated[bool, typer.Option("--json", help="With --export: print one JSON object.")]
Port = Annotated[
    int | None,
    typer.Option(
        min=1024,
        max=65535,
        help="Where the browser finds the page.",
        show_default="the first free one from 7000 on",
    ),
]
Browser = Annotated[bool, typer.Option(help="Whether to open a browser.")]
Duration = Annotated[
    float | None,
    typer.Option(min=0.0, help="Close after so many seconds.", show_default="at Ctrl-C"),
]


def check_export(export: Path | None, *, meshes: bool, as_json: bool) -> None:
    """Refuse what says how a page is written where none is.

    Raises:
        typer.BadParameter: If there is no `--export`.
    """
    if export is None and (meshes or as_json):
        raise typer.BadParameter("--meshes and --json need --export.", param_hint="--export")
