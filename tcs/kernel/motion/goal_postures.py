"""Postures that hold the tool at a pose, spread over all of them, collisions not considered."""

from __future__ import annotations

import numpy as np

from tcs.kernel.analytic.ik import sample_joints, wrist_goal
from tcs.kernel.analytic.solver import ArmSolver, is_outside
from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import jit
from tcs.kernel.five_joints.score_turned import new_five_joint_solver, solve_turned
from tcs.kernel.kinematics import pose_error, tool_pose
from tcs.kernel.numeric.solutions import numeric_solutions
from tcs.kernel.problem import Problem, chain_of
from tcs.kernel.six_joints.score_solutions import new_six_joint_solver
from tcs.kernel.six_joints.solutions import solve_six_joints, within_limits

AT_POSE = 1e-7
"""Greatest error of a posture [rad and m]."""
UNTURNED = 1e-6
"""Rotation of a tool that may not rotate, by rounding of its pose [rad]."""


def postures_at(
    problem: Problem, R_AG: FloatArray, p_AG: FloatArray, samples: int, *, may_turn: bool = False
) -> FloatArray:
    """Return postures with the tool at a pose and all joints within their limits.

    Args:
        problem: The scene with its arm.
        R_AG: Pose of the tool in the arm base A: orientation, shape (3, 3).
        p_AG: Position [m], shape (3,).
        samples: Number of values of the free joint for an arm of seven joints with a closed form.
            For others of seven the curves of solutions are sampled at most 0.2 rad apart; arms of
            fewer joints have a finite number of postures, and all of them are returned.
        may_turn: Whether the tool of an arm of five joints may be rotated about
            `Problem.goals.turn`.

    Returns:
        Joint angles [rad], shape (n, 7); n is 0 if no posture is found.
    """
    arm = problem.arm
    if problem.chain.joints < 7:
        return _finite_postures(problem, R_AG, p_AG, may_turn)
    if is_outside(arm):
        return numeric_solutions(chain_of(problem), R_AG, p_AG)
    found = np.empty((samples * len(arm.branches), 7))
    low, high = arm.lower[arm.free], arm.upper[arm.free]
    if np.isfinite(low):
        angles = np.linspace(low, high, samples)
    else:
        angles = np.linspace(-np.pi, np.pi, samples, endpoint=False)
    count = _sampled_postures(arm, problem.chain.R, problem.chain.p, R_AG, p_AG, angles, found)
    return found[:count]


def _finite_postures(
    problem: Problem, R_AG: FloatArray, p_AG: FloatArray, may_turn: bool
) -> FloatArray:
    """Return all postures of an arm of five or six joints as `postures_at` does."""
    R, p = np.array(R_AG, dtype=np.float64, order="C"), np.array(p_AG, dtype=np.float64)
    if problem.chain.joints == 5:
        turned = new_five_joint_solver(problem)
        solve_turned(turned, R, p)
        found = turned.solutions[: turned.kept[0]]
        return found if may_turn else found[np.abs(turned.angle[: len(found)]) < UNTURNED]
    solver = new_six_joint_solver(problem)
    count = solve_six_joints(solver.arm, R, p, solver.solutions)
    return solver.solutions[: within_limits(solver.arm, solver.solutions, count)]


@jit
def _sampled_postures(
    arm: ArmSolver,
    chain_R: FloatArray,
    chain_p: FloatArray,
    R_AG: FloatArray,
    p_AG: FloatArray,
    angles: FloatArray,
    found: FloatArray,
) -> int:
    """Fill the solutions of the closed form at given angles of the free joint; return how many."""
    goal, error = np.empty((4, 3)), np.empty(6)
    link_R, link_p = np.empty((8, 3, 3)), np.empty((8, 3))
    R_AT, p_AT = np.empty((3, 3)), np.empty(3)
    wrist_goal(arm, R_AG, p_AG, goal)
    count = 0
    for angle in angles:
        for b in range(len(arm.branches)):
            q = found[count]
            sample_joints(arm, goal, arm.branches[b], angle, q)
            # Where there is no solution within the limits, joints are clipped: the tool misses.
            tool_pose(chain_R, chain_p, q, link_R, link_p, R_AT, p_AT)
            if pose_error(R_AT, p_AT, R_AG, p_AG, error) < AT_POSE:
                count += 1
    return count
