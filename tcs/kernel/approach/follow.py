"""Following the line from a posture at the goal, around contacts that are met."""

from __future__ import annotations

from tcs.kernel.approach.curve import fill_spline, path_touches, spline_is_free
from tcs.kernel.approach.grid import NOWHERE, PIECES, close_node, column_at, take_path
from tcs.kernel.approach.memory import ENOUGH, MOST_CURVES, Approach
from tcs.kernel.approach.opening import lead_on, make_whole
from tcs.kernel.approach.scene import pair_contact_code
from tcs.kernel.approach.turns import place_sample
from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner
from tcs.kernel.contacts import NO_CONTACT
from tcs.kernel.motion.contact_bounds import is_near, take_turned_posture
from tcs.kernel.motion.edges import is_placed_free
from tcs.kernel.motion.scene import NO_PAIR, MotionScene
from tcs.kernel.motion.straight import BLOCKED, DONE, LIMITS
from tcs.kernel.problem import Problem

GRIPPER = 7
"""Link of the gripper, whose motion is the same from every posture."""
WIDEST = 32
"""Greatest number of nodes on either side of one in contact that are closed with it."""
CLOSED = -2
"""Outcome of a posture that is in contact, or has no path of the free joint."""


@inner
def follow(
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
    lead_on(problem, approach, b, column)
    while grid.onward[b, 0, column] != NOWHERE and columns[4] <= MOST_CURVES:
        take_path(grid, b, column)
        if columns[5] == 1 and path_touches(
            problem.arm, scene, motion, grid, curve, b, approach.offset
        ):
            outcome = BLOCKED
            if not is_free:
                # Closing the node would close it to postures too whose lines lead past the contact.
                break
            _close(problem, approach, b, column, curve.blocked[0])
            continue
        level, k = _first_contact(problem, approach, b, column)
        is_at_level = level != NOWHERE
        # A contact counts on lines only that limits allow.
        if level == NOWHERE or (level > 0 and approach.contact[0] == NO_CONTACT):
            columns[4] += 1
            if not _fill_spline(problem, approach, fastest, b):
                outcome = LIMITS
                break
        if level == NOWHERE:
            if spline_is_free(scene, motion, curve):
                outcome = DONE
                break
            level, k = curve.blocked[0], curve.blocked[1]
        columns[6] = level
        if level > 0:
            outcome = BLOCKED
            if approach.contact[0] == NO_CONTACT or _is_of_gripper(scene, k):
                approach.contact[0] = pair_contact_code(problem, scene, k)
            if _is_of_gripper(scene, k):
                columns[4] = ENOUGH
                break
        i = _close(problem, approach, b, column, level)
        if is_at_level:
            _close_beside(problem, approach, b, level, i, k)
    if outcome != DONE:
        close_goal(approach, b, column)
    return outcome


@inner
def _fill_spline(problem: Problem, approach: Approach, fastest: FloatArray, b: int) -> bool:
    """Follow the line along `grid.path`; return whether the joints keep their limits.

    Narrow windows seldom lie at a constant rate: in them the path is tried with bent ends too.
    """
    grid, curve, offset = approach.grid, approach.curve, approach.offset
    scene, motion = approach.scene, approach.motion
    for n in range(2 if grid.is_fine[0] else 1):
        grid.is_bent[0] = n == 1
        if fill_spline(problem.arm, scene, motion, grid, curve, b, offset, fastest):
            return True
    return False


@inner
def _is_of_gripper(scene: MotionScene, k: int) -> bool:
    """Return whether a pair is of the gripper and something fixed, the same from every posture."""
    return (
        scene.pairs.members[k, 2] == 0
        and scene.shapes.link_frame[scene.pairs.members[k, 0]] == GRIPPER
    )


@inner
def _close(problem: Problem, approach: Approach, b: int, column: int, level: int) -> int:
    """Close the node at a level of the path from a column at the goal; return its column."""
    grid, columns = approach.grid, approach.columns
    if level > 0:
        # Other lines lead past it in columns that have not been looked at.
        make_whole(problem, approach, b)
    i = column_at(grid, b, column, level)
    close_node(grid, b, level, i, columns[0], columns[1])
    return i


@inner
def _close_beside(
    problem: Problem, approach: Approach, b: int, level: int, column: int, k: int
) -> None:
    """Close the nodes beside one in contact in which the same pair k touches."""
    grid, columns, motion = approach.grid, approach.columns, approach.motion
    for side in range(2):
        i, step = column, 2 * side - 1
        for _ in range(WIDEST):
            i += step
            if (
                not 0 <= i < columns[0]
                or not grid.is_open[b, level, i]
                or grid.is_free[b, level, i]
            ):
                break
            _take_node(problem, approach, b, i, level)
            if not is_near(approach.scene, motion, k, False):
                break
            close_node(grid, b, level, i, columns[0], columns[1])


@inner
def _take_node(problem: Problem, approach: Approach, b: int, i: int, level: int) -> None:
    """Take the posture of a node of the grid; no joint moves."""
    arm, grid, motion = problem.arm, approach.grid, approach.motion
    angle = grid.origin[0] + i * grid.origin[1]
    place_sample(
        arm, grid.goal[level], arm.branches[b], angle, motion.posture.q, motion.posture.turns
    )
    take_turned_posture(approach.scene, motion)


@inner
def close_goal(approach: Approach, b: int, column: int) -> None:
    """Close a node at the goal."""
    approach.grid.is_open[b, 0, column] = False
    approach.grid.onward[b, 0, column] = NOWHERE


@inner
def _first_contact(problem: Problem, approach: Approach, b: int, column: int) -> tuple[int, int]:
    """Return a level at which the path from a column is in contact, or NOWHERE, and the pair.

    Until a contact is known, most paths are free, and only the goal is checked.
    """
    grid = approach.grid
    levels = 1 if approach.contact[0] == NO_CONTACT else PIECES + 2
    for n in range(levels):
        # The goal, then where a line was blocked last, then from the begin of the approach on.
        level = 0 if n == 0 else (approach.columns[6] if n == 1 else PIECES + 2 - n)
        i = column_at(grid, b, column, level)
        if grid.is_free[b, level, i]:
            continue
        k = contact_at(problem, approach, b, i, level)
        if k != NO_PAIR:
            return level, k
        grid.is_free[b, level, i] = True
    return NOWHERE, NO_PAIR


@inner
def contact_at(problem: Problem, approach: Approach, b: int, i: int, level: int) -> int:
    """Return a pair in contact at a node of the grid, or NO_PAIR."""
    _take_node(problem, approach, b, i, level)
    if is_placed_free(approach.scene, approach.motion):
        return NO_PAIR
    return approach.motion.contacts.pair[0]
