"""The best approachable posture of one reached pair."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.analytic.ik import sample_joints
from tcs.kernel.analytic.pairs import measure_of, samples_hold_measure
from tcs.kernel.analytic.scratch import Search, new_search, sort_candidates
from tcs.kernel.analytic.solver import ArmSolver
from tcs.kernel.approach.curve import (
    CurveWorkspace,
    fill_spline,
    new_curve,
    path_touches,
    place_line,
    spline_is_free,
)
from tcs.kernel.approach.grid import (
    NOWHERE,
    PIECES,
    LineGrid,
    close_node,
    column_at,
    find_onward,
    new_grid,
    open_levels,
    place_columns,
    place_fine_columns,
    place_levels,
    take_path,
)
from tcs.kernel.approach.scene import LineScene, pair_contact_code
from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner, int_constant
from tcs.kernel.contacts import (
    NO_CONTACT,
    Workspace,
    arm_contact,
    gripper_body_contact,
    new_workspace,
    place_gripper,
)
from tcs.kernel.kinematics import copy_joints
from tcs.kernel.motion.scene import MotionScene, MotionWorkspace, new_motion_workspace
from tcs.kernel.motion.straight import BLOCKED, DONE, LIMITS
from tcs.kernel.problem import Problem
from tcs.kernel.scores import APPROACH_BLOCKED, APPROACH_LIMITS, REACHED

PATH_SPEED = 0.8
"""Fraction of the velocity limit up to which the free joint moves from level to level: cubics
through the levels are faster in between."""
STRIDE = 8
"""Number of columns from one of the postures tried first to the next."""
NEAR = 8
"""Number of columns on either side of the posture that scoring found, whose line is tried first."""
MOST_CURVES = 100
"""Greatest number of motions that are followed for a pair."""
NARROW = 16
"""Greatest number of columns of a window that is searched again if no line leads beyond it: further
on it may be narrower than their spacing."""
FINE, TIMES = 8, 2
"""Factor by which the columns are closer then, and how often."""
SHIFTS = 4
"""Number of times that the columns are moved by a part of their spacing, until a line is free."""
ENOUGH = 1_000_000
"""In place of the number of motions: no other can be free."""
GRIPPER = 7
"""Link of the gripper, whose motion is the same from every posture."""
PHASE = 1e6
"""Above any measure: sort key of postures that are tried later."""
CLOSED = -2
"""Outcome of a posture that is in contact, or has no path of the free joint."""
UNKNOWN = -2
"""In place of a contact: not looked at yet."""
AT_GOAL = int_constant(0)
"""Level of the goal."""


class Approach(NamedTuple):
    """Memory of one worker."""

    work: Workspace
    search: Search
    grid: LineGrid
    scene: MotionScene
    boxes: FloatArray
    """As in `LineScene`."""
    moving: IntArray
    """As in `LineScene`."""
    motion: MotionWorkspace
    curve: CurveWorkspace
    offset: FloatArray
    """Motion of the tool from the goal to the begin of the approach, in A [m], shape (3,)."""
    columns: IntArray
    """Number of columns of the grid, and of those that the free joint moves from level to level;
    column and branch of the posture that scoring found; number of motions followed; torso level; 1
    if lines are looked at first where others were blocked; shape (7,)."""
    gripper: IntArray
    """Contact of the gripper with the robot's body at each level, as a code, or UNKNOWN: it is the
    same for all postures; then the level at which the gripper is placed; shape (PIECES + 2,)."""
    contact: IntArray
    """First contact that blocked a motion, as a code, shape (1,)."""


def new_approach(problem: Problem, lines: LineScene) -> Approach:
    """Return the memory of one worker, given the `approach_scene` of the problem."""
    scene = lines.motion._replace(centre=lines.motion.centre.copy())
    return Approach(
        new_workspace(problem),
        new_search(),
        new_grid(),
        scene,
        lines.boxes,
        lines.moving,
        new_motion_workspace(scene),
        new_curve(),
        np.empty(3),
        np.zeros(7, np.int64),
        np.zeros(PIECES + 2, np.int64),
        np.zeros(1, np.int64),
    )


@inner
def approach_pair(problem: Problem, approach: Approach, fastest: FloatArray, q: FloatArray) -> int:
    """Find the best posture of a reached pair that can be left backwards along the approach.

    Args:
        problem: The scene.
        approach: `work`, `scene` and `offset` are in place. `search.best` is filled with the joint
            angles [rad] if another posture than q is the best, `contact` if all are blocked.
        fastest: Greatest motion of each joint for the whole line at constant rate [rad], shape
            (7,).
        q: Joint angles that scoring found [rad], shape (7,).

    Returns:
        REACHED, APPROACH_LIMITS or APPROACH_BLOCKED; -1 if q itself is approachable.
    """
    _prepare(problem, approach, fastest, q)
    columns = approach.columns
    b = columns[3]
    first, last = max(columns[2] - NEAR, 0), min(columns[2] + NEAR, columns[0] - 1)
    if _open(problem, approach, b, first, last) and (
        _follow(problem, approach, fastest, b, columns[2], True) == DONE
    ):
        return -1
    for shift in range(SHIFTS):
        if columns[4] == ENOUGH:
            break
        if shift > 0:
            # Between the columns lie windows that are narrower than their spacing.
            arm, step = problem.arm, approach.grid.origin[1]
            angle = q[arm.free] + shift / SHIFTS * step
            if angle > arm.upper[arm.free]:
                angle -= step
            if angle < arm.lower[arm.free]:
                break
            columns[0], columns[4] = place_columns(arm, approach.grid, angle), 0
        if shift == SHIFTS - 1:
            columns[6] = 0
        if _search(problem, approach, fastest):
            return REACHED
        if approach.contact[0] == NO_CONTACT:
            if _search_narrow(problem, approach, fastest):
                return REACHED
            if approach.contact[0] == NO_CONTACT:
                return APPROACH_LIMITS
            break
    return APPROACH_BLOCKED


@inner
def _search(problem: Problem, approach: Approach, fastest: FloatArray) -> bool:
    """Fill `search.best` with the best approachable node; return whether there is one."""
    for b in range(len(problem.arm.branches)):
        _open(problem, approach, b, 0, approach.columns[0] - 1)
    return _follow_candidates(problem, approach, fastest)


@inner
def _search_narrow(problem: Problem, approach: Approach, fastest: FloatArray) -> bool:
    """Search where no line leads beyond a narrow window, at a finer spacing around that.

    Returns:
        Whether a node is approachable; the best one on its branch fills `search.best`.
    """
    arm, grid, columns = problem.arm, approach.grid, approach.columns
    first, step = grid.origin[0], grid.origin[1]
    for b in range(len(arm.branches)):
        level = grid.deepest[b]
        if level == NOWHERE or level == PIECES:
            continue
        low, high = grid.spans[b, level, 0], grid.spans[b, level, 1]
        if high - low >= NARROW:
            continue
        angle, spacing = first + 0.5 * (low + high) * step, step
        for _ in range(TIMES):
            spacing /= FINE
            _place_fine(arm, approach, fastest, angle, spacing)
            for other in range(len(arm.branches)):
                for i in range(columns[0]):
                    grid.onward[other, 0, i] = NOWHERE
            if _open(problem, approach, b, 0, columns[0] - 1):
                if _follow_candidates(problem, approach, fastest):
                    return True
                break
            level = grid.deepest[b]
            if level == NOWHERE:
                break
            low, high = grid.spans[b, level, 0], grid.spans[b, level, 1]
            angle = grid.origin[0] + 0.5 * (low + high) * spacing
    return False


@inner
def _place_fine(
    arm: ArmSolver, approach: Approach, fastest: FloatArray, through: float, spacing: float
) -> None:
    """Place columns at a fine spacing around an angle of the free joint [rad]."""
    columns, grid = approach.columns, approach.grid
    columns[0], columns[4] = place_fine_columns(arm, grid, through, spacing), 0
    columns[1] = _most_columns(arm, grid, fastest)
    columns[2] = int((through - grid.origin[0]) / grid.origin[1] + 0.5)


@inner
def _most_columns(arm: ArmSolver, grid: LineGrid, fastest: FloatArray) -> int:
    """Return the number of columns that the free joint may move from level to level."""
    return int(PATH_SPEED * fastest[arm.free] / (PIECES * grid.origin[1]))


@inner
def _follow_candidates(problem: Problem, approach: Approach, fastest: FloatArray) -> bool:
    """Fill `search.best` with the best approachable open node; return whether there is one."""
    columns, search = approach.columns, approach.search
    for rank in range(_list_candidates(problem, approach)):
        n = search.order[rank]
        b, i = search.found_branch[n], search.found_pair[n, 0]
        if _follow(problem, approach, fastest, b, i, False) == DONE:
            copy_joints(approach.curve.points[0], search.best)
            if rank > 0:
                _climb(problem, approach, fastest, b, i)
            return True
        if columns[4] > MOST_CURVES:
            break
    return False


@inner
def follow_posture(problem: Problem, approach: Approach, fastest: FloatArray, q: FloatArray) -> int:
    """Follow the line from a posture at the goal; return DONE if it succeeds.

    Args:
        problem: The scene.
        approach: As for `approach_pair`; the spline is filled.
        fastest: As for `approach_pair`.
        q: Joint angles of a posture free of contact [rad], shape (7,).
    """
    _prepare(problem, approach, fastest, q)
    b, columns = approach.columns[3], approach.columns
    columns[6] = 0
    arm, spacing, outcome = problem.arm, approach.grid.origin[1], CLOSED
    for n in range(TIMES + 1):
        if n > 0:
            spacing /= FINE
            _place_fine(arm, approach, fastest, q[arm.free], spacing)
        if _open(problem, approach, b, 0, columns[0] - 1):
            outcome = _follow(problem, approach, fastest, b, columns[2], True)
        if outcome == DONE or outcome == BLOCKED:
            break
    return outcome


@inner
def _open(problem: Problem, approach: Approach, b: int, first: int, last: int) -> bool:
    """Fill the nodes of a branch from columns at the goal; return whether the line is complete."""
    grid, columns = approach.grid, approach.columns
    if open_levels(problem.arm, approach.search, grid, b, columns[0], columns[1], first, last):
        find_onward(grid, b, columns[0], columns[1])
        return True
    for i in range(columns[0]):
        grid.onward[b, 0, i] = NOWHERE
    return False


@inner
def _prepare(problem: Problem, approach: Approach, fastest: FloatArray, q: FloatArray) -> None:
    """Place line and grid, and find column and branch of the posture that scoring found."""
    arm, grid, search, columns = problem.arm, approach.grid, approach.search, approach.columns
    place_levels(arm, approach.work, approach.offset, grid)
    place_line(approach.work, approach.curve)
    angle = q[arm.free]
    columns[0] = place_columns(arm, grid, angle)
    columns[1] = _most_columns(arm, grid, fastest)
    columns[2] = int((angle - grid.origin[0]) / grid.origin[1] + 0.5)
    columns[3], columns[4], columns[6] = 0, 0, 1
    approach.contact[0] = NO_CONTACT
    for level in range(PIECES + 1):
        approach.gripper[level] = UNKNOWN
    approach.gripper[PIECES + 1] = NOWHERE
    least = np.inf
    for b in range(len(arm.branches)):
        sample_joints(arm, grid.goal[0], arm.branches[b], angle, search.q)
        error = 0.0
        for k in range(7):
            error += 1.0 - np.cos(search.q[k] - q[k])
        if error < least:
            least, columns[3] = error, b


@inner
def _follow(
    problem: Problem,
    approach: Approach,
    fastest: FloatArray,
    b: int,
    column: int,
    is_free: bool,
) -> int:
    """Follow the line from a node at the goal, around contacts that are met.

    A node in contact is closed, and so is one from which the line cannot be followed.

    Args:
        problem: The scene.
        approach: The grid is filled; so is the spline.
        fastest: As for `approach_pair`.
        b: The branch.
        column: The column of the node.
        is_free: Whether the node is known to be free of contact.

    Returns:
        DONE, LIMITS, BLOCKED or CLOSED.
    """
    grid, columns, scene = approach.grid, approach.columns, approach.scene
    motion, curve = approach.motion, approach.curve
    if is_free:
        grid.is_free[b, 0, column] = True
    outcome = CLOSED
    while grid.onward[b, 0, column] != NOWHERE and columns[4] <= MOST_CURVES:
        take_path(grid, b, column)
        if columns[6] == 1 and path_touches(
            problem.arm, scene, motion, grid, curve, b, approach.offset
        ):
            outcome = BLOCKED
            if not is_free:
                # Closing the node would close it to postures too whose lines lead past the contact.
                break
            level = curve.blocked[0]
            i = column_at(grid, b, column, level)
            close_node(grid, b, level, i, columns[0], columns[1])
            continue
        level, contact = _first_contact(problem, approach, b, column)
        # A contact counts on lines only that limits allow.
        if level == NOWHERE or (level > 0 and approach.contact[0] == NO_CONTACT):
            columns[4] += 1
            if not fill_spline(
                problem.arm, scene, motion, grid, curve, b, approach.offset, fastest
            ):
                outcome = LIMITS
                break
        if level == NOWHERE:
            if spline_is_free(scene, motion, curve):
                outcome = DONE
                break
            level, k = curve.blocked[0], curve.blocked[1]
            contact = pair_contact_code(problem, scene, k)
            if scene.pair[k, 2] == 0 and scene.link_frame[scene.pair[k, 0]] == GRIPPER:
                approach.contact[0], columns[4] = contact, ENOUGH
                outcome = BLOCKED
                break
        if level > 0:
            outcome = BLOCKED
            if approach.contact[0] == NO_CONTACT:
                approach.contact[0] = contact
            if approach.gripper[level] >= 0:
                columns[4] = ENOUGH
                break
        close_node(grid, b, level, column_at(grid, b, column, level), columns[0], columns[1])
    if outcome != DONE:
        grid.is_open[b, 0, column] = False
        grid.onward[b, 0, column] = NOWHERE
    return outcome


@inner
def _first_contact(problem: Problem, approach: Approach, b: int, column: int) -> tuple[int, int]:
    """Return a level at which the path from a column is in contact, or NOWHERE, and the contact.

    Until a contact is known, most paths are free, and only the goal is checked.
    """
    grid = approach.grid
    for n in range(PIECES + 1):
        # The goal, then from the begin of the approach on.
        level = (PIECES + 1 - n) % (PIECES + 1)
        if level > 0 and approach.contact[0] == NO_CONTACT:
            continue
        i = column_at(grid, b, column, level)
        if grid.is_free[b, level, i]:
            continue
        contact = _contact_at(problem, approach, b, i, level)
        if contact != NO_CONTACT:
            return level, contact
        grid.is_free[b, level, i] = True
    return NOWHERE, NO_CONTACT


@inner
def _contact_at(problem: Problem, approach: Approach, b: int, i: int, level: int) -> int:
    """Return the contact of a node of the grid, or NO_CONTACT."""
    work, grid, q, gripper = approach.work, approach.grid, approach.search.q, approach.gripper
    body_A = problem.body_A[approach.columns[5]]
    for r in range(3):
        work.p_AG[r] = approach.curve.line.p_AT[r] + level / PIECES * approach.offset[r]
    if gripper[level] == UNKNOWN:
        gripper[level] = gripper_body_contact(problem, work, body_A)
    elif gripper[PIECES + 1] != level:
        place_gripper(problem, work, work.R_AG, work.p_AG)
    gripper[PIECES + 1] = level
    if gripper[level] != NO_CONTACT:
        return gripper[level]
    angle = grid.origin[0] + i * grid.origin[1]
    sample_joints(problem.arm, grid.goal[level], problem.arm.branches[b], angle, q)
    return arm_contact(problem, work, body_A, q)


@inner
def _list_candidates(problem: Problem, approach: Approach) -> int:
    """List the nodes at the goal from which the line can be completed; return their number.

    The best one comes first, then every STRIDE-th, then all others, each in descending order of
    their measure.
    """
    grid, search, columns = approach.grid, approach.search, approach.columns
    count, best = 0, 0
    for b in range(len(problem.arm.branches)):
        for i in range(columns[0]):
            if grid.onward[b, 0, i] == NOWHERE or count == len(search.key):
                continue
            if not samples_hold_measure(problem):
                for r in range(4):
                    for c in range(3):
                        search.goal[r, c] = grid.goal[0, r, c]
                angle = grid.origin[0] + i * grid.origin[1]
                grid.measure[b, i] = measure_of(problem, search, b, angle)
            search.found_branch[count], search.found_pair[count, 0] = b, i
            search.key[count] = -grid.measure[b, i]
            if search.key[count] < search.key[best]:
                best = count
            count += 1
    for n in range(count):
        if n == best:
            search.key[n] -= PHASE
        elif search.found_pair[n, 0] % STRIDE:
            search.key[n] += PHASE
    sort_candidates(search, count)
    return count


@inner
def _climb(problem: Problem, approach: Approach, fastest: FloatArray, b: int, i: int) -> None:
    """Climb from a node whose line is free to a better one less than STRIDE columns away.

    Nodes on the way are followed only where the climb ends; where that one is blocked, the climb
    begins again.
    """
    columns = approach.columns
    while columns[4] <= MOST_CURVES:
        j = _better(problem, approach, b, i)
        if j == i:
            break
        if _follow(problem, approach, fastest, b, j, False) == DONE:
            copy_joints(approach.curve.points[0], approach.search.best)
            break


@inner
def _better(problem: Problem, approach: Approach, b: int, i: int) -> int:
    """Return a better node less than STRIDE columns from node i that seems free, i without one."""
    columns, step, measure = approach.columns, STRIDE // 2, approach.grid.measure[b]
    while step >= 1:
        for side in range(2):
            j = i + step if side else i - step
            if not 0 <= j < columns[0] or measure[j] <= measure[i]:
                continue
            if _seems_free(problem, approach, b, j):
                i = j
                break
        step //= 2
    return i


@inner
def _seems_free(problem: Problem, approach: Approach, b: int, column: int) -> bool:
    """Return whether a node at the goal is free of contact, and its line where others are not."""
    grid, columns = approach.grid, approach.columns
    if grid.onward[b, 0, column] == NOWHERE:
        return False
    take_path(grid, b, column)
    if columns[6] == 1 and path_touches(
        problem.arm, approach.scene, approach.motion, grid, approach.curve, b, approach.offset
    ):
        return False
    if not grid.is_free[b, 0, column]:
        if _contact_at(problem, approach, b, column, AT_GOAL) != NO_CONTACT:
            return False
        grid.is_free[b, 0, column] = True
    return True
