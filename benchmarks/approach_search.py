"""Approaches refused though free: a search of refusals that shares only the shapes with scoring.

Usage: python benchmarks/approach_search.py [--refusals 200] [--robots NAME ...]

The line is divided into levels. From all postures at one end of it, at most a step apart along the
curves of solutions, each posture leads to those of the next level that the tool's motion and a step
along the curve there reach within the velocity limits; a joint beyond a limit rests there. What
these lead to at the other end is a path; Drake judges it at postures a quarter of a millimetre of
the line apart: on the line, within limits and velocity limits, and free of contact. A refusal is
searched at short steps only if a path is found at long ones with wider limits and no contacts.
Through each of the postures of an arm of six joints, found from many starts, leads one line.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numba import njit
from table import cell, header, parser, row, save

from tcs.kernel.analytic.solver import ArmSolver
from tcs.kernel.arrays import BoolArray, Chain, FloatArray, IntArray
from tcs.kernel.motion.edges import posture_contact
from tcs.kernel.motion.goal_postures import postures_at
from tcs.kernel.motion.scene import NO_PAIR, MotionScene, MotionWorkspace
from tcs.kernel.motion.search_trees import new_trees
from tcs.kernel.verification.newton_solutions import newton_solutions, within
from tcs.model.scene import NeighbourList
from tcs.motion.recheck import CLEARANCE_ROUNDING
from tcs.motion.stops import Stop, StopGrid
from tcs.placement.robustness.statistics import binomial_interval
from tcs.placement.scoring import load_job, sweep
from tcs.placement.scoring.approaches import approach_lines
from tcs.placement.tables import Reason
from tests.reference.kinematics import jacobian, link_poses

TASK = ("shaving", "wheelchair")
ROBOTS = ("pr2", "tiago", "iiwa7", "panda", "fr3", "ur5", "jaco", "stretch")
"""Arms of seven joints with a closed form, and of six."""
APPROACH = (Reason.APPROACH_LIMITS, Reason.APPROACH_BLOCKED)
SEEDS = 2000
"""Values of the free joint of the closed form from which the curves at the end are found."""
PASSES = (0.04, 20, 1), (0.01, 40, 3)
"""Step along the curves [rad], number of levels, and most steps from one level to the next."""
WIDER, FASTER = 0.1, 1.5
"""How much wider joint limits are [rad], and how much faster joints, where a path is sought first
that may be near: more than a long step can miss."""
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


class Scratch(NamedTuple):
    """Kinematics at one posture."""

    R: FloatArray
    """Orientation of the current link, its product with a turn, and a turn, shape (3, 3, 3)."""
    p: FloatArray
    """Position of the tool [m], shape (3,)."""
    axes: FloatArray
    """Axes of the joints, shape (7, 3)."""
    origins: FloatArray
    """Points on them [m], shape (7, 3)."""
    J: FloatArray
    """Jacobian, shape (6, 7)."""
    error: FloatArray
    """Pose error [rad and m], shape (6,)."""
    G: FloatArray
    """The product of the Jacobian and its transpose, and right-hand sides, shape (6, 13)."""


@njit
def _scratch() -> Scratch:
    """Return memory for kinematics."""
    return Scratch(
        np.empty((3, 3, 3)), np.empty(3), np.empty((7, 3)), np.empty((7, 3)), np.empty((6, 7)),
        np.empty(6), np.empty((6, 13)),
    )  # fmt: skip


@njit
def _times(A: FloatArray, B: FloatArray, out: FloatArray) -> None:
    """Fill the product of two matrices, shape (3, 3)."""
    for r in range(3):
        for c in range(3):
            out[r, c] = A[r, 0] * B[0, c] + A[r, 1] * B[1, c] + A[r, 2] * B[2, c]


@njit
def _tool(arm: Arm, q: FloatArray, work: Scratch, at: float) -> None:
    """Fill the Jacobian and the pose error at a fraction of the line."""
    R, turned, turn = work.R[0], work.R[1], work.R[2]
    p, J, error = work.p, work.J, work.error
    for r in range(3):
        p[r] = 0.0
        for c in range(3):
            R[r, c] = turn[r, c] = 1.0 if r == c else 0.0
    for k in range(8):
        for r in range(3):
            p[r] += R[r, 0] * arm.p[k, 0] + R[r, 1] * arm.p[k, 1] + R[r, 2] * arm.p[k, 2]
        _times(R, arm.R[k], turned)
        if k < 7:
            turn[0, 0] = turn[1, 1] = np.cos(q[k])
            turn[1, 0] = np.sin(q[k])
            turn[0, 1] = -turn[1, 0]
            _times(turned, turn, R)
            for r in range(3):
                work.axes[k, r], work.origins[k, r] = R[r, 2], p[r]
    for k in range(7):
        for r in range(3):
            s, t = (r + 1) % 3, (r + 2) % 3
            J[r, k] = work.axes[k, r]
            J[3 + r, k] = work.axes[k, s] * (p[t] - work.origins[k, t]) - work.axes[k, t] * (
                p[s] - work.origins[k, s]
            )
    for r in range(3):
        for c in range(3):
            turn[r, c] = 0.0
            for m in range(3):
                turn[r, c] += arm.R_AG[r, m] * turned[c, m]
    for r in range(3):
        s, t = (r + 1) % 3, (r + 2) % 3
        error[r] = 0.5 * (turn[t, s] - turn[s, t])
        error[3 + r] = arm.p_AG[r] + at * arm.offset[r] - p[r]
    if turn[0, 0] + turn[1, 1] + turn[2, 2] < 1.0:
        error[0] = 1.0


@njit
def _solve(work: Scratch, sides: int) -> None:
    """Solve J J' X = B in place; B, shape (6, sides), is in `G` from column 6 on."""
    J, G = work.J, work.G
    for i in range(6):
        for j in range(6):
            G[i, j] = 1e-12 if i == j else 0.0
            for k in range(7):
                G[i, j] += J[i, k] * J[j, k]
    for i in range(6):
        for r in range(6):
            if r != i:
                factor = G[r, i] / G[i, i]
                for c in range(i, 6 + sides):
                    G[r, c] -= factor * G[i, c]
    for i in range(6):
        for c in range(6, 6 + sides):
            G[i, c] /= G[i, i]


@njit
def _onto(arm: Arm, q: FloatArray, at: float, work: Scratch) -> bool:
    """Move a posture to a fraction of the line by short steps; one joint may rest at a limit."""
    J, G = work.J, work.G
    resting = -1
    for _ in range(20):
        _tool(arm, q, work, at)
        if np.abs(work.error).max() < AT_POSE:
            most, beyond = 1e-9, -1
            for k in range(7):
                over = max(q[k] - arm.upper[k], arm.lower[k] - q[k])
                if over > most:
                    most, beyond = over, k
            if beyond < 0:
                return True
            if resting >= 0:
                return False
            resting = beyond
            q[beyond] = arm.upper[beyond] if q[beyond] > arm.upper[beyond] else arm.lower[beyond]
            _tool(arm, q, work, at)
        if resting >= 0:
            J[:, resting] = 0.0
        G[:, 6] = work.error
        _solve(work, 1)
        moved = 0.0
        for k in range(7):
            change = 0.0
            for r in range(6):
                change += J[r, k] * G[r, 6]
            q[k] += change
            moved += abs(change)
        if not moved < np.inf:
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
    count, work = 0, _scratch()
    J, G = work.J, work.G
    forward, along = np.empty(7), np.empty(7)
    for i in range(len(q)):
        _tool(arm, q[i], work, at)
        G[:3, 6], G[3:, 6], G[:, 7:13] = 0.0, ahead * arm.offset, np.eye(6)
        _solve(work, 7)
        forward[:] = J.T @ np.ascontiguousarray(G[:, 6])
        null = np.eye(7) - J.T @ (np.ascontiguousarray(G[:, 7:13]) @ J)
        widest = int(np.argmax(np.diag(null)))
        along[:] = null[widest] / np.sqrt(max(null[widest, widest], 1e-12))
        for m in range(-most, most + 1):
            trial, is_far = found[count], False
            for k in range(7):
                change = forward[k] + m * step * along[k]
                trial[k] = q[i, k] + change
                # Of the steps that follow, none is as long as one along the curves.
                is_far |= abs(change) > allowed[k] + step
            if is_far or not _onto(arm, trial, at + ahead, work):
                continue
            if np.all(np.abs(trial - q[i]) <= allowed):
                origin[count] = i
                count += 1
    return found[:count], origin[:count]


@njit
def _are_free(scene: MotionScene, work: MotionWorkspace, q: FloatArray) -> BoolArray:
    """Return whether postures are free of contact, shape (n,)."""
    free = np.empty(len(q), np.bool_)
    for n in range(len(q)):
        free[n] = posture_contact(scene, work, q[n]) == NO_PAIR
    return free


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
    arm: Arm, ends: FloatArray, are_free: Callable[[FloatArray], BoolArray], step: float,
    levels: int, most: int,
) -> FloatArray | None:  # fmt: skip
    """Return postures along the whole line, shape (levels + 1, 7), None if none are found.

    Args:
        arm: The arm and the line.
        ends: Postures where it begins [rad], shape (n, 7).
        are_free: Whether postures, shape (n, 7), are free of contact.
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
    front = front[are_free(front)]
    fronts, origins = [front], []
    for level in range(levels):
        at, ahead = level / levels, 1.0 / levels
        front, origin = _spread(arm, front, at, ahead, step, most, 0.99 * arm.fastest * ahead)
        kept = _new(arm, front, step, set())[:MOST]
        kept = kept[are_free(front[kept])]
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
    lines = (p_AG, back), (p_AG + back, -back)
    chain = np.ascontiguousarray(stop.problem.chain.R), np.ascontiguousarray(stop.problem.chain.p)

    def path_of(solver: ArmSolver, line: tuple[FloatArray, FloatArray], factor: float,
                are_free: Callable[[FloatArray], BoolArray], how: tuple[float, int, int],
    ) -> tuple[Arm, FloatArray | None]:  # fmt: skip
        arm = Arm(*chain, solver.lower, solver.upper, factor * fastest, R_AG, *line)
        ends = postures_at(stop.problem._replace(arm=solver), R_AG, line[0], SEEDS)
        return arm, find_path(arm, ends, are_free, *how)

    solver = stop.problem.arm
    wide = solver._replace(lower=solver.lower - WIDER, upper=solver.upper + WIDER)
    refuted = Found(None, False, 0.0, 0.0)
    near = (path_of(wide, line, FASTER, _any, PASSES[0])[1] for line in lines)
    if all(path is None for path in near):
        return refuted
    for how in PASSES:
        for line in lines:
            arm, path = path_of(
                solver, line, 1.0, lambda q: _are_free(stop.lines, stop.line_work, q), how
            )
            if path is None:
                continue
            for _ in range(3):
                refuted = _judged(stop, neighbours, arm, path)
                if refuted.is_true:
                    return refuted
                path = _evened(arm, path)
    return refuted


def _any(q: FloatArray) -> BoolArray:
    """Return that all postures count."""
    return np.ones(len(q), np.bool_)


def _evened(arm: Arm, path: FloatArray) -> FloatArray:
    """Return a path with each posture moved towards the mean of those before and after it."""
    path, levels, work = path.copy(), len(path) - 1, _scratch()
    for _ in range(EVEN):
        for n in range(1, levels):
            q = 0.5 * (path[n - 1] + path[n + 1])
            if _onto(arm, q, n / levels, work):
                path[n] = q
    return path


def _judged(stop: Stop, neighbours: NeighbourList, arm: Arm, path: FloatArray) -> Found:
    """Return the finding on a path between whose postures the joints move straight."""
    levels = len(path) - 1
    parts = int(np.ceil(np.linalg.norm(arm.offset) / FINE / levels))
    fine, is_true, work = [path[0]], True, _scratch()
    for level in range(levels):
        for part in range(1, parts + 1):
            share = part / parts
            q = (1.0 - share) * path[level] + share * path[level + 1]
            is_true &= _onto(arm, q, (level + share) / levels, work)
            fine.append(q)
    q = np.array(fine)
    rates = np.diff(q, axis=0) * (levels * parts)
    # A joint next to a singularity is faster at the end itself than on average to the next posture.
    ends = 1.5 * rates[[0, -1]] - 0.5 * rates[[1, -2]]
    speed = np.abs(np.concatenate([rates, ends])) / arm.fastest
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


def search_listed(stop: Stop, neighbours: NeighbourList, goal: int, fastest: FloatArray) -> Found:
    """Do as `search` for an arm of six joints: the line through each posture is the only one."""
    chain = stop.grid.lowered.arrays.chain
    R_AG, p_AG = stop.goal_in_arm_base(goal)
    back = -R_AG @ np.asarray(stop.job.task.goals[goal].approach.offset)
    steps = int(np.ceil(np.linalg.norm(back) / FINE))
    refuted = Found(None, False, 0.0, 0.0)
    for q in within(chain, newton_solutions(chain, R_AG, p_AG)):
        path = _line_from(chain, q, R_AG, p_AG, back, steps)
        if path is not None:
            speed = float(np.max(np.abs(np.diff(path, axis=0)) * steps / fastest))
            slack = float(np.min(np.minimum(path - chain.lower, chain.upper - path)[:, 1:]))
            is_true = speed <= 1.0 and slack >= -1e-9 and _is_free(stop, neighbours, path)
            refuted = Found(path, is_true, slack, speed)
            if is_true:
                break
    return refuted


def _line_from(
    chain: Chain, q: FloatArray, R_AG: FloatArray, p_AG: FloatArray, back: FloatArray, steps: int
) -> FloatArray | None:
    """Return the postures along the line, shape (steps + 1, 7), None if a limit ends it."""
    path = [q]
    for n in range(1, steps + 1):
        q = path[-1].copy()
        for _ in range(6):
            R, p = link_poses(chain, q)[-1]
            turn = R_AG @ R.T
            skew = [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
            error = np.concatenate([0.5 * np.array(skew), p_AG + n / steps * back - p])
            if np.abs(error).max() < AT_POSE:
                break
            q[1:] += np.linalg.lstsq(jacobian(chain, q), error, rcond=1e-9)[0]
        else:
            return None
        if np.any((q < chain.lower - 1e-9) | (q > chain.upper + 1e-9)):
            return None
        path.append(q)
    return np.array(path)


def _is_free(stop: Stop, neighbours: NeighbourList, path: FloatArray) -> bool:
    """Return whether Drake finds nothing in contact along a path."""
    scene = stop.scene
    for q in path:
        scene.set_arm(q)
        for first, second, distance in neighbours.violations():
            if distance < scene.required_clearance(first, second) - CLEARANCE_ROUNDING:
                return False
    return True


def refusals(robot: str, most: int, seed: int) -> None:
    """Search approaches of refusals of a robot drawn at random.

    Args:
        robot: Its name.
        most: Greatest number of refusals.
        seed: Seed of the draw.
    """
    job = load_job(*TASK, robot, paper=True)
    scene, lines = job.scene(), approach_lines(job)
    lowered = job.lowered(scene)
    (table,) = sweep(lowered, job.task.weights, jobs=1, approaches=lines).tables
    neighbours = NeighbourList(scene)
    stops, trees = StopGrid.of(job, scene, job.scored_grid, lowered), new_trees(seed)
    find = search_listed if lowered.arrays.chain.joints == 6 else search
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
            stop = stops.stop(number, trees)
            values = job.scored_grid.values(np.array([number]))
            stop.place({axis: float(value[0]) for axis, value in values.items()})
            found = find(stop, neighbours, goal, lines.fastest[goal])
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
        cell("refusals", robot, f"free, {kind}", f"{free} ({low:.1%} to {high:.1%})")
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
