"""Measure the control loop of teleoperation: times, tool displacement, and changes of joint rates.

Usage: python benchmarks/teleop.py [--steps 2000] [--robots iiwa7 pr2 ...] [--seed 0]

Times are processor time and wall time of one whole step of `Teleoperation` in Python. This is a
benchmark, not a test.
"""

from __future__ import annotations

import statistics
import time

import numpy as np
from table import cell, header, parser, row, save

from tcs.teleop import Arm, Command, Mode, Settings, Step, Teleoperation, load_arm

ROBOTS = ("iiwa7", "pr2", "tiago", "panda")
READY = np.array([0.0, 0.6, 0.0, -1.4, 0.0, 1.0, 0.0])
"""A posture of the iiwa in the middle of its workspace, elbow up [rad]."""
SWEEP = np.radians(60.0)


def main() -> None:
    """Measure and print everything."""
    command_line = parser(__doc__)
    command_line.add_argument("--steps", type=int, default=2000, help="steps in each mode")
    command_line.add_argument("--robots", nargs="*", default=ROBOTS, metavar="ROBOT")
    command_line.add_argument("--seed", type=int, default=0, help="of the random commands")
    options = command_line.parse_args()
    header()
    row("seed", str(options.seed))
    for robot in options.robots:
        arm = load_arm(robot)
        for mode in Mode:
            times(arm, mode, options.steps, options.seed)
    print()
    arm = load_arm("iiwa7")
    for limits in ("paper", "clamped"):
        sweep(arm, Settings(limits=limits))
    print()
    for robot in options.robots:
        for limits in ("paper", "clamped"):
            switches(load_arm(robot), Settings(limits=limits), options.steps, options.seed)
    save(options)


def times(arm: Arm, mode: Mode, steps: int, seed: int) -> None:
    """Measure one step of a mode under commands that change, from postures all over the range."""
    rng = np.random.default_rng(seed)
    wall, cpu = [], []
    for joints in arm.random_joints(rng, max(1, steps // 100)):
        session = Teleoperation(arm, joints, mode=mode)
        for _ in range(4):
            command = random_command(rng, None)
            for _ in range(25):
                begun, busy = time.perf_counter(), time.process_time()
                session.step(command)
                wall.append(1e6 * (time.perf_counter() - begun))
                cpu.append(1e6 * (time.process_time() - busy))
    median, ninth = statistics.median(wall), statistics.quantiles(wall, n=100)[98]
    cell(
        "steps",
        f"{mode}, median (99th percentile) [ms]",
        arm.name,
        f"{median / 1e3:.3f} ({ninth / 1e3:.2f})",
    )
    row(
        f"{arm.name}, {mode}: one step",
        f"{median:.0f} us median, {ninth:.0f} us 99th percentile, processor "
        f"{statistics.median(cpu):.0f} us ({len(wall)} steps)",
    )


def sweep(arm: Arm, settings: Settings) -> None:
    """Print how far the tool moves while joint 1 sweeps 60 degrees and back, start to stop."""
    session = Teleoperation(arm, READY, settings, Mode.NULL_SPACE)
    here = session.step(Command())
    while here.joints[0] > -SWEEP / 2:
        here = session.step(Command(group=0, sign=-1))
    start, gone = here, []
    for sign in (1, -1):
        while sign * here.joints[0] < SWEEP / 2 and not here.stopped:
            here = session.step(Command(group=0, sign=sign))
            gone.append(drift(here, start))
        for _ in range(100):
            here = session.step(Command(group=0))
            gone.append(drift(here, start))
    line = "tool displacement while joint 1 moves by 60 deg and back [mm]"
    cell("holding", line, f"{arm.name}, {settings.limits}", f"{1e3 * max(gone):.4f}")
    row(
        f"{arm.name}, {settings.limits}: joint 1 by 60 deg",
        f"tool off by {1e3 * max(gone):.5f} mm at most, {1e3 * gone[-1]:.6f} mm in the end "
        f"({len(gone)} steps)",
    )


def switches(arm: Arm, settings: Settings, steps: int, seed: int) -> None:
    """Print the largest change of a joint rate under random commands and switches of mode."""
    rng = np.random.default_rng(seed)
    largest, count = 0.0, 0
    for joints in 0.9 * arm.random_joints(rng, max(1, steps // 200)):
        if arm.limit_violation(joints):
            continue
        session, before, mode = Teleoperation(arm, joints, settings), np.zeros(7), None
        for _ in range(10):
            command = random_command(rng, list(Mode)[rng.integers(len(Mode))])
            count += command.mode != mode
            mode = command.mode
            for _ in range(20):
                step = session.step(command)
                largest = max(largest, float(np.abs(step.rates - before).max()))
                before = step.rates
    bound = settings.acceleration * settings.period
    line = f"largest change of a joint rate in a step [rad/s], bound {bound:g}, {settings.limits}"
    cell("switches", line, arm.name, f"{largest:.4f}")
    row(
        f"{arm.name}, {settings.limits}: joint rates",
        f"change by {largest:.6f} rad/s in a step at most, bound {bound:g} ({count} switches)",
    )


def random_command(rng: np.random.Generator, mode: Mode | None) -> Command:
    """Return a fast random command."""
    return Command(
        linear=tuple(0.2 * rng.normal(size=3)),
        angular=tuple(0.5 * rng.normal(size=3)),
        group=int(rng.integers(4)),
        sign=int(rng.choice([-1, 1])),
        mode=mode,
        joints=tuple(rng.uniform(-np.pi, np.pi, size=7)),
    )


def drift(step: Step, start: Step) -> float:
    """Return how far the tool is from where it was [m]."""
    return float(np.linalg.norm(step.p - start.p))


if __name__ == "__main__":
    main()
