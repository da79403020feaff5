"""Approach as part of a goal: scores of the postures that the arm can leave backwards."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from tcs.errors import ArmClassError, RobotError
from tcs.files.mapped import chunks
from tcs.kernel.arrays import GridArrays
from tcs.kernel.problem import Problem
from tcs.kernel.rows import Rows, no_rows, rows_at
from tcs.kernel.scores import JOINTS, REACHED, Scores, new_scores
from tcs.kernel.second_process import compiled_beside
from tcs.model.tasks import TOOL_SPEED
from tcs.placement.scoring.job import Job
from tcs.placement.store import APPROACH, WITHOUT_APPROACH

if TYPE_CHECKING:
    from tcs.kernel.approach.memory import AnyApproach
    from tcs.kernel.approach.scene import LineScene
    from tcs.kernel.approach.sweep import ApproachLines, ReachedPairs

SLICE = 512
"""Reached pairs per slice: tens of milliseconds of work."""


def approach_lines(job: Job) -> ApproachLines:
    """Return the approaches of a job's goals as arrays.

    Raises:
        RobotError: If a velocity limit is unknown.
    """
    # Imported here, as below: scoring without approach does not import this part of the kernel.
    from tcs.kernel.approach.sweep import ApproachLines

    velocity, _ = job.spec.robot.arm_rates()
    goals = job.task.goals
    seconds = np.array([goal.approach.distance / TOOL_SPEED for goal in goals])
    # Joints that the arm lacks are the first ones of its chain, and never move.
    limits = np.concatenate([np.full(JOINTS - len(velocity), np.inf), velocity])
    return ApproachLines(
        offset=np.array([goal.approach.offset for goal in goals]),
        fastest=seconds[:, None] * limits,
    )


@dataclass(frozen=True)
class ApproachChoice:
    """Whether goals are scored with their approaches, the same for all of a file."""

    is_scored: bool
    """Whether a goal counts as reached only by postures that can be approached."""
    hindrance: str = ""
    """Why approaches are not scored, if that is not by request."""

    @property
    def entry(self) -> dict[str, Any]:
        """The entry of a file's metadata that records the choice; {} without by request."""
        if self.is_scored:
            return {APPROACH: {"tool_speed": TOOL_SPEED}}
        return {WITHOUT_APPROACH: self.hindrance} if self.hindrance else {}


def choose_approach(wanted: bool | None, jobs: Sequence[Job]) -> ApproachChoice:
    """Return whether goals are scored with their approaches.

    Args:
        wanted: Whether they should be; None for wherever all of them can be, in the papers' way
            nowhere.
        jobs: The job of each arm or hand.

    Raises:
        ArmClassError: If they should be and cannot, or the jobs are scored as in the papers.
    """
    if wanted and any(job.paper for job in jobs):
        raise ArmClassError(
            "The papers score no approach. Leave out 'approach', or score without 'paper'."
        )
    if wanted is False or any(job.paper for job in jobs):
        return ApproachChoice(False)
    hindrance = next(filter(None, map(approach_hindrance, jobs)), "")
    if hindrance and wanted:
        raise ArmClassError(f"{hindrance}. Leave out 'approach': it is then scored without.")
    return ApproachChoice(not hindrance, hindrance)


def approach_hindrance(job: Job) -> str:
    """Return why the approaches of a job's goals cannot be scored, "" if they can be."""
    if job.hand.other is not None:
        return (
            "approaches are scored for one arm, but goals of this task are reached by two at the "
            "same time"
        )
    try:
        job.spec.robot.arm_rates()
    except RobotError as error:
        return f"approaches need velocity limits: {error}".removesuffix(".")
    return ""


@dataclass(eq=False)
class ApproachScorer:
    """Scoring of the approaches of a problem, after all else."""

    problem: Problem
    """The scene and its goals."""
    lines: ApproachLines
    """The approaches of the goals."""
    _of_thread: threading.local = field(default_factory=threading.local, repr=False)
    _arranging: threading.Lock = field(default_factory=threading.Lock, repr=False)

    @cached_property
    def scene(self) -> LineScene:
        """The shapes around all lines, which take a tenth of a second to arrange."""
        # Imported here, as below: scoring without approach does not import this part of the kernel.
        from tcs.kernel.approach.scene import approach_scene

        return approach_scene(self.problem)

    def of_goals(self, problem: Problem, goals: Sequence[int]) -> ApproachScorer:
        """Return the scorer of some of the goals, with the arranged shapes and memory of this one.

        Args:
            problem: The problem of this scorer with these goals alone, or with its environment in
                other states.
            goals: Numbers of the goals here.
        """
        some = list(goals)
        lines = self.lines._replace(
            offset=np.ascontiguousarray(self.lines.offset[some]),
            fastest=np.ascontiguousarray(self.lines.fastest[some]),
        )
        found = ApproachScorer(problem, lines)
        found.scene, found._of_thread = self.scene, self._of_thread
        return found

    def warm_up(self) -> None:
        """Compile the kernel or load its machine code."""
        from tcs.kernel.approach.regions import warm_up

        warm_up(self.problem, self.lines, self.memory(), no_rows())

    def compiled_beside(self) -> AbstractContextManager[None]:
        """Have a second process compile what `warm_up` needs, if this one compiles within."""
        from tcs.kernel.approach.scene import compile_checks
        from tcs.kernel.approach.sweep import score_approaches

        return compiled_beside(
            score_approaches,
            *(self.problem, self.lines, no_rows(), self._no_pairs()),
            first=lambda: compile_checks(self.problem),
        )

    def _no_pairs(self) -> ReachedPairs:
        return _pairs_of(new_scores(0, self.problem.goals.number))

    def score(
        self,
        grid: GridArrays,
        reason: NDArray[np.uint8],
        contact: NDArray[Any],
        dexterity: NDArray[np.float32],
        joints: NDArray[np.float32],
        *,
        jobs: int,
        first: int = 0,
    ) -> NDArray[np.float32]:
        """Replace the scores of reached pairs by those of their best approachable postures.

        Args:
            grid: The grid of the configurations.
            reason: Reasons, replaced where no posture is approachable, shape (H, G).
            contact: Contact codes, replaced where the approach is blocked, shape (H, G).
            dexterity: Replaced where another posture is the best, shape (H, G).
            joints: Arm joints of the R reached pairs [rad], shape (R, 7).
            jobs: Number of threads; the scores do not depend on it.
            first: Flat index of the first of the H configurations.

        Returns:
            Arm joints of the pairs that remain reached [rad].
        """
        from tcs.kernel.approach.regions import score_region_approaches
        from tcs.kernel.approach.sweep import ReachedPairs

        found_pairs = (
            np.argwhere(reason[rows] == 0) + np.array([rows.start, 0]) for rows in chunks(reason)
        )
        pairs = np.concatenate([np.empty((0, 2), np.int64), *found_pairs])
        rows, columns = pairs.T

        def part(start: int) -> ReachedPairs:
            chosen = slice(start, start + SLICE)
            at = rows[chosen], columns[chosen]
            configurations, row = np.unique(rows[chosen], return_inverse=True)
            scores = ReachedPairs(
                np.stack([row, columns[chosen]], axis=1), reason[at],
                contact[at].astype(np.int32), dexterity[at], joints[chosen].copy(),
            )  # fmt: skip
            at_rows = rows_at(grid, first + configurations)
            score_region_approaches(self.problem, self.lines, at_rows, scores, self.memory())
            return scores

        found = Parallel(n_jobs=jobs, prefer="threads")(
            delayed(part)(start) for start in range(0, max(len(pairs), 1), SLICE)
        )
        scores = ReachedPairs(*map(np.concatenate, zip(*found, strict=True)))
        reason[rows, columns] = scores.reason
        contact[rows, columns] = scores.contact
        dexterity[rows, columns] = scores.dexterity
        kept: NDArray[np.float32] = scores.joints[scores.reason == 0]
        return kept

    def score_rows(self, problem: Problem, rows: Rows, scores: Scores) -> None:
        """Replace the scores of configurations by those with approach, in this thread.

        Args:
            problem: The problem of this scorer, or with its environment in other states.
            rows: The configurations.
            scores: Their scores, as `tcs.kernel.sweep.score` returns them.
        """
        from tcs.kernel.approach.regions import score_region_approaches

        at = np.nonzero(scores.reason == REACHED)
        if not at[0].size:
            return
        pairs = _pairs_of(scores)
        score_region_approaches(problem, self.lines, rows, pairs, self.memory())
        scores.reason[at], scores.contact[at] = pairs.reason, pairs.contact
        scores.dexterity[at], scores.joints[at] = pairs.dexterity, pairs.joints

    def memory(self) -> AnyApproach:
        """Return the memory of this thread, whose pages take as long as 30 pairs to touch."""
        from tcs.kernel.approach.memory import new_approach

        if not hasattr(self._of_thread, "memory"):
            with self._arranging:
                scene = self.scene
            self._of_thread.memory = new_approach(self.problem, scene)
        found: AnyApproach = self._of_thread.memory
        return found


def _pairs_of(scores: Scores) -> ReachedPairs:
    """Return the reached pairs of some scores."""
    from tcs.kernel.approach.sweep import ReachedPairs

    at = np.nonzero(scores.reason == REACHED)
    pair = np.stack(at, axis=1)
    return ReachedPairs(
        pair, scores.reason[at], scores.contact[at], scores.dexterity[at], scores.joints[at]
    )
