"""The commands `tcs capability show` and `tcs map-check`: draw a map, and check its accuracy."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tcs.cli import options
from tcs.cli.capability.groups import PICTURE, GridOptions, Map, Radius, check_picture
from tcs.cli.options import expand_options
from tcs.output import terminal
from tcs.output.terminal import capability_tables


def show(
    capability: Map,
    out: Annotated[Path, typer.Option(help=PICTURE)],
    tilt: Annotated[int, typer.Option(min=0, help="Number of the tool's tilt, from 0.")] = 0,
    height: Annotated[
        float | None,
        typer.Option(
            help="Height of the tool above the floor, in metres.",
            show_default="the one with most base poses",
        ),
    ] = None,
    as_json: options.Json = False,
) -> None:
    """Draw a map from above: the best score at each base position, relative to the tool."""
    from tcs.capability import load_map
    from tcs.output.view.base_poses import save_map_layer

    check_picture(out)
    save_map_layer(out, load_map(capability), tilt=tilt, height=height)
    terminal.print_result({"file": str(out)}, lambda _: typer.echo(f"wrote {out}"), as_json=as_json)


@expand_options
def map_check(
    grid: GridOptions,
    capability: Annotated[
        Path | None,
        typer.Argument(
            metavar="MAP",
            help="A map made by inverse kinematics.",
            show_default="the map that these options would make",
        ),
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option(
            help="Name or YAML file of a robot.", show_default="that of MAP; without MAP tiago"
        ),
    ] = None,
    grasps: Annotated[
        list[str] | None,
        typer.Option(
            help="Tilts of the tool: side, top or all; may be repeated.", show_default="each"
        ),
    ] = None,
    radius: Radius = None,
    queries: Annotated[
        int,
        typer.Option(
            min=1, max=options.MOST_QUERIES, help="Random tool poses for each set of grasps."
        ),
    ] = 20_000,
    seed: options.Seed = 0,
    jobs: options.Jobs = 2,
    as_json: options.Json = False,
) -> None:
    """Compare a capability map with inverse kinematics at random tool poses."""
    if capability is not None and (radius is not None or grid != GridOptions()):
        raise typer.BadParameter(
            "a map has its own grid, torso height, tool and radius; leave out their options.",
            param_hint="MAP",
        )
    from tcs.capability import check_file, check_map

    if capability is not None:
        cells, checks = check_file(
            capability, robot=robot, grasps=grasps or (), queries=queries, seed=seed, jobs=jobs
        )
    else:
        reach = grid.reach(robot or "tiago")
        checks = {}
        for name in grasps or ("side", "top", "all"):
            cells = grid.grid(name)
            checks[name] = check_map(
                reach, cells, name, radius=radius, queries=queries, seed=seed, jobs=jobs
            )
    result = capability_tables.check_result(capability, cells, checks)
    terminal.print_result(result, capability_tables.report_check, as_json=as_json)
