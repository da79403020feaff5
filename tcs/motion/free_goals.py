"""Postures at which scoring reaches the goals: where in its freedom a goal is reached."""

from __future__ import annotations

import copy
from functools import cached_property

import numpy as np

from tcs.kernel.approach.sweep import ApproachLines
from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.problem import Problem
from tcs.kernel.rows import Rows
from tcs.kernel.scores import REACHED
from tcs.kernel.sweep import gripper_contacts, score
from tcs.placement.scoring.approaches import ApproachScorer


class ScoredPostures:
    """The most dexterous posture at each goal of a scene from its initial configurations.

    Of those that can be approached if there are any.
    """

    def __init__(self, problem: Problem, lines: ApproachLines) -> None:
        """Take a scene and the approaches of its goals."""
        self._problem = problem
        self._approaches = ApproachScorer(problem, lines)

    @cached_property
    def _grippers(self) -> IntArray:
        return gripper_contacts(self._problem)

    def at(self, row: Rows) -> dict[int, FloatArray]:
        """Return the posture at each goal that is reached [rad], shape (7,), by its number.

        Args:
            row: One initial configuration.
        """
        scores = score(self._problem, row, self._grippers)
        led = copy.deepcopy(scores)
        self._approaches.score_rows(self._problem, row, led)
        return {
            goal: (led if led.reason[0, goal] == REACHED else scores)
            .joints[0, goal]
            .astype(np.float64)
            for goal, reason in enumerate(scores.reason[0].tolist())
            if reason == REACHED
        }
