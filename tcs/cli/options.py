"""Arguments and options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

File = Annotated[Path, typer.Argument(metavar="FILE", help="A file made by `tcs score`.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
Robot = Annotated[str, typer.Option(help="Name or YAML file of a robot.")]
Jobs = Annotated[int, typer.Option(min=1, help="Number of threads; does not change the results.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of all random numbers.")]
HERE = typer.Option(
    "--here",
    metavar="X Y YAW_DEG",
    help="Current base pose in the environment frame (m, m, deg).",
)
Torso = Annotated[float, typer.Option(help="Current torso height, in metres.")]
At = Annotated[
    list[str] | None,
    typer.Option(
        metavar="AXIS=VALUE",
        help="Current setting of an axis of the environment, in metres; AXIS_deg=VALUE for angles.",
    ),
]
Observed = Annotated[
    list[str] | None,
    typer.Option(
        metavar="AXIS=VALUE",
        help="Observed state of the person, e.g. person_y=0.03 (m; AXIS_deg=VALUE for angles); "
        "the nearest scored state is used.",
    ),
]
Members = Annotated[
    int | None,
    typer.Option(
        min=1,
        max=3,
        help="Greatest number of base poses in the set: 1, 2 or 3.",
        show_default="that of the file",
    ),
]
Page = Annotated[
    Path | None,
    typer.Option(
        metavar="PAGE",
        help="Write one self-contained .html page with the animation, and exit.",
    ),
]
Meshes = Annotated[
    bool,
    typer.Option(
        "--meshes",
        help="With --export: show the robot's meshes in place of its collision shapes; the output "
        "states their licence.",
    ),
]
PageJson = Annotated[bool, typer.Option("--json", help="With --export: print one JSON object.")]
Port = Annotated[
    int | None,
    typer.Option(
        min=1024,
        max=65535,
        help="Port of the viewer.",
        show_default="the first free one from 7000 on",
    ),
]
Browser = Annotated[bool, typer.Option(help="Whether to open a browser.")]
Duration = Annotated[
    float | None,
    typer.Option(min=0.0, help="Close after this many seconds.", show_default="at Ctrl-C"),
]


def check_export(export: Path | None, *, meshes: bool, as_json: bool) -> None:
    """Reject options of an exported page without `--export`.

    Raises:
        typer.BadParameter: If `--meshes` or `--json` is given without `--export`.
    """
    if export is None and (meshes or as_json):
        raise typer.BadParameter("--meshes and --json require --export.", param_hint="--export")
