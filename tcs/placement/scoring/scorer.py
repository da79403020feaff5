"""The one scorer: a scene with one hand, in which rows of any origin are scored."""

from __future__ import annotations

from typing import NamedTuple

from joblib import Parallel, delayed

from tcs.kernel.arrays import IntArray
from tcs.kernel.problem import Problem
from tcs.kernel.rows import Rows
from tcs.kernel.scores import Scores, joined
from tcs.kernel.sweep import gripper_contacts, score
from tcs.placement.scoring.approaches import ApproachScorer

BATCH = 64
"""Most rows that a thread scores at a time: with approach, some ten milliseconds of work."""


class Scorer(NamedTuple):
    """A scene in some states, with one hand and its goals.

    Rows come from the offline grid, perturbed rooms and bodies of a population (a state for each),
    refinement, and base poses for poses of the tool.
    """

    problem: Problem
    """The scene and its goals."""
    grippers: IntArray
    """Contacts of the gripper with the environment, from `gripper_contacts`."""
    approaches: ApproachScorer | None = None
    """Scores the approaches of the goals; None to score all postures."""

    @classmethod
    def of(cls, problem: Problem, approaches: ApproachScorer | None = None) -> Scorer:
        """Return the scorer of a scene."""
        return cls(problem, gripper_contacts(problem), approaches)

    def score(self, rows: Rows, jobs: int = 1) -> Scores:
        """Return the scores of rows.

        Args:
            rows: The rows.
            jobs: Number of threads; the scores do not depend on it.
        """
        if jobs > 1:
            parts = (rows.at(slice(i, i + BATCH)) for i in range(0, max(rows.number, 1), BATCH))
            return joined(Parallel(n_jobs=jobs, prefer="threads")(map(delayed(self.score), parts)))
        scores = score(self.problem, rows, self.grippers)
        if self.approaches is not None:
            self.approaches.score_rows(self.problem, rows, scores)
        return scores
