"""Approaches of reached pairs of configuration and goal."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.approach.memory import AnyApproach, new_approach
from tcs.kernel.approach.scene import LineScene, approach_scene, place_scene
from tcs.kernel.approach.solvers import approach_pair, follow_posture
from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.base_pose import (
    environment_in_arm_base,
    goal_in_arm_base,
    place_base,
    shares_base,
)
from tcs.kernel.cache import inner, jit
from tcs.kernel.contacts import NO_CONTACT
from tcs.kernel.dexterity.measures import measure_at, rounded_inward
from tcs.kernel.motion.scene import NO_PAIR
from tcs.kernel.motion.straight import DONE
from tcs.kernel.problem import Problem
from tcs.kernel.rows import Rows
from tcs.kernel.scores import APPROACH_BLOCKED, JOINTS, REACHED
from tcs.kernel.views import unowned


class ApproachLines(NamedTuple):
    """The straight tool motions that end at the goals."""

    offset: FloatArray
    """Motion of the tool from begin to end, in the tool frame at the goal [m], shape (goals, 3)."""
    fastest: FloatArray
    """Greatest motion of each joint for the whole line at constant rate, which is what the velocity
    limits allow at the tool's speed [rad], shape (goals, 7)."""


class ReachedPairs(NamedTuple):
    """Scores of reached pairs, in ascending order of the rows."""

    pair: IntArray
    """Row and goal, shape (n, 2)."""
    reason: NDArray[np.uint8]
    """REACHED; filled with the reason where no posture is approachable, shape (n,)."""
    contact: NDArray[np.int32]
    """Filled with the contact that blocks the approach, or NO_CONTACT, shape (n,)."""
    dexterity: NDArray[np.float32]
    """Measure of the best solution; filled with that of the best approachable one, shape (n,)."""
    joints: NDArray[np.float32]
    """Its joint angles [rad], shape (n, 7)."""


def score_approaches(
    problem: Problem,
    lines: ApproachLines,
    rows: Rows,
    pairs: ReachedPairs,
    memory: AnyApproach | None = None,
) -> None:
    """Replace the scores of reached pairs by those with approach.

    Args:
        problem: The scene and its goals.
        lines: The approaches of the goals.
        rows: The configurations.
        pairs: The scores; replaced.
        memory: Made by `new_approach`, and used by no other thread; None makes it, and the
            `approach_scene` of the problem, which takes a tenth of a second.
    """
    # Referred to here to outlive the call: the compiled code takes unowned views of these arrays.
    memory = new_approach(problem, approach_scene(problem)) if memory is None else memory
    # Other orders in memory are other types, for which the code would be compiled anew.
    pairs = pairs._replace(pair=np.ascontiguousarray(pairs.pair, dtype=np.int64))
    _approach(problem, memory, lines, rows, pairs, np.empty(0))


def approach_spline(
    problem: Problem,
    lines: ApproachLines,
    row: Rows,
    goal: int,
    q: FloatArray,
    scene: LineScene | None = None,
) -> tuple[FloatArray, FloatArray] | None:
    """Return the approach of a posture as a spline in joint space, None if none is found.

    Args:
        problem: The scene and its goals.
        lines: The approaches of the goals.
        row: The configuration.
        goal: Number of the goal.
        q: Joint angles at the goal, free of contact [rad], shape (7,).
        scene: The `approach_scene` of the problem, which takes a tenth of a second to make.

    Returns:
        Joint angles at equal distances of the tool [rad], shape (n, 7), from the begin of the
        approach to the goal, and their derivatives by the fraction of the line [rad]: a cubic
        Hermite spline.
    """
    approach = new_approach(problem, approach_scene(problem) if scene is None else scene)
    at = ReachedPairs(
        np.array([[0, goal]]), np.zeros(1, np.uint8), np.zeros(1, np.int32),
        np.zeros(1, np.float32), np.zeros((1, JOINTS), np.float32),
    )  # fmt: skip
    if _approach(problem, approach, lines, row, at, np.array(q, dtype=np.float64)) != DONE:
        return None
    count = approach.curve.pieces[0] + 1
    points, tangents = approach.curve.points[:count], approach.curve.tangents[:count]
    return points[::-1].copy(), -tangents[::-1]


@inner
def _place_surroundings(problem: Problem, approach: AnyApproach, torso: int) -> None:
    """Place everything around the arm, the base being in place."""
    environment_in_arm_base(problem, approach.work, torso)
    place_scene(
        problem, approach.work, torso, approach.scene, approach.moving, approach.moved,
        approach.motion,
    )  # fmt: skip


@inner
def _place_goal(
    problem: Problem, approach: AnyApproach, lines: ApproachLines, state: int, torso: int, g: int
) -> None:
    """Fill the pose of a goal in A, and the offset from there to the begin of its approach."""
    work = approach.work
    goal_in_arm_base(problem, work, state, torso, g)
    # No result may depend on the pairs before, whose shapes are no longer in place.
    approach.motion.contacts.pair[0] = NO_PAIR
    for r in range(3):
        approach.offset[r] = 0.0
        for c in range(3):
            approach.offset[r] -= work.R_AG[r, c] * lines.offset[g, c]


@jit
def _approach(
    owned_problem: Problem,
    owned_approach: AnyApproach,
    owned_lines: ApproachLines,
    owned_rows: Rows,
    owned_pairs: ReachedPairs,
    posture: FloatArray,
) -> int:
    """Replace the scores of pairs; or follow the line of a posture at the first pair.

    One function, as scoring follows lines too: two would be compiled from almost the same code.

    Args:
        owned_problem: The scene and its goals.
        owned_approach: Memory of this thread.
        owned_lines: The approaches of the goals.
        owned_rows: The configurations.
        owned_pairs: The pairs; their scores are replaced, unless a line is followed.
        posture: Joint angles whose line is followed [rad], shape (7,), or (0,) to score.

    Returns:
        DONE; if a line is followed, why not.
    """
    problem, approach = unowned(owned_problem), unowned(owned_approach)
    lines, rows, pairs = unowned(owned_lines), unowned(owned_rows), unowned(owned_pairs)
    work, q, last = approach.work, np.empty(7), -1
    for n in range(len(pairs.pair)):
        row, g = pairs.pair[n, 0], pairs.pair[n, 1]
        state, torso = rows.state[row], rows.torso[row]
        if row != last:
            if last == -1 or not shares_base(rows, row, last):
                place_base(problem, work, rows, row)
            last = row
            _place_surroundings(problem, approach, torso)
        _place_goal(problem, approach, lines, state, torso, g)
        if len(posture) > 0:
            return follow_posture(problem, approach, lines.fastest[g], posture)
        for k in range(7):
            q[k] = pairs.joints[n, k]
        outcome = approach_pair(problem, approach, lines.fastest[g], q)
        if outcome == -1:
            continue
        pairs.reason[n] = outcome
        pairs.contact[n] = approach.contact[0] if outcome == APPROACH_BLOCKED else NO_CONTACT
        pairs.dexterity[n] = 0.0
        if outcome == REACHED:
            rounded_inward(approach.search.best, problem.arm.lower, problem.arm.upper, q)
            for k in range(7):
                pairs.joints[n, k] = q[k]
            pairs.dexterity[n] = measure_at(problem, q)
    return DONE
