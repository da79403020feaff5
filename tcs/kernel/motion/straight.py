"""Straight motions of the tool at constant orientation, as certified curves in joint space."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner, int_constant, jit
from tcs.kernel.kinematics import fill_jacobian, fill_sliding, place_tool, pose_error
from tcs.kernel.motion.edges import curve_is_free, posture_is_free
from tcs.kernel.motion.link_poses import LANES, place_links
from tcs.kernel.motion.scene import MOST_PIECES, MotionScene, MotionWorkspace
from tcs.kernel.motion.tool_line import may_turn
from tcs.kernel.numeric.newton import (
    NewtonWorkspace,
    factorise,
    new_newton_workspace,
    step_to_goal,
)
from tcs.kernel.views import unowned

DONE, LIMITS, BLOCKED = 0, 1, 2
"""Outcome of a straight motion: complete, ended by joint or velocity limits or at a singularity, or
by a contact."""
ON_LINE = 1e-9
"""Greatest error of a posture on the line [rad and m]."""
ITERATIONS = 6
"""Greatest number of Newton iterations from one posture to the next; 3 are typical."""
LONGEST_STEP = 0.3
"""Greatest joint motion between two postures [rad, norm of the joints]: a longer one would leave
the branch."""
OFF_LINE = 5e-4
"""Greatest error of the spline between its points [rad and m]; it is above 1e-5 next to
singularities, and where a joint arrives at its limit."""
ONE = int_constant(1)
MOST_LOCKED = 1
"""Number of joints that may rest, at a limit or because the arm lacks them: a pose takes six."""


class StraightWorkspace(NamedTuple):
    """Scratch of straight motions, and their result."""

    newton: NewtonWorkspace
    """Kinematics at one posture."""
    turns: FloatArray
    """Scratch of `place_links`, shape (3, LANES)."""
    R_AT: FloatArray
    """Orientation of the tool in A, the same all along, shape (3, 3)."""
    p_AT: FloatArray
    """Position of the tool in A where the line begins [m], shape (3,)."""
    target: FloatArray
    """Next position of the tool in A [m], shape (3,)."""
    locked: IntArray
    """1 for each joint that rests at a limit, or that the arm lacks, shape (7,). The first one of
    an arm of five joints stands for the rotation of its tool that is free."""
    q: FloatArray
    """Trial posture [rad], shape (7,)."""


class StraightSearch(NamedTuple):
    """Postures, one of which may begin a straight motion, and what has become of them."""

    q: FloatArray
    """Joint angles [rad], shape (n, 7)."""
    offset: FloatArray
    """Motion of the tool along the line, in A [m], shape (3,)."""
    fastest: FloatArray
    """As for `straight_motion`, shape (7,)."""
    outcomes: IntArray
    """How often a motion ended in each way: DONE, LIMITS or BLOCKED, shape (3,)."""
    contacts: IntArray
    """How often two bodies touch at these postures, shape as that of `FoundContacts.hits`."""


@jit
def new_straight_workspace() -> StraightWorkspace:
    """Return scratch memory for one worker."""
    return StraightWorkspace(
        new_newton_workspace(),
        np.zeros((3, LANES)),
        np.empty((3, 3)),
        np.empty(3),
        np.empty(3),
        np.zeros(7, np.int64),
        np.empty(7),
    )


@jit
def straight_motion(
    owned_scene: MotionScene,
    owned_work: MotionWorkspace,
    owned_line: StraightWorkspace,
    q: FloatArray,
    offset: FloatArray,
    fastest: FloatArray,
    points: FloatArray,
    tangents: FloatArray,
) -> int:
    """Follow a straight line with the tool from a posture, and certify the motion.

    Of all joint motions that move the tool along the line the shortest is taken; a joint that
    arrives at a limit rests there.

    Args:
        owned_scene: The scene.
        owned_work: Scratch; `contacts.pair` is the pair that blocks the motion if one does.
        owned_line: Scratch.
        q: Joint angles to start from [rad], shape (7,).
        offset: Motion of the tool from the first posture to the last, in A [m], shape (3,).
        fastest: Greatest motion of each joint for the whole line at constant rate, which is what
            the velocity limits allow at the tool's speed [rad], shape (7,).
        points: Filled with joint angles [rad], shape (n + 1, 7), at equal distances of the tool.
        tangents: Filled with derivatives of the joints by the fraction of the line [rad], shape
            (n + 1, 7). Points and tangents define a cubic Hermite spline.

    Returns:
        DONE, LIMITS or BLOCKED.
    """
    scene, work, line = unowned(owned_scene), unowned(owned_work), unowned(owned_line)
    return _lead(scene, work, line, q, offset, fastest, points, tangents)


@jit
def next_straight(
    owned_scene: MotionScene,
    owned_work: MotionWorkspace,
    owned_line: StraightWorkspace,
    owned_search: StraightSearch,
    first: int,
    points: FloatArray,
    tangents: FloatArray,
) -> int:
    """Return the number of the next posture that is free and begins a straight motion.

    Args:
        owned_scene: The scene.
        owned_work: Scratch.
        owned_line: Scratch.
        owned_search: The postures and the line; outcomes and contacts are counted.
        first: Number of the first posture to try.
        points: As for `straight_motion`, filled with the motion found.
        tangents: As for `straight_motion`, filled with those of the motion found.

    Returns:
        Number of the posture, the number of all if there is none.
    """
    scene, work, line = unowned(owned_scene), unowned(owned_work), unowned(owned_line)
    search = unowned(owned_search)
    for n in range(first, len(search.q)):
        q = search.q[n]
        if not posture_is_free(scene, work, q):
            i, j = (
                scene.pairs.members[work.contacts.pair[0], 0],
                scene.pairs.members[work.contacts.pair[0], 1],
            )
            search.contacts[scene.shapes.body[i], scene.shapes.body[j]] += 1
            continue
        outcome = _lead(scene, work, line, q, search.offset, search.fastest, points, tangents)
        search.outcomes[outcome] += 1
        if outcome == DONE:
            return n
    return len(search.q)


@inner
def _lead(
    scene: MotionScene,
    work: MotionWorkspace,
    line: StraightWorkspace,
    q: FloatArray,
    offset: FloatArray,
    fastest: FloatArray,
    points: FloatArray,
    tangents: FloatArray,
) -> int:
    """Do as `straight_motion`."""
    chain = scene.chain
    newton, last = line.newton, len(points) - 1
    place_links(chain.R, chain.p, q, line.turns, newton.link_R, newton.link_p)
    place_tool(chain.R, chain.p, newton.link_R, newton.link_p, line.R_AT, line.p_AT)
    release_joints(scene, line)
    for k in range(7):
        points[0, k] = q[k]
    for n in range(last + 1):
        if n > 0 and not next_on_line(
            scene, line, offset, n / last, points[n - 1], points[n - 1], points[n]
        ):
            return LIMITS
        if not tangent_on_line(scene, line, offset, points[n], tangents[n]):
            return LIMITS
        for k in range(7):
            if abs(tangents[n, k]) > fastest[k]:
                return LIMITS
    keep_within_limits(scene, points, tangents)
    release_joints(scene, line)
    for n in range(last):
        take_piece(work, points, tangents, n)
        if error_between(scene, work, line, offset, (n + 0.5) / last) > OFF_LINE:
            return LIMITS
    first = 0
    while first < last:
        count = MOST_PIECES
        while count > last - first:
            count //= 2
        take_pieces(work, points, tangents, first, count)
        if not curve_is_free(scene, work, False):
            return BLOCKED
        first += count
    return DONE


@inner
def release_joints(scene: MotionScene, line: StraightWorkspace) -> None:
    """Lock no joint but those that the arm lacks and that do not stand for another."""
    for k in range(7):
        is_turn = k == 0 and may_turn(scene)
        line.locked[k] = 1 if scene.limits.lower[k] == scene.limits.upper[k] and not is_turn else 0


@inner
def take_pieces(
    work: MotionWorkspace, points: FloatArray, tangents: FloatArray, first: int, count: int
) -> None:
    """Make some pieces of a spline the current curve.

    Args:
        work: `curve` is filled.
        points: Joint angles [rad], shape (n + 1, 7).
        tangents: Their derivatives by the fraction of the spline [rad], shape (n + 1, 7).
        first: Number of the first piece.
        count: Number of pieces, a power of two.
    """
    control, third = work.curve.control, 1.0 / (3.0 * (len(points) - 1))
    work.curve.pieces[0] = count
    for m in range(count):
        n, at = first + m, 3 * m
        for k in range(7):
            control[at, k], control[at + 3, k] = points[n, k], points[n + 1, k]
            control[at + 1, k] = points[n, k] + third * tangents[n, k]
            control[at + 2, k] = points[n + 1, k] - third * tangents[n + 1, k]


@inner
def take_piece(work: MotionWorkspace, points: FloatArray, tangents: FloatArray, n: int) -> None:
    """Make piece n of a spline the current curve."""
    take_pieces(work, points, tangents, n, ONE)


@inner
def error_between(
    scene: MotionScene,
    work: MotionWorkspace,
    line: StraightWorkspace,
    offset: FloatArray,
    fraction: float,
) -> float:
    """Return the error of the tool in the middle of the current curve [rad and m]."""
    c = work.curve.control
    for k in range(7):
        line.q[k] = 0.125 * (c[0, k] + c[3, k]) + 0.375 * (c[1, k] + c[2, k])
    for r in range(3):
        line.target[r] = line.p_AT[r] + fraction * offset[r]
    return _error_on_line(scene, line, line.q)


@inner
def _error_on_line(scene: MotionScene, line: StraightWorkspace, q: FloatArray) -> float:
    """Fill link poses and pose error at joint angles q; return the error [rad and m]."""
    chain = scene.chain
    newton = line.newton
    place_links(chain.R, chain.p, q, line.turns, newton.link_R, newton.link_p)
    place_tool(chain.R, chain.p, newton.link_R, newton.link_p, newton.R_AT, newton.p_AT)
    worst = pose_error(newton.R_AT, newton.p_AT, line.R_AT, line.target, newton.error)
    return _without_turn(scene, line) if may_turn(scene) else worst


@inner
def _without_turn(scene: MotionScene, line: StraightWorkspace) -> float:
    """Let the direction of the free axis alone count in `newton.error`; return it [rad and m]."""
    error, worst = line.newton.error, 0.0
    R, S = line.newton.R_AT, line.R_AT
    x, y, z = (_turn_in_base(scene, R, 0), _turn_in_base(scene, R, 1), _turn_in_base(scene, R, 2))
    u, v, w = (_turn_in_base(scene, S, 0), _turn_in_base(scene, S, 1), _turn_in_base(scene, S, 2))
    # However far the tool is rotated about it, Newton's method converges as fast.
    error[0], error[1], error[2] = y * w - z * v, z * u - x * w, x * v - y * u
    if x * u + y * v + z * w < 0.0:
        error[0] = 1.0
    for m in range(6):
        worst = max(worst, abs(error[m]))
    return worst


@inner
def _turn_in_base(scene: MotionScene, R: FloatArray, r: int) -> float:
    """Return a component in A of the axis about which a tool, at orientation R, may rotate."""
    turn = scene.chain.free_axis
    return R[r, 0] * turn[0] + R[r, 1] * turn[1] + R[r, 2] * turn[2]


@inner
def evaluate_on_line(scene: MotionScene, line: StraightWorkspace, q: FloatArray) -> float:
    """Fill pose error and Jacobian at joint angles q, with the columns of locked joints at 0."""
    newton, error = line.newton, _error_on_line(scene, line, q)
    fill_jacobian(newton.link_R, newton.link_p, newton.p_AT, newton.J)
    fill_sliding(scene.chain.p, newton.link_R, newton.J)
    for k in range(7):
        if line.locked[k] == 1:
            for i in range(6):
                newton.J[i, k] = 0.0
    if may_turn(scene):
        for r in range(3):
            newton.J[r, 0], newton.J[3 + r, 0] = _turn_in_base(scene, line.R_AT, r), 0.0
    return error


@inner
def next_on_line(
    scene: MotionScene,
    line: StraightWorkspace,
    offset: FloatArray,
    fraction: float,
    before: FloatArray,
    begin: FloatArray,
    after: FloatArray,
) -> bool:
    """Fill the posture at a fraction of the line, from the one before it; False if there is none.

    A joint that would exceed a limit is set to it and locked, and the posture solved again.

    Args:
        scene: The scene.
        line: The line, and the joints that rest.
        offset: Motion of the tool along the line, in A [m], shape (3,).
        fraction: Where the posture is.
        before: The posture before it [rad], shape (7,).
        begin: Where Newton's method begins, which moves the joints the shortest way [rad], shape
            (7,).
        after: Filled, shape (7,).
    """
    limits = scene.limits
    for r in range(3):
        line.target[r] = line.p_AT[r] + fraction * offset[r]
    for k in range(7):
        # Joints locked in an earlier step are at their limit there.
        after[k] = before[k]
    while True:
        for k in range(7):
            # Joints locked in this step start at their limit.
            line.q[k] = after[k] if line.locked[k] == 1 else begin[k]
        arrived = False
        for _ in range(ITERATIONS):
            if evaluate_on_line(scene, line, line.q) < ON_LINE:
                arrived = True
                break
            factorise(line.newton, 0.0)
            step_to_goal(line.newton, line.q, LONGEST_STEP)
            if may_turn(scene):
                line.q[0] = 0.0
        square, worst, beyond = 0.0, 0.0, -1
        locked = 0
        for k in range(7):
            square += (line.q[k] - before[k]) ** 2
            over = max(line.q[k] - limits.upper[k], limits.lower[k] - line.q[k])
            if over > worst:
                worst, beyond = over, k
            locked += line.locked[k]
        if not arrived or square > LONGEST_STEP * LONGEST_STEP:
            return False
        if beyond < 0:
            break
        if locked >= MOST_LOCKED:
            return False
        line.locked[beyond] = 1
        low, high = limits.lower[beyond], limits.upper[beyond]
        after[beyond] = low if line.q[beyond] < low else high
    for k in range(7):
        after[k] = line.q[k]
    return True


@inner
def tangent_on_line(
    scene: MotionScene,
    line: StraightWorkspace,
    offset: FloatArray,
    q: FloatArray,
    tangent: FloatArray,
) -> bool:
    """Fill the derivative of the joints by the fraction of the line; False at a singularity."""
    evaluate_on_line(scene, line, q)
    return tangent_where_evaluated(scene, line, offset, tangent)


@inner
def tangent_where_evaluated(
    scene: MotionScene, line: StraightWorkspace, offset: FloatArray, tangent: FloatArray
) -> bool:
    """Do as `tangent_on_line` at the posture of the last evaluation."""
    newton = line.newton
    factorise(newton, 0.0)
    for r in range(3):
        newton.error[r], newton.error[3 + r] = 0.0, offset[r]
    for k in range(7):
        tangent[k] = 0.0
    length = step_to_goal(newton, tangent, np.inf)
    if may_turn(scene):
        tangent[0] = 0.0
    return np.isfinite(length)


@inner
def keep_within_limits(scene: MotionScene, points: FloatArray, tangents: FloatArray) -> None:
    """Shorten tangents such that the control points of every piece are within the joint limits.

    Points have one on either side, the first and the last on one side: a motion may begin or end at
    a limit.
    """
    limits = scene.limits
    last = len(points) - 1
    steps = 3.0 * last
    for n in range(last + 1):
        for k in range(7):
            if limits.period[k] == 0.0:
                below = steps * max(points[n, k] - limits.lower[k], 0.0)
                above = steps * max(limits.upper[k] - points[n, k], 0.0)
                most = above if n == 0 else (below if n == last else min(below, above))
                least = below if n == 0 else (above if n == last else min(below, above))
                tangents[n, k] = min(max(tangents[n, k], -least), most)
