"""The commands `tcs capability from-ik`, `record` and `from-bag`: make a map."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tcs.cli import options
from tcs.cli.capability.groups import (
    FileOptions,
    GridOptions,
    Radius,
    SampleOptions,
    ScoreOptions,
)
from tcs.cli.options import expand_options
from tcs.output import terminal
from tcs.output.terminal import capability_tables

if TYPE_CHECKING:
    from tcs.capability import Reach, Recording

_SIMULATED = (3197.0, 7.5, (0.65, 0.0))
"""Length [s], scale and centre [m] of a simulated recording."""


@expand_options
def from_ik(
    files: FileOptions,
    scores: ScoreOptions,
    grid: GridOptions,
    map_type: Annotated[
        str,
        typer.Option("--type", "--kind", help="Type of the map: IHCM, or ICM without visibility."),
    ] = "IHCM",
    grasps: Annotated[
        str, typer.Option(help="Tilts of the tool: side, top, side+top or all.")
    ] = "side+top",
    radius: Radius = None,
    blocks: options.Blocks = None,
    restart: options.Restart = False,
    jobs: options.Jobs = 2,
    as_json: options.Json = False,
) -> None:
    """Make a map (IHCM or ICM) by inverse kinematics of every cell around the tool."""
    from tcs.capability import map_from_ik

    kept = options.block_folder(blocks, restart)
    files.check()
    cells = grid.grid(grasps)
    reach = grid.reach(scores.robot, scores.measure, scores.head)
    begun = time.perf_counter()
    with terminal.progress_bar("cells") as on_progress:
        capability = map_from_ik(
            reach, cells, map_type=map_type, radius=radius, view_rule=scores.visibility, jobs=jobs,
            blocks=kept, on_progress=on_progress,
        )  # fmt: skip
    seconds = time.perf_counter() - begun
    files.write(capability)
    result = {**capability_tables.map_result(files.out, capability), "seconds": round(seconds, 3)}
    terminal.print_result(result, capability_tables.report_map, as_json=as_json)


@expand_options
def record(
    files: FileOptions,
    scores: ScoreOptions,
    grid: GridOptions,
    samples: SampleOptions,
    csv: Annotated[
        Path | None,
        typer.Argument(
            metavar="CSV",
            help="Recorded joint states: a row of joint names, then a row per sample [rad].",
            show_default="a simulated recording",
        ),
    ] = None,
    seconds: Annotated[
        float, typer.Option(help="Simulated: length of the recording, in seconds.")
    ] = _SIMULATED[0],
    scale: Annotated[
        float, typer.Option(help="Simulated: metres at the arm per metre at the master.")
    ] = _SIMULATED[1],
    centre: Annotated[
        tuple[float, float],
        typer.Option(
            metavar="X Y",
            help="Simulated: centre of the workspace of the hand in the base frame, in metres.",
        ),
    ] = _SIMULATED[2],
    seed: options.Seed = 0,
    save_csv: Annotated[
        Path | None, typer.Option(help="Simulated: also write the joint states to this file.")
    ] = None,
    as_json: options.Json = False,
) -> None:
    """Make a map (ITCM) from recorded joint states, or from a simulated recording.

    The simulated hand keeps the tool at --height, by default 0.41 m.
    """
    if csv is not None and (save_csv, seconds, scale, centre) != (None, *_SIMULATED):
        raise typer.BadParameter(
            "--seconds, --scale, --centre and --save-csv belong to a simulated recording; leave "
            "them out.",
            param_hint="CSV",
        )
    from tcs.capability import read_csv, write_csv

    files.check(save_csv, inputs=[] if csv is None else [csv])
    reach = grid.reach(scores.robot, scores.measure, scores.head)
    if csv is not None:
        recording = read_csv(csv, reach.robot, drop_bad=samples.drop_bad)
        _map_recording(reach, recording, files, scores, grid, samples, {}, as_json=as_json)
        return
    from tcs_studies.simulated_recording import HandMotion, simulate_recording

    height = 0.41 if samples.height is None else samples.height
    motion = HandMotion(height=height, seconds=seconds, scale=scale, centre=centre)
    with terminal.progress_bar("samples") as on_progress:
        simulated = simulate_recording(reach, motion, seed=seed, on_progress=on_progress)
    if save_csv is not None:
        write_csv(save_csv, reach.robot, simulated.recording)
    more = {"seed": seed, "stopped": float(simulated.stopped.mean())}
    samples = SampleOptions(height=height, grasps=samples.grasps)
    _map_recording(reach, simulated.recording, files, scores, grid, samples, more, as_json=as_json)


@expand_options
def from_bag(
    bags: Annotated[
        list[Path], typer.Argument(metavar="BAG...", help="ROS 1 bag files or ROS 2 bag folders.")
    ],
    files: FileOptions,
    scores: ScoreOptions,
    grid: GridOptions,
    samples: SampleOptions,
    topic: Annotated[
        str | None, typer.Option(help="Topic of the joint states.", show_default="any")
    ] = None,
    as_json: options.Json = False,
) -> None:
    """Make a map (ITCM) from the joint states in ROS bags; requires the extra `bags` of tcs."""
    from tcs.capability.bags import read_bags

    files.check(inputs=bags)
    reach = grid.reach(scores.robot, scores.measure, scores.head)
    recording = read_bags(bags, reach.robot, topic=topic, drop_bad=samples.drop_bad)
    _map_recording(reach, recording, files, scores, grid, samples, {}, as_json=as_json)


def _map_recording(
    reach: Reach, recording: Recording, files: FileOptions, scores: ScoreOptions, grid: GridOptions,
    samples: SampleOptions, more: dict[str, float], *, as_json: bool,
) -> None:  # fmt: skip
    """Make the map of a recording, write it and print a summary."""
    from tcs.capability import map_from_recording

    recorded = map_from_recording(
        reach, grid.grid(samples.grasps), recording, height=samples.height,
        view_rule=scores.visibility,
    )  # fmt: skip
    files.write(recorded.capability)
    result = {
        **capability_tables.map_result(files.out, recorded.capability),
        "dropped": recording.dropped,
        **recorded.to_json(),
        **more,
    }
    terminal.print_result(result, capability_tables.report_map, as_json=as_json)
