"""Scratch memory of the search over the free joint, and the steps that every search takes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.analytic.arcs import MAX_ARCS
from tcs.kernel.analytic.samples import MAX_SAMPLES, ROW, ROWS, measure_samples, solve_samples
from tcs.kernel.analytic.solver import ArmSolver
from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.cache import inner, int_constant
from tcs.kernel.collide import COLUMNS

MAX_WINDOWS = 32
MAX_CANDIDATES = 4096
MAX_INTERVALS = 1024
"""Most intervals between samples that are searched for windows later on."""
MAX_STACK = 256
"""Most parts of one interval that wait to be divided."""
NO_PAIR, UNCHECKED_PAIR = int_constant(-1), int_constant(-2)
"""In place of a pair in contact: nothing touches there, or it has not been looked at."""


class FeasibleAngles(NamedTuple):
    """Where the joint limits leave the free joint."""

    arcs: FloatArray
    """Arcs of the free joint (first, last) [rad], shape (MAX_ARCS, 2)."""
    arc_count: IntArray
    """Number of arcs, shape (1,)."""
    windows: FloatArray
    """Windows among the samples (first, last), see `windows_of`, shape (MAX_WINDOWS, 2)."""
    ends: FloatArray
    """Samples just outside and just inside each end of a feasible interval [rad], shape
    (MAX_WINDOWS, 2)."""
    peaks: FloatArray
    """Infeasible angles at which the slack has a local maximum [rad], shape (MAX_WINDOWS,)."""


class Samples(NamedTuple):
    """Samples of the free joint on one branch, shape (MAX_SAMPLES,) where none is given."""

    angle: FloatArray
    """The free joint [rad]."""
    cosine: FloatArray
    """Its cosine."""
    sine: FloatArray
    """Its sine."""
    rows: FloatArray
    """Joints of the samples, see `samples`, shape (ROWS * ROW,)."""
    slack: FloatArray
    """At least 0 where every joint is within its limits, see `solve_samples`."""
    measure: FloatArray
    """Isotropy to the sixth power, or another measure that is maximised."""
    motion: FloatArray
    """How far joints move between neighbouring samples, from `motions`."""


class PostponedIntervals(NamedTuple):
    """Intervals between neighbouring samples to search later on."""

    intervals: FloatArray
    """First and last [rad], branch, and the greatest isotropy that they may hold, shape
    (MAX_INTERVALS, 4)."""
    number: IntArray
    """Number of intervals, shape (1,)."""
    stack: FloatArray
    """Parts of one that are still to divide: first and last [rad], shape (MAX_STACK, 2)."""


class Candidates(NamedTuple):
    """Feasible postures found so far, shape (MAX_CANDIDATES,) where none is given."""

    angle: FloatArray
    """Free joint of each [rad]."""
    step: FloatArray
    """Spacing of the samples among which each was found [rad]."""
    measure: FloatArray
    """Isotropy of each to the sixth power, or its measure if another one is maximised."""
    branch: IntArray
    """Row of each one's branch in `arm.branches`."""
    q: FloatArray
    """Its joint angles once its contacts have been checked [rad], shape (MAX_CANDIDATES, 7)."""
    pair: IntArray
    """The pair in contact there, as in `Workspace.last`, shape (MAX_CANDIDATES, 3)."""
    key: FloatArray
    """Sort key of each."""
    order: IntArray
    """Indices by ascending key."""
    spare: IntArray
    """Scratch of the merge sort."""
    free_from: IntArray
    """First of those that are known to be free, shape (1,)."""


class Bisection(NamedTuple):
    """Intervals between angles in contact, which are halved until one is free."""

    angle: FloatArray
    """First and last [rad], shape (MAX_STACK, 2)."""
    q: FloatArray
    """Joint angles at their ends [rad], shape (MAX_STACK, 2, 7)."""
    pair: IntArray
    """Pairs in contact at their ends, as in `Workspace.last`, shape (MAX_STACK, 2, 3)."""
    R: FloatArray
    """Orientations of A, L1..L7 in A at their ends, shape (MAX_STACK, 2, 8, 3, 3)."""
    p: FloatArray
    """Origins of A, L1..L7 in A at their ends [m], shape (MAX_STACK, 2, 8, 3)."""
    moved: FloatArray
    """A shape at both ends of an interval, packed, shape (2, COLUMNS)."""


class Search(NamedTuple):
    """Scratch of the search over the free joint, reused from pair to pair."""

    goal: FloatArray
    """The goal as the closed form takes it, see `ik.wrist_goal`, shape (4, 3)."""
    feasible: FeasibleAngles
    samples: Samples
    postponed: PostponedIntervals
    candidates: Candidates
    bisection: Bisection
    trial: FloatArray
    """Joint angles of the solution that is being refined, shape (7,)."""
    q: FloatArray
    """Current joint angles [rad], shape (7,)."""
    best: FloatArray
    """Joint angles of the best solution so far [rad], shape (7,)."""


def new_search() -> Search:
    """Return scratch memory for one worker."""
    return Search(
        goal=np.empty((4, 3)),
        feasible=FeasibleAngles(
            arcs=np.empty((MAX_ARCS, 2)),
            arc_count=np.zeros(1, np.int64),
            windows=np.empty((MAX_WINDOWS, 2)),
            ends=np.empty((MAX_WINDOWS, 2)),
            peaks=np.empty(MAX_WINDOWS),
        ),
        samples=Samples(
            angle=np.empty(MAX_SAMPLES),
            cosine=np.empty(MAX_SAMPLES),
            sine=np.empty(MAX_SAMPLES),
            rows=np.empty(ROWS * ROW),
            slack=np.empty(MAX_SAMPLES),
            measure=np.empty(MAX_SAMPLES),
            motion=np.empty(MAX_SAMPLES),
        ),
        postponed=PostponedIntervals(
            intervals=np.empty((MAX_INTERVALS, 4)),
            number=np.zeros(1, np.int64),
            stack=np.empty((MAX_STACK, 2)),
        ),
        candidates=Candidates(
            angle=np.empty(MAX_CANDIDATES),
            step=np.empty(MAX_CANDIDATES),
            measure=np.empty(MAX_CANDIDATES),
            branch=np.empty(MAX_CANDIDATES, np.int64),
            q=np.empty((MAX_CANDIDATES, 7)),
            pair=np.empty((MAX_CANDIDATES, 3), np.int64),
            key=np.empty(MAX_CANDIDATES),
            order=np.empty(MAX_CANDIDATES, np.int64),
            spare=np.empty(MAX_CANDIDATES, np.int64),
            free_from=np.zeros(1, np.int64),
        ),
        bisection=Bisection(
            angle=np.empty((MAX_STACK, 2)),
            q=np.empty((MAX_STACK, 2, 7)),
            pair=np.empty((MAX_STACK, 2, 3), np.int64),
            R=np.empty((MAX_STACK, 2, 8, 3, 3)),
            p=np.empty((MAX_STACK, 2, 8, 3)),
            moved=np.empty((2, COLUMNS)),
        ),
        trial=np.empty(7),
        q=np.empty(7),
        best=np.empty(7),
    )


@inner
def fill_samples(search: Search, first: float, last: float, count: int) -> float:
    """Spread `count` >= 2 samples evenly from first to last, ends included; return their spacing.

    Each cosine and sine follows from the previous one by a rotation: 512 rotations lose about
    1e-13, and the joint angles of a solution are recomputed from its angle.
    """
    samples = search.samples
    step = (last - first) / (count - 1)
    c, s = np.cos(first), np.sin(first)
    dc, ds = np.cos(step), np.sin(step)
    for i in range(count):
        samples.angle[i] = first + i * step
        samples.cosine[i], samples.sine[i] = c, s
        c, s = c * dc - s * ds, s * dc + c * ds
    return step


@inner
def solve(arm: ArmSolver, search: Search, b: int, count: int) -> None:
    """Fill joints and slack of the first samples on branch b."""
    samples = search.samples
    solve_samples(
        arm, search.goal, arm.branches[b], samples.cosine, samples.sine, count,
        samples.rows, samples.slack,
    )  # fmt: skip


@inner
def measure_feasible(arm: ArmSolver, search: Search, count: int) -> None:
    """Fill the isotropy of the samples that `solve` left, if any of them is feasible."""
    samples = search.samples
    for i in range(count):
        if samples.slack[i] >= 0.0:
            measure_samples(arm, samples.rows, samples.slack, count, samples.measure)
            return


@inner
def best_of(measure: FloatArray, count: int) -> int:
    """Return the index of the greatest value, the first one if several are equal."""
    best = 0
    for i in range(1, count):
        if measure[i] > measure[best]:
            best = i
    return best


@inner
def sort_candidates(search: Search, count: int) -> None:
    """Fill `candidates.order` with the first `count` ones by ascending `key`; the sort is stable.

    The merge sort is written out because numpy's takes three seconds to compile.
    """
    candidates = search.candidates
    key, order, spare = candidates.key, candidates.order, candidates.spare
    for i in range(count):
        order[i] = i
    width = 1
    while width < count:
        for first in range(0, count, 2 * width):
            middle, last = min(first + width, count), min(first + 2 * width, count)
            i, j = first, middle
            for k in range(first, last):
                if j == last or (i < middle and key[order[i]] <= key[order[j]]):
                    spare[k] = order[i]
                    i += 1
                else:
                    spare[k] = order[j]
                    j += 1
        for k in range(count):
            order[k] = spare[k]
        width *= 2


@inner
def add_candidate(search: Search, b: int, i: int, step: float, found: int) -> int:
    """Append sample i as a candidate on branch b; return the number of candidates."""
    candidates = search.candidates
    if found == MAX_CANDIDATES:
        return found
    candidates.angle[found] = search.samples.angle[i]
    candidates.step[found] = step
    candidates.measure[found] = search.samples.measure[i]
    candidates.branch[found] = b
    candidates.pair[found, 0] = UNCHECKED_PAIR
    return found + 1
