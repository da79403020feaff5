"""What a stop still serves with the base off its place, by the scorer of the grid."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import BoolArray, FloatArray, SceneArrays
from tcs.kernel.dexterity import ANY_SOLUTION
from tcs.kernel.freedom.goals import free_goals
from tcs.kernel.problem import Problem, build_problem
from tcs.kernel.rows import Rows
from tcs.model.grid import ROBOT_AXES
from tcs.model.scene import environment_at, torso_at
from tcs.placement.refinement import PointScorer
from tcs.placement.scoring.approaches import ApproachScorer
from tcs.placement.scoring.blocks import arrays_of_goals
from tcs.placement.scoring.scorer import Scorer
from tcs.placement.tables import Reason
from tcs.placement.tables.windows import SAME

FEW = 32
"""Most base poses that one thread scores: starting others takes as long as they do."""
BASE = slice(-len(ROBOT_AXES), -1)
"""Columns of x, y and heading of the base among the axes of a grid."""


class _OfHand(NamedTuple):
    """The goals of a stop that one hand may serve."""

    thorough: Scorer
    """Maximises the measure of the file, as its grid was scored."""
    quick: Scorer | None
    """Stops at the first posture that is found, which takes less time where something is free, but
    leads to fewer approaches; None where nothing is free."""
    goals: list[int]
    """Numbers among those of the stop."""
    torso: int
    """Number of the torso height in the problem."""


@dataclass(frozen=True, eq=False)
class ParkedStop:
    """One stop with the goals it serves, prepared for base poses around it."""

    scorer: PointScorer
    """The table of the score file."""
    values: FloatArray
    """Values of the grid's axes [m or rad], shape (axes,)."""
    goals: tuple[int, ...]
    """Numbers of the goals it serves."""
    threads: Executor
    """Who scores."""
    hands: tuple[_OfHand, ...]
    """Empty where two arms work at the same time: the scorer of the table checks them then."""

    def missed(self, offsets: FloatArray, *, thorough: bool = False) -> BoolArray:
        """Return which goals are not reached, or not approached, with the base off its place.

        Args:
            offsets: In x and y [m] and in heading [rad], shape (n, 3).
            thorough: Whether all is scored as the grid was; if not, only what is missed from the
                first posture that is found.

        Returns:
            Shape (n, goals of the stop).
        """
        points = np.repeat(self.values[None], len(offsets), axis=0)
        points[:, BASE] += offsets
        if not self.hands:
            return ~self.scorer.score(points).reached[:, list(self.goals)]
        missed = np.ones((len(points), len(self.goals)), dtype=np.bool_)
        allowed = np.flatnonzero(~self.scorer.forbidden(points))
        parts = np.array_split(allowed, self.scorer.jobs if len(allowed) > FEW else 1)
        found = self.threads.map(lambda part: self._missed(points[part], thorough), parts)
        missed[allowed] = np.concatenate(list(found))
        return missed

    def _missed(self, points: FloatArray, thorough: bool) -> BoolArray:
        missed = np.ones((len(points), len(self.goals)), dtype=np.bool_)
        x, y, yaw = (np.ascontiguousarray(column) for column in points[:, BASE].T)
        for hand in self.hands:
            state = np.zeros(len(points), np.int64)
            rows = Rows(state, x, y, yaw, state + hand.torso)
            left = np.arange(len(points))
            if hand.quick is not None and not thorough:
                reason = hand.quick.score(rows).reason
                missed[:, hand.goals] &= reason != Reason.REACHED
                left = np.flatnonzero(np.any(reason != Reason.REACHED, axis=1))
            if left.size:
                reason = hand.thorough.score(rows.at(left)).reason
                missed[np.ix_(left, np.array(hand.goals))] &= reason != Reason.REACHED
        return missed


class _Surroundings(NamedTuple):
    """A state of the environment and a torso height, for one hand with all its goals."""

    arrays: SceneArrays
    problem: Problem
    approaches: ApproachScorer | None
    torso: int
    """Number of the torso height."""


@dataclass(frozen=True, eq=False)
class StopScorers:
    """Prepares the stops of one table of a score file."""

    scorer: PointScorer
    """The table."""
    threads: Executor
    """Who scores. Threads that stay keep the memory that approaches need."""
    known: dict[tuple[float, ...], _Surroundings] = field(default_factory=dict, repr=False)
    """Those of the stops so far, by hand, state and torso height."""
    approaches: dict[tuple[float, ...], ApproachScorer] = field(default_factory=dict, repr=False)
    """Who scores approaches, by hand and the torso height if the grid lacks it."""

    def at(self, values: FloatArray, goals: Sequence[int]) -> ParkedStop:
        """Return a stop.

        Args:
            values: Values of the grid's axes in their order [m or rad], shape (axes,).
            goals: Numbers of the goals it serves.
        """
        hands: tuple[_OfHand, ...] = ()
        if not self.scorer.has_pairs:
            hands = tuple(
                self._of_hand(number, values, goals)
                for number, hand in enumerate(self.scorer.hands)
                if set(hand.goals) & set(goals)
            )
        return ParkedStop(self.scorer, values, tuple(goals), self.threads, hands)

    def _of_hand(self, number: int, values: FloatArray, goals: Sequence[int]) -> _OfHand:
        """Return one hand at a stop."""
        arrays, every, of_every, torso = self._surroundings(number, values)
        hand_goals = self.scorer.hands[number].goals
        places = [hand_goals.index(goal) for goal in goals if goal in hand_goals]
        some = arrays_of_goals(arrays, places)
        problem = every._replace(
            goals=every.goals.at(some.goal_R, some.goal_p)._replace(
                first_pose=np.array(some.first_pose, dtype=np.int64),
                freedom=free_goals(some.freedom, some.chain, every.measure),
            ),
        )
        approaches = None if of_every is None else of_every.of_goals(problem, places)
        thorough, quick = Scorer.of(problem, approaches), None
        if len(some.freedom):
            first = problem._replace(measure=ANY_SOLUTION)
            approaches = None if of_every is None else of_every.of_goals(first, places)
            quick = Scorer(first, thorough.grippers, approaches)
        numbers = [i for i, goal in enumerate(goals) if goal in hand_goals]
        return _OfHand(thorough, quick, numbers, torso)

    def _surroundings(self, number: int, values: FloatArray) -> _Surroundings:
        """Return what is around one hand at a stop, wherever its base is."""
        scorer, hand = self.scorer, self.scorer.hands[number]
        names = [axis.name for axis in scorer.grid.environment_axes]
        state, height = values[: len(names)].tolist(), float(values[-1])
        key = (number, *state, height)
        if key not in self.known:
            positions = {**scorer.observed, **dict(zip(names, state, strict=True))}
            arrays = environment_at(hand.lowered, hand.scene, hand.job.task, [positions])
            (level,) = np.nonzero(np.abs(scorer.grid.axis("torso").values - height) < SAME)
            if not level.size:
                raised = torso_at(hand.lowered, hand.scene, [height])
                arrays = arrays._replace(
                    arm_base_R=raised.arm_base_R, arm_base_p=raised.arm_base_p, body=raised.body
                )
            problem = build_problem(arrays, scorer.measure)
            # The shapes around the lines are arranged once for all heights of the grid.
            heights = (number,) if level.size else (number, height)
            if hand.lines is not None and heights not in self.approaches:
                self.approaches[heights] = ApproachScorer(problem, hand.lines)
            self.known[key] = _Surroundings(
                arrays, problem, self.approaches.get(heights), int(level[0]) if level.size else 0
            )
        return self.known[key]
