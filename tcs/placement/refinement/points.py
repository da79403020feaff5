"""Scores of configurations anywhere between the grid points of a score file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Self

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from tcs.kernel.arrays import BoolArray, FloatArray, IntArray
from tcs.kernel.problem import Problem, build_problem
from tcs.kernel.rows import Rows
from tcs.kernel.scores import Scores, new_scores
from tcs.kernel.sweep import gripper_contacts, score_rows
from tcs.model.grid import ROBOT_AXES, Grid
from tcs.model.scene import LoweredScene, Scene, environment_at, torso_at
from tcs.placement.constraints import Footprint
from tcs.placement.scoring.approaches import ApproachScorer, approach_lines
from tcs.placement.scoring.job import Job
from tcs.placement.scoring.kernel_start import warm_up
from tcs.placement.scoring.rebuild import rebuild_scene
from tcs.placement.scoring.sweep import name_contacts
from tcs.placement.store import APPROACH, ScoreFile, files_of_arms
from tcs.placement.tables import Points, Reason, ScoreTable

if TYPE_CHECKING:
    from tcs.kernel.approach.sweep import ApproachLines

BATCH = 32
"""Configurations that a thread scores at a time: some milliseconds of work."""


class PointScores(NamedTuple):
    """What configurations reach."""

    reached: BoolArray
    """Whether a configuration reaches a goal, shape (n, G)."""
    dexterity: NDArray[np.float32]
    """Its dexterity there, 0 where not reached, shape (n, G)."""
    joints: NDArray[np.float32]
    """Arm joints of the best solution [rad], 0 where not reached, shape (n, G, 7)."""


@dataclass(frozen=True, eq=False)
class ScoredArm:
    """The robot with one of its arms."""

    job: Job
    scene: Scene
    lowered: LoweredScene
    lines: ApproachLines | None
    """The approaches of the goals; None to score all postures."""


@dataclass(frozen=True, eq=False)
class PointScorer:
    """One table of a score file, prepared for scoring configurations off its grid.

    The code that scores the grid scores them, with approach if it scored the grid so: at a grid
    point it gives the stored scores.
    Construction builds Drake's plant, which takes half a second.
    """

    arms: tuple[ScoredArm, ...]
    """The robot with each arm, in the order of the grid."""
    grid: Grid
    """The grid of the file."""
    measure: str
    """Name of the dexterity measure."""
    observed: Mapping[str, float]
    """Observed state of the table, by joint [m or rad]."""
    footprint: Footprint
    """The floor that the robot covers, for forbidden regions."""
    jobs: int
    """Number of threads; the scores do not depend on it."""

    @classmethod
    def of(cls, file: ScoreFile, table: int, jobs: int = 2) -> Self:
        """Return the scorer of one table of a score file.

        Raises:
            StoreMismatchError: If the file was made from other models.
            RobotError: If the file was scored with approach, and a velocity limit is unknown.
        """
        arms = []
        for of_arm in files_of_arms(file):
            job, scene, lowered = rebuild_scene(of_arm)
            lines = approach_lines(job) if APPROACH in file.metadata else None
            arms.append(ScoredArm(job, scene, lowered, lines))
        return cls(
            tuple(arms),
            file.configurations,
            str(file.metadata["measure"]),
            file.observed_states[table],
            Footprint.of(file.robot_shapes),
            jobs,
        )

    def warm_up(self, on_compile: Callable[[], None] | None = None) -> None:
        """Compile the kernel or load its machine code.

        Args:
            on_compile: Called first if the kernel has to be compiled.
        """
        for arm in self.arms:
            problem = build_problem(arm.lowered.arrays, self.measure)
            scorer = None if arm.lines is None else ApproachScorer(problem, arm.lines)
            warm_up(problem, on_compile, scorer)

    @property
    def built(self) -> list[tuple[Job, Scene, LoweredScene]]:
        """The robot with each arm, for trials."""
        return [(arm.job, arm.scene, arm.lowered) for arm in self.arms]

    @property
    def goals(self) -> int:
        """Number of goals."""
        return len(self.arms[0].job.task.goals)

    def score(self, points: Points) -> PointScores:
        """Return the scores of configurations; one on a forbidden region reaches nothing."""
        found = self._scores(points)
        return PointScores(found.reason == Reason.REACHED, found.dexterity, found.joints)

    def score_table(self, points: Points, weights: FloatArray) -> ScoreTable:
        """Return the scores of configurations as a table, with reasons and bodies in contact.

        Args:
            points: The configurations.
            weights: Weights of the goals, sum 1, shape (G,).
        """
        found = self._scores(points)
        names: list[tuple[str, str]] = []
        for number, arm in enumerate(self.arms):
            rows = points.arm == number
            pair = found.contact[rows]
            problem = build_problem(arm.lowered.arrays, self.measure)
            of_arm = name_contacts(pair, arm.lowered, problem)
            found.contact[rows] = np.where(pair >= 0, pair + len(names), -1)
            names.extend(of_arm)
        reached = found.reason == Reason.REACHED
        return ScoreTable(
            dexterity=found.dexterity,
            reason=found.reason,
            pair=found.contact,
            pair_names=tuple(names),
            arm_joints=found.joints[reached],
            weights=weights,
        )

    def _scores(self, points: Points) -> Scores:
        """Return the scores of configurations as the kernel gives them, 0 where not reached."""
        count = len(points.values)
        found = Scores(
            reason=np.full((count, self.goals), Reason.EXCLUDED, np.uint8),
            contact=np.full((count, self.goals), -1, np.int32),
            dexterity=np.zeros((count, self.goals), np.float32),
            joints=np.zeros((count, self.goals, 7), np.float32),
        )
        admitted = ~self._forbidden(points)
        for number, arm in enumerate(self.arms):
            rows = np.flatnonzero(admitted & (points.arm == number))
            if rows.size:
                self._score_arm(arm, points.values, rows, found)
        reached = found.reason == Reason.REACHED
        found.dexterity[~reached], found.joints[~reached] = 0.0, 0.0
        return found

    def _forbidden(self, points: Points) -> BoolArray:
        """Return which configurations stand on a forbidden region, shape (n,)."""
        base = self._columns(points.values, "base_x", "base_y", "base_yaw")
        forbidden = np.zeros(len(base), dtype=np.bool_)
        for region in self.arms[0].job.constraints.forbid:
            forbidden |= self.footprint.overlaps(region, base)
        return forbidden

    def _columns(self, values: FloatArray, *names: str) -> FloatArray:
        """Return the columns of some of the robot's axes, shape (n, names)."""
        order = list(ROBOT_AXES)
        return values[:, [order.index(name) - len(order) for name in names]]

    def _score_arm(self, arm: ScoredArm, values: FloatArray, rows: IntArray, found: Scores) -> None:
        """Fill the scores of some configurations, all with one arm."""
        chosen = values[rows]
        states, state = np.unique(chosen[:, : -len(ROBOT_AXES)], axis=0, return_inverse=True)
        levels, level = np.unique(self._columns(chosen, "torso")[:, 0], return_inverse=True)
        problem = self._problem(arm, states, levels)
        grippers = gripper_contacts(problem)
        approaches = None if arm.lines is None else ApproachScorer(problem, arm.lines)
        x, y, yaw = self._columns(chosen, "base_x", "base_y", "base_yaw").T
        at = Rows(state.ravel(), x, y, yaw, level.ravel())

        def score_batch(start: int) -> None:
            part = slice(start, start + BATCH)
            scores = new_scores(rows[part].size, self.goals)
            score_rows(problem, grippers, at.at(part), scores)
            if approaches is not None:
                approaches.score_rows(problem, at.at(part), scores)
            found.put(rows[part], scores)

        Parallel(n_jobs=self.jobs, prefer="threads")(
            delayed(score_batch)(start) for start in range(0, rows.size, BATCH)
        )

    def _problem(self, arm: ScoredArm, states: FloatArray, levels: FloatArray) -> Problem:
        """Return the kernel's problem of environment states and torso heights."""
        names = [axis.name for axis in self.grid.environment_axes]
        positions = (
            {**self.observed, **dict(zip(names, map(float, state), strict=True))}
            for state in states
        )
        moved = environment_at(arm.lowered, arm.scene, arm.job.task, positions)
        raised = torso_at(arm.lowered, arm.scene, levels)
        arrays = moved._replace(
            arm_base_R=raised.arm_base_R, arm_base_p=raised.arm_base_p, body=raised.body
        )
        return build_problem(arrays, self.measure)
