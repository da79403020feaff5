"""Solve arms of six joints at random poses, and compare with every solution of EAIK and of ssik.

Usage: python benchmarks/six_joints.py [--robots ur5,jaco] [--ssik-arms jaco2,crx10ia]
           [--poses 10000] [--seed 0]

Arms with a closed form are compared with EAIK. Arms without one are those that come with ssik.

Poses are those of random postures, joints anywhere in a full turn. Solutions of a peer count if
they bring the tool to its pose; ours are all confirmed by forward kinematics. ssik is not among the
packages that `make` installs: `pip install ssik`. All poses are solved in one call, by EAIK in one
thread, and the median of seven calls is given; ssik takes one pose at a time, once.
"""

from __future__ import annotations

import argparse
import importlib.util
import sys
import time
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from table import cell, header, parser, row, save

from tcs.kernel.arrays import Chain, FloatArray
from tcs.kernel.six_joints.arm import six_joint_arm
from tcs.kernel.six_joints.solutions import MOST_SOLUTIONS, solve_poses
from tcs.model.robots import load_robot
from tcs.model.scene import EMPTY_ENVIRONMENT, Scene, SceneSpec, arm_chain
from tests.reference.kinematics import compose, link_poses

SAME = 1e-5
"""Greatest difference of equal joint angles [rad]; next to a singularity both are less exact."""
ON_POSE = 1e-7
"""Greatest error of a solution of a peer, as of ours [entries of the rotation matrix; m]:
solutions in the sense of least squares exceed it."""

REPEATS = 7
"""Number of calls with all poses, ours and EAIK's, of which the median is given."""
PEERS = {"poses": "EAIK", "elimination": "ssik"}
"""What each table compares with."""
Solve = Callable[[Chain, list[tuple[FloatArray, FloatArray]]], tuple[list[FloatArray], float]]
"""Solves an arm at poses: solutions, and processor time [s]."""


def main() -> int:
    """Compare on every robot; return 1 if a solution of a peer is missing."""
    command_line = parser(__doc__)
    command_line.add_argument("--robots", default="ur5,jaco")
    command_line.add_argument("--ssik-arms", default="jaco2,crx10ia")
    command_line.add_argument("--poses", type=int, default=10_000)
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header("eaik", "ssik")
    row("seed", str(options.seed))
    missing = 0
    for robot in filter(None, options.robots.split(",")):
        chain = robot_chain(robot)
        missing += compare("poses", robot, chain, solved_by_eaik, options)
    arms = options.ssik_arms
    if arms and importlib.util.find_spec("ssik") is None:
        row("ssik", "not installed: its arms are left out (pip install ssik)")
        arms = ""
    for arm in filter(None, arms.split(",")):
        missing += compare("elimination", arm, *ssik_arm(arm), options)
    save(options, keep=True)
    return 1 if missing else 0


def robot_chain(robot: str) -> Chain:
    """Return the arm of a robot that ships."""
    scene = Scene(SceneSpec(load_robot(robot), EMPTY_ENVIRONMENT))
    scene.set_arm(np.zeros(6))
    return arm_chain(scene)[0]


def compare(
    table: str, name: str, chain: Chain, solved_by_peer: Solve, options: argparse.Namespace
) -> int:
    """Solve the poses with both; print and record the result; return what is missing."""
    poses, peer = options.poses, PEERS[table]
    postures = np.zeros((poses, 7))
    drawn = np.random.default_rng(options.seed).uniform(-np.pi, np.pi, (poses, 6))
    postures[:, 1:] = drawn
    targets = [link_poses(chain, q)[-1] for q in postures]
    ours, seconds = solved(chain, targets)
    theirs, their_seconds = solved_by_peer(chain, targets)
    # Not the posture that made the pose: a peer need not find it either.
    unknown = [
        sum(not _is_among(q, found) for q in others)
        for found, others in zip(ours, theirs, strict=True)
    ]
    lost = sum(not _is_among(q, found) for q, found in zip(postures, ours, strict=True))
    not_theirs = sum(not _is_among(q, found) for q, found in zip(postures, theirs, strict=True))
    values = {
        "poses": f"{poses:,}",
        "postures recovered": f"{poses - lost:,}",
        "solutions": f"{sum(map(len, ours)):,}",
        f"solutions of {peer}": f"{sum(map(len, theirs)):,}",
        "of these found": f"{sum(map(len, theirs)) - sum(unknown):,}",
        f"postures recovered by {peer}": f"{poses - not_theirs:,}",
        "per pose [us of one core]": f"{seconds / poses * 1e6:.1f}",
        f"{peer}, per pose [us of one core]": f"{their_seconds / poses * 1e6:.1f}",
    }
    for column, text in values.items():
        row(f"{name}: {column}", text)
        cell(table, name, column, text)
    return sum(unknown) + lost


def solved(
    chain: Chain, targets: list[tuple[FloatArray, FloatArray]]
) -> tuple[list[FloatArray], float]:
    """Return our solutions for each pose, joint limits left aside, and the processor time [s]."""
    arm = six_joint_arm(chain)
    R = np.array([R for R, _ in targets])
    p = np.array([p for _, p in targets])
    out = np.empty((len(targets), MOST_SOLUTIONS, 7))
    counts = np.zeros(len(targets), np.int64)
    # Load or compile the machine code, and get the memory.
    solve_poses(arm, R, p, out, counts)
    taken = []
    for _ in range(REPEATS):
        begun = time.process_time()
        solve_poses(arm, R, p, out, counts)
        taken.append(time.process_time() - begun)
    found = [found[:count] for found, count in zip(out, counts, strict=True)]
    return found, float(np.median(taken))


def solved_by_eaik(
    chain: Chain, targets: list[tuple[FloatArray, FloatArray]]
) -> tuple[list[FloatArray], float]:
    """Return the solutions of EAIK that reach each pose, and the processor time [s]."""
    from eaik.IK_Homogeneous import HomogeneousRobot

    arm = HomogeneousRobot(_zero_poses(chain))
    matrices = np.tile(np.eye(4), (len(targets), 1, 1))
    for X, (R, p) in zip(matrices, targets, strict=True):
        X[:3, :3], X[:3, 3] = R, p
    taken = []
    for _ in range(REPEATS):
        begun = time.process_time()
        answers = arm.IK_batched(matrices, 1)
        taken.append(time.process_time() - begun)
    found = []
    for answer, (R, p) in zip(answers, targets, strict=True):
        joints = np.asarray(answer.Q).reshape(-1, 6) if answer.num_solutions() else ()
        found.append(_on_pose(chain, joints, R, p))
    return found, float(np.median(taken))


def ssik_arm(name: str) -> tuple[Chain, Solve]:
    """Return an arm that comes with ssik, and its solver there."""
    from ssik import Manipulator

    arm = Manipulator.from_prebuilt(name)
    R, p = np.tile(np.eye(3), (8, 1, 1)), np.zeros((8, 3))
    before = np.eye(4)
    for i, joint in enumerate(arm.kinbody.joints, 1):
        to_z = np.eye(4)
        to_z[:3, :3] = _rotation_to(np.asarray(joint.axis))
        X = before @ joint.T_left @ to_z
        R[i], p[i] = X[:3, :3], X[:3, 3]
        before = to_z.T @ joint.T_right
    R[7], p[7] = before[:3, :3], before[:3, 3]
    chain = Chain(R, p, np.full(7, -np.inf), np.full(7, np.inf), joints=6)

    def solve(
        chain: Chain, targets: list[tuple[FloatArray, FloatArray]]
    ) -> tuple[list[FloatArray], float]:
        matrices = np.tile(np.eye(4), (len(targets), 1, 1))
        for X, (R, p) in zip(matrices, targets, strict=True):
            X[:3, :3], X[:3, 3] = R, p
        arm.solve(matrices[0])
        begun = time.process_time()
        answers = [arm.solve(X, respect_limits=False) for X in matrices]
        seconds = time.process_time() - begun
        found = [
            _on_pose(chain, [solution.q for solution in answer], R, p)
            for answer, (R, p) in zip(answers, targets, strict=True)
        ]
        return found, seconds

    return chain, solve


def _rotation_to(axis: FloatArray) -> FloatArray:
    """Return a rotation whose z axis is a unit vector."""
    x = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    x = x / np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])


def _on_pose(chain: Chain, postures: Iterable[FloatArray], R: FloatArray, p: FloatArray) -> Any:
    """Return the postures of a peer that bring the tool to its pose, shape (n, 7)."""
    kept = []
    for joints in postures:
        q = np.concatenate([[0.0], joints])
        S, s = link_poses(chain, q)[-1]
        if max(np.abs(S - R).max(), np.abs(s - p).max()) < ON_POSE:
            kept.append(q)
    return np.array(kept).reshape(-1, 7)


def _zero_poses(chain: Chain) -> FloatArray:
    """Return the poses of the links of joints 1 to 6 and of the tool at zero, shape (7, 4, 4)."""
    X = chain.R[0], chain.p[0]
    frames = np.tile(np.eye(4), (7, 1, 1))
    for frame, step in zip(frames, zip(chain.R[1:], chain.p[1:], strict=True), strict=True):
        X = compose(X, step)
        frame[:3, :3], frame[:3, 3] = X
    return frames


def _is_among(q: FloatArray, solutions: FloatArray) -> bool:
    """Return whether a posture is one of the solutions, but for full turns."""
    if not len(solutions):
        return False
    return bool(np.abs(np.angle(np.exp(1j * (solutions - q)))).max(axis=1).min() < SAME)


if __name__ == "__main__":
    sys.exit(main())
