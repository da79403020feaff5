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


class Search(NamedTuple):
    """Scratch of the search over the free joint, reused from pair to pair."""

    goal: FloatArray
    arcs: FloatArray
    """Arcs of the free joint (first, last) [rad], shape (MAX_ARCS, 2)."""
    arc_count: IntArray
    """Number of arcs, shape (1,)."""
    windows: FloatArray
    ends: FloatArray
    """Samples just outside and just inside each end of a feasible interval [rad], shape
    (MAX_WINDOWS, 2)."""
    peaks: FloatArray
    """Infeasible angles at which the slack has a local maximum [rad], shape (MAX_WINDOWS,)."""
    angle: FloatArray
    cosine: FloatArray
    sine: FloatArray
    rows: FloatArray
    """Joints of the samples, see `samples`, shape (ROWS * ROW,)."""
    slack: FloatArray
    measure: FloatArray
    motion: FloatArray
    """How far joints move between neighbouring samples, from `motions`, shape (MAX_SAMPLES,)."""
    intervals: FloatArray
    """Intervals between neighbouring samples to search later on: first and last [rad], branch, and
    the greatest isotropy that they may hold, shape (MAX_INTERVALS, 4)."""
    interval_count: IntArray
    """Number of intervals, shape (1,)."""
    stack: FloatArray
    """Intervals still to divide: first and last [rad], shape (MAX_STACK, 2)."""
    found_angle: FloatArray
    """Free joint of each candidate [rad], shape (MAX_CANDIDATES,)."""
    found_step: FloatArray
    """Spacing of the samples among which each candidate was found [rad], shape
    (MAX_CANDIDATES,)."""
    found_measure: FloatArray
    """Isotropy of each candidate to the sixth power, or its measure if another one is maximised,
    shape (MAX_CANDIDATES,)."""
    found_branch: IntArray
    """Row of each candidate's branch in `arm.branches`, shape (MAX_CANDIDATES,)."""
    found_q: FloatArray
    """Its joint angles once its contacts have been checked [rad], shape (MAX_CANDIDATES, 7)."""
    found_pair: IntArray
    """The pair in contact there, as in `Workspace.last`, shape (MAX_CANDIDATES, 3)."""
    key: FloatArray
    """Sort key of each candidate, shape (MAX_CANDIDATES,)."""
    order: IntArray
    """Indices of the candidates by ascending key, shape (MAX_CANDIDATES,)."""
    spare: IntArray
    """Scratch of the merge sort, shape (MAX_CANDIDATES,)."""
    free_from: IntArray
    """First of the candidates that are known to be free, shape (1,)."""
    ends_angle: FloatArray
    """Intervals between angles in contact: first and last [rad], shape (MAX_STACK, 2)."""
    ends_q: FloatArray
    """Joint angles at their ends [rad], shape (MAX_STACK, 2, 7)."""
    ends_pair: IntArray
    """Pairs in contact at their ends, as in `Workspace.last`, shape (MAX_STACK, 2, 3)."""
    ends_R: FloatArray
    """Orientations of A, L1..L7 in A at their ends, shape (MAX_STACK, 2, 8, 3, 3)."""
    ends_p: FloatArray
    """Origins of A, L1..L7 in A at their ends [m], shape (MAX_STACK, 2, 8, 3)."""
    moved: FloatArray
    """A shape at both ends of an interval, packed, shape (2, COLUMNS)."""
    trial: FloatArray
    """Joint angles of the solution that is being refined, shape (7,)."""
    q: FloatArray
    """Current joint angles [rad], shape (7,)."""
    best: FloatArray
    """Joint angles of the best solution so far [rad], shape (7,)."""


def new_search() -> Search:
    """Return scratch memory for one worker."""
    return Search(
        np.empty((4, 3)),
        np.empty((MAX_ARCS, 2)),
        np.zeros(1, np.int64),
        np.empty((MAX_WINDOWS, 2)),
        np.empty((MAX_WINDOWS, 2)),
        np.empty(MAX_WINDOWS),
        np.empty(MAX_SAMPLES),
        np.empty(MAX_SAMPLES),
        np.empty(MAX_SAMPLES),
        np.empty(ROWS * ROW),
        np.empty(MAX_SAMPLES),
        np.empty(MAX_SAMPLES),
        np.empty(MAX_SAMPLES),
        np.empty((MAX_INTERVALS, 4)),
        np.zeros(1, np.int64),
        np.empty((MAX_STACK, 2)),
        np.empty(MAX_CANDIDATES),
        np.empty(MAX_CANDIDATES),
        np.empty(MAX_CANDIDATES),
        np.empty(MAX_CANDIDATES, np.int64),
        np.empty((MAX_CANDIDATES, 7)),
        np.empty((MAX_CANDIDATES, 3), np.int64),
        np.empty(MAX_CANDIDATES),
        np.empty(MAX_CANDIDATES, np.int64),
        np.empty(MAX_CANDIDATES, np.int64),
        np.zeros(1, np.int64),
        np.empty((MAX_STACK, 2)),
        np.empty((MAX_STACK, 2, 7)),
        np.empty((MAX_STACK, 2, 3), np.int64),
        np.empty((MAX_STACK, 2, 8, 3, 3)),
        np.empty((MAX_STACK, 2, 8, 3)),
        np.empty((2, COLUMNS)),
        np.empty(7),
        np.empty(7),
        np.empty(7),
    )


@inner
def fill_samples(search: Search, first: float, last: float, count: int) -> float:
    """Spread `count` >= 2 samples evenly from first to last, ends included; return their spacing.

    Each cosine and sine follows from the previous one by a rotation: 512 rotations lose about
    1e-13, and the joint angles of a solution are recomputed from its angle.
    """
    step = (last - first) / (count - 1)
    c, s = np.cos(first), np.sin(first)
    dc, ds = np.cos(step), np.sin(step)
    for i in range(count):
        search.angle[i] = first + i * step
        search.cosine[i], search.sine[i] = c, s
        c, s = c * dc - s * ds, s * dc + c * ds
    return step


@inner
def solve(arm: ArmSolver, search: Search, b: int, count: int) -> None:
    """Fill joints and slack of the first samples on branch b."""
    solve_samples(
        arm, search.goal, arm.branches[b], search.cosine, search.sine, count,
        search.rows, search.slack,
    )  # fmt: skip


@inner
def measure_feasible(arm: ArmSolver, search: Search, count: int) -> None:
    """Fill the isotropy of the samples that `solve` left, if any of them is feasible."""
    for i in range(count):
        if search.slack[i] >= 0.0:
            measure_samples(arm, search.rows, search.slack, count, search.measure)
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
    """Fill `order` with the first `count` candidates by ascending `key`; the sort is stable.

    The merge sort is written out because numpy's takes three seconds to compile.
    """
    key, order, spare = search.key, search.order, search.spare
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
    if found == MAX_CANDIDATES:
        return found
    search.found_angle[found] = search.angle[i]
    search.found_step[found] = step
    search.found_measure[found] = search.measure[i]
    search.found_branch[found] = b
    search.found_pair[found, 0] = UNCHECKED_PAIR
    return found + 1
