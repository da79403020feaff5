"""Approachable postures: those at a goal from which the arm leaves backwards along its approach."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.kernel.motion.postures import postures_at
from tcs.kernel.motion.straight import (
    BLOCKED,
    DONE,
    LIMITS,
    new_straight_workspace,
    straight_motion,
)
from tcs.model.tasks import Goal, ToolLine
from tcs.motion.curves import Curve
from tcs.motion.stops import BodyPair, Stop

TOOL_SPEED = 0.1
"""Speed of the tool on straight motions [m/s], at which the velocity limits must be kept: a hand's
width in a second, slow enough for a person to turn away."""
SPACING = 0.005
"""Greatest distance of the tool between two points of a straight motion [m]."""
SAMPLES = (96, 1000)
"""Numbers of angles of the free joint at which postures are solved: the second, where the first
finds no approach."""
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
    from postures before it: the two rarely rest the same joint at a limit.

    Args:
        stop: The initial configuration.
        goal: Number of the goal.
    """
    search = _Search(stop, stop.job.task.goals[goal], *_goal_in_arm_base(stop, goal))
    for samples in SAMPLES:
        for forwards in (False, True):
            search.follow(samples, forwards=forwards)
            if search.found:
                return Accesses(_spread(stop, search.found), "", None)
    return search.nothing()


class _Search:
    """The search for the accesses of one goal."""

    def __init__(self, stop: Stop, goal: Goal, R_AG: FloatArray, p_AG: FloatArray) -> None:
        self.stop, self.goal, self.R_AG, self.p_AG = stop, goal, R_AG, p_AG
        self.found: list[Access] = []
        self.outcomes = {DONE: 0, LIMITS: 0, BLOCKED: 0}
        self.at_goal: dict[BodyPair, int] = {}
        """How often each pair of bodies touches at a posture at the goal."""
        stop.forget_contacts()

    def follow(self, samples: int, *, forwards: bool) -> None:
        """Follow the approach from many postures, at its begin (forwards) or at the goal."""
        stop, goal = self.stop, self.goal
        begin = self.p_AG - self.R_AG @ goal.approach.offset if forwards else self.p_AG
        line = goal.approach if forwards else goal.approach.reverse()
        for q in postures_at(stop.problem, self.R_AG, begin, samples):
            pair = stop.contact_at(q)
            if pair is not None and not forwards:
                self.at_goal[pair] = self.at_goal.get(pair, 0) + 1
            if pair is not None:
                continue
            outcome, curve = _straight(stop, q, line, self.R_AG)
            curve = curve if forwards else curve.reverse()
            away = curve.reverse()
            if outcome == DONE and goal.retreat != goal.approach.reverse():
                outcome, away = _straight(stop, curve.q[-1], goal.retreat, self.R_AG)
            self.outcomes[outcome] += 1
            if outcome == DONE:
                self.found.append(Access(approach=curve, retreat=away))

    def nothing(self) -> Accesses:
        """Return why nothing was found."""
        if self.outcomes[BLOCKED]:
            return Accesses((), "approach_blocked", self.stop.most_frequent_contact())
        if self.outcomes[LIMITS]:
            return Accesses((), "approach_limits", None)
        pair = max(self.at_goal, key=lambda names: self.at_goal[names], default=None)
        return Accesses((), "unreached", pair)


def _goal_in_arm_base(stop: Stop, goal: int) -> tuple[FloatArray, FloatArray]:
    """Return the pose of a goal in the arm base A: orientation (3, 3), position (3,) [m]."""
    problem = stop.problem
    yaw = problem.base_yaw[0]
    R_WB = np.array(
        [[np.cos(yaw), -np.sin(yaw), 0.0], [np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]]
    )
    p_WB = np.array([problem.base_x[0], problem.base_y[0], 0.0])
    R_WA = R_WB @ problem.base_R[0]
    p_WA = p_WB + R_WB @ problem.base_p[0]
    R_AG = np.ascontiguousarray(R_WA.T @ problem.goal_R[0, goal])
    return R_AG, R_WA.T @ (problem.goal_p[0, goal] - p_WA)


def _straight(stop: Stop, q: FloatArray, line: ToolLine, R_AG: FloatArray) -> tuple[int, Curve]:
    """Return the outcome of a straight motion from posture q, and its curve if it is DONE."""
    pieces = max(2, int(np.ceil(line.distance / SPACING)))
    points, tangents = np.empty((pieces + 1, 7)), np.empty((pieces + 1, 7))
    outcome = straight_motion(
        stop.motion,
        stop.work,
        new_straight_workspace(),
        q,
        np.ascontiguousarray(R_AG @ line.offset),
        stop.velocity * (line.distance / TOOL_SPEED),
        points,
        tangents,
    )
    knots = np.linspace(0.0, 1.0, pieces + 1)
    return outcome, Curve(knots, points, tangents, fastest=TOOL_SPEED / line.distance)


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
    period = stop.motion.period
    angle = ends - start
    turns = np.where(period > 0.0, np.round(angle / np.where(period > 0.0, period, 1.0)), 0.0)
    return np.asarray(np.max(np.abs(angle - turns * period) / stop.velocity, axis=-1))
