"""The tour of one stop: through the goals it serves, from rest and back."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.motion.approach import Access, Accesses, accesses, joint_time
from tcs.motion.curves import CHAIN, Curve, in_chain
from tcs.motion.limits import MotionLimits
from tcs.motion.motion_plan import GoalResult, Segment, StopPlan, joined
from tcs.motion.paths import WIDEST_CORNER, find_path, is_certified, rounded
from tcs.motion.smoothing import smoothed
from tcs.motion.stops import BodyPair, Stop
from tcs.motion.timing import Timed, motion_along
from tcs.motion.tool_line import is_straight, tool_slowing
from tcs.motion.tour import REST, best_tour, given_tour

SAME_POSTURE = 1e-9
"""Greatest difference of a posture from rest that is rounding [rad]."""
ORDERS = {"best": best_tour, "given": given_tour}
"""Orders of the goals: that of the shortest tour, or their own."""


def plan_stop(
    stop: Stop,
    index: int | None,
    number: int,
    goals: Sequence[int],
    order: str = "best",
    jerk: FloatArray | None = None,
    on_step: Callable[[float], None] = lambda _: None,
) -> tuple[StopPlan, list[GoalResult]]:
    """Plan the tour of one stop through goals.

    Args:
        stop: The stop.
        index: Flat index of its configuration; None off the grid.
        number: Number of the stop in the plan.
        goals: Numbers of the goals.
        order: Order of the goals, one of ORDERS.
        jerk: Jerk limits [rad/s^3], one for each joint of the arm, inf for joints without one; None
            for no limits.
        on_step: Called with the finished fraction after each goal is approached, and after each is
            visited; what it raises ends the planning.

    Returns:
        The motions, and what became of each goal.
    """
    tour = _Tour(stop, number, np.full(stop.joints, np.inf) if jerk is None else jerk)
    blocked = stop.rest_contact()
    steps = 2 * len(goals) + 1
    for done, goal in enumerate(goals, 1):
        if blocked is not None:
            tour.fail(goal, "rest_blocked", blocked, "rest", time.perf_counter())
            continue
        tour.open(goal)
        on_step(done / steps)
    for done, (goal, access) in enumerate(tour.order(ORDERS[order]), len(goals) + 1):
        tour.visit(goal, access)
        on_step(done / steps)
    returns = tour.go_home()
    planned = StopPlan(stop.at, index, tuple(tour.segments), returns)
    return planned, list(tour.results.values())


class _Tour:
    """The tour of one stop while it is planned."""

    def __init__(self, stop: Stop, number: int, jerk: FloatArray) -> None:
        self.stop, self.number = stop, number
        joints = stop.motion.limits.lower, stop.motion.limits.upper
        jerk = in_chain(jerk, np.inf)
        self.limits = MotionLimits(stop.velocity, stop.acceleration, jerk, *joints)
        self.found: dict[int, Accesses] = {}
        self.results: dict[int, GoalResult] = {}
        self.segments: list[Segment] = []
        self.q = stop.rest
        """Joint angles where the arm is [rad]."""
        self.goal: int | None = None
        """Goal visited last, None at rest."""

    def open(self, goal: int) -> None:
        """Find the postures at a goal that can be approached."""
        begun = time.perf_counter()
        found = accesses(self.stop, goal)
        if found.found:
            self.found[goal] = found
            return
        self.fail(goal, found.reason, found.pair, f"approach of goal {goal + 1}", begun)

    def order(self, through: Callable[..., Sequence[tuple[int, int]]]) -> list[tuple[int, Access]]:
        """Return the goals in the order of a tour in joint time, each with a posture.

        Args:
            through: Returns the tour from numbers of postures and their distances in joint time.
        """
        goals = sorted(self.found)
        lists = [self.found[goal].found for goal in goals]

        def leg(a: int, b: int) -> FloatArray:
            rest = self.stop.rest[None]
            starts = rest if a == REST else np.array([access.end for access in lists[a]])
            ends = rest if b == REST else np.array([access.begin for access in lists[b]])
            return np.array([joint_time(self.stop, start, ends) for start in starts])

        tour = through([len(found) for found in lists], leg)
        return [(goals[number], lists[number][posture]) for number, posture in tour]

    def visit(self, goal: int, access: Access) -> None:
        """Append the motions to a goal, in and out, or note that there are none."""
        begun = time.perf_counter()
        here = "rest" if self.goal is None else f"goal {self.goal + 1}"
        self.stop.forget_contacts()
        chosen, path = access, self._path(access.begin[None])
        if path is None:
            # By another posture at the same goal.
            others = self.found[goal].found
            path = self._path(np.array([other.begin for other in others]))
            chosen = access if path is None else others[path[1]]
        moves = None if path is None else self._timed_path(path[0])
        if path is None or moves is None:
            pair = self.stop.most_frequent_contact()
            self.fail(goal, "no_path", pair, f"{here} to goal {goal + 1}", begun)
            return
        # Joints without limits may have arrived full turns away.
        offset = path[0][-1] - chosen.begin
        approach = self._timed_line(chosen.approach.shifted(offset))
        retreat = self._timed_line(chosen.retreat.shifted(offset))
        if approach is None or retreat is None:
            self.fail(goal, "approach_limits", None, f"approach of goal {goal + 1}", begun)
            return
        self._append("move", self.goal, goal, moves)
        self._append("approach", goal, goal, approach)
        self._append("retreat", goal, goal, retreat)
        self.q, self.goal = in_chain(self.segments[-1].timing.positions[-1]), goal
        self.results[goal] = GoalResult(goal, self.number, True, "")

    def go_home(self) -> bool:
        """Append the motion back to rest, all full turns taken back; return whether there is one.

        The next stop begins at rest, so the arm has to be there, not a full turn away.
        """
        if self.goal is None:
            return True
        rest = self.stop.rest
        path = self._path(rest[None])
        if path is not None and np.max(np.abs(path[0][-1] - rest)) > SAME_POSTURE:
            path = find_path(self.stop, self.q[None], rest[None], turns=False)
        if path is not None:
            path[0][-1] = rest
        moves = None if path is None else self._timed_path(path[0])
        if moves is None:
            return False
        self._append("move", self.goal, None, moves)
        return True

    def _path(self, ends: FloatArray) -> tuple[FloatArray, int] | None:
        return find_path(self.stop, self.q[None], ends)

    def _timed_path(self, path: FloatArray) -> list[Curve] | None:
        """Return the motions along a path, None if there are none within the limits."""

        def accepted(motion: Curve) -> bool:
            return is_certified(self.stop.motion, self.stop.work, motion)

        # Along straight edges alone, the arm cuts no corner.
        for widest in (WIDEST_CORNER, 0.0):
            curves = rounded(self.stop, path, widest)
            motions = [_motion(curve, self.limits, accepted) for curve in curves]
            found = [motion for motion in motions if motion is not None]
            if len(found) == len(curves):
                return found
        return None

    def _timed_line(self, line: Curve) -> list[Curve] | None:
        """Return the motion along a straight line of the tool, None as `_timed_path`."""
        stop = self.stop

        def accepted(motion: Curve) -> bool:
            straight = is_straight(stop.lines, motion)
            return straight and is_certified(stop.lines, stop.line_work, motion)

        limits = replace(self.limits, other=lambda motion: tool_slowing(stop.lines, motion))
        motion = _motion(line, limits, accepted)
        return None if motion is None else [motion]

    def _append(
        self, kind: str, start: int | None, end: int | None, motions: Sequence[Curve]
    ) -> None:
        if motions:
            own = slice(CHAIN - self.stop.joints, None)
            timing = joined([Timed(one.knots, one.q[:, own], one.dq[:, own]) for one in motions])
            self.segments.append(Segment(kind, start, end, timing))

    def fail(
        self, goal: int, reason: str, pair: BodyPair | None, segment: str, begun: float
    ) -> None:
        """Note that a goal cannot be done."""
        seconds = time.perf_counter() - begun
        self.results[goal] = GoalResult(goal, self.number, False, reason, pair, segment, seconds)


def _motion(curve: Curve, limits: MotionLimits, accepted: Callable[[Curve], bool]) -> Curve | None:
    """Return the motion along a curve, None if none within the limits is accepted."""
    return (smoothed if limits.bound_jerk else motion_along)(curve, limits, accepted)
