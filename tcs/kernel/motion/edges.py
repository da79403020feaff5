"""Certified freedom from contact of curves in joint space.

A curve is a sequence of cubic Bezier curves of joint angles; a straight edge is a single one with
equally spaced control points. A part of it is certified when, at its middle posture, every pair of
shapes is farther apart than its gap plus a bound on how far the shapes move on the part. Other
parts are halved and the pairs in question checked again, until all are certified or a pair is in
contact. So nothing lies between samples, however thin.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner, jit
from tcs.kernel.motion.contact_bounds import (
    ROUNDING,
    count_hit,
    is_near,
    is_near_on_piece,
    is_of_groups,
    take_posture,
)
from tcs.kernel.motion.near_pairs import append_below, contact_here, list_near
from tcs.kernel.motion.scene import LISTED, NO_PAIR, WIDE, MotionScene, MotionWorkspace
from tcs.kernel.motion.separating_planes import take_twists
from tcs.kernel.views import unowned

RESOLUTION = 1e-5
"""Motion [m] below which a piece that is not certified counts as blocked: a path keeps at most this
much more clearance than required."""
PIECE = 0.2
"""Motion [m] of the pieces into which a curve is divided first: on longer ones most pairs may
meet."""
FIRST_PARTS = 2
"""Number of parts of a curve of several pieces."""
GOLDEN = 0.382
"""Step from one of these postures to the next, as a fraction of the edge: the golden section
spreads the first of them evenly, however many there are."""
SPACING = 0.3
"""Bound on the motion of the arm [m] between the postures at which an edge is checked before it is
certified: most edges that are blocked are so at one of them."""


@inner
def posture_is_free(scene: MotionScene, work: MotionWorkspace, q: FloatArray) -> bool:
    """Return whether nothing touches at joint angles q; fills `contacts.pair` if something does."""
    for k in range(7):
        work.posture.q[k] = q[k]
    return is_free_here(scene, work)


@inner
def is_free_here(scene: MotionScene, work: MotionWorkspace) -> bool:
    """Return whether nothing touches at `posture.q`; fills `contacts.pair` if something does.

    The last pair in contact is checked first.
    """
    for k in range(7):
        work.piece.delta[k] = 0.0
    take_posture(scene, work)
    return is_placed_free(scene, work)


@inner
def is_placed_free(scene: MotionScene, work: MotionWorkspace) -> bool:
    """Do as `is_free_here` where the posture is taken, and no joint moves."""
    last = work.contacts.pair[0]
    if last >= 0 and is_near(scene, work, last, False):
        return False
    found = contact_here(scene, work)
    if found == NO_PAIR:
        return True
    work.contacts.pair[0] = found
    return False


@jit
def posture_contact(owned_scene: MotionScene, owned_work: MotionWorkspace, q: FloatArray) -> int:
    """Return a pair in contact at joint angles q [rad], shape (7,), or NO_PAIR."""
    scene, work = unowned(owned_scene), unowned(owned_work)
    return NO_PAIR if posture_is_free(scene, work, q) else work.contacts.pair[0]


@jit
def certified(owned_scene: MotionScene, owned_work: MotionWorkspace, control: FloatArray) -> float:
    """Return 1 if a curve is certified free of contact, else where it is blocked, below 1.

    Args:
        owned_scene: The scene.
        owned_work: Scratch; where the result is below 1, `contacts.pair` is the pair that blocks it
            there.
        control: Control points of the cubic Bezier curve [rad], shape (4, 7).
    """
    scene, work = unowned(owned_scene), unowned(owned_work)
    work.curve.pieces[0] = 1
    for m in range(4):
        for k in range(7):
            work.curve.control[m, k] = control[m, k]
    return 1.0 if curve_is_free(scene, work, False) else work.contacts.met[0]


@inner
def edge_is_free(
    scene: MotionScene, work: MotionWorkspace, start: FloatArray, end: FloatArray
) -> bool:
    """Return whether the straight edge between two postures [rad] is certified, ends included."""
    return edge_seems_free(scene, work, start, end) and edge_is_certified(scene, work, start, end)


@inner
def edge_seems_free(
    scene: MotionScene, work: MotionWorkspace, start: FloatArray, end: FloatArray
) -> bool:
    """Return whether nothing touches at postures between the two ends of a straight edge [rad]."""
    moved = 0.0
    for k in range(7):
        moved += abs(end[k] - start[k]) * scene.chain.reach[k]
    parts = max(int(np.ceil(moved / SPACING)), 1)
    stride = max(int(GOLDEN * parts + 0.5), 1)
    while not _are_coprime(stride, parts):
        stride += 1
    n = parts // 2
    for _ in range(parts):
        if n > 0:
            for k in range(7):
                work.posture.q[k] = start[k] + (end[k] - start[k]) * (n / parts)
            if not is_free_here(scene, work):
                count_hit(scene, work, work.contacts.pair[0])
                return False
        n = (n + stride) % parts
    return True


@inner
def _are_coprime(a: int, b: int) -> bool:
    """Return whether two positive integers have no common divisor but 1."""
    while b > 0:
        a, b = b, a % b
    return a == 1


@inner
def edge_is_certified(
    scene: MotionScene, work: MotionWorkspace, start: FloatArray, end: FloatArray
) -> bool:
    """Return whether the straight edge between two postures [rad] is certified."""
    control = work.curve.control
    work.curve.pieces[0] = 1
    for k in range(7):
        step = end[k] - start[k]
        control[0, k], control[3, k] = start[k], end[k]
        control[1, k], control[2, k] = start[k] + step / 3.0, end[k] - step / 3.0
    return curve_is_free(scene, work, False)


@inner
def curve_is_free(scene: MotionScene, work: MotionWorkspace, at_end: bool) -> bool:
    """Return whether `work.curve` is certified; else `contacts.pair` blocks it, at `contacts.met`.

    Args:
        scene: The scene.
        work: Holds the curve.
        at_end: Whether the end of the curve is looked at first of all: it is where a curve that
            begins at a free posture is blocked most often.
    """
    take_middle(work, 0.0, 1.0)
    moved = 0.0
    for k in range(7):
        moved += work.piece.delta[k] * scene.chain.reach[k]
    # A curve of several pieces is halved as they are.
    parts = min(FIRST_PARTS, work.curve.pieces[0])
    if work.curve.pieces[0] == 1 and moved > PIECE:
        parts = int(np.ceil(moved / PIECE))
    for n in range(parts):
        begin, end = n / parts, (n + 1) / parts
        _take_piece(scene, work, begin, end)
        count = list_near(scene, work, ROUNDING, len(scene.pairs.members))
        if not _listed_are_free(scene, work, count, begin, end, at_end and n == parts - 1):
            return False
    return True


@inner
def _listed_are_free(
    scene: MotionScene, work: MotionWorkspace, count: int, begin: float, end: float, at_end: bool
) -> bool:
    """Return whether a piece of `work.curve` is certified for listed pairs.

    Args:
        scene: The scene.
        work: Holds the curve, and as current posture the middle of the piece; the first pairs in
            `uncertified.pairs` are checked.
        count: Number of pairs.
        begin: Begin of the piece, in [0, 1].
        end: End of the piece.
        at_end: Whether to look at its end before its halves.
    """
    if count == 0:
        return True
    if _listed_touch(scene, work, count, 0.5 * (begin + end)):
        return False
    if at_end:
        take_middle(work, end, end)
        take_posture(scene, work)
        if _listed_touch(scene, work, count, end):
            return False
    return _halves_are_free(scene, work, count, begin, end)


@inner
def _listed_touch(scene: MotionScene, work: MotionWorkspace, count: int, at: float) -> bool:
    """Return whether one of the first listed pairs is in contact at the current posture."""
    for m in range(count):
        k = work.uncertified.pairs[m]
        if not is_of_groups(scene, k) and is_near(scene, work, k, False):
            _block(scene, work, k, at)
            return True
    return False


@inner
def _block(scene: MotionScene, work: MotionWorkspace, k: int, at: float) -> None:
    """Record that pair k blocks the curve."""
    work.contacts.pair[0], work.contacts.met[0] = k, at
    count_hit(scene, work, k)


@inner
def _halves_are_free(
    scene: MotionScene, work: MotionWorkspace, count: int, begin: float, end: float
) -> bool:
    """Return whether both halves of a piece of `work.curve` are certified.

    Pieces are divided level by level, so that a contact is met on the longest pieces that show it;
    depth first once memory is short.

    Args:
        scene: The scene.
        work: Holds the curve; the first pairs in `uncertified.pairs` are checked.
        count: Number of pairs.
        begin: Begin of the piece, in [0, 1].
        end: End of the piece.
    """
    uncertified = work.uncertified
    span, stretch, most = uncertified.span, uncertified.stretch, len(uncertified.span)
    _push_halves(work, 0, begin, end, 0, count)
    head, top, used = 0, 2, count
    while head < top:
        by_level = top + 2 <= WIDE and used <= LISTED
        if by_level:
            n, head = head, head + 1
        else:
            top -= 1
            n, used = top, stretch[top, 1]
        begin, end = span[n, 0], span[n, 1]
        left = _uncertified(scene, work, begin, end, stretch[n, 0], stretch[n, 1], used)
        if left < 0 or (left > 0 and top + 2 > most):
            _block(scene, work, work.contacts.pair[0], 0.5 * (begin + end))
            return False
        if left > 0:
            _push_halves(work, top, begin, end, used, used + left)
            top, used = top + 2, used + left
    return True


@inner
def _push_halves(
    work: MotionWorkspace, top: int, begin: float, end: float, first: int, last: int
) -> None:
    """Append both halves of a piece to those to certify, with the pairs to check on them."""
    span, stretch, middle = work.uncertified.span, work.uncertified.stretch, 0.5 * (begin + end)
    span[top, 0], span[top, 1] = begin, middle
    span[top + 1, 0], span[top + 1, 1] = middle, end
    for n in range(2):
        stretch[top + n, 0], stretch[top + n, 1] = first, last


@inner
def _uncertified(
    scene: MotionScene,
    work: MotionWorkspace,
    begin: float,
    end: float,
    first: int,
    last: int,
    to: int,
) -> int:
    """Certify pairs on a piece of the curve, and list those that are not certified.

    Args:
        scene: The scene.
        work: Holds the curve; `uncertified.pairs[first:last]` are the pairs to check. Those not
            certified are listed from `uncertified.pairs[to]` on.
        begin: Begin of the piece, in [0, 1].
        end: End of the piece.
        first: First pair.
        last: One after the last pair.
        to: Where the list begins.

    Returns:
        Number of pairs not certified, or -1 where one is in contact, or moves less than RESOLUTION.
    """
    uncertified, pairs = work.uncertified, scene.pairs
    _take_piece(scene, work, begin, end)
    left = 0
    for n in range(first, last):
        k = uncertified.pairs[n]
        if not is_near_on_piece(scene, work, k):
            continue
        moved, before = work.piece.motion[pairs.members[k, 0], pairs.members[k, 2]], to + left
        left = append_below(scene, work, k, moved, ROUNDING, before, len(uncertified.pairs)) - to
        for m in range(before, to + left):
            k = uncertified.pairs[m]
            if is_of_groups(scene, k):
                continue
            moved = work.piece.motion[pairs.members[k, 0], pairs.members[k, 2]]
            if moved < RESOLUTION or is_near(scene, work, k, False):
                work.contacts.pair[0] = k
                return -1
    return left


@inner
def _take_piece(scene: MotionScene, work: MotionWorkspace, begin: float, end: float) -> None:
    """Make the middle of a piece the current posture, with the motion of the links on the piece."""
    take_middle(work, begin, end)
    take_posture(scene, work)
    take_twists(scene, work, 0.5 * (end - begin))


@inner
def take_middle(work: MotionWorkspace, begin: float, end: float) -> None:
    """Fill the posture in the middle of a part of the curve, and how far each joint is from it."""
    piece = work.piece
    control, pieces = work.curve.control, work.curve.pieces[0]
    first, last = begin * pieces, end * pieces
    if last - first > 1.0:
        _take_middle_of_pieces(work, int(first), int(last))
        return
    n = min(int(0.5 * (first + last)), pieces - 1)
    t, half, at = 0.5 * (first + last) - n, 0.5 * (last - first), 3 * n
    u = 1.0 - t
    for k in range(7):
        a, b = control[at, k], control[at + 1, k]
        c, d = control[at + 2, k], control[at + 3, k]
        work.posture.q[k] = u * u * (u * a + 3.0 * t * b) + t * t * (3.0 * u * c + t * d)
        # The derivatives of the curve lie between multiples of the differences of its points.
        piece.delta[k] = 3.0 * half * max(abs(b - a), abs(c - b), abs(d - c))
        piece.rate[k] = 3.0 * half * (u * u * (b - a) + 2.0 * u * t * (c - b) + t * t * (d - c))
        piece.bend[k] = 6.0 * half * half * max(abs(a - 2.0 * b + c), abs(b - 2.0 * c + d))


@inner
def _take_middle_of_pieces(work: MotionWorkspace, first: int, last: int) -> None:
    """Do as `take_middle` for an even number of whole pieces of the curve.

    What is left of the curve without its motion at a constant rate is a sequence of Bezier curves
    too, and lies between their control points.

    Args:
        work: Holds the curve.
        first: Number of the first piece.
        last: One after the last piece.
    """
    piece = work.piece
    control, middle = work.curve.control, 3 * ((first + last) // 2)
    scale = 2.0 / (3.0 * (last - first))
    for k in range(7):
        q = control[middle, k]
        rate = 0.5 * (control[3 * last, k] - control[3 * first, k])
        delta = beyond = 0.0
        for m in range(3 * first, 3 * last + 1):
            along = control[m, k] - q
            delta = max(delta, abs(along))
            beyond = max(beyond, abs(along - rate * scale * (m - middle)))
        work.posture.q[k], piece.delta[k], piece.rate[k], piece.bend[k] = (
            q,
            delta,
            rate,
            2.0 * beyond,
        )
