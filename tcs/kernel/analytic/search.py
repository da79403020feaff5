"""Search over the free joint: arcs, windows, and candidates for the collision check."""

from __future__ import annotations

from tcs.kernel.analytic.arcs import PEAK_SLOPE, is_peak, windows_of
from tcs.kernel.analytic.intervals import record_fast, record_intervals, record_uncovered
from tcs.kernel.analytic.samples import MAX_SAMPLES
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
COARSE_SAMPLES, ENOUGH = int_constant(16), int_constant(10)
"""Number of samples of a window in which any feasible angle will do, and of feasible ones in the
first pass over an arc that do without."""
PEAK_REFINEMENTS = 4
"""Number of refinements about an infeasible peak, each to 2/7 of the spacing: down to 8e-5
rad. A window between a limit that one joint leaves and a limit that another meets may be
arbitrarily narrow."""
NONE = int_constant(0)


@jit
def find_candidates(arm: ArmSolver, search: Search, arcs: int) -> int:
    """Collect feasible angles of the free joint, on every branch: all joints within their limits.

    Args:
        arm: The arm.
        search: `goal` and `feasible.arcs` are read; the candidates are filled.
        arcs: Number of arcs.

    Returns:
        Number of candidates.
    """
    feasible = search.feasible
    search.postponed.number[0] = 0
    length = _length(search, arcs)
    found = NONE
    for k in range(arcs):
        for b in range(len(arm.branches)):
            count, step = _sample_arc(arm, search, b, k, length)
            windows = windows_of(search.samples.slack, count, step, feasible.windows, 0)
            if found == 0:
                record_uncovered(arm, search, b, count, step, windows)
            for w in range(windows):
                start = feasible.arcs[k, 0] + feasible.windows[w, 0] * step
                stop = feasible.arcs[k, 0] + feasible.windows[w, 1] * step
                found = _refine_window(arm, search, b, start, stop, found)
    return found


@jit
def find_coarse(arm: ArmSolver, search: Search, arcs: int) -> int:
    """Collect feasible angles as `find_candidates`, fewer of each window.

    Their measures are not computed, and what lies between them is not recorded.

    Args:
        arm: The arm.
        search: `goal` and `feasible.arcs` are read; the candidates are filled.
        arcs: Number of arcs.

    Returns:
        Number of candidates.
    """
    feasible = search.feasible
    search.postponed.number[0] = 0
    length = _length(search, arcs)
    found = NONE
    for k in range(arcs):
        for b in range(len(arm.branches)):
            count, step = _sample_arc(arm, search, b, k, length)
            before = found
            for i in range(count):
                if search.samples.slack[i] >= 0.0:
                    found = add_candidate(search, b, i, step, found)
            if found - before >= ENOUGH:
                continue
            found = before
            windows = windows_of(search.samples.slack, count, step, feasible.windows, 0)
            for w in range(windows):
                first = feasible.arcs[k, 0] + feasible.windows[w, 0] * step
                last = feasible.arcs[k, 0] + feasible.windows[w, 1] * step
                before, fine = found, fill_samples(search, first, last, COARSE_SAMPLES)
                solve(arm, search, b, COARSE_SAMPLES)
                for i in range(COARSE_SAMPLES):
                    if search.samples.slack[i] >= 0.0:
                        found = add_candidate(search, b, i, fine, found)
                if found == before:
                    found = _refine_window(arm, search, b, first, last, found)
    return found


@jit
def record_all(arm: ArmSolver, search: Search, arcs: int) -> None:
    """Record all intervals between samples that need to be divided if the goal is to be reached.

    `find_candidates` records them only until it has found a candidate, because most goals are
    reached at one.

    Args:
        arm: The arm.
        search: `goal` and `feasible.arcs` are read; the intervals are filled anew.
        arcs: Number of arcs.
    """
    feasible = search.feasible
    search.postponed.number[0] = 0
    length = _length(search, arcs)
    for k in range(arcs):
        for b in range(len(arm.branches)):
            count, step = _sample_arc(arm, search, b, k, length)
            windows = windows_of(search.samples.slack, count, step, feasible.windows, 0)
            record_uncovered(arm, search, b, count, step, windows)
            for w in range(windows):
                start = feasible.arcs[k, 0] + feasible.windows[w, 0] * step
                stop = feasible.arcs[k, 0] + feasible.windows[w, 1] * step
                fine, spacing = _sample_window(arm, search, b, start, stop)
                record_intervals(arm, search, b, fine, spacing)


@inner
def _length(search: Search, arcs: int) -> float:
    """Return the length of all arcs together [rad]."""
    length = 0.0
    for k in range(arcs):
        length += search.feasible.arcs[k, 1] - search.feasible.arcs[k, 0]
    return length


@inner
def _sample_arc(arm: ArmSolver, search: Search, b: int, k: int, length: float) -> tuple[int, float]:
    """Solve the samples of the first pass over arc k; return their number and spacing [rad]."""
    first, last = search.feasible.arcs[k, 0], search.feasible.arcs[k, 1]
    share = FIRST_SAMPLES * (last - first) / length if length > 0.0 else 0.0
    # To nearest: truncation would let rounding decide the number of samples of symmetric arcs.
    count = max(MIN_SAMPLES, int(share + 0.5))
    step = fill_samples(search, first, last, count)
    solve(arm, search, b, count)
    return count, step


@inner
def _sample_window(
    arm: ArmSolver, search: Search, b: int, first: float, last: float
) -> tuple[int, float]:
    """Solve the samples of the second pass over one window; return their number and spacing."""
    count = min(max(MIN_SAMPLES, int((last - first) / FINE_STEP) + 1), MAX_SAMPLES)
    step = fill_samples(search, first, last, count)
    solve(arm, search, b, count)
    return count, step


@inner
def _refine_window(
    arm: ArmSolver, search: Search, b: int, first: float, last: float, found: int
) -> int:
    """Append the feasible angles of one window on branch b; return the number of candidates."""
    samples, feasible = search.samples, search.feasible
    count, step = _sample_window(arm, search, b, first, last)
    measure_feasible(arm, search, count)
    if found == 0:
        record_intervals(arm, search, b, count, step)
    else:
        record_fast(arm, search, b, count, step)
    before = samples.slack[0] >= 0.0
    ends = peaks = 0
    for i in range(count):
        inside = samples.slack[i] >= 0.0
        if inside:
            found = add_candidate(search, b, i, step, found)
        if inside != before and ends < MAX_WINDOWS:
            # The samples just outside and just inside an end of a feasible interval.
            feasible.ends[ends, 0] = samples.angle[i - 1] if inside else samples.angle[i]
            feasible.ends[ends, 1] = samples.angle[i] if inside else samples.angle[i - 1]
            ends += 1
        before = inside
        if peaks < MAX_WINDOWS and is_peak(samples.slack, i, count, step):
            feasible.peaks[peaks] = samples.angle[i]
            peaks += 1
    for e in range(ends):
        found = _refine_end(arm, search, b, feasible.ends[e, 0], feasible.ends[e, 1], found)
    for k in range(peaks):
        found = _refine_peak(arm, search, b, feasible.peaks[k], step, (first, last), found)
    return found


@inner
def _refine_peak(
    arm: ArmSolver,
    search: Search,
    b: int,
    middle: float,
    step: float,
    ends: tuple[float, float],
    found: int,
) -> int:
    """Append feasible angles near an infeasible peak of the slack.

    Args:
        arm: The arm.
        search: The candidates are filled.
        b: Row of the branch in `arm.branches`.
        middle: The peak [rad].
        step: Spacing of the samples among which it was found [rad].
        ends: Bounds of the angles to try [rad].
        found: Number of candidates.

    Returns:
        Updated number of candidates.
    """
    samples = search.samples
    for _ in range(PEAK_REFINEMENTS):
        low, high = max(middle - step, ends[0]), min(middle + step, ends[1])
        step = fill_samples(search, low, high, FINE_SAMPLES)
        solve(arm, search, b, FINE_SAMPLES)
        measure_feasible(arm, search, FINE_SAMPLES)
        before = found
        for i in range(FINE_SAMPLES):
            if samples.slack[i] >= 0.0:
                found = add_candidate(search, b, i, step, found)
        top = best_of(samples.slack, FINE_SAMPLES)
        if found > before or samples.slack[top] < -PEAK_SLOPE * step:
            break
        middle = samples.angle[top]
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
        if search.samples.slack[i] >= 0.0:
            found = add_candidate(search, b, i, abs(step), found)
    return found
