"""Draft a robot file from every URDF of example-robot-data that has an arm, and score with it.

Usage: python benchmarks/drafting.py [--robots ur10,z1] [--coarse] [--jobs 2] [--limit 900]

Each robot is drafted by `tcs robot new`, checked by `tcs robot check` and scored at goals around
its reach, each in a process of its own that ends at the limit [s]. What is not supported ends in
one line of the command.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from table import header, parser, record, row, save

DATA = "package://example-robot-data/robots"
ROBOTS = {
    "xarm7": ("xarm_description/urdf/xarm7.urdf", "link_eef"),
    "ur10": ("ur_description/urdf/ur10_robot.urdf", "ee_link"),
    "ur3": ("ur_description/urdf/ur3_robot.urdf", "ee_link"),
    "jaco": ("kinova_description/robots/kinova.urdf", "j2s6s200_end_effector"),
    "panda": ("panda_description/urdf/panda.urdf", "panda_hand_tcp"),
    "z1": ("z1_description/urdf/z1.urdf", "gripperStator"),
    "so101": ("so_arm_description/urdf/so101.urdf", "gripper_frame_link"),
    "so100": ("so_arm_description/urdf/so100.urdf", "gripper"),
    "talos": ("talos_data/robots/talos_full_v2.urdf", "gripper_left_base_link"),
    "romeo": ("romeo_description/urdf/romeo.urdf", "l_wrist"),
    "tiago_dual": ("tiago_description/robots/tiago_dual.urdf", "arm_left_tool_link"),
    "tiago_pro": ("tiago_pro_description/robots/tiago_pro.urdf", "gripper_left_base_link"),
    "centauro": ("centauro_description/urdf/centauro.urdf", "arm1_8"),
    "icub": ("icub_description/robots/icub.urdf", "l_hand_dh_frame"),
    "g1": ("g1_description/urdf/g1_29dof_with_hand_rev_1_0.urdf", "left_hand_palm_link"),
    "b1_z1": ("b1_description/urdf/b1-z1.urdf", "gripperStator"),
    "anymal_kinova": (
        "anymal_b_simple_description/robots/anymal-kinova.urdf",
        "j2s6s200_end_effector",
    ),
    "alex": ("alex_description/urdf/alex_nub_hands.urdf", "leftNub"),
    "human": ("human_description/robots/human.urdf", "left_hand"),
    "simple_humanoid": ("simple_humanoid_description/urdf/simple_humanoid.urdf", "l_wrist"),
    "hextilt": ("hextilt_description/urdf/hextilt_flying_arm_5.urdf", "flying_arm_5__gripper"),
    "two_dofs": ("asr_twodof_description/urdf/TwoDofs.urdf", "Tip"),
}
"""Path of the URDF and tool link of each robot; quadrupeds and quadrotors have no arm."""

ENVIRONMENT = """\
name: board
title: Goals around a board
origin: on the floor
source: made up
obstacles: [{name: board, box: [0.3, 0.6, 0.03], xyz: [0, 0, 0.4]}]
body_frames: {room: world}
grid:
  base_x: {unit: m, start: -1.2, step: 0.2, count: 7}
  base_y: {unit: m, start: -0.6, step: 0.2, count: 7}
  base_yaw: {unit: deg, start: 0, step: 45, count: 8}
  torso: {unit: m, start: 0, step: 0.1, count: 3}
"""
HEIGHTS = (0.2, 0.6, 0.9, 1.2)
COLUMNS = ("robot", "drafted in [s]", "shapes", "check", "pairs reached", "what is said")


@dataclass(frozen=True)
class Run:
    """What a command did: its exit code, output, last line of messages, and time [s]."""

    code: int | None
    output: str
    message: str
    seconds: float


def main() -> int:
    """Draft, check and score every robot."""
    options = parse()
    header()
    rows = []
    for name in options.robots.split(","):
        rows.append((name, *outcome(name, options)))
        row(name, ", ".join(text for text in rows[-1][1:] if text))
        # After each robot: an interrupted run keeps what it has.
        record("coarse" if options.coarse else "robots", COLUMNS, rows)
        save(options)
    return 0


def parse():
    """Return the options."""
    found = parser(__doc__ or "")
    found.add_argument("--robots", default=",".join(ROBOTS), help="names, separated by commas")
    found.add_argument("--coarse", action="store_true", help="draft with few shapes")
    found.add_argument("--jobs", type=int, default=2)
    found.add_argument("--limit", type=float, default=900.0, help="time for each command [s]")
    return found.parse_args()


def outcome(name: str, options) -> tuple[str, str, str, str, str]:
    """Return the cells of a robot's row after its name."""
    urdf, tool = ROBOTS[name]
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        words = ["robot", "new", f"{DATA}/{urdf}", "--tool", tool, "--out", "drafted.yaml"]
        words += ["--jobs", str(options.jobs), *(["--coarse"] if options.coarse else [])]
        drafted = run(words, folder, options.limit)
        if drafted.code != 0:
            return "", "", "", "", drafted.message
        shapes = len((folder / "drafted_primitives.csv").read_text().splitlines()) - 1
        checked = run(
            ["robot", "check", "drafted.yaml", "--samples", "100", "--json"], folder, options.limit
        )
        found = json.loads(checked.output) if checked.output.startswith("{") else {}
        problems = found.get("problems", [checked.message])
        scored = run(score_words(folder), folder, options.limit)
        if scored.code != 0:
            return seconds(drafted), str(shapes), str(checked.code), "", scored.message
        result = json.loads(scored.output)
        reached = result["reached_pairs"]
        return (
            seconds(drafted),
            str(shapes),
            "sound" if checked.code == 0 else f"{len(problems)} to review",
            f"{reached:,} of {result['pairs']:,}",
            problems[0] if problems else "",
        )


def score_words(folder: Path) -> list[str]:
    """Write a task and its environment; return the command that scores them."""
    (folder / "board.yaml").write_text(ENVIRONMENT)
    goals = "".join(
        f"  - {{body_frame: room, position: [0, {y}, {z}], quaternion_wxyz: [1, 0, 0, 0]}}\n"
        for y in (-0.2, 0.2)
        for z in HEIGHTS
    )
    (folder / "task.yaml").write_text(
        f"name: task\ntitle: task\nsource: made up\nenvironments: [board]\ngoals:\n{goals}"
    )
    words = ["score", "task.yaml", "--environment", "board.yaml", "--robot", "drafted.yaml"]
    return [*words, "--out", "out.tcs", "--json"]


def run(words: list[str], folder: Path, limit: float) -> Run:
    """Run a command of tcs in a folder."""
    began = time.monotonic()
    command = [sys.executable, "-c", "from tcs.cli import main; main()", *words]
    try:
        done = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, timeout=limit, env=os.environ
        )
    except subprocess.TimeoutExpired:
        return Run(None, "", f"ended after {limit:g} s", limit)
    lines = done.stderr.strip().splitlines()
    message = lines[-1].removeprefix("tcs: ") if lines else ""
    return Run(done.returncode, done.stdout, message, time.monotonic() - began)


def seconds(done: Run) -> str:
    """Return the time of a command as text."""
    return f"{done.seconds:.0f}"


if __name__ == "__main__":
    sys.exit(main())
