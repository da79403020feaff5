"""Solve arms of six joints at random poses, and compare with every solution that EAIK finds.

Usage: python benchmarks/six_joints.py [--robots ur5,jaco] [--poses 10000] [--seed 0]

Poses are those of random postures, joints anywhere in a full turn. Solutions of EAIK count if they
bring the tool to its pose; ours are all confirmed by forward kinematics.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from table import cell, header, parser, row, save

from tcs.kernel.arrays import Chain, FloatArray
from tcs.kernel.six_joints.arm import six_joint_arm
from tcs.kernel.six_joints.solutions import MOST_SOLUTIONS, solve_six_joints
from tcs.kernel.verification.reference import compose, link_poses
from tcs.model.robots import load_robot
from tcs.model.scene import EMPTY_ENVIRONMENT, Scene, SceneSpec, arm_chain

SAME = 1e-5
"""Greatest difference of equal joint angles [rad]; next to a singularity both are less exact."""
ON_POSE = 1e-7
"""Greatest error of a solution of EAIK, as of ours [entries of the rotation matrix; m]:
solutions in the sense of least squares exceed it."""


def main() -> int:
    """Compare on every robot; return 1 if a solution of EAIK is missing."""
    command_line = parser(__doc__)
    command_line.add_argument("--robots", default="ur5,jaco")
    command_line.add_argument("--poses", type=int, default=10_000)
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header("eaik")
    row("seed", str(options.seed))
    missing = 0
    for robot in options.robots.split(","):
        missing += compare(robot, options.poses, options.seed)
    save(options)
    return 1 if missing else 0


def compare(robot: str, poses: int, seed: int) -> int:
    """Solve the poses with both; print and record the result; return what is missing."""
    scene = Scene(SceneSpec(load_robot(robot), EMPTY_ENVIRONMENT))
    scene.set_arm(np.zeros(6))
    chain, _ = arm_chain(scene)
    postures = np.zeros((poses, 7))
    postures[:, 1:] = np.random.default_rng(seed).uniform(-np.pi, np.pi, (poses, 6))
    targets = [link_poses(chain, q)[-1] for q in postures]
    ours, seconds = solved(chain, targets)
    theirs, their_seconds = solved_by_eaik(chain, targets)
    # Not the posture that made the pose: EAIK need not find it either.
    unknown = [
        sum(not _is_among(q, found) for q in others)
        for found, others in zip(ours, theirs, strict=True)
    ]
    lost = sum(not _is_among(q, found) for q, found in zip(postures, ours, strict=True))
    values = {
        "poses": f"{poses:,}",
        "postures recovered": f"{poses - lost:,}",
        "solutions": f"{sum(map(len, ours)):,}",
        "solutions of EAIK": f"{sum(map(len, theirs)):,}",
        "of these found": f"{sum(map(len, theirs)) - sum(unknown):,}",
        "per pose [us of one core]": f"{seconds / poses * 1e6:.1f}",
        "EAIK, per pose [us of one core]": f"{their_seconds / poses * 1e6:.1f}",
    }
    for column, text in values.items():
        row(f"{robot}: {column}", text)
        cell("poses", robot, column, text)
    return sum(unknown) + lost


def solved(
    chain: Chain, targets: list[tuple[FloatArray, FloatArray]]
) -> tuple[list[FloatArray], float]:
    """Return our solutions for each pose, joint limits left aside, and the processor time [s]."""
    arm, out = six_joint_arm(chain), np.empty((MOST_SOLUTIONS, 7))
    prepared = [(np.ascontiguousarray(R), p) for R, p in targets]
    # Load or compile the machine code.
    solve_six_joints(arm, *prepared[0], out)
    found, begun = [], time.process_time()
    for R, p in prepared:
        count = solve_six_joints(arm, R, p, out)
        found.append(out[:count].copy())
    return found, time.process_time() - begun


def solved_by_eaik(
    chain: Chain, targets: list[tuple[FloatArray, FloatArray]]
) -> tuple[list[FloatArray], float]:
    """Return the solutions of EAIK that reach each pose, and the processor time [s]."""
    from eaik.IK_Homogeneous import HomogeneousRobot

    arm = HomogeneousRobot(_zero_poses(chain))
    matrices = np.tile(np.eye(4), (len(targets), 1, 1))
    for X, (R, p) in zip(matrices, targets, strict=True):
        X[:3, :3], X[:3, 3] = R, p
    begun = time.process_time()
    answers = [arm.IK(X) for X in matrices]
    seconds = time.process_time() - begun
    found = []
    for answer, (R, p) in zip(answers, targets, strict=True):
        kept = []
        for joints in np.asarray(answer.Q).reshape(-1, 6) if answer.num_solutions() else ():
            q = np.concatenate([[0.0], joints])
            S, s = link_poses(chain, q)[-1]
            if max(np.abs(S - R).max(), np.abs(s - p).max()) < ON_POSE:
                kept.append(q)
        found.append(np.array(kept).reshape(-1, 7))
    return found, seconds


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
