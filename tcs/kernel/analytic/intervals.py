"""Intervals between samples of the free joint in which joints move far or windows may hide.

Between two samples every joint moves continuously. How far it has moved bounds how near to its
limits it may come in between: that rules most intervals out for certain, and the others are divided
until they are ruled out as well, hold a feasible angle, or are too narrow to matter. Next to a
singular posture, where joints move by radians while the free joint all but rests, that divides as
finely as the joints need it.
"""

from __future__ import annotations

import numpy as np

from tcs.kernel.analytic.samples import (
    AIM,
    C2,
    C3,
    C4,
    C5,
    C6,
    C7,
    S2,
    S3,
    S4,
    S5,
    S6,
    S7,
    WRIST,
    measure_samples,
)
from tcs.kernel.analytic.scratch import (
    MAX_INTERVALS,
    MAX_STACK,
    Search,
    add_candidate,
    fill_samples,
    measure_feasible,
    solve,
)
from tcs.kernel.analytic.solver import ArmSolver
from tcs.kernel.arrays import FloatArray
from tcs.kernel.cache import inner, int_constant, jit

ONE = np.uint64(1)
PATH = 1.6
"""Longest path of a joint over the distance between its ends: half a turn over its chord is pi / 2.
Distances are taken as the sum of the changes of cosine and sine, the chord or more."""
REST = 0.5
"""How much farther a joint may move than its ends show, as a fraction of the farthest motion of any
joint in the interval: joints drive each other."""
FAR = 0.15
"""Motion of a joint between two feasible samples [rad] from which on the interval is divided:
contacts and measure change with the joints, not with the free joint alone."""
FAR_ENDS = 0.5
"""The same where the goal is reached already, for intervals of the search and for those with an
infeasible end: up to here, refinement of the best sample and the samples at the ends of windows
suffice."""
COS_FAST = float(np.cos(FAR_ENDS))
"""Cosine of a motion of FAR_ENDS."""
SLOPE = 0.8
"""Change of isotropy over the motion of the joint that moves farthest [1/rad], from above: where
the goal is reached already, intervals that cannot hold a better solution are left out."""
ROLLED = 4.0
"""Added to the bound of joints 5 and 7 [1], more than any limit takes, where the wrist may pass
straight between two samples: each time they rotate by half a turn, and twice leaves no trace."""
ONCE = 5e-3
"""Spacing [rad] up to which the wrist passes straight at most once between two samples, and the
joints at the two show it."""
NEAR = 2e-4
"""Motion [rad] below which an interval is not divided further: narrower windows are given up."""
PARTS = int_constant(8)
"""Samples over an interval, its ends among them: one vector of the processor."""
FINEST = 1e-15
"""Spacing of samples [rad] at which the free joint's own digits end."""
MAX_DIVISIONS = 4096
"""Most intervals divided for one goal, shared among those recorded. Reached only if a joint follows
its limit for a while."""


@jit
def motions(
    arm: ArmSolver, goal: FloatArray, rows: FloatArray, slack: FloatArray, count: int, step: float,
    motion: FloatArray,
) -> None:  # fmt: skip
    """Fill how far joints move between neighbouring samples where that matters, else 0.

    Args:
        arm: The arm.
        goal: From `wrist_goal`, shape (4, 3).
        rows: Joints of the samples, from `solve_samples`.
        slack: Of the samples, from `solve_samples`.
        count: Number of samples.
        step: Their spacing [rad].
        motion: Filled, shape (>= count - 1,): the farthest motion of any joint [rad], where both
            samples are infeasible and a feasible one may lie between, or one is feasible and a
            joint moves farther than FAR; 0 elsewhere.
    """
    h2, h3, h4 = 2.0 * arm.limit_cos[1], 2.0 * arm.limit_cos[2], 2.0 * arm.limit_cos[3]
    h5, h6, h7 = 2.0 * arm.limit_cos[4], 2.0 * arm.limit_cos[5], 2.0 * arm.limit_cos[6]
    mc2, ms2 = arm.middle_cos[1], arm.middle_sin[1]
    mc3, ms3 = arm.middle_cos[2], arm.middle_sin[2]
    mc4, ms4 = arm.middle_cos[3], arm.middle_sin[3]
    mc5, ms5 = arm.middle_cos[4], arm.middle_sin[4]
    mc6, ms6 = arm.middle_cos[5], arm.middle_sin[5]
    mc7, ms7 = arm.middle_cos[6], arm.middle_sin[6]
    # The aim is missed or met along axis 2, which moves against the wrist as the free joint turns,
    # and at a distance from axis 3, which the elbow changes.
    swing = step * np.hypot(goal[0, 0], goal[0, 1])
    forearm = PATH * np.sqrt(arm.uc[0] ** 2 + arm.uc[1] ** 2 + arm.uc[2] ** 2)
    for i in range(count - 1):
        n = np.uint64(i)
        m = n + ONE
        l2 = abs(rows[C2 + m] - rows[C2 + n]) + abs(rows[S2 + m] - rows[S2 + n])
        l3 = abs(rows[C3 + m] - rows[C3 + n]) + abs(rows[S3 + m] - rows[S3 + n])
        l4 = abs(rows[C4 + m] - rows[C4 + n]) + abs(rows[S4 + m] - rows[S4 + n])
        l5 = abs(rows[C5 + m] - rows[C5 + n]) + abs(rows[S5 + m] - rows[S5 + n])
        l6 = abs(rows[C6 + m] - rows[C6 + n]) + abs(rows[S6 + m] - rows[S6 + n])
        l7 = abs(rows[C7 + m] - rows[C7 + n]) + abs(rows[S7 + m] - rows[S7 + n])
        most = max(max(max(l2, l3), max(l4, l5)), max(l6, l7))
        # Slack is a cosine, which changes by no more than its angle: twice its highest in between.
        high = (rows[C2 + n] + rows[C2 + m]) * mc2 + (rows[S2 + n] + rows[S2 + m]) * ms2
        room = high - h2 + PATH * l2
        high = (rows[C3 + n] + rows[C3 + m]) * mc3 + (rows[S3 + n] + rows[S3 + m]) * ms3
        room = min(room, high - h3 + PATH * l3)
        high = (rows[C4 + n] + rows[C4 + m]) * mc4 + (rows[S4 + n] + rows[S4 + m]) * ms4
        room = min(room, high - h4 + PATH * l4)
        swept = PATH * (step + l2 + l3 + l4)
        bend = np.sqrt(max(-2.0 * rows[WRIST + n], 0.0)) + np.sqrt(max(-2.0 * rows[WRIST + m], 0.0))
        rolled = ROLLED if bend < (swept if step > ONCE else 0.0) else 0.0
        high = (rows[C5 + n] + rows[C5 + m]) * mc5 + (rows[S5 + n] + rows[S5 + m]) * ms5 + rolled
        room = min(room, high - h5 + PATH * l5)
        high = (rows[C6 + n] + rows[C6 + m]) * mc6 + (rows[S6 + n] + rows[S6 + m]) * ms6
        room = min(room, high - h6 + PATH * l6)
        high = (rows[C7 + n] + rows[C7 + m]) * mc7 + (rows[S7 + n] + rows[S7 + m]) * ms7 + rolled
        room = min(room, high - h7 + PATH * l7) + REST * most
        # Where aim or wrist do not exist at either end, what stands in says nothing of its joint.
        missing = max(min(rows[AIM + n], rows[AIM + m]), min(rows[WRIST + n], rows[WRIST + m]))
        room = 1.0 if missing > 0.0 else room
        room = min(room, swing + forearm * l4 - (rows[AIM + n] + rows[AIM + m]))
        room = min(room, swept - (rows[WRIST + n] + rows[WRIST + m]))
        most = max(most, step)
        matters = most > FAR or max(slack[i], slack[i + 1]) < 0.0
        motion[i] = most if room >= 0.0 and matters else 0.0


@inner
def record_intervals(arm: ArmSolver, search: Search, b: int, count: int, step: float) -> None:
    """Append the intervals between the samples on branch b that need to be divided."""
    samples = search.samples
    motions(arm, search.goal, samples.rows, samples.slack, count, step, samples.motion)
    for i in range(count - 1):
        if samples.motion[i] > FAR_ENDS:
            measure_samples(arm, samples.rows, samples.slack, count, samples.measure)
            break
    for i in range(count - 1):
        if samples.motion[i] > 0.0:
            _record(search, b, i, _most(search, i) if samples.motion[i] > FAR_ENDS else -1.0)


@inner
def record_fast(arm: ArmSolver, search: Search, b: int, count: int, step: float) -> None:
    """Append the intervals in which joints move farther than FAR_ENDS, between samples on branch b.

    Next to singular postures joints 2, 3 and 5 move that far, and others only with them.
    """
    rows, fast = search.samples.rows, 0
    for i in range(count - 1):
        n = np.uint64(i)
        m = n + ONE
        along2 = rows[C2 + n] * rows[C2 + m] + rows[S2 + n] * rows[S2 + m]
        along3 = rows[C3 + n] * rows[C3 + m] + rows[S3 + n] * rows[S3 + m]
        along5 = rows[C5 + n] * rows[C5 + m] + rows[S5 + n] * rows[S5 + m]
        # Counted, not returned early: so the loop is vectorised.
        fast += min(along2, min(along3, along5)) < COS_FAST
    if fast:
        record_intervals(arm, search, b, count, step)


@inner
def record_uncovered(
    arm: ArmSolver, search: Search, b: int, count: int, step: float, windows: int
) -> None:
    """Append the intervals on branch b that need to be divided and lie in no window."""
    samples = search.samples
    motions(arm, search.goal, samples.rows, samples.slack, count, step, samples.motion)
    w = 0
    for i in range(count - 1):
        while w < windows and search.feasible.windows[w, 1] <= i:
            w += 1
        if samples.motion[i] > 0.0 and not (w < windows and search.feasible.windows[w, 0] <= i):
            _record(search, b, i, -1.0)


@inner
def _record(search: Search, b: int, i: int, most: float) -> None:
    """Append the interval between samples i and i + 1, which holds at most a given isotropy."""
    postponed = search.postponed
    n = postponed.number[0]
    if n < MAX_INTERVALS:
        interval = postponed.intervals[n]
        interval[0], interval[1], interval[2] = (
            search.samples.angle[i],
            search.samples.angle[i + 1],
            b,
        )
        interval[3] = most
        postponed.number[0] = n + 1


@inner
def _most(search: Search, i: int) -> float:
    """Return the greatest isotropy that may lie between samples i and i + 1."""
    samples = search.samples
    ends = abs(samples.measure[i]) ** (1.0 / 6.0) + abs(samples.measure[i + 1]) ** (1.0 / 6.0)
    return 0.5 * (ends + SLOPE * samples.motion[i])


@inner
def _may_improve(search: Search, i: int, isotropy: float) -> bool:
    """Return whether more than an isotropy may lie between samples i and i + 1."""
    samples = search.samples
    least = min(samples.slack[i], samples.slack[i + 1])
    if samples.motion[i] <= (FAR if least >= 0.0 else FAR_ENDS):
        return False
    return _most(search, i) > isotropy


@jit
def divide_intervals(arm: ArmSolver, search: Search, found: int, isotropy: float) -> int:
    """Append the feasible angles that lie in the recorded intervals.

    Args:
        arm: The arm.
        search: From `find_candidates`.
        found: Number of candidates.
        isotropy: Isotropy to exceed if the goal is reached already: only intervals that may hold a
            better solution are divided; -1 to divide all.

    Returns:
        Updated number of candidates.
    """
    postponed, samples = search.postponed, search.samples
    stack, intervals, divisions = postponed.stack, postponed.number[0], 0
    for k in range(intervals):
        interval = postponed.intervals[k]
        if isotropy >= 0.0 and interval[3] <= isotropy:
            continue
        b = int(interval[2])
        stack[0, 0], stack[0, 1] = interval[0], interval[1]
        top = 1
        # No interval takes more than its part and what earlier ones left.
        while top and divisions * intervals < MAX_DIVISIONS * (k + 1):
            top -= 1
            divisions += 1
            step = fill_samples(search, stack[top, 0], stack[top, 1], PARTS)
            solve(arm, search, b, PARTS)
            if isotropy >= 0.0:
                measure_samples(arm, samples.rows, samples.slack, PARTS, samples.measure)
            else:
                measure_feasible(arm, search, PARTS)
            motions(arm, search.goal, samples.rows, samples.slack, PARTS, step, samples.motion)
            for i in range(PARTS):
                if 0 < i < PARTS - 1 and samples.slack[i] >= 0.0:
                    found = add_candidate(search, b, i, step, found)
                divisible = i < PARTS - 1 and step > FINEST and top < MAX_STACK
                if not divisible or samples.motion[i] <= NEAR:
                    continue
                if isotropy < 0.0 or _may_improve(search, i, isotropy):
                    stack[top, 0], stack[top, 1] = samples.angle[i], samples.angle[i + 1]
                    top += 1
    return found
