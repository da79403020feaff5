"""The tcs kernel on single pairs of configuration and goal, with all steps of a sweep."""

from __future__ import annotations

import time

import numpy as np
from peer_problems import Answer, Bench, Pair

from tcs.kernel.analytic.scratch import Search, new_search
from tcs.kernel.arrays import IntArray
from tcs.kernel.cache import jit
from tcs.kernel.problem import Problem
from tcs.kernel.rows import Rows, rows_at
from tcs.kernel.scores import Scores, new_scores

# `score` does the same with memory of its own, but is not compiled: a call from Python takes
# longer than a pair.
from tcs.kernel.sweep import _score_rows
from tcs.kernel.workspace import Workspace, new_workspace
from tcs.placement.tables import Reason

REPEATS = 32
"""Repetitions of a pair in one call: the clock does not resolve microseconds."""


@jit
def score_each(
    problem: Problem,
    work: Workspace,
    search: Search,
    grippers: IntArray,
    rows: Rows,
    repeats: int,
    scores: Scores,
) -> None:
    """Score configurations one by one, each by itself, all of them `repeats` times.

    Args:
        problem: The scene, with a single goal.
        work: Scratch memory.
        search: Scratch memory.
        grippers: From `gripper_contacts`, of that goal.
        rows: The configurations.
        repeats: How often.
        scores: Filled, n rows.
    """
    for _ in range(repeats):
        for i in range(len(rows.state)):
            row = Rows(
                rows.state[i : i + 1],
                rows.x[i : i + 1],
                rows.y[i : i + 1],
                rows.yaw[i : i + 1],
                rows.torso[i : i + 1],
            )
            one = Scores(
                scores.reason[i : i + 1],
                scores.contact[i : i + 1],
                scores.dexterity[i : i + 1],
                scores.joints[i : i + 1],
            )
            _score_rows(problem, None, work, search, grippers, row, one)


class Kernel:
    """Our kernel, best collision-free solution of each pair, on one thread.

    Unlike the peers it also checks base and gripper, and looks for the best solution.
    """

    labels = ("tcs kernel, the best one",)

    def __init__(self, bench: Bench) -> None:
        """Cut the problem into one for each goal."""
        goals = range(bench.problem.goals.p.shape[1])
        self._problems = [
            bench.problem.at_poses(
                bench.problem.goals.R[:, g : g + 1], bench.problem.goals.p[:, g : g + 1]
            )
            for g in goals
        ]
        self._grippers = [np.ascontiguousarray(bench.grippers[:, g : g + 1]) for g in goals]
        self._grid = bench.lowered.grid
        self._work, self._search = new_workspace(bench.problem), new_search()
        # Load or compile the machine code.
        self._score(0, np.zeros(1, np.int64), 1)

    def solve(self, pair: Pair, rng: np.random.Generator) -> tuple[Answer, ...]:
        """Return the best solution, if any, and its share of REPEATS runs in one call."""
        rows = np.array([pair.configuration])
        begun = time.process_time()
        scores = self._score(pair.goal, rows, REPEATS)
        seconds = (time.process_time() - begun) / REPEATS
        reached = scores.reason[0, 0] == Reason.REACHED
        return (Answer(seconds, (scores.joints[0, 0].astype(float),) if reached else ()),)

    def seconds(self, pairs: tuple[Pair, ...]) -> float:
        """Return the processor time of solving all pairs once, each time one after the other.

        Every pair is another one than the one before, as in a sweep; REPEATS rounds are timed.
        """
        used = 0.0
        for g in range(len(self._problems)):
            rows = np.array([pair.configuration for pair in pairs if pair.goal == g], np.int64)
            if rows.size:
                begun = time.process_time()
                self._score(g, rows, REPEATS)
                used += time.process_time() - begun
        return used / REPEATS

    def _score(self, g: int, rows: IntArray, repeats: int) -> Scores:
        scores = new_scores(rows.size, 1)
        memory, at = (self._work, self._search), rows_at(self._grid, rows)
        score_each(self._problems[g], *memory, self._grippers[g], at, repeats, scores)
        return scores
