"""Search over the free joint: arcs, windows, and candidates for the collision check."""

from __future__ import annotations

import numpy as np

from tcs.kernel.analytic.arcs import PEAK_SLOPE, is_peak, windows_of
from tcs.kernel.analytic.intervals import record_intervals, record_uncovered
from tcs.kernel.analytic.samples import MAX_SAMPLES, STRAIGHTNESS, measure_samples
from tcs.kernel.analytic.scratch import (
    MAX_WINDOWS,
    Search,
    add_candidate,
    best_of,
    fill_samples,
    measure_feasible,
    solve,
)
from tcs.kernel.analytic.solver import ArmSolver
from tcs.kernel.cache import inner, int_constant, jit

FIRST_SAMPLES = 48
"""Number of samples over all arcs together in the first pass, which finds the feasible windows."""
FINE_STEP = 0.0125
"""Spacing [rad] of the second pass, inside the windows. Chosen by measurement: recall against a
dense scan of 11,520 samples (benchmarks/)."""
MIN_SAMPLES = int_constant(8)
"""Least number of samples of a window or arc: one SIMD vector."""
FINE_SAMPLES = int_constant(8)
"""Number of samples at each end of a feasible interval, and about a peak that is refined."""
PEAK_REFINEMENTS = 4
"""Number of refinements about an infeasible peak, each to 2/7 of the spacing: down to 8e-5
rad. A window between a limit that one joint leaves and a limit that another meets may be
arbitrarily narrow."""
STRAIGHT = 0.05
"""Squared sine of the wrist angle below which joints 5 and 7 (1 and 3 of the spherical-shoulder
class) rotate by 180 degrees within a few hundredths of a radian of the free joint, so that samples
may miss the window in which both are within their limits."""
NONE = int_constant(0)
BY_SLACK, BY_WRIST = int_constant(0), int_constant(1)
"""What a refinement maximises: the slack, or how straight the wrist is."""
ANYWHERE = (-np.inf, np.inf)
STRAIGHT_REFINEMENTS = 5
"""Number of refinements about a straight wrist, each to 2/7 of the spacing: from 0.05 rad to 1e-4
rad."""


@jit
def find_candidates(arm: ArmSolver, search: Search, arcs: int) -> int:
    """Collect feasible angles of the free joint, on every branch: all joints within their limits.

    Args:
        arm: The arm.
        search: `goal` and `arcs` are read; the candidates are filled.
        arcs: Number of arcs.

    Returns:
        Number of candidates.
    """
    search.interval_count[0] = 0
    length = 0.0
    for k in range(arcs):
        length += search.arcs[k, 1] - search.arcs[k, 0]
    found = straight = NONE
    for k in range(arcs):
        first, last = search.arcs[k, 0], search.arcs[k, 1]
        share = FIRST_SAMPLES * (last - first) / length if length > 0.0 else 0.0
        # To nearest: truncation would let rounding decide the number of samples of symmetric arcs.
        count = max(MIN_SAMPLES, int(share + 0.5))
        for b in range(len(arm.branches)):
            step = fill_samples(search, first, last, count)
            solve(arm, search, b, count)
            windows = windows_of(search.slack, count, step, search.windows, 0)
            record_uncovered(arm, search, b, count, step, windows)
            if found == 0:
                straight = _record_straight(search, b, count, step, first, straight)
            for w in range(windows):
                start = first + search.windows[w, 0] * step
                stop = first + search.windows[w, 1] * step
                found = _refine_window(arm, search, b, start, stop, found)
    if found == 0:
        for n in range(straight):
            middle, step, b = (
                search.straight[n, 0],
                search.straight[n, 1],
                int(search.straight[n, 2]),
            )
            found = _refine_about(arm, search, b, middle, step, (-np.inf, np.inf), True, found)
    return found


@inner
def _record_straight(
    search: Search, b: int, count: int, step: float, first: float, straight: int
) -> int:
    """Append the samples at which the wrist is straighter than at both neighbouring samples."""
    first_row = int(STRAIGHTNESS)
    straightness = search.rows[first_row : first_row + count]
    for i in range(count):
        if straightness[i] > -STRAIGHT and straight < MAX_WINDOWS:
            left = straightness[i - 1] if i > 0 else -np.inf
            right = straightness[i + 1] if i + 1 < count else -np.inf
            if left <= straightness[i] and right < straightness[i]:
                search.straight[straight, 0] = first + i * step
                search.straight[straight, 1] = step
                search.straight[straight, 2] = b
                straight += 1
    return straight


@inner
def _refine_window(
    arm: ArmSolver, search: Search, b: int, first: float, last: float, found: int
) -> int:
    """Append the feasible angles of one window on branch b; return the number of candidates."""
    count = min(max(MIN_SAMPLES, int((last - first) / FINE_STEP) + 1), MAX_SAMPLES)
    step = fill_samples(search, first, last, count)
    solve(arm, search, b, count)
    measure_feasible(arm, search, count)
    record_intervals(arm, search, b, count, step)
    before = search.slack[0] >= 0.0
    ends = peaks = 0
    for i in range(count):
        inside = search.slack[i] >= 0.0
        if inside:
            found = add_candidate(search, b, i, step, found)
        if inside != before and ends < MAX_WINDOWS:
            # The samples just outside and just inside an end of a feasible interval.
            search.ends[ends, 0] = search.angle[i - 1] if inside else search.angle[i]
            search.ends[ends, 1] = search.angle[i] if inside else search.angle[i - 1]
            ends += 1
        before = inside
        if peaks < MAX_WINDOWS and is_peak(search.slack, i, count, step):
            search.peaks[peaks] = search.angle[i]
            peaks += 1
    for e in range(ends):
        found = _refine_end(arm, search, b, search.ends[e, 0], search.ends[e, 1], found)
    for k in range(peaks):
        peak = search.peaks[k]
        found = _refine_about(arm, search, b, peak, step, (first, last), BY_SLACK, found)
    return found


@inner
def _refine_about(
    arm: ArmSolver,
    search: Search,
    b: int,
    middle: float,
    step: float,
    ends: tuple[float, float],
    guide: int,
    found: int,
) -> int:
    """Append feasible angles near an infeasible one, found by refining the samples about it.

    Args:
        arm: The arm.
        search: The candidates are filled.
        b: Row of the branch in `arm.branches`.
        middle: The infeasible angle: a peak of the slack, or where the wrist is straightest [rad].
        step: Spacing of the samples among which it was found [rad].
        ends: Bounds of the angles to try [rad].
        guide: What to maximise, BY_SLACK or BY_WRIST.
        found: Number of candidates.

    Returns:
        Updated number of candidates.
    """
    value = search.slack if guide == BY_SLACK else search.measure
    for _ in range(PEAK_REFINEMENTS if guide == BY_SLACK else STRAIGHT_REFINEMENTS):
        low, high = max(middle - step, ends[0]), min(middle + step, ends[1])
        step = fill_samples(search, low, high, FINE_SAMPLES)
        solve(arm, search, b, FINE_SAMPLES)
        measure_samples(arm, search.rows, search.slack, FINE_SAMPLES, search.measure)
        before = found
        for i in range(FINE_SAMPLES):
            if search.slack[i] >= 0.0:
                found = add_candidate(search, b, i, step, found)
        top = best_of(value, FINE_SAMPLES)
        if found > before or (guide == BY_SLACK and value[top] < -PEAK_SLOPE * step):
            break
        middle = search.angle[top]
    return found


@inner
def _refine_end(
    arm: ArmSolver, search: Search, b: int, outer: float, inner: float, found: int
) -> int:
    """Append feasible angles strictly between two neighbouring samples.

    The best measure is often close to a joint limit, where a feasible interval ends.
    """
    step = fill_samples(search, outer, inner, FINE_SAMPLES)
    solve(arm, search, b, FINE_SAMPLES - 1)
    measure_feasible(arm, search, FINE_SAMPLES - 1)
    for i in range(1, FINE_SAMPLES - 1):
        if search.slack[i] >= 0.0:
            found = add_candidate(search, b, i, abs(step), found)
    return found
