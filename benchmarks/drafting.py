"""Draft a robot file from every URDF of example-robot-data that has an arm, and score with it.

Usage: python benchmarks/drafting.py [--robots ur10,b1] [--all] [--coarse] [--jobs 2] [--limit 900]
                                      [--missing]

Each robot is drafted by `tcs robot new`, checked by `tcs robot check` and scored at goals around
its reach, each in a process of its own that ends at the limit [s of processor] and may use 8 GB.
What is not supported ends in one line of the command. With `--all`, every URDF of the package is
drafted, also of what has no arm, with the tool named here or else its deepest link, and counted;
`--robots` takes any of them. `--missing` continues a run that was interrupted.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import yaml
from table import FIGURES, header, parser, record, row, save

from tcs.errors import TcsError
from tcs.model.robots.urdf.packages import resolve_uri
from tcs.model.robots.urdf.reading import read_urdf

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
FURTHER_TOOLS = {
    "alex_sake_hands": "LeftSakePalmLink",
    "baxter": "left_gripper",
    "g1_29dof_rev_1_0": "left_rubber_hand",
    "icub_reduced": "l_hand_dh_frame",
    "panda_collision": "panda_hand_tcp",
    "pr2": "l_gripper_tool_frame",
    "romeo_small": "l_wrist",
    "simple_humanoid_classical": "l_wrist",
    "talos_full_v2_box": "gripper_left_base_link",
    "talos_left_arm": "gripper_left_base_link",
    "talos_reduced": "gripper_left_base_link",
    "talos_reduced_box": "gripper_left_base_link",
    "talos_reduced_corrected": "gripper_left_base_link",
    "tiago": "hand_tool_link",
    "ur3_gripper": "ee_link",
    "ur3_joint_limited_robot": "ee_link",
    "ur5_gripper": "ee_link",
    "ur5_joint_limited_robot": "ee_link",
    "ur5_robot": "ee_link",
    "ur10_joint_limited_robot": "ee_link",
}
"""Tool link of further URDFs, by the name of the file; others with `--all` are drafted with the
link that most joints move."""
MEMORY = 8e9
"""Address space of a command [bytes]."""
FREE = "free: {rotation_about: [0, 0, 1]}\n"
"""What goals leave free for an arm of five joints."""

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
SAVED = FIGURES / "drafting.json"
NONE: dict[str, list[list[str]]] = {"rows": []}
HEIGHTS = (0.2, 0.6, 0.9, 1.2)
COLUMNS = (
    "robot",
    "drafted in [s]",
    "of processor [s]",
    "shapes",
    "check",
    "pairs reached",
    "what is said",
)


@dataclass(frozen=True)
class Run:
    """What a command did: its exit code, output, last line of messages, and time [s]."""

    code: int | None
    output: str
    message: str
    processor: float
    seconds: float
    is_one_line: bool = True
    """Whether nothing but progress precedes the last line: no traceback."""


def main() -> int:
    """Draft, check and score every robot."""
    options = parse()
    header()
    rows = []
    robots = everything()
    if not options.all:
        robots = {name: robots[name] for name in options.robots.split(",")}
    table = "all_coarse" if options.coarse else "all"
    done = saved_rows(table) if options.missing else ()
    for name, (urdf, tool) in robots.items():
        if name in done:
            continue
        rows.append((name, *outcome(urdf, tool, options)))
        row(name, ", ".join(text for text in rows[-1][1:] if text))
        # After each robot: an interrupted run keeps what it has.
        record(table, COLUMNS, rows)
        save(options, keep=True)
    return 0


def saved_rows(table: str) -> set[str]:
    """Return the robots that the saved figures have in a table."""
    if not SAVED.exists():
        return set()
    return {cells[0] for cells in json.loads(SAVED.read_text())["tables"].get(table, NONE)["rows"]}


def everything() -> dict[str, tuple[str, str]]:
    """Return the path of every URDF of the package and its tool link, by a name of its own."""
    names = {urdf: name for name, (urdf, _) in ROBOTS.items()}
    root, found = data_folder(), {}
    for path in sorted(root.rglob("*.urdf")):
        urdf = str(path.relative_to(root))
        name = names.get(urdf, path.stem)
        if urdf not in names and (name in ROBOTS or name in found):
            name = f"{urdf.split('_description')[0]}_{name}"
        _, tool = ROBOTS.get(name, ("", FURTHER_TOOLS.get(path.stem, "")))
        found[name] = urdf, tool or deepest(path)
    return found


def data_folder() -> Path:
    """Return the folder of the robots of example-robot-data."""
    return resolve_uri(f"{DATA}/{ROBOTS['ur10'][0]}", Path()).parents[2]


def deepest(path: Path) -> str:
    """Return the link that most joints move, the first of several; "tool" if a URDF is refused."""
    try:
        model = read_urdf(path)
    except TcsError:
        return "tool"
    chains = {link: model.chain(model.root, link) or () for link in model.links}
    return max(chains, key=lambda link: sum(joint.is_movable for joint in chains[link]))


def parse():
    """Return the options."""
    found = parser(__doc__ or "")
    found.add_argument("--robots", default=",".join(ROBOTS), help="names, separated by commas")
    found.add_argument("--all", action="store_true", help="every URDF of the package")
    found.add_argument("--coarse", action="store_true", help="draft with few shapes")
    found.add_argument("--missing", action="store_true", help="only robots not saved yet")
    found.add_argument("--jobs", type=int, default=2)
    found.add_argument("--limit", type=float, default=900.0, help="processor time of a command [s]")
    return found.parse_args()


def outcome(urdf: str, tool: str, options) -> tuple[str, ...]:
    """Return the cells of a robot's row after its name."""
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        words = ["robot", "new", f"{DATA}/{urdf}", "--tool", tool, "--out", "drafted.yaml"]
        words += ["--jobs", str(options.jobs), *(["--coarse"] if options.coarse else [])]
        drafted = run(words, folder, options.limit)
        if drafted.code != 0:
            clear = drafted.code == 1 and drafted.is_one_line
            said = drafted.message if clear else f"NOT ONE LINE: {drafted.message}"
            return *times(drafted), "", "", "", said
        shapes = len((folder / "drafted_primitives.csv").read_text().splitlines()) - 1
        checked = run(
            ["robot", "check", "drafted.yaml", "--samples", "100", "--json"], folder, options.limit
        )
        found = json.loads(checked.output) if checked.output.startswith("{") else {}
        problems = found.get("problems", [checked.message])
        scored = run(score_words(folder), folder, options.limit)
        if scored.code != 0:
            return *times(drafted), str(shapes), str(checked.code), "", scored.message
        result = json.loads(scored.output)
        reached = result["reached_pairs"]
        return (
            *times(drafted),
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
    joints = yaml.safe_load((folder / "drafted.yaml").read_text())["arm_joints"]
    (folder / "task.yaml").write_text(
        "name: task\ntitle: task\nsource: made up\nenvironments: [board]\n"
        f"{FREE if len(joints) == 5 else ''}goals:\n{goals}"
    )
    words = ["score", "task.yaml", "--environment", "board.yaml", "--robot", "drafted.yaml"]
    return [*words, "--no-approach", "--out", "out.tcs", "--json"]


def run(words: list[str], folder: Path, limit: float) -> Run:
    """Run a command of tcs in a folder."""
    command = [sys.executable, "-c", "from tcs.cli import main; main()", *words]
    start, before = time.perf_counter(), processor_time()
    done = subprocess.run(
        command,
        cwd=folder,
        capture_output=True,
        text=True,
        env=os.environ,
        preexec_fn=lambda: bound(limit),
    )
    used, passed = processor_time() - before, time.perf_counter() - start
    if done.returncode < 0:
        return Run(
            None, "", f"ended by signal {-done.returncode} after {used:.0f} s", used, passed, False
        )
    lines = done.stderr.strip().splitlines()
    message = lines[-1].removeprefix("tcs: ") if lines else ""
    # The folder is another one on each machine.
    message = message.replace(f"{data_folder()}/", "")
    is_one_line = all(line.startswith("tcs: ") for line in lines)
    return Run(done.returncode, done.stdout, message, used, passed, is_one_line)


def bound(limit: float) -> None:
    """Bound processor time and address space of this process."""
    resource.setrlimit(resource.RLIMIT_CPU, (int(limit), int(limit) + 5))
    resource.setrlimit(resource.RLIMIT_AS, (int(MEMORY), int(MEMORY)))


def processor_time() -> float:
    """Return the processor time of all processes that have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def times(done: Run) -> tuple[str, str]:
    """Return the time of a command and that of the processors as texts [s]."""
    return f"{done.seconds:.0f}", f"{done.processor:.0f}"


if __name__ == "__main__":
    sys.exit(main())
