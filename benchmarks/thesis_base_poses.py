"""Compare base poses of the ITCM thesis with ours, under errors of the base and of the task.

Usage: python benchmarks/thesis_base_poses.py [--samples 500] [--seed 0] [--jobs 2]

The task is pick and place of the thesis, with its tool frame and its table. The base poses are
Expert, ITCM-high and ITCM-low of the thesis; the best of a map made by inverse kinematics; and
those that TCS selects by P_R + P_M, and by success under an error of the object's position. The
kernel judges all of them on the same displacements of base and tool poses.
"""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

import yaml
from arplace import OBJECT
from itcm_task import (
    EXPERT,
    HEIGHT,
    HIGH,
    LOW,
    TOOL_FRAMES,
    TORSO_HEIGHT,
    base_of,
    table,
    the_merge,
    the_task,
)
from table import header, parser, record, row, save

from tcs.capability import (
    BasePose,
    GraspTask,
    MapGrid,
    PoseErrors,
    Reach,
    Surroundings,
    map_from_ik,
    success_under_error,
)
from tcs.errors import SelectionError
from tcs.files.paths import data_folder
from tcs.model.grid import Grid, InitialConfiguration
from tcs.model.robots import load_robot
from tcs.model.scene import ErrorDistribution
from tcs.placement.robustness import robustify
from tcs.placement.scoring import score

ROBOT, TOOL = "tiago", TOOL_FRAMES["thesis"]
ERRORS = {
    "none": PoseErrors(),
    "base 2.5 cm, 2.5 deg": PoseErrors(base_position=0.025, base_yaw=math.radians(2.5)),
    "task 2.5 cm, 2.5 deg": PoseErrors(task_position=0.025, task_yaw=math.radians(2.5)),
    "both": PoseErrors(
        base_position=0.025, base_yaw=math.radians(2.5),
        task_position=0.025, task_yaw=math.radians(2.5),
    ),
    "both, twice as large": PoseErrors(
        base_position=0.05, base_yaw=math.radians(5.0),
        task_position=0.05, task_yaw=math.radians(5.0),
    ),
}  # fmt: skip
"""Standard deviations of x, of y and of the yaw."""
GRID = {
    "base_x": {"unit": "m", "start": -1.2, "step": 0.05, "count": 25},
    "base_y": {"unit": "m", "start": -0.9, "step": 0.05, "count": 37},
    "base_yaw": {"unit": "deg", "start": 0.0, "step": 22.5, "count": 16},
    "torso": {"unit": "m", "start": TORSO_HEIGHT, "step": 0.0, "count": 1},
}
"""Base poses that TCS scores: the spacing of the maps."""


def main() -> None:
    """Judge every base pose with every error and print the table."""
    command_line = parser(__doc__)
    command_line.add_argument("--samples", type=int, default=500)
    command_line.add_argument("--seed", type=int, default=0)
    command_line.add_argument("--jobs", type=int, default=2)
    options = command_line.parse_args()
    header()
    robot = load_robot(ROBOT).model_copy(update={"tool_frame": TOOL})
    around = Surroundings(robot, table())
    reach = Reach(robot, torso_height=TORSO_HEIGHT)
    ihcm = map_from_ik(reach, MapGrid.of(grasps="side"), jobs=options.jobs)
    rows = []
    for direction, side in ((1, "left"), (3, "right")):
        task = the_task(direction)
        bases = {
            name: BasePose(*base_of(pose), TORSO_HEIGHT, 0.0)
            for name, pose in (("Expert", EXPERT), ("ITCM-high", HIGH), ("ITCM-low", LOW))
        }
        bases["Expert, torso lowered"] = BasePose(*base_of(EXPERT), 0.0, 0.0)
        try:
            bases["IHCM, best feasible"], _ = around.best(the_merge(ihcm, direction))
        except SelectionError as error:
            row(f"IHCM, {side}", str(error))
        bases |= tcs_choices(task, options.jobs)
        for name, base in bases.items():
            cells = [side, name, f"{base.x:.2f}, {base.y:.2f}, {math.degrees(base.yaw):.1f}"]
            for errors in ERRORS.values():
                count = options.samples if errors != PoseErrors() else 1
                found = success_under_error(
                    around, task, base, errors, samples=count, seed=options.seed
                )
                cells.append(f"{100 * found.complete:.0f} ({100 * found.positions:.0f})")
            rows.append(cells)
            row(f"{side}, {name}", ", ".join(cells[2:]))
    record("success", ["place", "base pose", "x, y [m], yaw [deg]", *ERRORS], rows)
    save(options)


def tcs_choices(task: GraspTask, jobs: int) -> dict[str, BasePose]:
    """Return the base poses of the greatest P_R + P_M and of the greatest success under error.

    Every grasp and pre-grasp is a goal. The error of the object's x and y is 2.5 cm.
    """
    normal = ErrorDistribution(distribution="normal", std=0.025)
    with tempfile.TemporaryDirectory() as name:
        paths = written(task, Path(name))
        file = score(*paths, max_members=1, jobs=jobs, paper=True)
        file = robustify(file, errors={"object_x": normal, "object_y": normal}, jobs=jobs)
    grid, success = Grid.from_dict(file.grid), file.nominal.success
    (best,) = file.nominal.sets.best
    robust = int(success.members[int(success.low.argmax()), 0])
    return {
        "TCS, P_R + P_M": base_pose(grid.configuration(best)),
        "TCS, success under error": base_pose(grid.configuration(robust)),
    }


def written(task: GraspTask, folder: Path) -> tuple[Path, Path, Path]:
    """Write task, environment and robot files of a grasp task, and return their paths."""
    named = {"title": "Pick and place", "source": "ITCM thesis, III"}
    goals = [
        {
            "body_frame": "object",
            "position": [float(one.x - back * R[0, 0]), float(one.y - back * R[1, 0]), 0.0],
            "quaternion_wxyz": [math.cos(grasp.heading / 2), 0.0, 0.0, math.sin(grasp.heading / 2)],
            "weight": 1,
        }
        for one in task.positions
        for grasp in one.grasps
        for R in (grasp.R_FT,)
        for back in (0.0, *grasp.pre_grasps)
    ]
    around = table()
    environment = {
        **named,
        "name": "thesis_table",
        "origin": around.origin,
        "models": [{"name": "object", "file": "object.sdf", "xyz": [0.0, 0.0, HEIGHT]}],
        "obstacles": [
            {"name": one.name, "box": list(one.box), "xyz": list(one.xyz)}
            for one in around.obstacles
        ],
        "body_frames": {"object": "object::grasp"},
        "contact_margin": around.contact_margin,
        "grid": GRID,
    }
    robot = data_folder() / "models" / "robots" / f"{ROBOT}.yaml"
    text = robot.read_text(encoding="utf-8")
    named_tool = f"tool_frame: {TOOL_FRAMES['robot file']}\n"
    if named_tool not in text:
        raise SystemExit(f"{robot} does not have '{named_tool.strip()}'.")
    shapes = f"{ROBOT}_primitives.csv"
    contents = {
        shapes: robot.with_name(shapes).read_text(encoding="utf-8"),
        "pick.yaml": yaml.safe_dump(
            {
                **named,
                "name": "pick",
                "environments": ["thesis_table"],
                "tool": TOOL,
                "goals": goals,
            }
        ),
        "table.yaml": yaml.safe_dump(environment),
        "robot.yaml": text.replace(named_tool, f"tool_frame: {TOOL}\n"),
        "object.sdf": OBJECT,
    }
    for name, content in contents.items():
        (folder / name).write_text(content, encoding="utf-8")
    return folder / "pick.yaml", folder / "table.yaml", folder / "robot.yaml"


def base_pose(at: InitialConfiguration) -> BasePose:
    """Return a configuration as a base pose of a map."""
    return BasePose(at.base_x, at.base_y, at.base_yaw, at.torso, 0.0)


if __name__ == "__main__":
    main()
