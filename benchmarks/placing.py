"""Measure `tcs.place` on trajectories generated from known base poses and joint paths.

Usage: python benchmarks/placing.py [--robots panda iiwa7] [--trajectories 100] [--seed 0]
           [--jobs 2]

A joint path is straight between two random postures, certified free of contact; its tool poses, 2
to 64 of them, are moved to a random base pose. So every trajectory can be done from one base pose,
by one continuous joint path. Times are those of calls after the first. With `--save`, the saved
rows of other robots are kept.
"""

from __future__ import annotations

import argparse
import statistics
import time

import numpy as np
from table import header, parser, record, row, save

import tcs
from tcs.kernel.arrays import FloatArray
from tcs.kernel.dexterity import DEFAULT_MEASURE
from tcs.kernel.motion.edges import certified
from tcs.kernel.motion.scene import motion_scene, new_motion_workspace
from tcs.kernel.problem import Problem
from tcs.kernel.rows import single_row
from tcs.model.robots import load_robot
from tcs.placement.refinement.base_poses import PoseScene

COUNTS = (2, 4, 8, 16, 32, 64)
"""Numbers of tool poses, one after the other."""
JOINT_MOTION = 1.2
"""Greatest motion of a joint along a path [rad]."""
COLUMNS = (
    *("robot", "trajectories", "all poses reached", "with a joint path"),
    *("median wall time [s]", "median processor time [s]", "greatest processor time [s]"),
)


def main() -> None:
    """Place each robot for its trajectories and print the table."""
    command_line = parser(__doc__)
    command_line.add_argument("--robots", nargs="+", default=["panda", "iiwa7"])
    command_line.add_argument("--trajectories", type=int, default=100)
    command_line.add_argument("--seed", type=int, default=0)
    command_line.add_argument("--jobs", type=int, default=2)
    options = command_line.parse_args()
    header()
    rows = []
    for robot in options.robots:
        rows.append(measured(robot, options))
        row(robot, ", ".join(rows[-1][1:]))
        record("rows", COLUMNS, rows)
        save(options, keep=True)


def measured(robot: str, options: argparse.Namespace) -> list[str]:
    """Return the row of one robot."""
    problem = PoseScene.of(load_robot(robot), (), 0.0, DEFAULT_MEASURE).problem
    rng = np.random.default_rng(options.seed)
    reached, continuous, seconds, wall = 0, 0, [], []
    tcs.place(robot, trajectory(problem, rng, COUNTS[0]), jobs=options.jobs)
    for i in range(options.trajectories):
        poses = trajectory(problem, rng, COUNTS[i % len(COUNTS)])
        begun = time.process_time()
        found = tcs.place(robot, poses, jobs=options.jobs)
        seconds.append(time.process_time() - begun)
        wall.append(found.seconds)
        reached += bool(found.reached.all())
        continuous += bool(found.reached.all() and all(found.continuous))
    return [
        robot,
        str(options.trajectories),
        str(reached),
        str(continuous),
        f"{statistics.median(wall):.2f}",
        f"{statistics.median(seconds):.2f}",
        f"{max(seconds):.2f}",
    ]


def trajectory(problem: Problem, rng: np.random.Generator, count: int) -> FloatArray:
    """Return tool poses in W along a random joint path from a random base pose, (count, 4, 4)."""
    scene = motion_scene(problem, single_row())
    work = new_motion_workspace(scene)
    low, high = np.maximum(problem.arm.lower, -np.pi), np.minimum(problem.arm.upper, np.pi)
    while True:
        start = rng.uniform(low, high)
        end = np.clip(start + rng.uniform(-JOINT_MOTION, JOINT_MOTION, 7), low, high)
        if certified(scene, work, np.linspace(start, end, 4)) == 1.0:
            break
    base = turn(rng.uniform(-np.pi, np.pi))
    base[:2, 3] = rng.uniform(-1.0, 1.0, 2)
    X_WA = base @ pose(problem.arm_base.R[0], problem.arm_base.p[0])
    return np.stack([X_WA @ tool(problem, q) for q in np.linspace(start, end, count)])


def tool(problem: Problem, q: FloatArray) -> FloatArray:
    """Return the pose of the tool in A at joint angles, shape (4, 4)."""
    X = np.eye(4)
    for i in range(7):
        X = X @ pose(problem.chain.R[i], problem.chain.p[i]) @ turn(q[i])
    return X @ pose(problem.chain.R[7], problem.chain.p[7])


def pose(R: FloatArray, p: FloatArray) -> FloatArray:
    """Return a homogeneous matrix."""
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = R, p
    return X


def turn(angle: float) -> FloatArray:
    """Return the homogeneous matrix of a rotation about z."""
    X = np.eye(4)
    X[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return X


if __name__ == "__main__":
    main()
