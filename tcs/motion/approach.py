"""Approachable postures: those at a goal from which the arm leaves backwards along its approach."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tcs.kernel.approach.regions import approach_spline
from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.motion.goal_postures import postures_at
from tcs.kernel.motion.straight import (
    BLOCKED,
    LIMITS,
    StraightSearch,
    new_straight_workspace,
    next_straight,
)
from tcs.kernel.postures import tool_poses
from tcs.model.tasks import TOOL_SPEED, ToolLine
from tcs.motion.curves import Curve
from tcs.motion.stops import BodyPair, Stop

SPACING = 0.005
"""Greatest distance of the tool between two points of a straight motion [m]."""
SAMPLES = (96, 1000)
"""Numbers of angles of the free joint at which postures are solved: the second, where the first
finds no approach."""
REGION_SAMPLES, OF_POSE = 24, 4
"""Angles of the free joint at another pose of a region, and the most accesses that are taken there:
paths that fail lead past the person, where another roll of the hand helps more than the elbow."""
MOST_ACCESSES = 16
"""Greatest number of postures kept for a goal, spread over those found."""


@dataclass(frozen=True, eq=False)
class Access:
    """A posture at a goal with its straight motions, each certified free of contact."""

    approach: Curve
    """From the pre-approach posture to the goal."""
    retreat: Curve
    """From the goal on."""

    @property
    def begin(self) -> FloatArray:
        """Joint angles before the approach [rad], shape (7,)."""
        begin: FloatArray = self.approach.q[0]
        return begin

    @property
    def end(self) -> FloatArray:
        """Joint angles after the retreat [rad], shape (7,)."""
        end: FloatArray = self.retreat.q[-1]
        return end


@dataclass(frozen=True)
class Accesses:
    """What was found at one goal."""

    found: tuple[Access, ...]
    reason: str
    """Why nothing was found: "unreached", "approach_limits", "approach_blocked"; "" otherwise."""
    pair: BodyPair | None
    """The bodies whose contact ruled out most postures, if a contact did."""


def accesses(stop: Stop, goal: int) -> Accesses:
    """Return postures at a goal that can be approached and left.

    The approach is followed backwards from postures at the goal and, where that fails, forwards
    from postures before it: the two rarely rest the same joint at a limit. Of a free goal, these
    are postures at the pose where scoring reaches it, and at others of its region.

    Args:
        stop: The initial configuration.
        goal: Number of the goal.
    """
    search = _Search(stop, goal)
    found = list(search.from_held())
    sampled: list[Access] = []
    for samples in SAMPLES if stop.is_sampled and not found else SAMPLES[:1]:
        for forwards in (False, True):
            sampled = sampled or list(search.follow(samples, forwards=forwards))
    found += sampled
    for pose in stop.region_in_arm_base(goal):
        elsewhere = _Search(stop, goal, pose)
        found += itertools.islice(elsewhere.follow(REGION_SAMPLES, forwards=False), OF_POSE)
    if found:
        # A hand may begin inside a box that paths keep out of.
        outside = [access for access in found if _is_outside(stop, access)]
        return Accesses(_spread(stop, outside or found), "", None)
    return search.nothing()


def first_accesses(stop: Stop, goal: int, samples: int) -> Iterator[Access]:
    """Yield postures at a goal that can be approached and left, as soon as each is found.

    Args:
        stop: The initial configuration.
        goal: Number of the goal.
        samples: Number of angles of the free joint at which postures are solved.
    """
    search = _Search(stop, goal)
    found = itertools.chain(
        search.from_held(), *(search.follow(samples, forwards=way) for way in (False, True))
    )
    return (access for access in found if _is_outside(stop, access))


def _is_outside(stop: Stop, access: Access) -> bool:
    """Return whether a path may begin and end where the straight motions do."""
    if stop.motion is stop.lines:
        return True
    ends = [access.begin]
    if not np.array_equal(access.begin, access.end):
        ends.append(access.end)
    return all(stop.contact_at(q) is None for q in ends)


class _Search:
    """The search for the accesses of one goal."""

    def __init__(
        self, stop: Stop, goal: int, pose: tuple[FloatArray, FloatArray] | None = None
    ) -> None:
        self.stop, self.goal, self.number = stop, stop.job.task.goals[goal], goal
        self.R_AG, self.p_AG = stop.goal_in_arm_base(goal) if pose is None else pose
        self.line = new_straight_workspace()
        self.outcomes = np.zeros(3, np.int64)
        # Where and how often bodies touch at postures at the goal, and before it.
        self.at_goal, self.before = np.zeros((2, *stop.line_work.contacts.hits.shape), np.int64)
        stop.forget_contacts()

    def follow(self, samples: int, *, forwards: bool) -> Iterator[Access]:
        """Follow the approach from many postures, at its begin (forwards) or at the goal."""
        stop, goal = self.stop, self.goal
        begin = self.p_AG - self.R_AG @ goal.approach.offset if forwards else self.p_AG
        line = goal.approach if forwards else goal.approach.reverse()
        may_turn = not forwards and goal.free is not None and goal.free.rotates
        postures = postures_at(stop.problem, self.R_AG, begin, samples, may_turn=may_turn)
        contacts = self.before if forwards else self.at_goal
        for q, R_AT in self._by_direction(postures):
            search, n = self._search(q, R_AT, line, contacts), 0
            while n < len(q):
                n, curve = self._next(search, line, n)
                if curve is not None:
                    curve = curve if forwards else curve.reverse()
                    away = self._retreat(curve, R_AT)
                    if away is not None:
                        yield Access(approach=curve, retreat=away)

    def from_held(self) -> Iterator[Access]:
        """Follow the approach from the posture at which scoring reaches the goal, if it is known.

        Scoring found the approach with any motion of the arm's redundancy; the shortest is tried
        first.
        """
        q = self.stop.held.get(self.number)
        if q is None:
            return
        chain, grid = self.stop.problem.chain, self.stop.grid
        R_AT, p_AT = np.empty((1, 3, 3)), np.empty((1, 3))
        tool_poses(chain.R, chain.p, q[None], R_AT, p_AT)
        line = self.goal.approach.reverse()
        curve = self._next(self._search(q[None], R_AT[0], line, self.at_goal), line, 0)[1]
        if curve is not None:
            curve = curve.reverse()
        else:
            found = approach_spline(
                self.stop.problem, grid.lines, self.stop.row, self.number, q, grid.around
            )
            if found is None:
                return
            knots = np.linspace(0.0, 1.0, len(found[0]))
            fastest = TOOL_SPEED / self.goal.approach.distance
            curve = Curve(knots, *found, fastest=fastest)
        away = self._retreat(curve, R_AT[0])
        if away is not None:
            yield Access(approach=curve, retreat=away)

    def _by_direction(self, postures: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
        """Return postures with the same orientation of the tool, and that, shape (3, 3).

        An arm of five joints rotates its tool at a goal, and its lines with it.
        """
        problem, count = self.stop.problem, len(postures)
        if not np.any(problem.goals.turn):
            return [(postures, self.R_AG)]
        R_AT, p_AT = np.empty((count, 3, 3)), np.empty((count, 3))
        tool_poses(problem.chain.R, problem.chain.p, postures, R_AT, p_AT)
        return [(postures[n : n + 1], R_AT[n]) for n in range(count)]

    def _retreat(self, approach: Curve, R_AT: FloatArray) -> Curve | None:
        """Return the retreat from the end of an approach, None if there is none."""
        goal = self.goal
        if goal.retreat == goal.approach.reverse():
            return approach.reverse()
        search = self._search(approach.q[-1:].copy(), R_AT, goal.retreat, self.before)
        return self._next(search, goal.retreat, 0)[1]

    def _search(
        self, q: FloatArray, R_AT: FloatArray, line: ToolLine, contacts: IntArray
    ) -> StraightSearch:
        """Return the search for straight motions from postures, shape (n, 7)."""
        offset = np.ascontiguousarray(R_AT @ line.offset)
        fastest = self.stop.velocity * (line.distance / TOOL_SPEED)
        return StraightSearch(q, offset, fastest, self.outcomes, contacts)

    def _next(self, search: StraightSearch, line: ToolLine, first: int) -> tuple[int, Curve | None]:
        """Return one more than the number of the next posture that begins a motion, and that."""
        pieces = max(2, int(np.ceil(line.distance / SPACING)))
        points, tangents = np.empty((pieces + 1, 7)), np.empty((pieces + 1, 7))
        lines, work = self.stop.lines, self.stop.line_work
        n = next_straight(lines, work, self.line, search, first, points, tangents)
        if n == len(search.q):
            return n, None
        knots = np.linspace(0.0, 1.0, pieces + 1)
        return n + 1, Curve(knots, points, tangents, fastest=TOOL_SPEED / line.distance)

    def nothing(self) -> Accesses:
        """Return why nothing was found."""
        if self.outcomes[BLOCKED]:
            return Accesses(
                (), "approach_blocked", self.stop.most_frequent(self.stop.line_work.contacts.hits)
            )
        if self.outcomes[LIMITS]:
            return Accesses((), "approach_limits", None)
        return Accesses((), "unreached", self.stop.most_frequent(self.at_goal))


def _spread(stop: Stop, found: list[Access]) -> tuple[Access, ...]:
    """Return at most MOST_ACCESSES, the one nearest to rest first, then each farthest from all."""
    begins = np.array([access.begin for access in found])
    chosen = [int(np.argmin(joint_time(stop, stop.rest, begins)))]
    while len(chosen) < min(MOST_ACCESSES, len(found)):
        away = np.min([joint_time(stop, begins[i], begins) for i in chosen], axis=0)
        chosen.append(int(np.argmax(away)))
    return tuple(found[i] for i in chosen)


def joint_time(stop: Stop, start: FloatArray, ends: FloatArray) -> FloatArray:
    """Return the time from one posture straight to others at the velocity limits [s].

    Args:
        stop: The initial configuration.
        start: Joint angles [rad], shape (7,).
        ends: Joint angles [rad], shape (..., 7); joints without limits take the short way.
    """
    period = stop.motion.limits.period
    angle = ends - start
    turns = np.where(period > 0.0, np.round(angle / np.where(period > 0.0, period, 1.0)), 0.0)
    return np.asarray(np.max(np.abs(angle - turns * period) / stop.velocity, axis=-1))
