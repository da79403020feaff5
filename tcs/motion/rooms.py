"""Rooms: which goals are done from the stops of a set where errors put person and furniture.

A goal is done in a room if from any stop of the set there is a posture at it, an approach to that
posture, and a motion from rest to the approach and back, all found anew in that room.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import wraps
from typing import ParamSpec, TypeVar

import numpy as np
from joblib import Parallel, delayed

from tcs.kernel.arrays import BoolArray, FloatArray, IntArray
from tcs.kernel.motion.search_trees import Trees, new_trees
from tcs.kernel.rows import Rows
from tcs.model.grid import ROBOT_AXES
from tcs.model.scene import environment_at, torso_at
from tcs.motion.examine import ReachableGoals
from tcs.motion.stops import StopGrid
from tcs.placement import refinement, robustness
from tcs.placement.robustness.perturbed_points import PerturbedPoints, PointScores
from tcs.placement.robustness.trials import HandTrials, Progress, counter
from tcs.placement.tables import MotionOutcome

ROOMS = 8
"""Number of rooms that a thread judges at a time: some tenths of a second of work."""


def done_in_rooms(
    samples: PerturbedPoints,
    points: FloatArray,
    found: PointScores,
    rooms: IntArray,
    *,
    seed: int,
    on_progress: Progress = None,
) -> BoolArray:
    """Return which goals are done in rooms from any of some stops.

    Args:
        samples: The samples of the errors: each is a room.
        points: The stops, as values of the axes [m or rad], shape (m, axes).
        found: What they reach and approach in all samples.
        rooms: Numbers of the samples that are judged, shape (n,).
        seed: Seed of the planner; the verdicts do not depend on the number of threads.
        on_progress: Called with the number of rooms judged and of all rooms.

    Returns:
        Shape (n, G).
    """
    if not len(rooms):
        return np.zeros((0, samples.trials.goals), dtype=np.bool_)
    judge = _Judge.of(samples, points, found, seed)
    parts = [rooms[start : start + ROOMS] for start in range(0, len(rooms), ROOMS)]
    step = counter(len(rooms), on_progress)
    verdicts = []
    parallel = Parallel(samples.jobs, prefer="threads", return_as="generator")
    for verdict in parallel(delayed(judge.verdicts)(part) for part in parts):
        verdicts.append(verdict)
        step(len(verdict))
    return np.concatenate(verdicts)


@dataclass(frozen=True, eq=False)
class _Judge:
    """The stops of a set in all rooms."""

    found: PointScores
    rows: Rows
    """The stops; the state of a row is the number of a room."""
    stops: tuple[tuple[StopGrid, ...], ...]
    """For each stop and hand, the environment in all rooms."""
    hands: tuple[HandTrials, ...]
    seed: int

    @classmethod
    def of(
        cls, samples: PerturbedPoints, points: FloatArray, found: PointScores, seed: int
    ) -> _Judge:
        """Prepare the stops in all rooms; what is compiled or arranged later is arranged here."""
        axes, hands = samples.trials.environment_axes, samples.trials.hands
        x, y, yaw, torso = (np.ascontiguousarray(c) for c in points[:, -len(ROBOT_AXES) :].T)
        levels, level = np.unique(torso, return_inverse=True)
        known: dict[tuple[int, tuple[float, ...]], StopGrid] = {}
        stops = []
        for point, number in zip(points, level.tolist(), strict=True):
            at = tuple(point[: len(axes)].tolist())
            of_point = []
            for k, hand in enumerate(hands):
                if (k, at) not in known:
                    state = dict(zip(axes, at, strict=True))
                    known[k, at] = in_rooms(samples, hand, state, levels)
                known[k, at].scenes_at(number)
                of_point.append(known[k, at])
            stops.append(tuple(of_point))
        for grid in known.values():
            grid.prepare()
        rows = Rows(np.zeros(len(points), np.int64), x, y, yaw, level.astype(np.int64))
        return cls(found, rows, tuple(stops), hands, seed)

    def verdicts(self, rooms: IntArray) -> BoolArray:
        """Return which goals are done in some rooms, shape (n, G)."""
        trees = new_trees(self.seed)
        return np.array([self._verdict(int(room), trees) for room in rooms])

    def _verdict(self, room: int, trees: Trees) -> BoolArray:
        """Return which goals are done in a room, shape (G,).

        The stop that approaches most goals comes first. Hard motions are sought only where they
        decide whether all goals are done: in a room that is lost, easy ones alone count.
        """
        # Rooms are independent draws: with the same random numbers in each, a lucky or unlucky
        # planner would be so in all of them, and intervals would be too narrow.
        trees.random[:] = np.random.SeedSequence((self.seed, room)).generate_state(1, np.uint64)
        reached = self.found.reached[:, room]
        order = np.argsort(-reached.sum(axis=1), kind="stable").tolist()
        done = np.zeros(reached.shape[1], dtype=np.bool_)
        visits = _Visits(self, room, trees)
        for stop in order:
            for goal in np.flatnonzero(reached[stop] & ~done).tolist():
                done[goal] = visits.does(stop, goal, thoroughly=False)
        left = np.flatnonzero(~done)
        if reached[:, left].any(axis=0).all():
            for goal in left.tolist():
                done[goal] = any(
                    reached[stop, goal] and visits.does(stop, goal, thoroughly=True)
                    for stop in order
                )
                if not done[goal]:
                    break
        return done


@dataclass(eq=False)
class _Visits:
    """The stops of a set in one room, as far as they were needed."""

    judge: _Judge
    room: int
    trees: Trees
    known: dict[tuple[int, int], ReachableGoals | None] = field(default_factory=dict)
    """By stop and hand; None where the arm touches something at rest."""

    def does(self, stop: int, goal: int, *, thoroughly: bool) -> bool:
        """Return whether a goal that is approached from a stop is done from there."""
        hand = int(self.judge.found.hand[stop, self.room, goal])
        if (stop, hand) not in self.known:
            self.known[stop, hand] = self._reachable(stop, hand)
        reachable = self.known[stop, hand]
        if reachable is None:
            return False
        number = self.judge.hands[hand].goals.index(goal)
        if thoroughly:
            return reachable.outcome(number)[0] == MotionOutcome.DONE
        return reachable.has_quickly(number)

    def _reachable(self, stop: int, hand: int) -> ReachableGoals | None:
        """Return the paths of one hand from a stop, None if it touches something at rest."""
        found, goals = self.judge.found, self.judge.hands[hand].goals
        row = self.judge.rows.at(np.array([stop]))._replace(state=np.array([self.room]))
        held = {
            number: found.joints[stop, self.room, goal].astype(np.float64)
            for number, goal in enumerate(goals)
            if found.reached[stop, self.room, goal] and found.hand[stop, self.room, goal] == hand
        }
        here = self.judge.stops[stop][hand].stop_at(row, self.trees, held)
        return None if here.contact_at(here.rest) is not None else ReachableGoals(here)


def in_rooms(
    samples: PerturbedPoints, hand: HandTrials, state: dict[str, float], levels: FloatArray
) -> StopGrid:
    """Return stops of a hand whose states of the environment are the rooms.

    Args:
        samples: The rooms.
        hand: The hand.
        state: Positions of the environment's axes without error, by name [m or rad].
        levels: Torso heights [m].
    """
    job, scene = hand.job, hand.scene
    lowered = dataclasses.replace(hand.lowered, arrays=torso_at(hand.lowered, scene, levels))
    positions = samples.positions(hand, state)
    rooms = (
        {name: float(values[i]) for name, values in positions.items()}
        for i in range(samples.samples)
    )
    arrays = environment_at(lowered, scene, job.task, rooms)
    lowered = dataclasses.replace(lowered, arrays=arrays)
    return StopGrid.of(job, scene, job.scored_grid, lowered)


P = ParamSpec("P")
R = TypeVar("R")


def _with_motions(function: Callable[P, R]) -> Callable[P, R]:
    """Return an estimation of success that counts goals by their motions."""

    @wraps(function)
    def judged(*args: P.args, **options: P.kwargs) -> R:
        options.setdefault("judge", done_in_rooms)
        return function(*args, **options)

    return judged


evaluate = _with_motions(robustness.evaluate)
robustify = _with_motions(robustness.robustify)
refine = _with_motions(refinement.refine)
