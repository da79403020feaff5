"""Score of one initial configuration at one pose of a goal, over what is free about it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.base_pose import pose_in_arm_base
from tcs.kernel.cache import inner
from tcs.kernel.contacts import NO_CONTACT, gripper_contact_at
from tcs.kernel.dexterity import ANY as ANY_MEASURE
from tcs.kernel.dexterity.measures import measure_at
from tcs.kernel.freedom.cap import cap_cosine, cap_pose
from tcs.kernel.freedom.forms import (
    FEW,
    FEWEST_JOINTS,
    FULL_TURN,
    HALF,
    PARAMETERS,
    TILT,
    TURNS,
    pose_of,
)
from tcs.kernel.freedom.goals import FreeGoals
from tcs.kernel.freedom.wrist_places import is_no_place
from tcs.kernel.kinematics import copy_joints
from tcs.kernel.problem import Problem
from tcs.kernel.scores import (
    ARM_BLOCKED,
    GRIPPER_BLOCKED_BY_ENVIRONMENT,
    GRIPPER_BLOCKED_BY_ROBOT,
    JOINT_LIMITS,
    NEARNESS,
    REACHED,
    TOO_FAR,
)
from tcs.kernel.solvers import THOROUGH, Solver, score_pose
from tcs.kernel.workspace import Workspace

SCALES = np.array([0.4, 0.2, 0.1])
"""Distances of the poses tried from the best one, in rounds of the refinement, as parts of the
range of each parameter."""
PROMISING = int(NEARNESS[GRIPPER_BLOCKED_BY_ROBOT])
"""Nearness of a sample from which further poses next to it are tried."""
BEYOND_LIMITS = int(NEARNESS[JOINT_LIMITS])
"""Nearness of a pose that no posture within the limits reaches, or more than that."""
CLOSE, PART = int(NEARNESS[ARM_BLOCKED]), 3
"""Nearness from which all of the poses next to a sample of any orientation are tried; next to
others, one in PART is."""
NONE, SOME, ALL = 0, 1, 2
"""How many of the poses next to a sample are tried."""
WIDEST_CAP = 0.5
"""Least cosine of the half-angle of a cap in which poses are made: a quarter of all directions."""
IN_CAP, TRIES_IN_CAP = 1000, 100
"""Number of poses made in a cap, and of those that are scored: at which the gripper is free."""
NEAR = 0.96
"""Fraction of the best measure so far that a quick look at another sample has to show: the measures
at samples of the free joint are this close to the best between them."""
ANY = -1.0
"""Bound of a measure that every solution exceeds."""
UNKNOWN = -2
"""In place of a contact code of the gripper: not looked for yet."""
SLABS = 4
"""Row of the first slab in the bounds of the reach."""
NO_SAMPLE = -1
"""In place of the number of a sample: a tool pose between them."""


class PlacedGoal(NamedTuple):
    """A pose of a goal at an initial configuration, whose base is in place."""

    state: int
    """The environment state."""
    torso: int
    """The torso level."""
    goal: int
    """Number of the pose."""
    list: int
    """Number of the list of tool poses that are tried."""


@inner
def score_free(
    problem: Problem,
    work: Workspace,
    solver: Solver,
    grippers: IntArray,
    state: int,
    torso: int,
    g: int,
) -> tuple[int, int]:
    """Score a pose over what is free about it: the best tool pose, refined.

    The samples are tried first. Where none reaches the goal, further poses follow, until one
    reaches it: those next to samples that come close, then, where any orientation serves, poses
    made within reach, and those of the widest cone. About the best pose, each free parameter is
    then varied by half the spacing, a quarter, and so on.

    Args:
        problem: The scene.
        work: Workspace with the environment in the arm base A.
        solver: `best` is filled with the joint angles [rad] of the solution if there is one.
        grippers: Contact codes of the gripper with the environment at each sample, shape (states,
            codes).
        state: The environment state.
        torso: The torso level.
        g: The pose.

    Returns:
        Reason and contact code, those of the first tool pose that comes farthest.
    """
    free = problem.goals.freedom
    goal = PlacedGoal(state, torso, g, g)
    best, u = np.empty(7), np.empty(PARAMETERS)
    bounds = _reach_in_goal(problem, work, goal)
    reason = _reach_of(bounds, free.around[g], free.around[g, 3])
    if reason != REACHED:
        return reason, NO_CONTACT
    reason, contact = _search_list(problem, work, solver, grippers, goal, bounds, u, best)
    if reason != REACHED and _is_spread(free, goal):
        cone = PlacedGoal(state, torso, g, free.fallback[g])
        if _try_cap(problem, work, solver, grippers, goal, bounds, u):
            reason = REACHED
            copy_joints(solver.best, best)
        elif _search_list(problem, work, solver, grippers, cone, bounds, u, best)[0] == REACHED:
            reason = REACHED
    if reason != REACHED:
        return reason, contact
    if problem.measure.of != ANY_MEASURE:
        _refine(problem, work, solver, grippers, goal, u, best, measure_at(problem, best))
    copy_joints(best, solver.best)
    return REACHED, NO_CONTACT


@inner
def _search_list(
    problem: Problem,
    work: Workspace,
    solver: Solver,
    grippers: IntArray,
    goal: PlacedGoal,
    bounds: FloatArray,
    u: FloatArray,
    best: FloatArray,
) -> tuple[int, int]:
    """Try the tool poses of a list: the best sample, or the first further one that reaches.

    Args:
        problem: The scene.
        work: Workspace with the environment in the arm base A.
        solver: The arm's solver.
        grippers: As for `score_free`.
        goal: The pose and the list.
        bounds: From `_reach_in_goal`.
        u: Filled with the parameters of the tool pose if there is one.
        best: Filled with the joint angles [rad] there.

    Returns:
        Reason and contact code, those of the first tool pose that comes farthest.
    """
    free = problem.goals.freedom
    worth = np.empty(free.first[goal.list + 1] - free.first[goal.list], np.int64)
    top, reason, contact = _try_samples(problem, work, solver, grippers, goal, bounds, worth, best)
    if top < 0:
        top, reason, contact = _try_next_to(
            problem, work, solver, grippers, goal, bounds, worth, reason, contact
        )
        if top >= 0:
            copy_joints(solver.best, best)
    if top < 0:
        return reason, contact
    for k in range(PARAMETERS):
        u[k] = free.u[free.start[goal.list] + top, k]
    return REACHED, NO_CONTACT


@inner
def _is_spread(free: FreeGoals, goal: PlacedGoal) -> bool:
    """Return whether the list is that of any orientation, of poses spread over all of them."""
    return free.form[goal.goal, TILT] >= np.pi and goal.list == goal.goal


@inner
def _try_samples(
    problem: Problem,
    work: Workspace,
    solver: Solver,
    grippers: IntArray,
    goal: PlacedGoal,
    bounds: FloatArray,
    worth: IntArray,
    best: FloatArray,
) -> tuple[int, int, int]:
    """Try the samples of a goal: all that are to be tried, of the others until one reaches it.

    Args:
        problem: The scene.
        work: Workspace with the environment in the arm base A.
        solver: The arm's solver.
        grippers: As for `score_free`.
        goal: The goal.
        bounds: From `_reach_in_goal`.
        worth: Filled with how many of the poses next to each sample are worth a try: ALL, SOME or
            NONE; shape (samples,).
        best: Filled with the joint angles [rad] at the best sample.

    Returns:
        The best sample, or -1; reason and contact code of the first one that comes farthest.
    """
    free, start = problem.goals.freedom, problem.goals.freedom.start[goal.list]
    any_orientation = _is_spread(free, goal)
    reason, contact, farthest = TOO_FAR, NO_CONTACT, -1
    # Poses of any orientation are many: what one of them leaves out, another one finds.
    value, top, least = -1.0, -1, ANY if any_orientation else THOROUGH
    for n in range(len(worth)):
        if top >= 0 and problem.measure.of == ANY_MEASURE:
            break
        if top >= 0 and not free.is_tried[start + n]:
            continue
        worth[n] = ALL
        why, code = _reach_of(bounds, free.wrist[start + n], 0.0), NO_CONTACT
        if why != REACHED:
            # The edge of what is within reach may be next to it.
            came = NEARNESS[why]
            if came > farthest:
                farthest, reason, contact = came, why, code
            continue
        lost = _is_lost(problem, bounds, free.wrist[start + n])
        if lost:
            # Poses next to it may be within the limits; its reason counts where none is nearer.
            worth[n] = SOME if any_orientation else ALL
            if farthest >= BEYOND_LIMITS:
                continue
        u = free.u[start + n]
        near = top >= 0 and not any_orientation and (u[1] != 0.0 or u[2] != 0.0)
        if near:
            copy_joints(best, solver.best)
        # Next to a tilted or displaced pose there are others: a quick look is enough there.
        bound = ANY if least < ANY and _is_moved(u) else least
        why, code = _score_at(problem, work, solver, grippers, goal, n, u, bound, near)
        if why == REACHED:
            measure = measure_at(problem, solver.best)
            if measure > value:
                value, top, least = measure, n, NEAR * measure
                copy_joints(solver.best, best)
        came = NEARNESS[why]
        if not lost and came < PROMISING and why != GRIPPER_BLOCKED_BY_ENVIRONMENT:
            worth[n] = NONE
        elif not lost and PROMISING <= came < CLOSE and any_orientation:
            worth[n] = SOME
        if came > farthest:
            farthest, reason, contact = came, why, code
    return top, reason, contact


@inner
def _is_moved(u: FloatArray) -> bool:
    """Return whether a tool pose is tilted or displaced."""
    for k in range(1, PARAMETERS):
        if u[k] != 0.0:
            return True
    return False


@inner
def _try_next_to(
    problem: Problem,
    work: Workspace,
    solver: Solver,
    grippers: IntArray,
    goal: PlacedGoal,
    bounds: FloatArray,
    worth: IntArray,
    reason: int,
    contact: int,
) -> tuple[int, int, int]:
    """Try further poses next to the samples, until one reaches the goal.

    Args:
        problem: The scene.
        work: Workspace with the environment in the arm base A.
        solver: `best` is filled with the joint angles [rad] of the solution if there is one.
        grippers: As for `score_free`.
        goal: The goal.
        bounds: From `_reach_in_goal`.
        worth: From `_try_samples`.
        reason: Reason of the sample that came farthest.
        contact: Contact code of that sample.

    Returns:
        The pose that reaches the goal, or -1; reason and contact code as `_try_samples`.
    """
    free, start = problem.goals.freedom, problem.goals.freedom.start[goal.list]
    farthest = NEARNESS[reason]
    for n in range(len(worth)):
        first, last = free.child_first[start + n], free.child_first[start + n + 1]
        if worth[n] == NONE:
            continue
        if worth[n] == SOME:
            last = first + (last - first) // PART
        for child in range(first, last):
            k = free.children[child]
            if _reach_of(bounds, free.wrist[start + k], 0.0) != REACHED:
                continue
            if farthest >= BEYOND_LIMITS and _is_lost(problem, bounds, free.wrist[start + k]):
                continue
            nearest = free.parents[start + k, 0]
            if nearest != n and worth[nearest] >= worth[n]:
                # Tried as a pose next to the other sample.
                continue
            u = free.u[start + k]
            why, code = _score_at(problem, work, solver, grippers, goal, NO_SAMPLE, u, ANY, False)
            if why == REACHED:
                return k, why, code
            came = NEARNESS[why]
            if came > farthest:
                farthest, reason, contact = came, why, code
    return -1, reason, contact


@inner
def _try_cap(
    problem: Problem,
    work: Workspace,
    solver: Solver,
    grippers: IntArray,
    goal: PlacedGoal,
    bounds: FloatArray,
    u: FloatArray,
) -> bool:
    """Try poses made within reach of a goal that any orientation serves, until one reaches it.

    Args:
        problem: The scene.
        work: Workspace with the environment in the arm base A.
        solver: `best` is filled with the joint angles [rad] of the solution if there is one.
        grippers: As for `score_free`.
        goal: The goal.
        bounds: From `_reach_in_goal`.
        u: Filled with the parameters of the pose that reaches the goal.
    """
    form, reach = problem.goals.freedom.form[goal.goal], problem.goals.freedom.reach
    cosine = cap_cosine(reach.wrist, bounds[0, :3], reach.span)
    if cosine < WIDEST_CAP or cosine > 1.0:
        return False
    tries = 0
    for n in range(IN_CAP):
        if tries == TRIES_IN_CAP:
            break
        cap_pose(form, reach.wrist, bounds[0, :3], cosine, n, u)
        why, _ = _score_at(problem, work, solver, grippers, goal, NO_SAMPLE, u, ANY, False)
        if why == REACHED:
            return True
        if why != GRIPPER_BLOCKED_BY_ENVIRONMENT:
            tries += 1
    return False


@inner
def _score_at(
    problem: Problem,
    work: Workspace,
    solver: Solver,
    grippers: IntArray,
    goal: PlacedGoal,
    sample: int,
    u: FloatArray,
    least: float,
    near: bool,
) -> tuple[int, int]:
    """Score a tool pose.

    Args:
        problem: The scene.
        work: Workspace with the environment in the arm base A.
        solver: `best` is filled with the joint angles [rad] of the solution if there is one.
        grippers: As for `score_free`.
        goal: The goal.
        sample: Number of the sample in its list, NO_SAMPLE for another tool pose.
        u: Parameters of the tool pose, shape (PARAMETERS,).
        least: As for `score_pose`.
        near: As for `score_pose`.
    """
    state, torso, g = goal.state, goal.torso, goal.goal
    if problem.goals.freedom.turned[g]:
        return _score_turned(problem, work, solver, grippers, goal, sample, u, least, near)
    R, p, body_A = np.empty((3, 3)), np.empty(3), problem.body.shapes_A[torso]
    code = _gripper_contact(problem, work, grippers, goal, sample, 0, u, R, p)
    if code != NO_CONTACT:
        return GRIPPER_BLOCKED_BY_ENVIRONMENT, code
    return score_pose(problem, work, body_A, state, torso, R, p, least, near, solver)


@inner
def _score_turned(
    problem: Problem,
    work: Workspace,
    solver: Solver,
    grippers: IntArray,
    goal: PlacedGoal,
    sample: int,
    u: FloatArray,
    least: float,
    near: bool,
) -> tuple[int, int]:
    """Score a tool pose that the last joint may turn on the spot.

    The other joints do not depend on the angle, nor does the measure. So one angle decides for all
    at which the last joint is within its limits, unless a link touched the gripper, which turns;
    further angles are tried until those at hand cover every angle of the last joint.

    The arguments are those of `_score_at`; u is the tool pose at angle 0.
    """
    state, torso, body_A = goal.state, goal.torso, problem.body.shapes_A[goal.torso]
    R, p, turned = np.empty((3, 3)), np.empty(3), np.empty(PARAMETERS)
    last = problem.arm.upper[6] - problem.arm.lower[6]
    tried, tries, met_gripper = np.empty(len(TURNS)), 0, False
    found, value, kept = False, -1.0, np.empty(7)
    reason, contact, farthest = TOO_FAR, NO_CONTACT, -1
    for angle in range(angles_of(problem.goals.freedom, goal.goal, sample)):
        if found and (problem.measure.of == ANY_MEASURE or (met_gripper and angle >= FEW)):
            break
        if tries and not met_gripper and _is_covered(tried, tries, TURNS[angle], last):
            if last >= FULL_TURN:
                break
            continue
        turned_parameters(u, angle, turned)
        why = GRIPPER_BLOCKED_BY_ENVIRONMENT
        code = _gripper_contact(problem, work, grippers, goal, sample, angle, turned, R, p)
        if code == NO_CONTACT:
            work.met_gripper[0] = False
            why, code = score_pose(problem, work, body_A, state, torso, R, p, least, near, solver)
            if why != GRIPPER_BLOCKED_BY_ROBOT:
                tried[tries] = TURNS[angle]
                tries += 1
                met_gripper = (why == ARM_BLOCKED or why == REACHED) and work.met_gripper[0]
            if why == REACHED:
                measure = measure_at(problem, solver.best)
                if measure > value:
                    found, value, least = True, measure, max(least, NEAR * measure)
                    copy_joints(solver.best, kept)
        came = NEARNESS[why]
        if came > farthest:
            farthest, reason, contact = came, why, code
    if found:
        copy_joints(kept, solver.best)
    return reason, contact


@inner
def _is_covered(tried: FloatArray, tries: int, angle: float, last: float) -> bool:
    """Return whether angles that were tried leave the last joint nothing new at another one.

    Where two angles are no farther apart than its range, the values that it takes at an angle in
    between are among those at these two.

    Args:
        tried: Angles that were tried [rad], shape (tries or more,).
        tries: Their number, one or more.
        angle: The angle [rad].
        last: Range of the last joint [rad].
    """
    before, after = FULL_TURN, FULL_TURN
    for k in range(tries):
        back = (angle - tried[k]) % FULL_TURN
        before, after = min(before, back), min(after, (FULL_TURN - back) % FULL_TURN)
    return before + after <= last


@inner
def _gripper_contact(
    problem: Problem,
    work: Workspace,
    grippers: IntArray,
    goal: PlacedGoal,
    sample: int,
    angle: int,
    u: FloatArray,
    R: FloatArray,
    p: FloatArray,
) -> int:
    """Fill the tool pose in W of parameters u; return the gripper's contact with the environment.

    For the sample and the number of the angle, the contact is known in most cases; of an arm of
    five joints, it is checked when the arm is solved.
    """
    free, g, state = problem.goals.freedom, goal.goal, goal.state
    first, last = free.codes[goal.list], free.codes[goal.list + 1]
    code = UNKNOWN
    if sample != NO_SAMPLE and last > first:
        if free.turned[g] and sample > 0:
            first += len(TURNS) + FEW * (sample - 1)
        elif not free.turned[g]:
            first += sample
        code = grippers[state, first + angle]
    if code >= 0:
        return code
    pose_of(free.form[g], u, problem.goals.R[state, g], problem.goals.p[state, g], R, p)
    if code == NO_CONTACT or problem.chain.joints == FEWEST_JOINTS:
        return NO_CONTACT
    return gripper_contact_at(problem, work, state, R, p)


@inner
def angles_of(free: FreeGoals, g: int, sample: int) -> int:
    """Return the number of angles at which the arm turns a tool pose, see `TURNS`.

    Args:
        free: The freedom.
        g: Number of a pose.
        sample: Number of a sample of it, 0 for the nominal tool pose, NO_SAMPLE for others.
    """
    if not free.turned[g]:
        return 1
    return len(TURNS) if sample == 0 else FEW


@inner
def turned_parameters(u: FloatArray, angle: int, turned: FloatArray) -> None:
    """Fill the parameters of a tool pose that is turned by an angle of `TURNS`."""
    for k in range(PARAMETERS):
        turned[k] = u[k]
    if angle:
        turned[0] += TURNS[angle]


@inner
def _refine(
    problem: Problem,
    work: Workspace,
    solver: Solver,
    grippers: IntArray,
    goal: PlacedGoal,
    u: FloatArray,
    best: FloatArray,
    value: float,
) -> None:
    """Climb from the pose with parameters u to a better one; u and `best` follow."""
    free, g, trial = problem.goals.freedom, goal.goal, np.empty(PARAMETERS)
    for scale in SCALES:
        for parameter in range(PARAMETERS):
            step = scale * free.step[g, parameter]
            if step == 0.0:
                continue
            for side in range(2):
                for k in range(PARAMETERS):
                    trial[k] = u[k]
                trial[parameter] += step if side == 0 else -step
                clip(free.form[g], trial)
                least = NEAR * value
                copy_joints(best, solver.best)
                why, _ = _score_at(
                    problem, work, solver, grippers, goal, NO_SAMPLE, trial, least, True
                )
                if why != REACHED:
                    continue
                measure = measure_at(problem, solver.best)
                if measure > value:
                    value = measure
                    copy_joints(solver.best, best)
                    for k in range(PARAMETERS):
                        u[k] = trial[k]
                    break


@inner
def clip(form: FloatArray, u: FloatArray) -> None:
    """Move the parameters u of a freedom into its bounds, in place."""
    tilt = np.hypot(u[1], u[2])
    if tilt > form[TILT]:
        u[1] *= form[TILT] / tilt
        u[2] *= form[TILT] / tilt
    for k in range(3):
        half = form[HALF + k]
        u[3 + k] = min(max(u[3 + k], -half), half)


@inner
def _reach_in_goal(problem: Problem, work: Workspace, goal: PlacedGoal) -> FloatArray:
    """Return the bounds of the arm's reach in the frame of the goal, shape (SLABS + slabs, 4).

    The first row is the pivot and the greatest distance from it. The next ones take a point to the
    frame of joint 1: their product with it, and what is added to that. The others are the slabs.
    """
    R_WG, p_WG = problem.goals.R[goal.state, goal.goal], problem.goals.p[goal.state, goal.goal]
    pose_in_arm_base(problem, work, goal.torso, R_WG, p_WG)
    R, p, reach = work.R_AG, work.p_AG, problem.goals.freedom.reach
    found, R_A1, p_A1 = np.empty((SLABS + len(reach.slabs), 4)), reach.places.R, reach.places.p
    for k in range(3):
        found[0, k] = 0.0
        for r in range(3):
            found[0, k] += R[r, k] * (reach.pivot[r] - p[r])
    found[0, 3] = reach.span
    for n in range(3):
        found[1 + n, 3] = 0.0
        for r in range(3):
            found[1 + n, 3] += R_A1[r, n] * (p[r] - p_A1[r])
        for k in range(3):
            found[1 + n, k] = R_A1[0, n] * R[0, k] + R_A1[1, n] * R[1, k] + R_A1[2, n] * R[2, k]
    for n in range(len(reach.slabs)):
        for k in range(3):
            found[SLABS + n, k] = 0.0
            for r in range(3):
                found[SLABS + n, k] += R[r, k] * reach.slabs[n, r]
        found[SLABS + n, 3] = reach.slabs[n, 3]
    return found


@inner
def _is_lost(problem: Problem, reach: FloatArray, at: FloatArray) -> bool:
    """Return whether no posture within the joint limits takes the wrist to a position.

    Args:
        problem: The scene.
        reach: From `_reach_in_goal`.
        at: Position of the wrist in the frame of the goal [m], shape (3,).
    """
    x = reach[1, 0] * at[0] + reach[1, 1] * at[1] + reach[1, 2] * at[2] + reach[1, 3]
    y = reach[2, 0] * at[0] + reach[2, 1] * at[1] + reach[2, 2] * at[2] + reach[2, 3]
    z = reach[3, 0] * at[0] + reach[3, 1] * at[1] + reach[3, 2] * at[2] + reach[3, 3]
    return is_no_place(problem.goals.freedom.reach.places, x, y, z)


@inner
def _reach_of(reach: FloatArray, at: FloatArray, radius: float) -> int:
    """Return TOO_FAR or JOINT_LIMITS if a wrist is out of reach, by what bounds it, else REACHED.

    Args:
        reach: From `_reach_in_goal`.
        at: Position of the wrist in the frame of the goal [m], shape (3 or more,).
        radius: How far from there it may be [m].
    """
    x, y, z = at[0] - reach[0, 0], at[1] - reach[0, 1], at[2] - reach[0, 2]
    span = reach[0, 3] + radius
    if x * x + y * y + z * z > span * span:
        return TOO_FAR
    for n in range(SLABS, len(reach)):
        along = reach[n, 0] * x + reach[n, 1] * y + reach[n, 2] * z
        if abs(along) > reach[n, 3] + radius:
            return JOINT_LIMITS
    return REACHED
