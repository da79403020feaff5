"""Approaches refused though free: a search of refusals that shares only the shapes with scoring.

Usage: python benchmarks/approach_search.py [--refusals 200] [--robots NAME ...]

The line is divided into levels. From all postures at one end of it, at most a step apart along the
curves of solutions, each posture leads to those of the next level that the tool's motion and a step
along the curve there reach within the velocity limits; a joint beyond a limit rests there. What
these lead to at the other end is a path; Drake judges it at postures a quarter of a millimetre of
the line apart: on the line, within limits and velocity limits, and free of contact.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numba import njit
from table import cell, header, parser, row, save

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.motion.edges import posture_contact
from tcs.kernel.motion.postures import postures_at
from tcs.kernel.motion.scene import NO_PAIR
from tcs.model.scene import NeighbourList
from tcs.motion.recheck import CLEARANCE_ROUNDING
from tcs.motion.stops import Stop
from tcs.placement.robustness.statistics import binomial_interval
from tcs.placement.scoring import load_job, sweep
from tcs.placement.scoring.approaches import approach_lines
from tcs.placement.tables import Reason

TASK = ("shaving", "wheelchair")
ROBOTS = ("pr2", "tiago", "iiwa7", "panda", "fr3")
"""Arms with a closed form."""
APPROACH = (Reason.APPROACH_LIMITS, Reason.APPROACH_BLOCKED)
SEEDS = 2000
"""Values of the free joint of the closed form from which the curves at the end are found."""
PASSES = (0.04, 20, 1), (0.01, 40, 3)
"""Step along the curves [rad], number of levels, and most steps from one level to the next."""
MOST = 20_000
"""Greatest number of postures of a level."""
FINE = 0.00025
"""Distance of the tool between two postures that Drake judges [m]."""
EVEN = 20
"""Number of times that each posture of a path is moved towards the mean of its neighbours, to find
out whether unevenness alone makes joints too fast."""
AT_POSE = 1e-9
"""Greatest error of a posture [rad and m]."""


class Arm(NamedTuple):
    """An arm and a line of its tool."""

    R: FloatArray
    """Rotations of the chain, shape (8, 3, 3)."""
    p: FloatArray
    """Translations of the chain [m], shape (8, 3)."""
    lower: FloatArray
    upper: FloatArray
    """Joint limits [rad], shape (7,)."""
    fastest: FloatArray
    """Greatest motion of each joint for the whole line [rad], shape (7,)."""
    R_AG: FloatArray
    """Orientation of the tool in A."""
    p_AG: FloatArray
    """Its position where the line begins [m]."""
    offset: FloatArray
    """From there to the end [m]."""


@njit
def _tool(arm: Arm, q: FloatArray, J: FloatArray, error: FloatArray, at: float) -> None:
    """Fill the Jacobian and the pose error at a fraction of the line."""
    R, p = np.eye(3), np.zeros(3)
    axes, origins = np.empty((7, 3)), np.empty((7, 3))
    for k in range(7):
        p = p + R @ arm.p[k]
        R = R @ arm.R[k]
        c, s = np.cos(q[k]), np.sin(q[k])
        R = R @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        axes[k], origins[k] = R[:, 2], p
    p = p + R @ arm.p[7]
    R = R @ arm.R[7]
    for k in range(7):
        J[:3, k], J[3:, k] = axes[k], np.cross(axes[k], p - origins[k])
    for r in range(3):
        error[3 + r] = arm.p_AG[r] + at * arm.offset[r] - p[r]
    turn = arm.R_AG @ R.T
    for r in range(3):
        error[r] = 0.5 * (turn[(r + 2) % 3, (r + 1) % 3] - turn[(r + 1) % 3, (r + 2) % 3])
    if np.trace(turn) < 1.0:
        error[0] = 1.0


@njit
def _onto(arm: Arm, q: FloatArray, at: float) -> bool:
    """Move a posture to a fraction of the line by short steps; one joint may rest at a limit."""
    J, error = np.empty((6, 7)), np.empty(6)
    resting = -1
    for _ in range(20):
        _tool(arm, q, J, error, at)
        if np.abs(error).max() < AT_POSE:
            beyond = np.maximum(q - arm.upper, arm.lower - q)
            k = int(np.argmax(beyond))
            if beyond[k] <= 1e-9:
                return True
            if resting >= 0:
                return False
            resting = k
            q[k] = arm.upper[k] if q[k] > arm.upper[k] else arm.lower[k]
            _tool(arm, q, J, error, at)
        if resting >= 0:
            J[:, resting] = 0.0
        q += J.T @ np.linalg.solve(J @ J.T + 1e-12 * np.eye(6), error)
        if not np.all(np.isfinite(q)):
            return False
    return False


@njit
def _spread(
    arm: Arm, q: FloatArray, at: float, ahead: float, step: float, most: int, allowed: FloatArray
) -> tuple[FloatArray, IntArray]:
    """Return the postures to which some lead, and from which each comes.

    Args:
        arm: The arm.
        q: Postures at a fraction of the line [rad], shape (n, 7).
        at: That fraction.
        ahead: From there to the fraction at which postures are sought.
        step: Step along the curves of solutions [rad].
        most: Most steps in each direction.
        allowed: Greatest motion of each joint [rad].
    """
    found, origin = (
        np.empty((len(q) * (2 * most + 1), 7)),
        np.empty(len(q) * (2 * most + 1), np.int64),
    )
    count = 0
    J, error = np.empty((6, 7)), np.empty(6)
    for i in range(len(q)):
        _tool(arm, q[i], J, error, at)
        error[:3] = 0.0
        error[3:] = ahead * arm.offset
        inverse = J.T @ np.linalg.inv(J @ J.T + 1e-12 * np.eye(6))
        forward, null = inverse @ error, np.eye(7) - inverse @ J
        widest = int(np.argmax(np.diag(null)))
        along = null[widest] / np.sqrt(max(null[widest, widest], 1e-12))
        for m in range(-most, most + 1):
            trial = q[i] + forward + m * step * along
            if _onto(arm, trial, at + ahead) and np.all(np.abs(trial - q[i]) <= allowed):
                found[count], origin[count] = trial, i
                count += 1
    return found[:count], origin[:count]


def _new(arm: Arm, q: FloatArray, step: float, seen: set[bytes]) -> IntArray:
    """Return the numbers of the postures that are the first in their cells."""
    endless = ~np.isfinite(arm.lower)
    angle = np.where(endless, np.mod(q, 2.0 * np.pi), q)
    cells = np.round(angle / step).astype(np.int32)
    kept = []
    for n, place in enumerate(cells):
        key = place.tobytes()
        if key not in seen:
            seen.add(key)
            kept.append(n)
    return np.array(kept, np.int64)


def find_path(
    arm: Arm, ends: FloatArray, is_free: Callable[[FloatArray], bool], step: float, levels: int,
    most: int,
) -> FloatArray | None:  # fmt: skip
    """Return postures along the whole line, shape (levels + 1, 7), None if none are found.

    Args:
        arm: The arm and the line.
        ends: Postures where it begins [rad], shape (n, 7).
        is_free: Whether a posture is free of contact.
        step: Step along the curves of solutions [rad].
        levels: Number of levels of the line after the first.
        most: Most steps along the curves from level to level.
    """
    seen: set[bytes] = set()
    front = ends[_new(arm, ends, step, seen)]
    grown = [front]
    while len(front) and sum(map(len, grown)) < MOST:
        front, _ = _spread(arm, front, 0.0, 0.0, step, 1, np.full(7, np.inf))
        front = front[_new(arm, front, step, seen)]
        grown.append(front)
    front = np.concatenate(grown)
    front = front[[is_free(q) for q in front]] if len(front) else front
    fronts, origins = [front], []
    for level in range(levels):
        at, ahead = level / levels, 1.0 / levels
        front, origin = _spread(arm, front, at, ahead, step, most, 0.99 * arm.fastest * ahead)
        kept = _new(arm, front, step, set())[:MOST]
        kept = kept[[is_free(q) for q in front[kept]]] if len(kept) else kept
        if not len(kept):
            return None
        front = front[kept]
        fronts.append(front)
        origins.append(origin[kept])
    n, path = 0, [fronts[-1][0]]
    for front, origin in zip(fronts[-2::-1], origins[::-1], strict=True):
        n = int(origin[n])
        path.append(front[n])
    return np.array(path[::-1])


class Found(NamedTuple):
    """What the search found."""

    path: FloatArray | None
    """Postures from the goal on, None if there is no path."""
    is_true: bool
    """Whether Drake confirms it."""
    slack: float
    """Least distance from a limit on it [rad]."""
    speed: float
    """Greatest velocity of a joint, as a fraction of its limit."""


def search(stop: Stop, neighbours: NeighbourList, goal: int, fastest: FloatArray) -> Found:
    """Search for an approach of a goal from a stop.

    Args:
        stop: The stop; its live scene is in place.
        neighbours: Those of the live scene.
        goal: The goal.
        fastest: Greatest motion of each joint for the whole line [rad], shape (7,).
    """
    R_AG, p_AG = stop.goal_in_arm_base(goal)
    back = -R_AG @ np.asarray(stop.job.task.goals[goal].approach.offset)
    problem = stop.problem
    limits = problem.arm.lower, problem.arm.upper
    chain = np.ascontiguousarray(problem.chain_R), np.ascontiguousarray(problem.chain_p[:, :3])

    def contact_free(q: FloatArray) -> bool:
        return bool(posture_contact(stop.lines, stop.line_work, q) == NO_PAIR)

    refuted = Found(None, False, 0.0, 0.0)
    for step, levels, most in PASSES:
        for begin, offset in ((p_AG, back), (p_AG + back, -back)):
            arm = Arm(*chain, *limits, fastest, R_AG, begin, offset)
            ends = postures_at(problem, R_AG, begin, SEEDS)
            path = find_path(arm, ends, lambda q: True, step, levels, most)
            if path is None:
                continue
            path = find_path(arm, ends, contact_free, step, levels, most)
            if path is None:
                continue
            for _ in range(3):
                refuted = _judged(stop, neighbours, arm, path)
                if refuted.is_true:
                    return refuted
                path = _evened(arm, path)
    return refuted


def _evened(arm: Arm, path: FloatArray) -> FloatArray:
    """Return a path with each posture moved towards the mean of those before and after it."""
    path, levels = path.copy(), len(path) - 1
    for _ in range(EVEN):
        for n in range(1, levels):
            q = 0.5 * (path[n - 1] + path[n + 1])
            if _onto(arm, q, n / levels):
                path[n] = q
    return path


def _judged(stop: Stop, neighbours: NeighbourList, arm: Arm, path: FloatArray) -> Found:
    """Return the finding on a path between whose postures the joints move straight."""
    levels = len(path) - 1
    parts = int(np.ceil(np.linalg.norm(arm.offset) / FINE / levels))
    fine, is_true = [path[0]], True
    for level in range(levels):
        for part in range(1, parts + 1):
            share = part / parts
            q = (1.0 - share) * path[level] + share * path[level + 1]
            is_true &= _onto(arm, q, (level + share) / levels)
            fine.append(q)
    q = np.array(fine)
    speed = np.abs(np.diff(q, axis=0)) * (levels * parts) / arm.fastest
    limited = np.isfinite(arm.lower)
    slack = np.minimum(q - arm.lower, arm.upper - q)[:, limited].min()
    is_true &= bool(speed.max() <= 1.0 and slack >= -1e-9)
    scene = stop.scene
    for posture in q if is_true else ():
        scene.set_arm(posture)
        for first, second, distance in neighbours.violations():
            if distance < scene.required_clearance(first, second) - CLEARANCE_ROUNDING:
                return Found(path, False, slack, speed.max())
    return Found(path, is_true, slack, speed.max())


def refusals(robot: str, most: int, seed: int) -> None:
    """Search approaches of refusals of a robot drawn at random.

    Args:
        robot: Its name.
        most: Greatest number of refusals.
        seed: Seed of the draw.
    """
    job = load_job(*TASK, robot)
    scene, lines = job.scene(), approach_lines(job)
    lowered = job.lowered(scene)
    (table,) = sweep(lowered, job.task.weights, jobs=1, approaches=lines).tables
    neighbours = NeighbourList(scene)
    for reason in APPROACH:
        refused = np.argwhere(table.reason == reason)
        order = np.random.default_rng(seed).permutation(len(refused))
        looked_at = refused[
            order[: round(most * len(refused) / np.sum(np.isin(table.reason, APPROACH)))]
        ]
        if not len(looked_at):
            continue
        free = 0
        for number, goal in looked_at.tolist():
            stop = Stop.of(job, scene, number, seed)
            found = search(stop, neighbours, goal, lines.fastest[goal])
            free += found.is_true
            if found.path is not None:
                row(
                    f"{robot}, configuration {number}, goal {goal}, {reason.name}",
                    f"{'free' if found.is_true else 'refuted'}, least slack {found.slack:.4f} rad, "
                    f"speed {found.speed:.2f} of the limit, from {found.path[0].round(6).tolist()}",
                )
        low, high = binomial_interval(free, len(looked_at))
        kind = "limits" if reason == Reason.APPROACH_LIMITS else "blocked"
        cell("refusals", robot, f"refused, {kind}", f"{len(refused):,}")
        cell("refusals", robot, f"looked at, {kind}", f"{len(looked_at):,}")
        cell("refusals", robot, f"free, {kind}", f"{free} ({low:.1%} .. {high:.1%})")
        row(f"{robot}, {kind}", f"{free} free of {len(looked_at)} of {len(refused)}")


def main() -> int:
    """Search refusals of each robot."""
    command_line = parser(__doc__)
    command_line.add_argument("--refusals", type=int, default=200)
    command_line.add_argument("--robots", nargs="*", default=ROBOTS)
    command_line.add_argument("--seed", type=int, default=0)
    options = command_line.parse_args()
    header()
    for robot in options.robots:
        refusals(robot, options.refusals, options.seed)
        save(options, keep=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
