"""Measure null-space motion and the modes of the tool on many random postures, limits and lines.

Usage: python benchmarks/null_space.py [--postures 1500] [--starts 60] [--lines 25]
           [--robots iiwa7 pr2 ...] [--seed 0]

Three tables: in how many postures a joint group alone holds the tool, how still it is held from
starts with a joint at its limit, and how far each mode follows straight lines. The results depend
on the seed alone, not on the machine.
"""

from __future__ import annotations

import argparse
import math
import statistics

import numpy as np
from table import cell, header, parser, row, save

from tcs.capability import Reach
from tcs.kernel.arrays import FloatArray
from tcs.teleop import Arm, Command, Mode, Settings, Step, Teleoperation, load_arm
from tcs.teleop.control.joint_groups import group_motion
from tcs.teleop.line import Line

ROBOTS = ("iiwa7", "panda", "pr2", "tiago")
STRAIGHT = {"any": [], "q3 = q5 = 0": [2, 4], "q3 = 0": [2], "q5 = 0": [4]}
"""Joints that are put to zero, by the name of the postures."""
LENGTH, SPEED, HEADING = 0.7, 0.1, math.radians(25.0)
"""Of the lines [m, m/s], and their greatest angle from straight back."""
DONE = 0.95
"""Fraction of a line that end-effector control must not reach in `paper` mode."""
WITHIN = (0.010, 0.035)
"""Distances from the line [m]."""
MODES = {
    "end-effector, paper": (Mode.END_EFFECTOR, "paper"),
    "end-effector, clamped": (Mode.END_EFFECTOR, "clamped"),
    "drake": (Mode.DRAKE, "clamped"),
    "assisted": (Mode.ASSISTED, "clamped"),
}


def main() -> None:
    """Measure, print and record everything."""
    command_line = parser(__doc__)
    command_line.add_argument("--postures", type=int, default=1500)
    command_line.add_argument("--starts", type=int, default=60, help="starts of each arm")
    command_line.add_argument("--lines", type=int, default=25)
    command_line.add_argument("--robots", nargs="*", default=ROBOTS, metavar="ROBOT")
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header()
    row("seed", str(options.seed))
    for robot in options.robots:
        arm = load_arm(robot)
        groups(arm, options.postures, options.seed)
        starts_at_limits(arm, options.starts)
        singular(arm, options.postures, options.seed)
    straight_lines(load_arm("iiwa7"), options)
    save(options)


def groups(arm: Arm, postures: int, seed: int) -> None:
    """Print in how many postures only joints of the group move, and the others' median share."""
    drawn = arm.random_joints(np.random.default_rng(seed), postures)
    for name, zero in STRAIGHT.items():
        joints = drawn.copy()
        joints[:, zero] = 0.0
        jacobians = [arm.kinematics(q).jacobian[3:] for q in joints]
        for number, group in enumerate(Settings().groups, start=1):
            found = [group_motion(J, group, 1.0) for J in jacobians]
            others = [i for i in range(7) if i not in group]
            exact = 100.0 * np.mean([motion.exact for motion in found])
            shares = [
                np.linalg.norm(motion.rates[others]) / np.linalg.norm(motion.rates)
                for motion in found
            ]
            text = f"{exact:.1f} ({100.0 * statistics.median(shares):.0f})"
            row(f"{arm.name}, {name}: group {number}", f"{text} %")
            cell("groups", f"{arm.name}, {name}", f"group {number}", text)


def starts_at_limits(arm: Arm, starts: int) -> None:
    """Print how far the tool goes while a group turns to and fro, one or two joints at a limit."""
    gone = []
    for seed in range(starts):
        rng = np.random.default_rng(seed)
        joints = arm.random_joints(rng, 1)[0]
        bounded = np.flatnonzero(arm.bounded)
        for joint in rng.choice(bounded, size=rng.integers(1, 3), replace=False):
            joints[joint] = (arm.lower, arm.upper)[rng.integers(2)][joint]
        group, sign = int(rng.integers(3)), int(rng.choice([-1, 1]))
        session = Teleoperation(arm, joints, mode=Mode.NULL_SPACE)
        start = session.step(Command())
        steps = round(1.5 / session.settings.period)
        signs = [sign] * steps + [-sign] * steps
        gone.append(max(drift(session.step(Command(group=group, sign=s)), start) for s in signs))
    row(f"{arm.name}: tool from {starts} starts", f"{1e3 * max(gone):.4f} mm at most")
    cell("starts", arm.name, "greatest displacement [mm]", f"{1e3 * max(gone):.4f}")
    cell("starts", arm.name, "median [mm]", f"{1e3 * statistics.median(gone):.4f}")


def singular(arm: Arm, postures: int, seed: int) -> None:
    """Print in how many postures the arm counts as singular."""
    drawn = arm.random_joints(np.random.default_rng(seed), postures)
    flags = [Teleoperation(arm, joints).step(Command()).singular for joints in drawn]
    row(f"{arm.name}: singular postures", f"{100.0 * np.mean(flags):.1f} %")
    cell("singular", arm.name, "singular postures [%]", f"{100.0 * np.mean(flags):.1f}")


def straight_lines(arm: Arm, options: argparse.Namespace) -> None:
    """Print how far each mode follows lines on which `paper` stops before the end."""
    rng = np.random.default_rng(options.seed)
    found: dict[str, list[tuple[float, float, float]]] = {name: [] for name in MODES}
    drawn = 0
    while len(found["assisted"]) < options.lines:
        joints, line = random_line(arm, rng)
        drawn += 1
        first = followed(arm, joints, line, "end-effector, paper")
        if first[0] >= DONE:
            continue
        for name in MODES:
            found[name].append(followed(arm, joints, line, name))
    row("lines", f"{options.lines} of {drawn} drawn end before {DONE:.0%} of their length")
    for name, results in found.items():
        reached = [one for one in results if one[0] >= 1.0 - 1e-2]
        texts = {
            "reach the end": str(len(reached)),
            **{
                f"within {1e3 * far:.0f} mm of the line": str(sum(r[1] <= far for r in reached))
                for far in WITHIN
            },
            "mean fraction of the line [%]": f"{100.0 * np.mean([r[0] for r in results]):.1f}",
            "mean of the greatest rotation [rad]": f"{np.mean([r[2] for r in results]):.2f}",
        }
        for column, text in texts.items():
            row(f"{name}: {column}", text)
            cell("lines", name, column, text)


def random_line(arm: Arm, rng: np.random.Generator) -> tuple[FloatArray, Line]:
    """Return a start posture and a level line from front to back, both ends within reach."""
    reach = Reach(arm.robot, torso_height=arm.torso_height)
    base = arm.frames[0, :3, 3]
    shoulder = arm.link_poses(np.zeros(7))[1, :3, 3]
    while True:
        joints = 0.9 * arm.random_joints(rng, 1)[0]
        start = arm.kinematics(joints).p
        heading = math.pi + rng.uniform(-HEADING, HEADING)
        end = start + LENGTH * np.array([math.cos(heading), math.sin(heading), 0.0])
        beside = abs((start - base)[0] * math.sin(heading) - (start - base)[1] * math.cos(heading))
        ahead = start[0] - base[0]
        if ahead < 0.3 or beside < 0.2 or np.linalg.norm(end - shoulder) > 0.8 * reach.length:
            continue
        return joints, Line(tuple(map(float, start)), tuple(map(float, end)))


def followed(arm: Arm, joints: FloatArray, line: Line, name: str) -> tuple[float, float, float]:
    """Return the fraction of the line, the greatest distance from it [m] and rotation [rad]."""
    mode, limits = MODES[name]
    session = Teleoperation(arm, joints, Settings(limits=limits), mode)
    start = session.step(Command())
    velocity = tuple(float(v) for v in SPEED * line.direction)
    farthest = largest = fraction = 0.0
    for _ in range(round(1.2 * line.length / SPEED / session.settings.period)):
        step = session.step(Command(linear=velocity))
        fraction = max(fraction, float(line.fraction_at(step.p)))
        if fraction >= 1.0:
            break
        beside = step.p - line.at(float(line.fraction_at(step.p)))
        farthest = max(farthest, float(np.linalg.norm(beside)))
        cosine = 0.5 * (np.trace(step.R @ start.R.T) - 1.0)
        largest = max(largest, math.acos(min(1.0, max(-1.0, cosine))))
    return min(1.0, fraction), farthest, largest


def drift(step: Step, start: Step) -> float:
    """Return how far the tool is from where it was [m]."""
    return float(np.linalg.norm(step.p - start.p))


if __name__ == "__main__":
    main()
