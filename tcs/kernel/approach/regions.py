"""Approaches of goals that are regions: of several poses, or with something free about them.

The line leads to the pose that the arm holds. It is sought through the pose at which scoring
reached the goal, which is the most dexterous one; where none leads there, through other poses of
the region, which are scored as goals of a single pose.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.approach import sweep
from tcs.kernel.approach.memory import AnyApproach
from tcs.kernel.approach.scene import LineScene
from tcs.kernel.approach.sweep import ApproachLines, ReachedPairs, score_approaches
from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.contacts import NO_CONTACT
from tcs.kernel.freedom.forms import FEWEST_JOINTS, orientations
from tcs.kernel.motion.scene import arm_base
from tcs.kernel.postures import tool_poses
from tcs.kernel.problem import Problem
from tcs.kernel.rows import Rows
from tcs.kernel.scores import JOINTS, REACHED
from tcs.kernel.sweep import score

MOST_POSES = 24
"""Most poses of a region that are scored where no line leads through the first one."""
MOST_LINES = 8
"""Most of these, the most dexterous ones, through which a line is sought; then through the nominal
ones."""


def is_region(problem: Problem) -> bool:
    """Return whether a goal has several poses, or leaves more than an arm of five joints needs."""
    is_free = problem.goals.freedom.first.size and problem.chain.joints > FEWEST_JOINTS
    return bool(problem.goals.first_pose.size or is_free)


def score_region_approaches(
    problem: Problem, lines: ApproachLines, rows: Rows, pairs: ReachedPairs, memory: AnyApproach
) -> None:
    """Do as `score_approaches` for any goals.

    Of a region, `dexterity` is a lower bound of the best approachable posture, and a pair that is
    refused might have a line through a pose that is not tried.
    """
    if not is_region(problem):
        score_approaches(problem, lines, rows, pairs, memory)
        return
    row, goal = pairs.pair.T
    held = _at_postures(problem, rows.at(row), pairs.joints.astype(np.float64))
    through = pairs._replace(pair=np.stack([row, np.arange(len(row))], axis=1))
    score_approaches(held, _lines_of(lines, goal), rows, through, memory)
    refused = pairs.reason != REACHED
    for g in np.unique(goal[refused]):
        _try_other_poses(problem, lines, rows, pairs, memory, np.flatnonzero(refused & (goal == g)))


def warm_up(problem: Problem, lines: ApproachLines, memory: AnyApproach, none: Rows) -> None:
    """Compile what the two need, or load its machine code, given no rows."""
    if is_region(problem):
        exact = problem.at_single_poses(np.empty((1, 0, 3, 3)), np.empty((1, 0, 3)))
        score(exact, none)
        _at_postures(problem, none, np.empty((0, JOINTS)))
    no_pairs = ReachedPairs(
        np.empty((0, 2), np.int64),
        np.empty(0, np.uint8),
        np.empty(0, np.int32),
        np.empty(0, np.float32),
        np.empty((0, JOINTS), np.float32),
    )
    score_approaches(problem, lines, none, no_pairs, memory)


def approach_spline(
    problem: Problem, lines: ApproachLines, row: Rows, goal: int, q: FloatArray, scene: LineScene
) -> tuple[FloatArray, FloatArray] | None:
    """Do as `sweep.approach_spline` for any goal."""
    if not is_region(problem):
        return sweep.approach_spline(problem, lines, row, goal, q, scene)
    held = _at_postures(problem, row, np.asarray(q, dtype=np.float64)[None])
    return sweep.approach_spline(held, _lines_of(lines, np.array([goal])), row, 0, q, scene)


def _try_other_poses(
    problem: Problem,
    lines: ApproachLines,
    rows: Rows,
    pairs: ReachedPairs,
    memory: AnyApproach,
    which: IntArray,
) -> None:
    """Replace the scores of refused pairs of one goal by those through another of its poses."""
    exact, nominal = _sampled(problem, int(pairs.pair[which[0], 1]))
    at, count = rows.at(pairs.pair[which, 0]), exact.goals.number
    scores = score(exact, at)
    value = np.where(scores.reason == REACHED, scores.dexterity, -1.0)
    order = np.argsort(-value, axis=1, kind="stable")[:, :MOST_LINES]
    # With the nominal poses, a region never reaches less than its nominal goal.
    order = np.concatenate([order, np.tile(nominal, (len(which), 1))], axis=1)
    of_pose = _lines_of(lines, np.full(count, pairs.pair[which[0], 1]))
    for rank in range(order.shape[1]):
        left = np.flatnonzero(pairs.reason[which] != REACHED)
        left = left[value[left, order[left, rank]] >= 0.0]
        if not left.size:
            continue
        pose = order[left, rank]
        found = ReachedPairs(
            np.stack([left, pose], axis=1),
            np.full(len(left), REACHED, np.uint8),
            np.full(len(left), NO_CONTACT, np.int32),
            scores.dexterity[left, pose],
            scores.joints[left, pose],
        )
        score_approaches(exact, of_pose, at, found, memory)
        leads = found.reason == REACHED
        to = which[left[leads]]
        pairs.reason[to], pairs.contact[to] = REACHED, NO_CONTACT
        pairs.dexterity[to], pairs.joints[to] = found.dexterity[leads], found.joints[leads]


class RegionPoses(NamedTuple):
    """Some poses of the region of a goal, the nominal ones first."""

    pose: IntArray
    """Number of the goal's pose in whose frame each is given, shape (n,)."""
    R: FloatArray
    """Orientations of the tool there, shape (n, 3, 3)."""
    p: FloatArray
    """Positions there [m], shape (n, 3)."""
    nominal: int
    """Number of nominal ones."""


def region_poses(problem: Problem, goal: int) -> RegionPoses:
    """Return the nominal poses of a goal, and at most MOST_POSES others of its region."""
    goals = problem.goals
    nominal = np.array(list(goals.poses_of(goal)), dtype=np.int64)
    pose, R, p = (
        [nominal],
        [np.tile(np.eye(3), (len(nominal), 1, 1))],
        [np.zeros((len(nominal), 3))],
    )
    for number in nominal.tolist() if goals.freedom.first.size else ():
        form, u = goals.freedom.form[number], goals.freedom.samples(number)
        pose.append(np.full(len(u), number))
        R.append(orientations(form, u).as_matrix())
        p.append(u[:, 3:6])
    of, every_R, every_p = np.concatenate(pose), np.concatenate(R), np.concatenate(p)
    count = len(nominal)
    others = np.linspace(count, len(of), MOST_POSES, endpoint=False).astype(np.int64)
    some = np.unique(np.concatenate([np.arange(count), others[others < len(of)]]))
    return RegionPoses(of[some], every_R[some], every_p[some], count)


def _sampled(problem: Problem, goal: int) -> tuple[Problem, IntArray]:
    """Return a problem whose goals are single poses of the region of one goal.

    Also the numbers of those that are nominal ones.
    """
    some = region_poses(problem, goal)
    R_WG, p_WG = problem.goals.R[:, some.pose], problem.goals.p[:, some.pose]
    exact = problem.at_single_poses(R_WG @ some.R, p_WG + np.einsum("suij,uj->sui", R_WG, some.p))
    return exact, np.arange(some.nominal)


def _at_postures(problem: Problem, rows: Rows, q: FloatArray) -> Problem:
    """Return a problem whose goal n is where posture n [rad] holds the tool at row n."""
    R, p = np.empty((len(q), 3, 3)), np.empty((len(q), 3))
    tool_poses(problem.chain.R, problem.chain.p, np.ascontiguousarray(q), R, p)
    for n in range(len(q)):
        R_WA, p_WA = arm_base(problem, rows.at(slice(n, n + 1)))
        R[n], p[n] = R_WA @ R[n], p_WA + R_WA @ p[n]
    states = len(problem.goals.p)
    return problem.at_single_poses(
        np.repeat(R[None], states, axis=0), np.repeat(p[None], states, 0)
    )


def _lines_of(lines: ApproachLines, goals: IntArray) -> ApproachLines:
    """Return the lines of some goals."""
    return ApproachLines(
        np.ascontiguousarray(lines.offset[goals]), np.ascontiguousarray(lines.fastest[goals])
    )
