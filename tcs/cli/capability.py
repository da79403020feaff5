"""The commands `tcs capability ...` and `tcs map-check`: make maps, merge them, look at them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any

import typer

from tcs.cli import capability_reports as reports
from tcs.cli import capability_work as work
from tcs.cli import options, talk
from tcs.cli.capability_setup import Setup

app = typer.Typer(
    help="Capability maps: from which base poses an end-effector pose is reached.",
    no_args_is_help=True,
)

_Map = Annotated[Path, typer.Argument(metavar="MAP", help="A capability map.")]
_Out = Annotated[Path, typer.Option(help="Map to write.")]
_Text = Annotated[
    Path | None, typer.Option(help="Also write it as text: score x y z R11 .. R33, a line each.")
]
_MapsRobot = Annotated[
    str | None,
    typer.Option(help="Name or YAML file of the robot.", show_default="the map's own"),
]
_Radius = Annotated[
    float | None,
    typer.Option(
        help="Farthest the tool may be from the shoulder, in metres; the thesis takes 0.9.",
        show_default="the arm's length",
    ),
]
_Tool = Annotated[
    str | None, typer.Option(help="Another frame of the robot as the tool.", show_default="its own")
]
_Head = Annotated[
    str | None,
    typer.Option(
        help="Name or YAML file of the head that looks on.", show_default="the robot's own"
    ),
]
_Lift = Annotated[
    float | None,
    typer.Option(help="Torso lift of the map, in metres.", show_default="the middle of its range"),
]
_Step = Annotated[float, typer.Option(help="Grid step along x, y, z, in metres.")]
_Turns = Annotated[int, typer.Option(help="Headings in a full turn; 16 are 22.5 deg apart.")]
_Grasps = Annotated[str, typer.Option(help="Tilts of the tool: side, top, side+top or all.")]
_Measure = Annotated[
    str, typer.Option(help="Dexterity measure; the default is the thesis's manipulability.")
]
_View = Annotated[
    str, typer.Option("--visibility", help="corrected, or thesis for the equations as printed.")
]
_Height = Annotated[
    float | None,
    typer.Option(
        help="Only samples whose tool is this high above the floor, to half a step, in metres."
    ),
]
_DropBad = Annotated[
    bool, typer.Option("--drop-bad", help="Leave unusable samples out instead of refusing them.")
]
_MEASURE = "inverse-condition-limited-thesis"


@app.command("from-ik")
def from_ik(
    out: _Out,
    robot: options.Robot = "tiago",
    kind: Annotated[str, typer.Option(help="IHCM, or ICM without visibility.")] = "IHCM",
    lift: _Lift = None,
    grasps: _Grasps = "side+top",
    step: _Step = 0.05,
    turns: _Turns = 16,
    radius: _Radius = None,
    tool: _Tool = None,
    measure: _Measure = _MEASURE,
    view: _View = "corrected",
    head: _Head = None,
    jobs: options.Jobs = 2,
    text: _Text = None,
    as_json: options.Json = False,
) -> None:
    """Make a map by inverse kinematics of every cell around the tool."""
    robot_setup = Setup(robot, tool, lift, step, turns, grasps, measure, head)
    with talk.progress_bar("cells") as on_progress:
        result = work.from_ik(
            robot_setup, out, text, kind=kind, radius=radius, view=view, jobs=jobs,
            on_progress=on_progress,
        )  # fmt: skip
    talk.print_result(result, reports.report_map, as_json=as_json)


@app.command()
def record(
    out: _Out,
    csv: Annotated[
        Path | None,
        typer.Argument(
            metavar="CSV",
            help="Recorded joint states: a row of joint names, then a row per sample, in radians.",
            show_default="a simulated operator records",
        ),
    ] = None,
    robot: options.Robot = "tiago",
    lift: _Lift = None,
    height: _Height = None,
    grasps: _Grasps = "side",
    step: _Step = 0.05,
    turns: _Turns = 16,
    tool: _Tool = None,
    measure: _Measure = _MEASURE,
    view: _View = "corrected",
    head: _Head = None,
    drop_bad: _DropBad = False,
    seconds: Annotated[float, typer.Option(help="Simulated: how long.")] = 3200.0,
    scale: Annotated[
        float, typer.Option(help="Simulated: metres of the slave per metre of the master.")
    ] = 7.5,
    centre: Annotated[
        tuple[float, float],
        typer.Option(metavar="X Y", help="Simulated: middle of the hand's box before the base, m."),
    ] = (0.65, 0.0),
    seed: options.Seed = 0,
    save_csv: Annotated[
        Path | None, typer.Option(help="Simulated: also write the joint states.")
    ] = None,
    text: _Text = None,
    as_json: options.Json = False,
) -> None:
    """Make a map (ITCM) from recorded joint states, or from those of a simulated operator.

    The simulated hand keeps the tool at --height, 0.41 m if none is given.
    """
    robot_setup = Setup(robot, tool, lift, step, turns, grasps, measure, head)
    hand = work.SimulatedHand(seconds, scale, centre, seed, save_csv)
    with talk.progress_bar("samples") as on_progress:
        result = work.record(
            robot_setup, out, text, csv, hand, height=height, view=view, drop_bad=drop_bad,
            on_progress=on_progress,
        )  # fmt: skip
    talk.print_result(result, reports.report_map, as_json=as_json)


@app.command("from-bag")
def from_bag(
    bags: Annotated[
        list[Path], typer.Argument(metavar="BAG...", help="ROS 1 bag files or ROS 2 bag folders.")
    ],
    out: _Out,
    topic: Annotated[
        str | None, typer.Option(help="Topic of the joint states.", show_default="any")
    ] = None,
    robot: options.Robot = "tiago",
    lift: _Lift = None,
    height: _Height = None,
    grasps: _Grasps = "side",
    step: _Step = 0.05,
    turns: _Turns = 16,
    tool: _Tool = None,
    measure: _Measure = _MEASURE,
    view: _View = "corrected",
    head: _Head = None,
    drop_bad: _DropBad = False,
    text: _Text = None,
    as_json: options.Json = False,
) -> None:
    """Make a map (ITCM) from the joint states in ROS bags; needs the extra `bags` of tcs."""
    robot_setup = Setup(robot, tool, lift, step, turns, grasps, measure, head)
    result = work.from_bags(
        robot_setup, out, text, bags, topic=topic, height=height, view=view, drop_bad=drop_bad
    )
    talk.print_result(result, reports.report_map, as_json=as_json)


@app.command("merge")
def merge_maps(
    capability: _Map,
    task: Annotated[str, typer.Option(help="pick-and-place, linear or curved.")],
    height: Annotated[float, typer.Option(help="Of the tool above the floor, in metres.")],
    length: Annotated[
        float, typer.Option(help="From the first to the last position; of an arc, its radius; m.")
    ] = 0.15,
    samples: Annotated[int, typer.Option(help="Positions along a line or an arc.")] = 3,
    heading_deg: Annotated[
        list[float] | None,
        typer.Option(help="Headings of the grasps, deg.", show_default="0, 90 and -90"),
    ] = None,
    approach: Annotated[str, typer.Option(help="side or top.")] = "side",
    pre_grasp: Annotated[
        list[float] | None, typer.Option(help="How far back a pre-grasp is, in metres.")
    ] = None,
    direction_deg: Annotated[
        int, typer.Option(help="The way a line goes: 0, 90, 180 or 270 deg.")
    ] = 90,
    start_deg: Annotated[float, typer.Option(help="Arc: the closed door, deg.")] = 0.0,
    end_deg: Annotated[float, typer.Option(help="Arc: the open door, deg.")] = 90.0,
    lift: Annotated[
        float | None,
        typer.Option(help="The only torso lift that counts.", show_default="any of the map's"),
    ] = None,
    scale: Annotated[str, typer.Option(help="Of the scores: fixed, or thesis.")] = "fixed",
    split: Annotated[
        bool, typer.Option("--split", help="As many base poses as it takes, in order.")
    ] = False,
    environment: Annotated[
        str | None,
        typer.Option(help="Name or YAML file of a room: also the best base pose that it leaves."),
    ] = None,
    task_at: Annotated[
        tuple[float, float, float],
        typer.Option(metavar="X Y YAW_DEG", help="Where the task's frame is in that room."),
    ] = (0.0, 0.0, 0.0),
    robot: _MapsRobot = None,
    out: Annotated[
        Path | None, typer.Option(help="CSV of every base pose: x, y, yaw_deg, lift, score.")
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Picture to draw: .png, .pdf, .svg, or .html to turn.")
    ] = None,
    as_json: options.Json = False,
) -> None:
    """Merge a map over the grasps of a task: where to stand for all of it."""
    asked = work.AskedTask(
        kind=task,
        height=height,
        length=length,
        samples=samples,
        headings=tuple(math.radians(h) for h in heading_deg or (0.0, 90.0, -90.0)),
        approach=approach,
        pre_grasps=tuple(pre_grasp or ()),
        direction_deg=direction_deg,
        start=math.radians(start_deg),
        end=math.radians(end_deg),
    )
    if split and (out, picture, environment) != (None, None, None):
        raise typer.BadParameter(
            "--split has no one map to write, to draw or to put into a room.", param_hint="--split"
        )
    if split:
        result = work.split(capability, asked, lift=lift, scale=scale)
        talk.print_result(result, reports.report_stops, as_json=as_json)
        return
    at = (task_at[0], task_at[1], math.radians(task_at[2]))
    room = None if environment is None else work.Room(environment, at, robot)
    result = work.merge(
        capability, asked, lift=lift, scale=scale, room=room, out=out, picture=picture
    )
    talk.print_result(result, reports.report_merged, as_json=as_json)


@app.command()
def show(
    capability: _Map,
    out: Annotated[Path, typer.Option(help="Picture to draw: .png, .pdf, .svg, or .html to turn.")],
    tilt: Annotated[int, typer.Option(min=0, help="Number of the tilt.")] = 0,
    height: Annotated[
        float | None,
        typer.Option(help="Of the tool, in metres.", show_default="where most base poses are"),
    ] = None,
    as_json: options.Json = False,
) -> None:
    """Draw a map from above: a short line for each base pose, seen from the tool."""
    result = work.show(capability, out, tilt=tilt, height=height)
    talk.print_result(result, lambda _: typer.echo(f"wrote {out}"), as_json=as_json)


def map_check(
    capability: Annotated[
        Path | None,
        typer.Argument(
            metavar="MAP",
            help="A map made by inverse kinematics.",
            show_default="one that would be made with these options",
        ),
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option(
            help="Name or YAML file of a robot.", show_default="the map's own; without MAP tiago"
        ),
    ] = None,
    lift: _Lift = None,
    grasps: Annotated[
        list[str] | None, typer.Option(help="side, top or all.", show_default="each of them")
    ] = None,
    step: _Step = 0.05,
    turns: _Turns = 16,
    radius: _Radius = None,
    tool: _Tool = None,
    queries: Annotated[int, typer.Option(min=1, help="Random tool poses of each kind.")] = 20_000,
    seed: options.Seed = 0,
    jobs: options.Jobs = 2,
    as_json: options.Json = False,
) -> None:
    """Compare a map's answers on random tool poses with inverse kinematics itself."""
    robot_setup = Setup(robot or "tiago", tool, lift, step, turns, "side", _MEASURE)
    result: dict[str, Any] = work.check(
        capability, robot_setup, tuple(grasps or ()), robot=robot, radius=radius, queries=queries,
        seed=seed, jobs=jobs,
    )  # fmt: skip
    talk.print_result(result, reports.report_check, as_json=as_json)
