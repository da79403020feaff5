"""The command `tcs capability merge`: merge a map over the grasps of a task."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tcs.cli import options
from tcs.cli.capability.groups import PICTURE, TORSO, ErrorOptions, Map, check_picture
from tcs.cli.options import expand_options
from tcs.files.writing import check_writable
from tcs.output import terminal
from tcs.output.terminal import capability_tables

if TYPE_CHECKING:
    from tcs.capability import TaskMap, TaskShape


@dataclass(frozen=True, kw_only=True)
class TaskOptions:
    """A task of grasps by the name of its shape."""

    task: Annotated[str, typer.Option(help="pick-and-place, linear or curved.")]
    height: Annotated[float, typer.Option(help="Height of the tool above the floor, in metres.")]
    length: Annotated[
        float,
        typer.Option(
            help="Distance from the first to the last position, or radius of an arc, in metres."
        ),
    ] = 0.15
    samples: Annotated[int, typer.Option(help="Positions along a line or an arc.")] = 3
    heading_deg: Annotated[
        list[float] | None,
        typer.Option(
            help="Heading of a grasp, in degrees; may be repeated.", show_default="0, 90 and -90"
        ),
    ] = None
    approach: Annotated[str, typer.Option(help="Approach of the grasps: side or top.")] = "side"
    pre_grasp: Annotated[
        list[float] | None,
        typer.Option(
            help="Distance of a pre-grasp back along the approach, in metres; may be repeated."
        ),
    ] = None
    direction_deg: Annotated[
        int, typer.Option(help="Direction of a line: 0, 90, 180 or 270 degrees.")
    ] = 90
    start_deg: Annotated[float, typer.Option(help="Arc: angle of the closed door, in degrees.")] = (
        0.0
    )
    end_deg: Annotated[float, typer.Option(help="Arc: angle of the open door, in degrees.")] = 90.0


@expand_options
def merge_maps(
    capability: Map,
    task: TaskOptions,
    torso_height: Annotated[
        float | None,
        typer.Option(
            *TORSO, help="Use only this torso height, in metres.", show_default="any of the map"
        ),
    ] = None,
    scale: Annotated[str, typer.Option(help="Scale of the scores: fixed, or thesis.")] = "fixed",
    split: Annotated[
        bool,
        typer.Option(
            "--split",
            help="Find the fewest base poses that reach all positions, in the order of the task.",
        ),
    ] = False,
    environment: Annotated[
        str | None,
        typer.Option(
            help="Name or YAML file of an environment: also print the best base pose that is "
            "feasible in it."
        ),
    ] = None,
    task_at: Annotated[
        tuple[float, float, float] | None,
        typer.Option(
            metavar="X Y YAW_DEG",
            help="With --environment: pose of the task frame in it (m, m, deg).",
            show_default="0 0 0",
        ),
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option(
            help="With --environment: name or YAML file of the robot.",
            show_default="that of the map",
        ),
    ] = None,
    located: Annotated[Path | None, options.LOCATED] = None,
    *,
    under_error: ErrorOptions,
    out: Annotated[
        Path | None,
        typer.Option(
            help="CSV file to write, with every base pose: x, y, yaw_deg, torso_height, score."
        ),
    ] = None,
    picture: Annotated[Path | None, typer.Option(help=PICTURE)] = None,
    as_json: options.Json = False,
) -> None:
    """Merge a map over the grasps of a task, and print its best base pose."""
    from tcs.capability import load_map, merge
    from tcs.capability import split as split_task

    if split and (out, picture, environment, located) != (None, None, None, None):
        raise typer.BadParameter(
            "makes no single task map; leave out --out, --picture, --environment and --located.",
            param_hint="--split",
        )
    for option, value in (("--task-at", task_at), ("--robot", robot)):
        if value is not None and environment is None:
            raise typer.BadParameter("requires --environment.", param_hint=option)
    if under_error.given and environment is None:
        raise typer.BadParameter(
            "errors and --judge require --environment.", param_hint="--environment"
        )
    if task.direction_deg % 90:
        raise typer.BadParameter("must be a multiple of 90.", param_hint="--direction-deg")
    if out is not None:
        check_writable(out, [capability])
    check_picture(picture)
    loaded = load_map(capability)
    grasps = _shape(task).task(loaded.grid.step)
    if split:
        stops = split_task(loaded, grasps, torso_height=torso_height, scale=scale)
        sequence = {"task": grasps.name, "stops": [stop.to_json() for stop in stops]}
        terminal.print_result(sequence, capability_tables.report_stops, as_json=as_json)
        return
    begun = time.perf_counter()
    task_map = merge(loaded, grasps, torso_height=torso_height, scale=scale)
    result = capability_tables.task_map_result(task_map, time.perf_counter() - begun)
    if out is not None:
        from tcs.capability import write_base_poses

        write_base_poses(out, task_map)
    if picture is not None:
        from tcs.output.view.base_poses import save_task_map

        save_task_map(picture, task_map)
    if environment is not None:
        from tcs.capability import Surroundings

        x, y, yaw_deg = task_at or (0.0, 0.0, 0.0)
        around = Surroundings.load(
            capability, loaded, environment, (x, y, math.radians(yaw_deg)), robot=robot
        )
        base, rejected = around.best(task_map)
        result |= {"best_in_environment": base.to_json(), "rejected": rejected}
        if under_error.given:
            result["success"] = under_error.judged(around, grasps, base)
    if located is not None:
        result |= _at_located(located, task_map)
    terminal.print_result(result, capability_tables.report_merged, as_json=as_json)


def _at_located(path: Path, task_map: TaskMap) -> dict[str, Any]:
    """Return the best base pose for a task whose pose has an error, and where it is."""
    from tcs.capability import best_under_error
    from tcs.perception import PlanarPose, load_located

    found = load_located(path)
    best = best_under_error(task_map, found.in_task_frame())
    target = found.pose @ PlanarPose(best.base.x, best.base.y, best.base.yaw)
    return {"best_under_error": best.to_json(), "drive_to": target.to_json()}


def _shape(task: TaskOptions) -> TaskShape:
    """Return the parameters of a task, with angles in radians."""
    from tcs.capability import TaskShape

    return TaskShape(
        shape=task.task,
        height=task.height,
        length=task.length,
        samples=task.samples,
        headings=tuple(math.radians(h) for h in task.heading_deg or (0.0, 90.0, -90.0)),
        approach=task.approach,
        pre_grasps=tuple(task.pre_grasp or ()),
        direction_deg=task.direction_deg,
        start=math.radians(task.start_deg),
        end=math.radians(task.end_deg),
    )
