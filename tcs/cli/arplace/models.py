"""The commands `tcs arplace learn` and `query`: make a model, and ask for a base position."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tcs.cli import options
from tcs.cli.arplace.drawing import PICTURE, check_outputs, draw_map
from tcs.cli.arplace.groups import GeneralisationOptions, PoseOptions, TaskOptions
from tcs.cli.options import expand_options
from tcs.errors import SelectionError
from tcs.files.writing import check_writable
from tcs.output import terminal
from tcs.output.terminal import arplace_tables

if TYPE_CHECKING:
    from tcs.capability.arplace import FloorObstacle


@expand_options
def learn(
    out: Annotated[Path, typer.Option(help="Model to write.")],
    task: TaskOptions,
    generalisation: GeneralisationOptions,
    robot: options.Robot = "tiago",
    jobs: options.Jobs = 2,
    as_json: options.Json = False,
) -> None:
    """Learn from which base positions grasps on a table are reached.

    The kernel labels every base position for every grasp; contacts with the table count. The
    defaults are the task of Appendix D of the ITCM thesis.
    """
    from tcs.capability.arplace import learn as learn_arplace
    from tcs.capability.arplace import save_arplace

    check_writable(out)
    begun = time.perf_counter()
    with terminal.progress_bar("labels") as on_progress:
        arplace = learn_arplace(
            robot, task.task(), generalisation.options(), jobs=jobs, on_progress=on_progress
        )
    seconds = time.perf_counter() - begun
    save_arplace(out, arplace)
    result = {**arplace_tables.model_result(out, arplace), "seconds": round(seconds, 3)}
    terminal.print_result(result, arplace_tables.report_learned, as_json=as_json)


Model = Annotated[Path, typer.Argument(metavar="FILE", help="A model made by `tcs arplace learn`.")]


@expand_options
def query(
    model: Model,
    pose: PoseOptions,
    located: Annotated[Path | None, options.LOCATED] = None,
    obstacle: Annotated[
        list[str] | None,
        typer.Option(
            metavar="X,Y,SIZE_X,SIZE_Y[,YAW_DEG]",
            help="A rectangle on the floor (m, deg); may be repeated.",
        ),
    ] = None,
    clearance: Annotated[
        float | None,
        typer.Option(
            help="Least distance of the base's centre from obstacles, in metres.",
            show_default="the radius of the base",
        ),
    ] = None,
    samples: Annotated[int, typer.Option(help="Random poses of the object.")] = 1000,
    seed: options.Seed = 0,
    out: Annotated[
        Path | None, typer.Option(help="Also write the map, for `tcs arplace merge`.")
    ] = None,
    picture: Annotated[Path | None, typer.Option(help=PICTURE)] = None,
    as_json: options.Json = False,
) -> None:
    """Return the base position of the greatest probability of success under pose errors."""
    from tcs.capability.arplace import load_arplace, save_probability_map
    from tcs.capability.arplace import query as query_arplace
    from tcs.perception import PlanarPose, load_located

    if clearance is not None and not obstacle:
        raise typer.BadParameter("requires --obstacle.", param_hint="--clearance")
    check_outputs(out, picture)
    obstacles = [obstacle_of(text) for text in obstacle or ()]
    arplace = load_arplace(model)
    # The first query prepares what all queries of a model share.
    at = pose.pose(arplace)
    _ = arplace.window
    table = None if located is None else load_located(located)
    found = query_arplace(
        arplace, at, pose.error(), obstacles=obstacles, clearance=clearance, samples=samples,
        seed=seed, table_covariance=None if table is None else table.in_task_frame(),
    )  # fmt: skip
    if out is not None:
        save_probability_map(out, found.map)
    if picture is not None:
        draw_map(picture, found.map, (found.x, found.y), f"success {found.success:.3f}")
    result = {"file": str(model), **found.to_json()}
    if table is not None:
        target = table.pose @ PlanarPose(found.x, found.y, found.map.base_yaw)
        result["drive_to"] = target.to_json()
    terminal.print_result(result, arplace_tables.report_query, as_json=as_json)


def obstacle_of(text: str) -> FloorObstacle:
    """Return an obstacle given as "X,Y,SIZE_X,SIZE_Y[,YAW_DEG]" [m, deg].

    Raises:
        SelectionError: If the text is not of that form, or a value is out of range.
    """
    from tcs.capability.arplace import FloorObstacle

    try:
        numbers = [float(number) for number in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (4, 5):
        raise SelectionError(
            f"--obstacle is '{text[:80]}'; must be X,Y,SIZE_X,SIZE_Y or X,Y,SIZE_X,SIZE_Y,YAW_DEG."
        )
    return FloorObstacle(*numbers[:4], *map(math.radians, numbers[4:]))
