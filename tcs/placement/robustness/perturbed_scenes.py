"""Perturbed scenes: the environment in several samples as kernel arrays, scored from base poses."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from tcs.errors import TcsError
from tcs.kernel.arrays import IntArray
from tcs.kernel.dexterity import ANY_SOLUTION
from tcs.kernel.problem import Problem
from tcs.kernel.rows import Rows
from tcs.kernel.sweep import gripper_contacts
from tcs.placement.scoring.hands import HandScores, best_of_hands
from tcs.placement.scoring.scorer import Scorer
from tcs.placement.scoring.together import Hands, together_at
from tcs.placement.tables import Reason

BATCH = 500
"""Pairs of configuration and sample that a thread evaluates at a time: milliseconds of work."""


STATES = 50
"""Samples in which a thread looks for contacts of the gripper at a time: with free goals, half a
second of work."""


def grippers_of(problem: Problem, jobs: int) -> IntArray:
    """Return `gripper_contacts` of a problem with many states, found by several threads.

    Raises:
        TcsError: If the number of threads is not positive.
    """
    _check_jobs(jobs)

    def contacts(states: IntArray) -> IntArray:
        goals, shapes = problem.goals, problem.environment.shapes[states]
        goals = goals._replace(R=goals.R[states], p=goals.p[states])
        environment = problem.environment._replace(shapes=shapes)
        return gripper_contacts(problem._replace(goals=goals, environment=environment))

    count = len(problem.goals.p)
    parts = [np.arange(n, min(n + STATES, count)) for n in range(0, max(count, 1), STATES)]
    return np.concatenate(Parallel(n_jobs=jobs, prefer="threads")(map(delayed(contacts), parts)))


def _check_jobs(jobs: int) -> None:
    if jobs < 1:
        raise TcsError(f"jobs is {jobs}; must be 1 or more threads.")


class Run(NamedTuple):
    """One configuration in consecutive samples, start <= s < stop."""

    row: int
    """Row of the configuration."""
    start: int
    stop: int


class HandScenes(NamedTuple):
    """One state of the environment in several samples, as kernel arrays, for one hand."""

    scorer: Scorer
    """Each sample is a state of the environment."""
    goals: Sequence[int]
    """Numbers of the goals that the hand may serve."""

    @property
    def for_reasons(self) -> HandScenes:
        """The scenes for scores whose dexterity does not matter, which need not be the best.

        With approach it has to be: from another posture some approaches through narrow windows are
        not found.
        """
        problem, grippers, approaches = self.scorer
        if approaches is not None:
            return self
        any_solution = Scorer(problem._replace(measure=ANY_SOLUTION), grippers)
        return self._replace(scorer=any_solution)


class PerturbedScenes(NamedTuple):
    """One state of the environment in several samples, for each hand."""

    hands: tuple[HandScenes, ...]
    together: Hands | None = None
    """The hands, to check arms that work at the same time against each other."""

    def scores(self, poses: Rows, run: Run) -> HandScores:
        """Return the scores of one run, each goal by the best hand."""
        samples = np.arange(run.start, run.stop)
        rows = poses.at(np.full(samples.size, run.row))._replace(state=samples)
        parts = [hand.scorer.score(rows) for hand in self.hands]
        if self.together is not None and self.together.pairs:
            problems = tuple(hand.scorer.problem for hand in self.hands)
            together_at(parts, dataclasses.replace(self.together, problems=problems), rows)
        return best_of_hands(parts, [hand.goals for hand in self.hands])

    def reasons(self, poses: Rows, run: Run) -> NDArray[np.uint8]:
        """Return the reason of each sample and goal of one run, shape (stop - start, goals)."""
        if self.together is not None and self.together.pairs:
            return self.scores(poses, run).scores.reason
        scenes = PerturbedScenes(tuple(hand.for_reasons for hand in self.hands))
        return scenes.scores(poses, run).scores.reason

    def reached(
        self, poses: Rows, runs: list[Run], jobs: int
    ) -> Iterator[tuple[Run, NDArray[np.bool_]]]:
        """Yield the goals that each run reaches, shape (stop - start, goals), in parallel.

        Raises:
            TcsError: If the number of threads is not positive.
        """
        _check_jobs(jobs)
        batches: list[list[Run]] = [[]]
        size = 0
        for run in runs:
            if size >= BATCH:
                batches.append([])
                size = 0
            batches[-1].append(run)
            size += run.stop - run.start
        parallel = Parallel(n_jobs=jobs, prefer="threads", return_as="generator")
        work = (delayed(self._reached)(poses, batch) for batch in batches)
        for batch, found in zip(batches, parallel(work), strict=True):
            yield from zip(batch, found, strict=True)

    def _reached(self, poses: Rows, runs: list[Run]) -> list[NDArray[np.bool_]]:
        return [self.reasons(poses, run) == Reason.REACHED for run in runs]
