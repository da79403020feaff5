"""Approach as part of a goal: scores of the postures that the arm can leave backwards."""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from tcs.errors import ArmClassError
from tcs.files.mapped import chunks
from tcs.kernel.analytic.solver import is_outside
from tcs.kernel.problem import Problem
from tcs.model.tasks import TOOL_SPEED
from tcs.placement.scoring.job import Job

if TYPE_CHECKING:
    from tcs.kernel.approach.scene import LineScene
    from tcs.kernel.approach.sweep import ApproachLines

SLICE = 256
"""Reached pairs per slice: tens of milliseconds of work."""
ENTRY = "approach.pairs.approach_pair"
"""Function into which the kernel of approaches is compiled, with its module."""


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
    return ApproachLines(
        offset=np.array([goal.approach.offset for goal in goals]),
        fastest=seconds[:, None] * np.array(velocity),
    )


def approach_entry() -> dict[str, Any]:
    """Return the entry of a file's metadata that records scoring with approach."""
    return {"approach": {"tool_speed": TOOL_SPEED}}


def check_closed_form(problem: Problem) -> None:
    """Check that the arm has a closed form, and that every goal is a single pose.

    Raises:
        ArmClassError: If it has none, or a goal is free.
    """
    if problem.freedom.first.size:
        raise ArmClassError(
            "approaches are scored for goals of a single pose, but goals of this task are free: "
            "score it without approach (--no-approach)."
        )
    if is_outside(problem.arm):
        raise ArmClassError(
            "approaches are scored for arms of seven joints with a closed form: score this arm "
            "without approach (--no-approach)."
        )


@dataclass(eq=False)
class ApproachScorer:
    """Scoring of the approaches of a problem, after all else."""

    problem: Problem
    """The scene, its goals and its grid."""
    lines: ApproachLines
    """The approaches of the goals."""

    @cached_property
    def scene(self) -> LineScene:
        """The shapes around all lines, which take a tenth of a second to arrange."""
        # Imported here, as below: scoring without approach does not import this part of the kernel.
        from tcs.kernel.approach.scene import approach_scene

        return approach_scene(self.problem)

    def warm_up(self) -> float:
        """Compile the kernel or load its machine code; return the time this took [s]."""
        begun = time.perf_counter()
        empty = np.empty((0, self.problem.goal_p.shape[1]))
        self.score(
            empty.astype(np.uint8),
            empty.astype(np.int32),
            empty.astype(np.float32),
            np.empty((0, 7), np.float32),
            jobs=1,
        )
        return time.perf_counter() - begun

    def score(
        self,
        reason: NDArray[np.uint8],
        contact: NDArray[Any],
        dexterity: NDArray[np.float32],
        joints: NDArray[np.float32],
        *,
        jobs: int,
    ) -> NDArray[np.float32]:
        """Replace the scores of reached pairs by those of their best approachable postures.

        Args:
            reason: Reasons, replaced where no posture is approachable, shape (H, G).
            contact: Contact codes, replaced where the approach is blocked, shape (H, G).
            dexterity: Replaced where another posture is the best, shape (H, G).
            joints: Arm joints of the R reached pairs [rad], shape (R, 7).
            jobs: Number of threads; the scores do not depend on it.

        Returns:
            Arm joints of the pairs that remain reached [rad].
        """
        from tcs.kernel.approach.memory import Approach, new_approach
        from tcs.kernel.approach.sweep import ReachedPairs, score_approaches

        found_pairs = (
            np.argwhere(reason[rows] == 0) + np.array([rows.start, 0]) for rows in chunks(reason)
        )
        pairs = np.concatenate([np.empty((0, 2), np.int64), *found_pairs])
        rows, columns = pairs.T
        scene, of_thread = self.scene, threading.local()

        def memory() -> Approach:
            """Return the memory of this thread, whose pages take as long as 30 pairs to touch."""
            if not hasattr(of_thread, "memory"):
                of_thread.memory = new_approach(self.problem, scene)
            found: Approach = of_thread.memory
            return found

        def part(start: int) -> ReachedPairs:
            chosen = slice(start, start + SLICE)
            at = rows[chosen], columns[chosen]
            scores = ReachedPairs(
                pairs[chosen], reason[at], contact[at].astype(np.int32), dexterity[at],
                joints[chosen].copy(),
            )  # fmt: skip
            score_approaches(self.problem, self.lines, scores, memory())
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
