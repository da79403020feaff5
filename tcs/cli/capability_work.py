"""What the commands on capability maps do: load, call the library, write, and tell."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from tcs.cli.capability_setup import Setup, robot_of
from tcs.errors import StoreError, UnknownNameError

if TYPE_CHECKING:
    from tcs.capability import CapabilityMap, GraspTask, MapGrid, Reach, Recording, TaskMap
    from tcs.capability.from_recording import Recorded

TASKS = ("pick-and-place", "linear", "curved")


@dataclass(frozen=True, slots=True)
class SimulatedHand:
    """What a simulated operator is told."""

    seconds: float
    scale: float
    centre: tuple[float, float]
    seed: int
    save_csv: Path | None


@dataclass(frozen=True, slots=True, kw_only=True)
class AskedTask:
    """A task as the command line gives it."""

    kind: str
    height: float
    length: float
    samples: int
    headings: tuple[float, ...]
    approach: str
    pre_grasps: tuple[float, ...]
    direction_deg: int
    start: float
    end: float

    def task(self, step: float) -> GraspTask:
        """Return the task on a grid of some step [m].

        Raises:
            UnknownNameError: If there is no such task.
            TaskError: If it has nothing to do.
        """
        from tcs.capability import curved_task, linear_task, pick_and_place_task

        if self.kind not in TASKS:
            raise UnknownNameError("task", self.kind, TASKS)
        if self.direction_deg % 90:
            raise typer.BadParameter("must be a multiple of 90.", param_hint="--direction-deg")
        if self.kind == "curved":
            return curved_task(
                self.length, self.start, self.end, self.samples, self.height,
                pre_grasps=self.pre_grasps, step=step,
            )  # fmt: skip
        options: dict[str, Any] = {
            "headings": self.headings,
            "approach": self.approach,
            "pre_grasps": self.pre_grasps,
            "direction": self.direction_deg // 90,
            "step": step,
        }
        if self.kind == "linear":
            return linear_task(self.length, self.samples, self.height, **options)
        return pick_and_place_task(self.length, self.height, **options)


@dataclass(frozen=True, slots=True)
class Room:
    """A room with the task in it."""

    environment: str
    at: tuple[float, float, float]
    """Where the task frame is in W: x, y [m] and heading [rad]."""
    robot: str | None
    """Name or file of the robot; None is the one that the map remembers."""


def from_ik(
    setup: Setup,
    out: Path,
    text: Path | None,
    *,
    kind: str,
    radius: float | None,
    view: str,
    jobs: int,
    on_progress: Callable[[int, int], None],
) -> dict[str, Any]:
    """Make a map by inverse kinematics and write it."""
    from tcs.capability import map_from_ik
    from tcs.capability.map import ICM, IHCM

    if kind not in (ICM, IHCM):
        raise UnknownNameError("kind of map", kind, (ICM, IHCM))
    _check_outputs(out, text)
    grid, reach = setup.grid(), setup.reach()
    begun = time.perf_counter()
    found = map_from_ik(
        reach, grid, kind=kind, radius=radius, view_rule=view, jobs=jobs, on_progress=on_progress
    )
    seconds = time.perf_counter() - begun
    return {**_written(found, out, text), "seconds": round(seconds, 3)}


def record(
    setup: Setup,
    out: Path,
    text: Path | None,
    csv: Path | None,
    hand: SimulatedHand,
    *,
    height: float | None,
    view: str,
    drop_bad: bool,
    on_progress: Callable[[int, int], None],
) -> dict[str, Any]:
    """Make a map of a CSV file or of a simulated recording, and write it."""
    from tcs.capability import read_csv, write_csv
    from tcs.teleop.simulated_recording import HandMotion, simulate_recording

    _check_outputs(out, text, hand.save_csv)
    grid, reach = setup.grid(), setup.reach()
    if csv is not None:
        recording = read_csv(csv, reach.robot, drop_bad=drop_bad)
        return _of_recording(reach, grid, recording, out, text, height, view)
    height = 0.41 if height is None else height
    motion = HandMotion(height=height, seconds=hand.seconds, scale=hand.scale, centre=hand.centre)
    simulated = simulate_recording(reach, motion, seed=hand.seed, on_progress=on_progress)
    if hand.save_csv is not None:
        write_csv(hand.save_csv, reach.robot, simulated.recording)
    result = _of_recording(reach, grid, simulated.recording, out, text, height, view)
    return {**result, "seed": hand.seed, "stopped": float(simulated.stopped.mean())}


def from_bags(
    setup: Setup,
    out: Path,
    text: Path | None,
    bags: list[Path],
    *,
    topic: str | None,
    height: float | None,
    view: str,
    drop_bad: bool,
) -> dict[str, Any]:
    """Make a map of ROS bags and write it."""
    from tcs.capability.bags import read_bags

    _check_outputs(out, text)
    grid, reach = setup.grid(), setup.reach()
    recording = read_bags(bags, reach.robot, topic=topic, drop_bad=drop_bad)
    return _of_recording(reach, grid, recording, out, text, height, view)


def merge(
    path: Path,
    asked: AskedTask,
    *,
    lift: float | None,
    scale: str,
    room: Room | None,
    out: Path | None,
    picture: Path | None,
) -> dict[str, Any]:
    """Merge a map over a task, and write or draw the result."""
    from tcs.capability import load_map
    from tcs.capability import merge as merged

    _check_outputs(out)
    _check_picture(picture)
    capability = load_map(path)
    task = asked.task(capability.grid.step)
    begun = time.perf_counter()
    found = merged(capability, task, lift=lift, scale=scale)
    seconds = time.perf_counter() - begun
    if out is not None:
        import numpy as np

        from tcs.files.writing import whole_file

        poses = found.base_poses.copy()
        poses[:, 2] = np.degrees(poses[:, 2])
        with whole_file(out, "Table") as stream:
            header = "x,y,yaw_deg,lift,score"
            np.savetxt(stream, poses, fmt="%.9g", delimiter=",", header=header, comments="")
    if picture is not None and picture.suffix == ".html":
        from tcs.output.view.base_poses import task_page

        task_page(picture, found)
    elif picture is not None:
        from tcs.output.draw import save_figure
        from tcs.output.draw.capability_maps import task_figure

        save_figure(picture, task_figure(found))
    left = {} if room is None else _left_by(path, room, capability, found)
    return {
        **left,
        "map": found.name,
        "task": task.name,
        "positions": [[p.x, p.y, p.height] for p in task.positions],
        "base_poses": len(found.base_poses),
        "best": found.best().to_json(),
        "worst": found.worst().to_json(),
        "off_cell_m": found.nearness.offset,
        "off_cell_rad": found.nearness.turn,
        "seconds": seconds,
    }


def split(path: Path, asked: AskedTask, *, lift: float | None, scale: str) -> dict[str, Any]:
    """Return the fewest base poses that reach a task's positions in order."""
    from tcs.capability import load_map
    from tcs.capability import split as split_task

    capability = load_map(path)
    task = asked.task(capability.grid.step)
    stops = split_task(capability, task, lift=lift, scale=scale)
    return {"task": task.name, "stops": [stop.to_json() for stop in stops]}


def show(path: Path, out: Path, *, tilt: int, height: float | None) -> dict[str, Any]:
    """Draw one layer of a map."""
    from tcs.capability import load_map

    _check_picture(out)
    capability = load_map(path)
    tilts = capability.grid.tilts
    if tilt >= len(tilts):
        raise UnknownNameError("tilt", str(tilt), map(str, range(len(tilts))), where=str(path))
    if out.suffix == ".html":
        import numpy as np

        from tcs.output.draw.capability_maps import layer
        from tcs.output.view.base_poses import write_page

        poses, shown = layer(capability, tilt=tilt, height=height)
        tools = [(capability.grid.R_ET[tilt], np.array([0.0, 0.0, shown]))]
        write_page(out, poses, length=0.42 * capability.grid.step, tools=tools)
    else:
        from tcs.output.draw import save_figure
        from tcs.output.draw.capability_maps import map_figure

        save_figure(out, map_figure(capability, tilt=tilt, height=height))
    return {"file": str(out)}


def check(
    path: Path | None, setup: Setup, grasps: tuple[str, ...], *, robot: str | None,
    radius: float | None, queries: int, seed: int, jobs: int,
) -> dict[str, Any]:  # fmt: skip
    """Compare a map, or one that is yet to be made, with inverse kinematics.

    The robot of a map is the one that it remembers, unless `robot` names one.
    """
    from dataclasses import replace

    from tcs.capability import MapGrid, check_map, check_stored, load_map
    from tcs.capability.map import ITCM

    rows: dict[str, Any] = {}
    options = {"queries": queries, "seed": seed, "jobs": jobs}
    if path is None:
        reach = setup.reach()
        for name in grasps or ("side", "top", "all"):
            grid = MapGrid.of(setup.step, setup.turns, name)
            rows[name] = check_map(reach, grid, name, radius=radius, **options).to_json()
        return {"map": None, "step": setup.step, "turns": setup.turns, "grasps": rows}
    capability = load_map(path)
    if capability.kind == ITCM or "measure" not in capability.metadata:
        raise StoreError(
            f"Capability map '{path}' holds what was recorded or imported, not all that inverse "
            "kinematics reaches. Check one made by `tcs capability from-ik`."
        )
    made = replace(
        setup, robot=robot_of(path, capability, robot), tool=str(capability.metadata["tool"]),
        lift=capability.lift, step=capability.grid.step,
    )  # fmt: skip
    reach = made.reach()
    digest = capability.metadata.get("scene_digest")
    if digest != reach.lowered.digest():
        raise StoreError(
            f"Capability map '{path}' was made from another model of robot "
            f"'{made.robot}' than the one installed now. Make it again."
        )
    held = {"side": (0, 0), "top": (capability.grid.turns // 4, 0)}
    names = grasps or tuple(name for name, tilt in held.items() if tilt in capability.grid.tilts)
    for name in names:
        rows[name] = check_stored(reach, capability, name, **options).to_json()
    shown = {"step": capability.grid.step, "turns": capability.grid.turns}
    return {"map": str(path), **shown, "grasps": rows}


def _left_by(path: Path, room: Room, capability: CapabilityMap, found: TaskMap) -> dict[str, Any]:
    """Return the best base pose that a room leaves, and how many better ones it takes away."""
    from tcs.capability.surroundings import Surroundings
    from tcs.model.robots import load_robot
    from tcs.model.scene import load_environment

    robot = load_robot(robot_of(path, capability, room.robot))
    robot = robot.model_copy(update={"tool_frame": str(capability.metadata["tool"])})
    around = Surroundings(robot, load_environment(room.environment), room.at)
    base, taken = around.best(found)
    return {"left": base.to_json(), "taken": taken}


def _of_recording(
    reach: Reach, grid: MapGrid, recording: Recording, out: Path, text: Path | None,
    height: float | None, view: str,
) -> dict[str, Any]:  # fmt: skip
    from tcs.capability import map_from_recording

    found: Recorded = map_from_recording(reach, grid, recording, height=height, view_rule=view)
    return {
        **_written(found.capability, out, text),
        "dropped": recording.dropped,
        **found.to_json(),
    }


def _written(capability: CapabilityMap, out: Path, text: Path | None) -> dict[str, Any]:
    from tcs.capability import export_text, save_map

    save_map(out, capability)
    if text is not None:
        export_text(text, capability)
    return {
        "file": str(out),
        "kind": capability.kind,
        "robot": capability.metadata["robot"],
        "cells": len(capability.cells),
        "cells_asked": capability.metadata.get("cells_asked"),
        "lift": capability.lift,
        "manipulability_scale": capability.manipulability_scale,
    }


def _check_outputs(*paths: Path | None) -> None:
    from tcs.cli.places import check_writable

    for path in paths:
        if path is not None:
            check_writable(path)


def _check_picture(path: Path | None) -> None:
    if path is None:
        return
    if path.suffix != ".html":
        from tcs.output.draw import check_format

        check_format(path)
    _check_outputs(path)
