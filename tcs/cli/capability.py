"""The commands `tcs capability ...` and `tcs map-check`: make, merge, draw and check maps."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tcs.cli import options
from tcs.cli.option_groups import expand_options
from tcs.files.writing import check_writable
from tcs.output import terminal
from tcs.output.terminal import capability_tables

if TYPE_CHECKING:
    from tcs.capability import CapabilityMap, MapGrid, Reach, Recording, TaskShape

app = typer.Typer(
    help="Capability maps: the base poses from which an end-effector pose is reached.",
    no_args_is_help=True,
)

_Map = Annotated[Path, typer.Argument(metavar="MAP", help="A capability map.")]
_Radius = Annotated[
    float | None,
    typer.Option(
        help="Greatest distance of the tool from the shoulder, in metres; the thesis uses 0.9.",
        show_default="the arm's length",
    ),
]
_PICTURE = "File to draw: .png, .pdf, .svg, or interactive .html."
_TORSO = ("--torso-height", "--lift")
_MEASURE = "inverse-condition-limited-thesis"


@dataclass(frozen=True, kw_only=True)
class _Grid:
    """Robot, torso height and grid of a map."""

    torso_height: Annotated[
        float | None,
        typer.Option(
            *_TORSO, help="Torso height of the map, in metres.",
            show_default="the middle of its range",
        ),
    ] = None  # fmt: skip
    step: Annotated[float, typer.Option(help="Grid step along x, y, z, in metres.")] = 0.05
    yaw_bins: Annotated[
        int,
        typer.Option(
            "--yaw-bins", "--turns", help="Number of base yaws in 360 deg; 16 are 22.5 deg apart."
        ),
    ] = 16
    tool: Annotated[
        str | None,
        typer.Option(
            help="Frame of the robot used as the tool.", show_default="that of the robot file"
        ),
    ] = None

    def grid(self, grasps: str) -> MapGrid:
        """Return the grid with the tilts of named grasps."""
        from tcs.capability import MapGrid

        return MapGrid.of(self.step, self.yaw_bins, grasps)

    def reach(self, robot: str, measure: str = _MEASURE, head: str | None = None) -> Reach:
        """Return the reachability of a robot."""
        from tcs.capability import Reach

        return Reach.load(
            robot, tool=self.tool, torso_height=self.torso_height, step=self.step,
            measure=measure, head=head,
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class _Scores:
    """Robot of a map and scores of its cells."""

    robot: options.Robot = "tiago"
    measure: Annotated[
        str,
        typer.Option(help="Dexterity measure; the default is the manipulability of the thesis."),
    ] = _MEASURE
    visibility: Annotated[
        str,
        typer.Option(help="Visibility: corrected, or thesis for the equations as printed."),
    ] = "corrected"
    head: Annotated[
        str | None,
        typer.Option(
            help="Name or YAML file of the head camera.", show_default="that of the robot"
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
class _Samples:
    """Samples of a recording that a map uses."""

    height: Annotated[
        float | None,
        typer.Option(
            help="Use only samples with the tool at this height above the floor, to half a step, "
            "in metres."
        ),
    ] = None
    grasps: Annotated[str, typer.Option(help="Tilts of the tool: side, top, side+top or all.")] = (
        "side"
    )
    drop_bad: Annotated[
        bool, typer.Option("--drop-bad", help="Leave out invalid samples instead of stopping.")
    ] = False


@dataclass(frozen=True, kw_only=True)
class _Files:
    """Files of a map."""

    out: Annotated[Path, typer.Option(help="Map to write.")]
    text: Annotated[
        Path | None,
        typer.Option(
            help="Also write the map as text, with a line score x y z R11 .. R33 for each cell."
        ),
    ] = None

    def check(self, *others: Path | None) -> None:
        """Check that the files can be written, before the map is made."""
        for path in (self.out, self.text, *others):
            if path is not None:
                check_writable(path)

    def write(self, capability: CapabilityMap) -> None:
        """Write the map."""
        from tcs.capability import export_text, save_map

        save_map(self.out, capability)
        if self.text is not None:
            export_text(self.text, capability)


@app.command("from-ik")
@expand_options
def from_ik(
    files: _Files,
    scores: _Scores,
    grid: _Grid,
    map_type: Annotated[
        str,
        typer.Option("--type", "--kind", help="Type of the map: IHCM, or ICM without visibility."),
    ] = "IHCM",
    grasps: Annotated[
        str, typer.Option(help="Tilts of the tool: side, top, side+top or all.")
    ] = "side+top",
    radius: _Radius = None,
    jobs: options.Jobs = 2,
    as_json: options.Json = False,
) -> None:
    """Make a map (IHCM or ICM) by inverse kinematics of every cell around the tool."""
    from tcs.capability import map_from_ik

    files.check()
    cells = grid.grid(grasps)
    reach = grid.reach(scores.robot, scores.measure, scores.head)
    begun = time.perf_counter()
    with terminal.progress_bar("cells") as on_progress:
        capability = map_from_ik(
            reach, cells, map_type=map_type, radius=radius, view_rule=scores.visibility, jobs=jobs,
            on_progress=on_progress,
        )  # fmt: skip
    seconds = time.perf_counter() - begun
    files.write(capability)
    result = {**capability_tables.map_result(files.out, capability), "seconds": round(seconds, 3)}
    terminal.print_result(result, capability_tables.report_map, as_json=as_json)


@app.command()
@expand_options
def record(
    files: _Files,
    scores: _Scores,
    grid: _Grid,
    samples: _Samples,
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
    ] = 3200.0,
    scale: Annotated[
        float, typer.Option(help="Simulated: metres at the arm per metre at the master.")
    ] = 7.5,
    centre: Annotated[
        tuple[float, float],
        typer.Option(
            metavar="X Y",
            help="Simulated: centre of the workspace of the hand in the base frame, in metres.",
        ),
    ] = (0.65, 0.0),
    seed: options.Seed = 0,
    save_csv: Annotated[
        Path | None, typer.Option(help="Simulated: also write the joint states to this file.")
    ] = None,
    as_json: options.Json = False,
) -> None:
    """Make a map (ITCM) from recorded joint states, or from a simulated recording.

    The simulated hand keeps the tool at --height, by default 0.41 m.
    """
    from tcs.capability import read_csv, write_csv

    files.check(save_csv)
    reach = grid.reach(scores.robot, scores.measure, scores.head)
    if csv is not None:
        recording = read_csv(csv, reach.robot, drop_bad=samples.drop_bad)
        _map_recording(reach, recording, files, scores, grid, samples, {}, as_json=as_json)
        return
    from tcs.teleop.simulated_recording import HandMotion, simulate_recording

    height = 0.41 if samples.height is None else samples.height
    motion = HandMotion(height=height, seconds=seconds, scale=scale, centre=centre)
    with terminal.progress_bar("samples") as on_progress:
        simulated = simulate_recording(reach, motion, seed=seed, on_progress=on_progress)
    if save_csv is not None:
        write_csv(save_csv, reach.robot, simulated.recording)
    more = {"seed": seed, "stopped": float(simulated.stopped.mean())}
    samples = _Samples(height=height, grasps=samples.grasps)
    _map_recording(reach, simulated.recording, files, scores, grid, samples, more, as_json=as_json)


@app.command("from-bag")
@expand_options
def from_bag(
    bags: Annotated[
        list[Path], typer.Argument(metavar="BAG...", help="ROS 1 bag files or ROS 2 bag folders.")
    ],
    files: _Files,
    scores: _Scores,
    grid: _Grid,
    samples: _Samples,
    topic: Annotated[
        str | None, typer.Option(help="Topic of the joint states.", show_default="any")
    ] = None,
    as_json: options.Json = False,
) -> None:
    """Make a map (ITCM) from the joint states in ROS bags; requires the extra `bags` of tcs."""
    from tcs.capability.bags import read_bags

    files.check()
    reach = grid.reach(scores.robot, scores.measure, scores.head)
    recording = read_bags(bags, reach.robot, topic=topic, drop_bad=samples.drop_bad)
    _map_recording(reach, recording, files, scores, grid, samples, {}, as_json=as_json)


def _map_recording(
    reach: Reach, recording: Recording, files: _Files, scores: _Scores, grid: _Grid,
    samples: _Samples, more: dict[str, float], *, as_json: bool,
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


@dataclass(frozen=True, kw_only=True)
class _Task:
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


@app.command("merge")
@expand_options
def merge_maps(
    capability: _Map,
    task: _Task,
    torso_height: Annotated[
        float | None,
        typer.Option(
            *_TORSO, help="Use only this torso height, in metres.", show_default="any of the map"
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
        tuple[float, float, float],
        typer.Option(
            metavar="X Y YAW_DEG", help="Pose of the task frame in the environment (m, m, deg)."
        ),
    ] = (0.0, 0.0, 0.0),
    robot: Annotated[
        str | None,
        typer.Option(help="Name or YAML file of the robot.", show_default="that of the map"),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="CSV file to write, with every base pose: x, y, yaw_deg, torso_height, score."
        ),
    ] = None,
    picture: Annotated[Path | None, typer.Option(help=_PICTURE)] = None,
    as_json: options.Json = False,
) -> None:
    """Merge a map over the grasps of a task, and print its best base pose."""
    from tcs.capability import Surroundings, load_map, merge, write_base_poses
    from tcs.capability import split as split_task

    if split and (out, picture, environment) != (None, None, None):
        raise typer.BadParameter(
            "makes no single task map; leave out --out, --picture and --environment.",
            param_hint="--split",
        )
    if task.direction_deg % 90:
        raise typer.BadParameter("must be a multiple of 90.", param_hint="--direction-deg")
    if out is not None:
        check_writable(out)
    _check_picture(picture)
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
        write_base_poses(out, task_map)
    if picture is not None:
        from tcs.output.view.base_poses import save_task_map

        save_task_map(picture, task_map)
    if environment is not None:
        x, y, yaw_deg = task_at
        around = Surroundings.load(
            capability, loaded, environment, (x, y, math.radians(yaw_deg)), robot=robot
        )
        base, rejected = around.best(task_map)
        result |= {"best_in_environment": base.to_json(), "rejected": rejected}
    terminal.print_result(result, capability_tables.report_merged, as_json=as_json)


def _shape(task: _Task) -> TaskShape:
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


@app.command()
def show(
    capability: _Map,
    out: Annotated[Path, typer.Option(help=_PICTURE)],
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
    """Draw a map from above: a short line for each base pose, relative to the tool."""
    from tcs.capability import load_map
    from tcs.output.view.base_poses import save_map_layer

    _check_picture(out)
    save_map_layer(out, load_map(capability), tilt=tilt, height=height)
    terminal.print_result({"file": str(out)}, lambda _: typer.echo(f"wrote {out}"), as_json=as_json)


def _check_picture(path: Path | None) -> None:
    """Check that a picture can be written there, before the result is computed."""
    if path is None:
        return
    if path.suffix != ".html":
        from tcs.output.draw import check_format

        check_format(path)
    check_writable(path)


@expand_options
def map_check(
    grid: _Grid,
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
    radius: _Radius = None,
    queries: Annotated[
        int, typer.Option(min=1, help="Random tool poses for each set of grasps.")
    ] = 20_000,
    seed: options.Seed = 0,
    jobs: options.Jobs = 2,
    as_json: options.Json = False,
) -> None:
    """Compare a capability map with inverse kinematics at random tool poses."""
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
