"""All solutions of the inverse kinematics of an arm of six joints, joint limits left aside."""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner, jit
from tcs.kernel.kinematics import copy_joints, link_poses, place_tool
from tcs.kernel.six_joints.arm import SixJointArm
from tcs.kernel.six_joints.elimination import is_known, solve_general
from tcs.kernel.six_joints.parallel_axes import solve_parallel_axes
from tcs.kernel.six_joints.spherical_wrist import solve_spherical_wrist
from tcs.kernel.six_joints.three_slides import solve_three_slides

MOST_SOLUTIONS = 16
"""Greatest number of solutions; with a closed form eight: two for each of three choices."""
TURN = 2.0 * np.pi
ON_GOAL = 1e-7
"""Greatest error of a solution, in entries of the rotation matrix and of the position [m]."""
CERTAIN = 1e-9
"""Error of a closed form [1 or m] below which its solution needs no further check: links are so
short that it stays below ON_GOAL at the tool."""


@jit
def solve_six_joints(
    arm: SixJointArm, R_AG: FloatArray, p_AG: FloatArray, solutions: FloatArray
) -> int:
    """Fill all solutions for a goal, each confirmed by forward kinematics.

    Two closed forms follow the chain from both ends, with the sine and cosine of each angle, and
    tell how far the ends miss each other. Where that is above rounding, and for other arms, the
    tool is placed by the angles.

    Args:
        arm: The arm.
        R_AG: Goal orientation in A, shape (3, 3).
        p_AG: Goal position in A [m], shape (3,).
        solutions: Filled with joint angles, each in any full turn [rad], shape (MOST_SOLUTIONS, 7).

    Returns:
        Number of solutions. Where a wrist is exactly straight, one stands for a continuum.
    """
    misses = np.empty(MOST_SOLUTIONS)
    for n in range(MOST_SOLUTIONS):
        misses[n] = np.inf
    if len(arm.wrist.branches):
        found = solve_spherical_wrist(arm.wrist, R_AG, p_AG, solutions, misses)
    elif arm.general.direction != 0:
        found = solve_general(arm.general, arm.R, arm.p, R_AG, p_AG, solutions)
    elif arm.p.shape[1] > 3:
        found = solve_three_slides(arm.R, arm.p, R_AG, p_AG, solutions)
    else:
        found = solve_parallel_axes(arm.R, arm.p, R_AG, p_AG, solutions, misses)
    kept = 0
    for n in range(found):
        q = solutions[n]
        is_certain = misses[n] < CERTAIN or _miss(arm, R_AG, p_AG, q) < ON_GOAL
        if is_certain and not is_known(solutions, kept, q):
            copy_joints(q, solutions[kept])
            kept += 1
    return kept


@jit
def solve_poses(
    arm: SixJointArm,
    R_AG: FloatArray,
    p_AG: FloatArray,
    solutions: FloatArray,
    counts: IntArray,
) -> None:
    """Fill all solutions for each of n goals.

    A call from Python passes the constants of the arm, which takes longer than a closed form.

    Args:
        arm: The arm.
        R_AG: Goal orientations in A, shape (n, 3, 3).
        p_AG: Goal positions in A [m], shape (n, 3).
        solutions: Filled as by `solve_six_joints`, shape (n, MOST_SOLUTIONS, 7).
        counts: Filled with the number of solutions of each, shape (n,).
    """
    for n in range(len(R_AG)):
        counts[n] = solve_six_joints(arm, R_AG[n], p_AG[n], solutions[n])


@inner
def _miss(arm: SixJointArm, R_AG: FloatArray, p_AG: FloatArray, q: FloatArray) -> float:
    """Return how far joints miss a goal, in entries of the rotation matrix and the position [m]."""
    link_R, link_p = np.empty((8, 3, 3)), np.empty((8, 3))
    R_AT, p_AT = np.empty((3, 3)), np.empty(3)
    link_poses(arm.R, arm.p, q, link_R, link_p)
    place_tool(arm.R, arm.p, link_R, link_p, R_AT, p_AT)
    worst = 0.0
    for r in range(3):
        worst = max(worst, abs(p_AT[r] - p_AG[r]))
        for c in range(3):
            worst = max(worst, abs(R_AT[r, c] - R_AG[r, c]))
    return worst


@jit
def within_limits(arm: SixJointArm, solutions: FloatArray, count: int) -> int:
    """Shift solutions by full turns into the limits; move those within them to the front.

    Args:
        arm: The arm.
        solutions: Changed in place [rad], shape (count or more, 7).
        count: Number of solutions.

    Returns:
        Number of solutions within the limits.
    """
    kept = 0
    for n in range(count):
        inside = True
        for k in range(7):
            lower, upper, angle = arm.lower[k], arm.upper[k], solutions[n, k]
            middle = 0.5 * (lower + upper) if np.isfinite(lower) else 0.0
            if arm.p.shape[1] <= 3 or arm.p[k, 3] == 0.0:
                angle -= TURN * np.ceil((angle - middle - np.pi) / TURN)
            inside = inside and lower <= angle <= upper
            solutions[kept, k] = angle
        kept += 1 if inside else 0
    return kept


def six_joint_solutions(arm: SixJointArm, R_AG: FloatArray, p_AG: FloatArray) -> FloatArray:
    """Return all postures within the joint limits with the tool at a pose.

    Args:
        arm: The arm.
        R_AG: Goal orientation in the arm base A, shape (3, 3).
        p_AG: Goal position in A [m], shape (3,).

    Returns:
        Joint angles [rad], shape (n, 7) with n up to MOST_SOLUTIONS, the first one 0.
    """
    R, p = np.array(R_AG, dtype=np.float64, order="C"), np.array(p_AG, dtype=np.float64)
    solutions = np.empty((MOST_SOLUTIONS, 7))
    count = solve_six_joints(arm, R, p, solutions)
    return solutions[: within_limits(arm, solutions, count)]
