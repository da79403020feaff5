"""Curves on which the tool moves straight: the last links seen from the tool, not from the base.

The tool moves on a line at constant orientation, up to a small error. So a point of a link moves as
the line does and, relative to the tool, by the joints between the link and the tool alone: those
are few and near, and the gripper only slides along the line.

The curve is a spline whose points and derivatives are on the line, so the error e(u) of a point
fixed to the tool is 0, and so is its derivative, at both ends u = 0 and 1 of a piece. With its
value at the middle,

    |e(u)| <= 16 u^2 (1 - u)^2 |e(1/2)| + u^2 (1 - u)^2 |u - 1/2| max |e'''''| / 120

(the error of the polynomial through these five values). The fifth derivative of a point at most L
from the first joint along the arm is at most `L B`, B the fifth complete Bell polynomial of bounds
on the sums of the joints' first, second and third derivatives: each rotation is an exponential, and
the motion of a prismatic joint by s counts as a rotation by s / L.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner
from tcs.kernel.motion.scene import SEEN_FROM_TOOL, MotionScene, MotionWorkspace

BEYOND = 7.5e-5
"""Greatest value of `u^2 (1 - u)^2 |u - 1/2| / 120` in [0, 1], rounded up."""
EXCESS = 1e-6
"""Excess of the errors [rad and m]: far above that of the points of a spline, and of the sine of an
angle in place of the angle."""
OFF, TURNED = 3, 4
"""In `PieceMotion.line`, after the motion in A [m]: bounds on the error of the motion of points
of the last links fixed to the tool [m], inf if the tool follows no line; and on the rotation of the
tool from its orientation on the line [rad]."""


@inner
def may_turn(scene: MotionScene) -> bool:
    """Return whether straight motions may rotate the tool about `scene.chain.free_axis`."""
    turn = scene.chain.free_axis
    return bool(turn[0] != 0.0 or turn[1] != 0.0 or turn[2] != 0.0)


@inner
def follows_line(work: MotionWorkspace) -> bool:
    """Return whether the tool follows a line on the current curve."""
    return work.piece.line[OFF] < np.inf


@inner
def off_line(work: MotionWorkspace, moved: float) -> float:
    """Return a bound on how far a point is from where line and tool lead it [m].

    Args:
        work: The tool follows a line.
        moved: Bound on the motion of the point relative to the tool [m].
    """
    return work.piece.line[OFF] + work.piece.line[TURNED] * moved


@inner
def line_motion(work: MotionWorkspace) -> float:
    """Return the length of the line on half of the current piece [m]."""
    piece = work.piece
    x, y, z = piece.tool_twist[7, 3], piece.tool_twist[7, 4], piece.tool_twist[7, 5]
    return np.sqrt(x * x + y * y + z * z)


@inner
def take_turns(scene: MotionScene, work: MotionWorkspace, half: float) -> None:
    """Fill `piece.tool_twist`, as `separating_planes.take_twists` does `twist`.

    Args:
        scene: The scene.
        work: The tool follows a line.
        half: Half of the length of the piece, as a fraction of the curve.
    """
    piece = work.piece
    turn, line = piece.tool_twist, piece.line
    for m in range(3):
        turn[7, m], turn[7, 3 + m] = 0.0, half * line[m]
    for k in range(6, SEEN_FROM_TOOL - 1, -1):
        R, p, rate = work.posture.link_R[k + 1], work.posture.link_p[k + 1], piece.rate[k]
        if scene.chain.slides[k] > 0.0:
            for r in range(3):
                turn[k, r] = turn[k + 1, r]
                turn[k, 3 + r] = turn[k + 1, 3 + r] - scene.chain.slides[k] * rate * R[r, 2]
            continue
        x, y, z = rate * R[0, 2], rate * R[1, 2], rate * R[2, 2]
        turn[k, 0], turn[k, 1], turn[k, 2] = (
            turn[k + 1, 0] - x,
            turn[k + 1, 1] - y,
            turn[k + 1, 2] - z,
        )
        turn[k, 3] = turn[k + 1, 3] + (y * p[2] - z * p[1])
        turn[k, 4] = turn[k + 1, 4] + (z * p[0] - x * p[2])
        turn[k, 5] = turn[k + 1, 5] + (x * p[1] - y * p[0])


@inner
def take_line(
    scene: MotionScene,
    work: MotionWorkspace,
    offset: FloatArray,
    points: FloatArray,
    tangents: FloatArray,
    slopes: FloatArray,
    off: float,
    turned: float,
) -> None:
    """Let the tool follow a line on the current curve, a spline, unless it may rotate on the way.

    Args:
        scene: The scene.
        work: `piece.line` is filled.
        offset: Motion of the tool on the whole curve, in A [m], shape (3,).
        points: Joint angles of the spline [rad], shape (n + 1, 7).
        tangents: Their derivatives by the fraction of the spline [rad], shape (n + 1, 7).
        slopes: These derivatives on the line, from which `tangents` may differ [rad].
        off: Greatest distance of the tool from the line in the middle of a piece [m].
        turned: Greatest rotation from its orientation there [rad].
    """
    if may_turn(scene):
        work.piece.line[OFF] = np.inf
        return
    pieces = len(points) - 1
    chain, aside = 0.0, scene.chain.aside
    for k in range(1, 7):
        p = scene.chain.p[k]
        length = np.sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2])
        if scene.chain.slides[k] > 0.0:
            length += scene.chain.slides[k] * max(
                abs(scene.limits.lower[k]), abs(scene.limits.upper[k])
            )
        chain += length
        if k >= SEEN_FROM_TOOL:
            aside += length
    first = second = third = changed = 0.0
    for k in range(7):
        a = b = c = d = 0.0
        for n in range(pieces):
            step = points[n + 1, k] - points[n, k]
            begin, end = tangents[n, k] / pieces, tangents[n + 1, k] / pieces
            a = max(a, max(abs(3.0 * step - begin - end), max(abs(begin), abs(end))))
            bend, bend_end = (
                6.0 * step - 4.0 * begin - 2.0 * end,
                2.0 * begin + 4.0 * end - 6.0 * step,
            )
            b, c = max(b, max(abs(bend), abs(bend_end))), max(c, abs(bend_end - bend))
        for n in range(pieces + 1):
            d = max(d, abs(tangents[n, k] - slopes[n, k]) / pieces)
        # A prismatic joint moves points no more than a rotation at the length of the arm would.
        scale = scene.chain.slides[k] / (chain + aside) if scene.chain.slides[k] > 0.0 else 1.0
        first, second = first + scale * a, second + scale * b
        third, changed = third + scale * c, changed + scale * d
    square = first * first
    bell = first * square * square + 10.0 * square * (first * second + third)
    bell += second * (15.0 * first * second + 10.0 * third)
    # Other derivatives at the ends of a piece move its points by a quarter of them at most, and so
    # they do at its middle.
    per_length = BEYOND * bell + 0.5 * changed
    line = work.piece.line
    for m in range(3):
        line[m] = offset[m]
    line[TURNED] = turned + per_length + EXCESS
    # Of the point at the middle posture, and of that at another one.
    line[OFF] = 2.0 * (off + turned * aside + per_length * (chain + aside) + EXCESS)
