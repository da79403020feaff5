"""Measure the pick-and-place task of the ITCM thesis on TIAGo, and compare it with the thesis.

Usage: python benchmarks/itcm_task.py [--seeds 3] [--jobs 2] [--pictures DIR]

Two positions 15 cm apart at 0.41 m, three side grasps each with a pre-grasp 5 cm before it, the
shoulder at 0.91 m, with the tool frame of the thesis and with that of the robot file. Recordings
are simulated: a long one with seed 0, and in the frame of the thesis short ones with several seeds.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
from table import cell, header, parser, record, row, save

from tcs.capability import (
    BasePose,
    CapabilityMap,
    GraspTask,
    MapGrid,
    MapVolume,
    Reach,
    TaskMap,
    map_from_ik,
    map_from_recording,
    merge,
    pick_and_place_task,
)
from tcs.capability.head import head_view
from tcs.capability.surroundings import Surroundings
from tcs.capability.visibility import visibility
from tcs.errors import SelectionError
from tcs.files.writing import make_folder
from tcs.model.robots import load_robot
from tcs.model.scene import EnvironmentFile
from tcs.output.draw import save_figure
from tcs.output.draw.capability_maps import task_figure
from tcs_studies.simulated_recording import HandMotion, simulate_recording

TORSO_HEIGHT = 0.1725
"""Torso height with the shoulder of TIAGo at 0.91 m."""
HEIGHT = 0.41
TOOL_FRAMES = {"thesis": "gripper_grasping_frame", "robot file": "gripper_tool_frame"}
"""Tool frames of TIAGo. `gripper_grasp_link` of the thesis is taken to be PAL's
`gripper_grasping_frame`, 8 cm behind the frame of the robot file."""
CAMERA = (0.136, 0.043, 0.155)
"""Position of the camera in the frame of the shoulder [m], ITCM thesis, eq. (16)."""
SHOULDER, CAMERA_FRAME = "arm_1_link", "xtion_rgb_frame"
# ITCM thesis, Listing 1: joints of the arm [rad] and torso height [m] in a message.
LISTING = (
    1.0058956265627637, -0.6668913466995965, -1.354832333675927, 0.7812407815765756,
    -0.6853028725871546, 0.591213316532442, 1.7869163059953614,
)  # fmt: skip
LISTING_TORSO_HEIGHT = 0.34834603143986886
# ITCM thesis, Table 1: the task in the frame of the robot, x, y [m] and rotation [deg].
HIGH, EXPERT, LOW = (0.75, 0.15, 0.0), (0.88, 0.20, 2.9), (0.55, -0.45, -90.0)
COLUMNS = (
    "base poses",
    "best: x, y, yaw, score",
    "best feasible with the table",
    "from it to ITCM-high, Expert [m]",
    "percentage with a lower score than ITCM-high, Expert, ITCM-low",
    "best score at yaw 0",
    "worst",
)
"""Headings of the table of task maps."""
SHORT = 400.0
"""Duration of a short recording [s]."""
# ITCM thesis, Table 3: from the recorded pose to the cell, mean (standard deviation).
TABLE_3 = {
    "x": "0.0112 (0.0078)", "y": "0.0109 (0.0079)", "z": "0.0100 (0.0070)",
    "roll": "0.0107 (0.0253)", "pitch": "0.0129 (0.0167)", "yaw": "0.0604 (0.0649)",
}  # fmt: skip


def main() -> None:
    """Make the maps, merge them and print the comparison."""
    command_line = parser(__doc__)
    command_line.add_argument("--seeds", type=int, default=3, help="of short recordings")
    command_line.add_argument("--jobs", type=int, default=2)
    command_line.add_argument("--pictures", type=Path)
    options = command_line.parse_args()
    header()
    if options.pictures is not None:
        make_folder(options.pictures)
    thesis_task(options.seeds, options.jobs, options.pictures)
    save(options)


def thesis_task(seeds: int, jobs: int, pictures: Path | None) -> None:
    """Compare the pick-and-place task of the thesis with its published base poses."""
    maps = []
    for frame, tool in TOOL_FRAMES.items():
        robot = load_robot("tiago").model_copy(update={"tool_frame": tool})
        reach = Reach(robot, torso_height=TORSO_HEIGHT)
        if not maps:
            printed(reach)
        found = itcm_maps(reach, frame, seeds if frame == "thesis" else 0)
        found["IHCM"] = map_from_ik(reach, MapGrid.of(grasps="side"), jobs=jobs)
        if frame == "thesis":
            for name in ("ITCM, long recording, seed 0", "IHCM"):
                found[f"{name}, camera of eq. (16)"] = from_printed_camera(found[name], reach)
        torso_heights(found["IHCM"], frame)
        around = Surroundings(robot, table())
        maps += [(frame, name, capability, around) for name, capability in found.items()]
    for direction, side in ((1, "left"), (3, "right")):
        print(f"\npick and place, to the {side} along the edge: x, y [m], yaw [deg] of the")
        print("base in the task frame, score:")
        rows = []
        for frame, name, capability, around in maps:
            try:
                merged = the_merge(capability, direction)
                cells = described(merged, around)
            except SelectionError:
                # No base pose of this map reaches both positions.
                cells = ("0", *["–"] * (len(COLUMNS) - 1))
            rows.append([name, frame, *cells])
            print("  " + " | ".join(rows[-1]))
        record(f"thesis_{side}", ["map", "tool frame", *COLUMNS], rows)
    if pictures is not None:
        of = {name: capability for frame, name, capability, _ in maps if frame == "thesis"}
        pair = (of["IHCM"], of["ITCM, long recording, seed 0"])
        for direction in (1, 3):
            side = "" if direction == 1 else "-right"
            figure = task_figure(*(the_merge(one, direction) for one in pair))
            save_figure(pictures / f"capability{side}.png", figure)


def itcm_maps(reach: Reach, frame: str, seeds: int) -> dict[str, CapabilityMap]:
    """Return the map of a long recording, and of short ones with several seeds, by name."""
    maps = {}
    for name, seconds, seed in (
        ("long recording, seed 0", HandMotion().seconds, 0),
        *((f"short recording, seed {seed}", SHORT, seed) for seed in range(seeds)),
    ):
        motion = HandMotion(height=HEIGHT, seconds=seconds)
        taken = time.process_time()
        simulated = simulate_recording(reach, motion, seed=seed)
        taken = time.process_time() - taken
        grid = MapGrid.of(grasps="side")
        recorded = map_from_recording(reach, grid, simulated.recording, height=HEIGHT)
        maps[f"ITCM, {name}"] = recorded.capability
        row(f"{name}, frame of the {frame}", f"{len(recorded.capability.cells):,} cells")
        for line, text in (
            ("duration [min]", f"{seconds / 60.0:.1f}"),
            ("samples", f"{len(simulated.recording.joints):,}"),
            ("cells", f"{len(recorded.capability.cells):,}"),
            (
                "stopped before a contact, or going back [%]",
                f"{100 * simulated.stopped.mean():.0f}",
            ),
            ("processor time [s]", f"{taken:.0f}"),
        ):
            row(f"  {line}", text)
            cell("recordings", f"{name}, frame of the {frame}", line, text)
        if len(maps) == 1:
            print("\nTable 3: from the recorded pose to the cell, mean (std)")
            for axis, error in recorded.error_table().items():
                here = f"{error['mean']:.4f} ({error['std']:.4f})"
                print(f"  {axis:<6} {here}")
                unit = "m" if axis in ("x", "y", "z") else "rad"
                cell("table_3", f"here, frame of the {frame}", f"{axis} [{unit}]", here)
                cell("table_3", "thesis, Table 3", f"{axis} [{unit}]", TABLE_3[axis])
    return maps


def printed(reach: Reach) -> None:
    """Compare places that the thesis prints with those of the URDF."""
    (R_AT,), (p_AT,) = reach.tool_poses(np.array([LISTING]))
    # The torso raises the arm and does not rotate it.
    raised = LISTING_TORSO_HEIGHT - reach.torso_height
    forward = reach.R_BA @ R_AT[:, 0]
    for line, print_text, text in (
        ("camera from the shoulder, eq. (16), x, y, z [m]", brief_place(CAMERA),
         brief_place(place_of(reach, CAMERA_FRAME) - place_of(reach, SHOULDER))),
        ("height of the tool in the posture of Listing 1 [m]", f"{HEIGHT:.2f}",
         f"{(reach.R_BA @ p_AT + reach.p_BA)[2] + raised:.2f}"),
        ("height of the shoulder in Listing 1 [m]", "0.91",
         f"{place_of(reach, SHOULDER)[2] + raised:.2f}"),
        ("pitch of the tool in the posture of Listing 1 [deg]", "0",
         f"{math.degrees(math.asin(forward[2])):.1f}"),
    ):  # fmt: skip
        row(line, f"{print_text}; URDF: {text}")
        cell("printed", line, "thesis", print_text)
        cell("printed", line, "URDF", text)


def place_of(reach: Reach, frame: str) -> np.ndarray:
    """Return the position of a frame of the robot in the base, head and arm at zero [m]."""
    before = reach.scene.positions()
    reach.scene.set_torso(reach.torso_height)
    pose = reach.scene.built.plant.GetFrameByName(frame).CalcPose(
        reach.scene.plant_context, reach.scene.built.base_frame
    )
    reach.scene.restore(before)
    return np.array(pose.translation())


def from_printed_camera(capability: CapabilityMap, reach: Reach) -> CapabilityMap:
    """Return a map with the visibility from the camera position of eq. (16)."""
    view = head_view(reach.scene, reach.torso_height)
    x, y, z = map(float, place_of(reach, SHOULDER) + CAMERA)
    _, p_AT = reach.tool_poses(capability.joints.astype(float))
    seen = visibility(replace(view, p_BoCo_B=(x, y, z)), p_AT @ reach.R_BA.T + reach.p_BA)
    return replace(capability, visibility=seen.astype(np.float32))


def torso_heights(ihcm: CapabilityMap, frame: str) -> None:
    """Record the best score at each torso height, of the ICM and of the IHCM."""
    for map_type in ("ICM", "IHCM"):
        for direction, side in ((1, "left"), (3, "right")):
            volume = MapVolume(ihcm.of_type(map_type), "thesis")
            found = merge(volume, the_task(direction))
            line = f"{map_type}, frame of the {frame}, place on the {side}"
            for torso_height, score in zip(found.torso_heights, found.score, strict=True):
                shoulder = torso_height + 0.91 - TORSO_HEIGHT
                reached = score[~np.isnan(score)]
                text = f"{reached.max():.3f}" if len(reached) else "–"
                row(f"{line}, {shoulder:.2f} m", text)
                cell("torso_heights", line, f"{shoulder:.2f} m", text)


def the_merge(capability: CapabilityMap, direction: int) -> TaskMap:
    """Return the task map of the thesis, in its scale and at its torso height."""
    return merge(capability, the_task(direction), scale="thesis", torso_height=TORSO_HEIGHT)


def the_task(direction: int) -> GraspTask:
    """Return the task of the thesis, its second position to the left (1) or to the right (3)."""
    return pick_and_place_task(0.15, HEIGHT, pre_grasps=(0.05,), direction=direction)


def table() -> EnvironmentFile:
    """Return the table of the thesis: 37 cm high, 75.5 cm wide, its edge 10 cm before the cup.

    With the tool frame of the thesis the gripper passes 0.9 mm above it, less than the usual margin
    of 1 mm.
    """
    axes = {
        name: {"unit": unit, "start": 0.0, "step": 0.0, "count": 1}
        for name, unit in (("base_x", "m"), ("base_y", "m"), ("base_yaw", "deg"), ("torso", "m"))
    }
    box = {"name": "table", "box": [0.6, 0.755, 0.37], "xyz": [0.2, 0.0, 0.185]}
    return EnvironmentFile(
        name="table", title="A table", origin="Under the cup", source="ITCM thesis, III.B",
        grid=axes, obstacles=[box],
        contact_margin=0.0005,
    )  # fmt: skip


def base_of(task: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return the base in the task frame, from the task in the frame of the robot; yaw [rad]."""
    x, y, yaw = task[0], task[1], math.radians(task[2])
    c, s = math.cos(yaw), math.sin(yaw)
    return -(c * x + s * y), s * x - c * y, -yaw


def described(found: TaskMap, around: Surroundings) -> tuple[str, ...]:
    """Return what the docs say about a task map, in the order of `COLUMNS`."""
    poses = found.base_poses
    best, feasible = found.best(), None
    with suppress(SelectionError):
        feasible, _ = around.best(found)
    front = poses[np.abs(poses[:, 2]) < 0.01]
    distances = [
        f"{math.hypot(feasible.x - base_of(other)[0], feasible.y - base_of(other)[1]):.2f}"
        for other in (HIGH, EXPERT)
        if feasible is not None
    ]
    ranks = [quantile(poses, base_of(other), found) for other in (HIGH, EXPERT, LOW)]
    return (
        f"{len(poses):,}",
        brief(best),
        "none" if feasible is None else brief(feasible),
        ", ".join(distances) or "–",
        ", ".join(ranks),
        f"{front[:, 4].max():.2f}" if len(front) else "none",
        brief(found.worst()),
    )


def brief_place(place: Sequence[float] | np.ndarray) -> str:
    """Return a position [m]."""
    return ", ".join(f"{value:.3f}" for value in place)


def brief(base: BasePose) -> str:
    """Return a base pose and its score."""
    yaw = math.degrees(base.yaw)
    return f"{base.x:.2f}, {base.y:.2f}, {yaw:.1f}, {base.score:.2f}"


def quantile(poses: np.ndarray, base: tuple[float, float, float], found: TaskMap) -> str:
    """Return the percentage of base poses that score less than the cell nearest to one."""
    step, yaw_step = found.grid.step, found.grid.yaw_step
    near = (np.abs(poses[:, 0] - base[0]) <= step / 2 + 1e-9) & (
        np.abs(poses[:, 1] - base[1]) <= step / 2 + 1e-9
    )
    yaw_difference = (poses[:, 2] - base[2] + math.pi) % (2 * math.pi) - math.pi
    rows = np.flatnonzero(near & (np.abs(yaw_difference) <= yaw_step / 2 + 1e-9))
    if not len(rows):
        return "not in the map"
    return f"{100.0 * (poses[:, 4] < poses[rows[0], 4]).mean():.0f}"


if __name__ == "__main__":
    main()
