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
