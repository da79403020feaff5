"""Measure the collision primitives of the shipped robots: their volume, and what they forbid.

Usage: python benchmarks/primitives.py [--robots pr2,tiago,baxter] [--postures 2000] [--seed 0]

The results depend on the seed alone, not on the machine.
"""

from __future__ import annotations

from collections import Counter

import numpy as np
from table import cell, header, parser, record, row, save

from tcs.model.robots import RobotFile, load_robot
from tcs_shapes.bodies import enclosure
from tcs_shapes.self_collision import SelfCollision, sample_positions

TORSO = {"pr2": (0.0115, 0.15, 0.30)}
"""Torso heights of the self-collision test [m]; others stand at the middle of the range."""


def main() -> None:
    """Measure, print and record everything."""
    command_line = parser(__doc__)
    command_line.add_argument("--robots", default="pr2,tiago,baxter")
    command_line.add_argument("--postures", type=int, default=2000)
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header()
    row("seed", str(options.seed))
    for name in options.robots.split(","):
        robot = load_robot(name)
        volumes(robot)
        for torso in TORSO.get(name, (None,)):
            self_collision(robot, torso, options.postures, options.seed)
    save(options)


def volumes(robot: RobotFile) -> None:
    """Print the volume of hull and primitives of each body; equal bodies share a line."""
    counts = Counter(primitive.body for primitive in robot.load_primitives())
    lines: dict[tuple[str, ...], list[str]] = {}
    for found in enclosure(robot):
        texts = (
            str(counts[found.body]),
            f"{1e3 * found.hull:.3f}",
            f"{1e3 * found.union:.3f}",
            f"{found.excess:.2f}",
        )
        lines.setdefault(texts, []).append(found.body)
    rows = [[", ".join(bodies), *texts] for texts, bodies in lines.items()]
    for cells in rows:
        row(f"{robot.name}: {cells[0]}", "  ".join(cells[1:]))
    record(robot.name, ["body", "shapes of each", "hull [l]", "union [l]", "excess"], rows)


def self_collision(robot: RobotFile, torso: float | None, postures: int, seed: int) -> None:
    """Print how many arm postures the shapes allow, and how many the hulls of the meshes."""
    shapes, hulls = SelfCollision(robot), SelfCollision(robot, hulls=True)
    model = robot.model()
    first, last = (model.joints[robot.arm_joints[i]].child for i in (0, -1))
    arm, hand = (
        {body for body in model.links if model.chain(top, body) is not None}
        for top in (first, last)
    )
    disabled = {frozenset(pair) for pair in robot.disabled_pairs}

    def touches(judge: SelfCollision, positions: dict[str, float]) -> bool:
        return any(
            frozenset(pair) not in disabled and arm & set(pair) and not set(pair) <= hand
            for pair in judge.touching(positions)
        )

    rest = robot.with_mimics(robot.joint_positions())
    if torso is not None and robot.torso_joint is not None:
        rest = rest | {robot.torso_joint: torso}
    drawn = [
        rest | {name: sample[name] for name in robot.arm_joints}
        for sample in sample_positions(robot, postures, seed)
    ]
    ours, theirs = (
        np.array([touches(judge, positions) for positions in drawn]) for judge in (shapes, hulls)
    )
    line = robot.name if torso is None else f"{robot.name}, torso at {torso:g} m"
    for column, found in (
        ("free by shapes [%]", ~ours),
        ("free by hulls [%]", ~theirs),
        ("shapes touch, hulls do not [%]", ours & ~theirs),
        ("hulls touch, shapes do not [%]", theirs & ~ours),
    ):
        row(f"{line}: {column}", f"{100.0 * found.mean():.1f}")
        cell("self_collision", line, column, f"{100.0 * found.mean():.1f}")


if __name__ == "__main__":
    main()
