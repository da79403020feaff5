"""The best approachable posture of one reached pair, for an arm whose postures there are a list.

The goal leaves arms of five and six joints a few postures. Through each of them leads one line, or,
with five joints, one along which the tool may rotate about the axis that goals leave free.
"""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np

from tcs.kernel.analytic.scratch import best_of
from tcs.kernel.approach.curve import place_line
from tcs.kernel.approach.lines import AT_GOAL, lead_from
from tcs.kernel.approach.memory import ListedApproach
from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner
from tcs.kernel.contacts import NO_CONTACT
from tcs.kernel.dexterity.measures import measure_at, rounded_inward
from tcs.kernel.five_joints.score_turned import FiveJointSolver, solve_turned
from tcs.kernel.kinematics import copy_joints, tool_pose
from tcs.kernel.motion.edges import posture_is_free
from tcs.kernel.motion.straight import DONE
from tcs.kernel.motion.tool_line import may_turn
from tcs.kernel.problem import Problem
from tcs.kernel.scores import APPROACH_BLOCKED, APPROACH_LIMITS, REACHED
from tcs.kernel.six_joints.score_solutions import SixJointSolver, out_of_reach

Listed = TypeVar("Listed", SixJointSolver, FiveJointSolver)

TRIED = -1.0
"""Measure of a posture whose line has been followed."""


@inner
def approach_of_six(
    problem: Problem, approach: ListedApproach[SixJointSolver], fastest: FloatArray, q: FloatArray
) -> int:
    """Do as `solvers.approach_pair` for an arm of six joints."""
    if follow_posture(problem, approach, fastest, q) == DONE:
        return -1
    out_of_reach(problem, approach.work, approach.search)
    return _best_listed(problem, approach, fastest)


@inner
def approach_of_five(
    problem: Problem, approach: ListedApproach[FiveJointSolver], fastest: FloatArray, q: FloatArray
) -> int:
    """Do as `solvers.approach_pair` for an arm of five joints."""
    if follow_posture(problem, approach, fastest, q) == DONE:
        return -1
    solve_turned(approach.search, approach.work.R_AG, approach.work.p_AG)
    return _best_listed(problem, approach, fastest)


@inner
def _best_listed(problem: Problem, approach: ListedApproach[Listed], fastest: FloatArray) -> int:
    """Fill `search.best` with the best listed posture whose line is free.

    Args:
        problem: The scene.
        approach: `search` holds the postures; `contact` is filled as for `solvers.approach_pair`.
        fastest: As for `solvers.approach_pair`.

    Returns:
        REACHED, APPROACH_LIMITS or APPROACH_BLOCKED.
    """
    search, count = approach.search, approach.search.kept[0]
    for n in range(count):
        search.measure[n] = measure_at(problem, search.solutions[n])
    for _ in range(count):
        top = best_of(search.measure, count)
        search.measure[top] = TRIED
        if leads_from(problem, approach, fastest, search.solutions[top]):
            return REACHED
    return refusal(approach)


@inner
def leads_from(
    problem: Problem, approach: ListedApproach[Any], fastest: FloatArray, q: FloatArray
) -> bool:
    """Return whether a posture at the goal, as it is stored, is free and so is its line.

    Args:
        problem: The scene.
        approach: As for `solvers.approach_pair`; `search.best` is filled with the posture if it is.
        fastest: As for `solvers.approach_pair`.
        q: The posture [rad], shape (7,).
    """
    stored = approach.q
    rounded_inward(q, problem.arm.lower, problem.arm.upper, stored)
    if not posture_is_free(approach.scene, approach.motion, stored):
        return False
    _place_line(problem, approach, stored)
    if lead_from(problem, approach, fastest, AT_GOAL, stored) != DONE:
        return False
    copy_joints(stored, approach.search.best)
    return True


@inner
def refusal(approach: ListedApproach[Any]) -> int:
    """Return why no line is free: APPROACH_BLOCKED if one is within the limits."""
    return APPROACH_LIMITS if approach.contact[0] == NO_CONTACT else APPROACH_BLOCKED


@inner
def follow_posture(
    problem: Problem, approach: ListedApproach[Any], fastest: FloatArray, q: FloatArray
) -> int:
    """Do as `solvers.follow_posture`: the line through the posture is the only one."""
    approach.contact[0] = NO_CONTACT
    _place_line(problem, approach, q)
    return lead_from(problem, approach, fastest, AT_GOAL, q)


@inner
def _place_line(problem: Problem, approach: ListedApproach[Any], q: FloatArray) -> None:
    """Let the line begin at the goal, or where a posture holds a tool that is free to rotate."""
    if may_turn(approach.scene):
        work, offset = approach.work, approach.offset
        x, y, z = _in_tool(work.R_AG, offset)
        link_R, link_p = np.empty((8, 3, 3)), np.empty((8, 3))
        tool_pose(problem.chain.R, problem.chain.p, q, link_R, link_p, work.R_AG, work.p_AG)
        for r in range(3):
            offset[r] = work.R_AG[r, 0] * x + work.R_AG[r, 1] * y + work.R_AG[r, 2] * z
    place_line(approach.scene, approach.work, approach.curve)


@inner
def _in_tool(R: FloatArray, v: FloatArray) -> tuple[float, float, float]:
    """Return a vector in the frame of the tool, whose orientation is R."""
    return (
        R[0, 0] * v[0] + R[1, 0] * v[1] + R[2, 0] * v[2],
        R[0, 1] * v[0] + R[1, 1] * v[1] + R[2, 1] * v[2],
        R[0, 2] * v[0] + R[1, 2] * v[1] + R[2, 2] * v[2],
    )
