"""Reference implementation of the search over the free joint, built on `reference`.

`find_candidates` samples the same angles as the kernel, so that both can be compared one by one;
`fast_candidates` halves the intervals in which joints move far, by a rule of its own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tcs.kernel.analytic.arcs import INSET, PEAK_SLOPE
from tcs.kernel.analytic.search import (
    FINE_SAMPLES,
    FINE_STEP,
    FIRST_SAMPLES,
    MIN_SAMPLES,
    PEAK_REFINEMENTS,
)
from tcs.kernel.arrays import Chain, FloatArray
from tests.reference.kinematics import (
    Pose,
    Solution,
    compose,
    elbow,
    free_joint,
    has_spherical_shoulder,
    inverse,
    rot_z,
    solutions,
)

Branch = tuple[int, int, int]
STRETCH = 1e-13
"""Rounding of |SW|^2 that must not make a goal too far [m^2]."""
FAST, SLOW = 0.1, 1e-3
"""Motion of a joint between two angles [rad] from which on more angles are tried between them, if
both are feasible, and if neither is."""
DIGITS = 1e-14
"""Distance of two angles [rad] that is close to their last digit."""


@dataclass(frozen=True)
class Candidate:
    """A solution within the joint limits."""

    q: FloatArray
    """Joint angles [rad], shape (7,)."""
    branch: Branch
    """Signs of elbow, aim and wrist."""
    step: float
    """Spacing of the samples among which it was found [rad]."""


def elbow_arcs(chain: Chain, X_AG: Pose) -> tuple[list[tuple[float, float]], bool]:
    """Return the arcs of the free joint at which the elbow can span the distance |SW|.

    Returns:
        Arcs (first, last) within the limits of the free joint [rad], and whether any angle, limits
        of the free joint left aside, would do.
    """
    near, far = elbow_spans(chain)
    X_A7 = compose(X_AG, inverse((chain.R[7], chain.p[7])))
    if has_spherical_shoulder(chain):
        # In L7 the shoulder is fixed, and joint 7 rotates the wrist in the negative sense.
        w = inverse((chain.R[6], chain.p[6]))[1]
        s = inverse(X_A7)[0] @ (chain.p[0] - X_A7[1])
    else:
        # In the frame about whose z axis joint 1 rotates, the wrist is fixed; the shoulder rotates.
        w, s = compose(inverse((chain.R[0], chain.p[0])), X_A7)[1], chain.p[1]
    steady = float(w @ w + s @ s - 2 * w[2] * s[2])
    swing = 2 * math.hypot(w[0], w[1]) * math.hypot(s[0], s[1])
    # At full stretch, or folded all the way, rounding must not decide.
    if 0 < steady - swing - far < STRETCH:
        far = steady - swing + STRETCH
    if 0 < near - steady - swing < STRETCH:
        near = steady + swing - STRETCH
    if steady - swing > far or steady + swing < near:
        return [], False
    centre = math.atan2(w[1], w[0]) - math.atan2(s[1], s[0])
    inner = math.acos(min((steady - near) / swing, 1.0)) if steady - swing < near else 0.0
    outer = math.acos(max((steady - far) / swing, -1.0)) if steady + swing > far else math.pi
    free = free_joint(chain)
    lower, upper = chain.lower[free], chain.upper[free]
    inner, outer = inner + INSET * (inner > 0), outer - INSET * (outer < math.pi)
    if inner > outer:
        return [], False
    arcs: list[tuple[float, float]] = []
    for middle in (centre + 2 * math.pi * k for k in range(-2, 3)):
        for first, last in ((middle - outer, middle - inner), (middle + inner, middle + outer)):
            first, last = max(first, lower + INSET), min(last, upper - INSET)
            if first <= last and arcs and arcs[-1][1] >= first - INSET:
                arcs[-1] = (arcs[-1][0], last)
            elif first <= last:
                arcs.append((first, last))
    return arcs, True


def elbow_spans(chain: Chain) -> tuple[float, float]:
    """Return the least and the greatest |SW|^2 within the limits of joint 4 [m^2]."""
    _, _, phase = elbow(chain, 0.0)
    turning = [phase + k * math.pi for k in range(-4, 5)]
    angles = [a for a in turning if chain.lower[3] <= a <= chain.upper[3]]
    angles += [a for a in (chain.lower[3], chain.upper[3]) if math.isfinite(a)]
    spans = [float(np.sum((chain.p[3] + chain.R[3] @ rot_z(a) @ chain.p[4]) ** 2)) for a in angles]
    return min(spans), max(spans)


def find_candidates(chain: Chain, X_AG: Pose, arcs: list[tuple[float, float]]) -> list[Candidate]:
    """Return the feasible samples of the kernel's two passes: over the arcs, inside the windows."""
    length = sum(last - first for first, last in arcs)
    found: list[Candidate] = []
    for first, last in arcs:
        share = FIRST_SAMPLES * (last - first) / length if length else 0
        count = max(MIN_SAMPLES, int(share + 0.5))
        angles = [first + i * (last - first) / (count - 1) for i in range(count)]
        looks = [solutions(chain, X_AG, angle) for angle in angles]
        for branch in looks[0]:
            slack = [look[branch].slack for look in looks]
            step = (last - first) / (count - 1)
            for i, j in windows_of(slack, step):
                found += refine_window(chain, X_AG, branch, angles[i], angles[j])
    return found


def fast_candidates(chain: Chain, X_AG: Pose, arcs: list[tuple[float, float]]) -> list[Candidate]:
    """Return feasible angles found where joints move far between neighbouring angles.

    The arcs are halved again and again, until no joint moves far from one angle to the next, or no
    solution can lie between the two for the way that the joints would have to go.
    """
    found: list[Candidate] = []
    for first, last in arcs:
        angles = [first + i * (last - first) / FIRST_SAMPLES for i in range(FIRST_SAMPLES + 1)]
        all_solutions = [solutions(chain, X_AG, angle) for angle in angles]
        for branch in all_solutions[0]:
            waiting = [
                (angles[i], angles[i + 1], all_solutions[i][branch], all_solutions[i + 1][branch])
                for i in range(FIRST_SAMPLES)
            ]
            while waiting:
                low, high, left, right = waiting.pop()
                if high - low < DIGITS or not is_worth_halving(chain, high - low, left, right):
                    continue
                angle = (low + high) / 2
                middle = solutions(chain, X_AG, angle)[branch]
                if middle.slack >= 0:
                    found.append(Candidate(middle.q, branch, (high - low) / 2))
                waiting += [(low, angle, left, middle), (angle, high, middle, right)]
    return found


def is_worth_halving(chain: Chain, width: float, left: Solution, right: Solution) -> bool:
    """Return whether a solution may lie between two angles that their own do not stand for."""
    motion = max(
        abs(math.remainder(b - a, 2 * math.pi)) for a, b in zip(left.q, right.q, strict=True)
    )
    if left.slack >= 0 and right.slack >= 0:
        return motion > FAST
    if motion < SLOW:
        return False
    if left.excess > 0 and right.excess > 0:
        # The excess is a length, or the sine of an angle: it changes with both.
        length = 1.0 + float(np.sum(np.linalg.norm(chain.p, axis=1)))
        return left.excess + right.excess < length * (width + motion)
    # Slack is a difference of cosines, and changes no faster than the joints.
    return max(left.slack, right.slack) > -2 * motion


def windows_of(slack: list[float], step: float) -> list[tuple[int, int]]:
    """Return the windows (first, last) of samples that contain, or may contain, feasible angles."""
    last = len(slack) - 1
    inside = [i for i, left in enumerate(slack) if left >= 0]
    windows = []
    for i in inside:
        if i - 1 not in inside:
            j = next(k for k in range(i, last + 1) if k == last or slack[k + 1] < 0)
            windows.append((max(i - 1, 0), min(j + 1, last)))
    windows += [(max(i - 1, 0), min(i + 1, last)) for i in peaks_of(slack, step)]
    return windows


def peaks_of(slack: list[float], step: float) -> list[int]:
    """Return the infeasible samples next to which a window narrower than the spacing may lie."""
    last = len(slack) - 1
    peaks = []
    for i, left in enumerate(slack):
        sides = [slack[k] for k in (i - 1, i + 1) if 0 <= k <= last]
        if -PEAK_SLOPE * step < left < 0 and all(s <= left for s in sides):
            peaks.append(i)
    return peaks


def refine_window(
    chain: Chain, X_AG: Pose, branch: Branch, first: float, last: float
) -> list[Candidate]:
    """Return the feasible samples of one window on one branch."""
    count = max(MIN_SAMPLES, int((last - first) / FINE_STEP) + 1)
    step = (last - first) / (count - 1)
    angles = [first + i * step for i in range(count)]
    slack = [solutions(chain, X_AG, angle)[branch].slack for angle in angles]
    inside = [left >= 0 for left in slack]
    found = candidates_at(chain, X_AG, branch, angles, step)
    for i in range(1, count):
        if inside[i] != inside[i - 1]:
            outer, inner = (i - 1, i) if inside[i] else (i, i - 1)
            found += refine_end(chain, X_AG, branch, angles[outer], angles[inner])
    for i in peaks_of(slack, step):
        found += refine_peak(chain, X_AG, branch, angles[i], step, (first, last))
    return found


def refine_peak(
    chain: Chain, X_AG: Pose, branch: Branch, middle: float, step: float, ends: tuple[float, float]
) -> list[Candidate]:
    """Return feasible samples near an infeasible peak, found by refining the samples about it."""
    for _ in range(PEAK_REFINEMENTS):
        low, high = max(middle - step, ends[0]), min(middle + step, ends[1])
        step = (high - low) / (FINE_SAMPLES - 1)
        angles = [low + i * step for i in range(FINE_SAMPLES)]
        found = candidates_at(chain, X_AG, branch, angles, step)
        slack = [solutions(chain, X_AG, angle)[branch].slack for angle in angles]
        if found or max(slack) < -PEAK_SLOPE * step:
            return found
        middle = angles[slack.index(max(slack))]
    return []


def refine_end(
    chain: Chain, X_AG: Pose, branch: Branch, outer: float, inner: float
) -> list[Candidate]:
    """Return feasible samples strictly between two neighbouring samples."""
    fine = (inner - outer) / (FINE_SAMPLES - 1)
    near = [outer + k * fine for k in range(1, FINE_SAMPLES - 1)]
    return candidates_at(chain, X_AG, branch, near, abs(fine))


def candidates_at(
    chain: Chain, X_AG: Pose, branch: Branch, angles: list[float], step: float
) -> list[Candidate]:
    """Return the candidates among angles of the free joint [rad] on one branch."""
    found = []
    for angle in angles:
        solution = solutions(chain, X_AG, angle)[branch]
        if solution.slack >= 0:
            found.append(Candidate(solution.q, branch, step))
    return found
