"""The commands `tcs robot ...`: draft a robot file from a URDF, and check a robot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from tcs.cli import options
from tcs.output import terminal
from tcs.output.terminal import robot_tables

app = typer.Typer(
    help="Robots: draft a robot file from any URDF, and check a robot.", no_args_is_help=True
)


@app.command()
def new(
    urdf: Annotated[
        str, typer.Argument(metavar="URDF", help="Path or package:// address of a URDF.")
    ],
    tool: Annotated[str, typer.Option(help="Link of the URDF that moves to the goals.")],
    base: Annotated[
        str | None,
        typer.Option(help="Link from which on joints may belong to the arm.", show_default="root"),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="File to write.", show_default="<urdf>.yaml")
    ] = None,
    coarse: Annotated[
        bool,
        typer.Option("--coarse", help="Few shapes on each link: a quick draft that blocks more."),
    ] = False,
    from_collision_meshes: Annotated[
        bool,
        typer.Option(
            "--from-collision-meshes",
            help="Enclose the collision meshes alone; parts of the visual ones may protrude.",
        ),
    ] = False,
    ignore: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LINKS",
            help="Links to leave out, separated by commas: nothing is checked against them.",
        ),
    ] = None,
    packages: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FOLDER",
            help="Folder to search for packages that the URDF names; may be repeated.",
        ),
    ] = None,
    jobs: options.Jobs = 2,
    as_json: options.Json = False,
) -> None:
    """Draft a robot file from any URDF, and a CSV file with its collision primitives."""
    from tcs_shapes.draft import DraftOptions, draft_to_files

    path = out or Path(f"{Path(urdf).stem}.yaml")
    chosen = DraftOptions(
        base=base,
        coarse=coarse,
        collision_meshes=from_collision_meshes,
        ignore=tuple(link for links in ignore or () for link in links.split(",") if link),
        packages=tuple(str(folder.absolute()) for folder in packages or ()),
        jobs=jobs,
    )
    with terminal.progress_bar("steps", lines=True) as on_progress:
        result = draft_to_files(urdf, tool, path, chosen, on_progress=on_progress)
    terminal.print_result(result, robot_tables.report_draft, as_json=as_json)


@app.command()
def check(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="Name or YAML file of a robot.")],
    samples: Annotated[
        int,
        typer.Option(min=1, max=options.MOST_QUERIES, help="Random postures of the IK round trip."),
    ] = 1000,
    seed: options.Seed = 0,
    as_json: options.Json = False,
) -> None:
    """Check a robot: arm class, limits, primitives, self-collision, IK; exit 1 if one fails."""
    is_sound, found = checked(robot, samples=samples, seed=seed)
    terminal.print_result(found, robot_tables.report_check, as_json=as_json)
    if not is_sound:
        terminal.note(f"robot '{found['robot']}' is not fit for scoring.")
        raise typer.Exit(1)


def checked(robot: str, *, samples: int = 1000, seed: int = 0) -> tuple[bool, dict[str, Any]]:
    """Return whether a robot is fit for scoring, and what was found."""
    from tcs.model.robots import load_robot
    from tcs_shapes.checkup import check_up

    found = check_up(load_robot(robot), samples=samples, seed=seed)
    return found.is_sound, found.to_json()
