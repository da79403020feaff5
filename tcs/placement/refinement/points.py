"""Scores of configurations anywhere between the grid points of a score file."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.kernel.problem import Problem, build_problem
from tcs.kernel.rows import Rows
from tcs.kernel.scores import Scores, new_scores
from tcs.model.grid import ROBOT_AXES, Grid, InitialConfiguration
from tcs.model.scene import LoweredScene, Scene, environment_at, torso_at
from tcs.placement.constraints import Footprint
from tcs.placement.scoring.approaches import ApproachScorer, approach_lines
from tcs.placement.scoring.hands import HandScores, best_of_hands
from tcs.placement.scoring.job import Job
from tcs.placement.scoring.kernel_start import warm_up
from tcs.placement.scoring.rebuild import rebuild_scenes
from tcs.placement.scoring.scorer import Scorer
from tcs.placement.scoring.sweep import name_contacts
from tcs.placement.scoring.together import Hands, together_at
from tcs.placement.store import APPROACH, ScoreFile
from tcs.placement.tables import Reason, RefinedSet, ScoreTable

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
    hand: NDArray[np.uint8]
    """Number of the hand that serves each goal, shape (n, G)."""


@dataclass(frozen=True, eq=False)
class ScoredHand:
    """The robot with one hand."""

    job: Job
    scene: Scene
    lowered: LoweredScene
    goals: tuple[int, ...]
    """Numbers of the goals that the hand may serve."""
    lines: ApproachLines | None
    """The approaches of the goals; None to score all postures."""


@dataclass(frozen=True, eq=False)
class PointScorer:
    """One table of a score file, prepared for scoring configurations off its grid.

    The code that scores the grid scores them, with approach if it scored the grid so: at a grid
    point it gives the stored scores.
    Construction builds Drake's plant, which takes half a second.
    """

    hands: tuple[ScoredHand, ...]
    """The robot with each hand."""
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
        with_approach = APPROACH in file.metadata
        hands = tuple(
            ScoredHand(*built, goals, approach_lines(built[0]) if with_approach else None)
            for built, goals in zip(rebuild_scenes(file), file.goals_of_hands, strict=True)
        )
        return cls(
            hands,
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
        for hand in self.hands:
            problem = build_problem(hand.lowered.arrays, self.measure)
            scorer = None if hand.lines is None else ApproachScorer(problem, hand.lines)
            warm_up(problem, on_compile, scorer)

    @property
    def built(self) -> list[tuple[Job, Scene, LoweredScene]]:
        """The robot with each hand, for trials."""
        return [(hand.job, hand.scene, hand.lowered) for hand in self.hands]

    @property
    def goals(self) -> int:
        """Number of goals."""
        return len({goal for hand in self.hands for goal in hand.goals})

    def score(self, points: FloatArray) -> PointScores:
        """Return the scores of configurations; one on a forbidden region reaches nothing.

        Args:
            points: Values in the order of the axes [m or rad], shape (n, axes).
        """
        found, hand = self._scores(points)
        return PointScores(found.reason == Reason.REACHED, found.dexterity, found.joints, hand)

    @property
    def has_pairs(self) -> bool:
        """Whether two arms reach goals at the same time."""
        return bool(self._together.pairs)

    def of_hand(self, hand: int) -> Self:
        """Return the scorer of the goals of one hand, numbered as those of the hand."""
        alone = self.hands[hand]
        goals = tuple(range(len(alone.goals)))
        return dataclasses.replace(self, hands=(dataclasses.replace(alone, goals=goals),))

    def score_table(self, points: FloatArray, weights: FloatArray | None = None) -> ScoreTable:
        """Return the scores of configurations as a table, with reasons and bodies in contact.

        Args:
            points: Values in the order of the axes [m or rad], shape (n, axes).
            weights: Weights of the goals, sum 1, shape (G,); None for equal ones.
        """
        if weights is None:
            weights = np.full(self.goals, 1.0 / self.goals)
        found, hand = self._scores(points)
        names: list[tuple[str, str]] = []
        for number, of_hand in enumerate(self.hands):
            at = hand == number
            problem = build_problem(of_hand.lowered.arrays, self.measure)
            pair = found.contact[at]
            of_pairs = name_contacts(pair, of_hand.lowered, problem)
            found.contact[at] = np.where(pair >= 0, pair + len(names), -1)
            names.extend(of_pairs)
        reached = found.reason == Reason.REACHED
        return ScoreTable(
            dexterity=found.dexterity,
            reason=found.reason,
            pair=found.contact,
            pair_names=tuple(names),
            arm_joints=found.joints[reached],
            weights=weights,
            hand=hand if len(self.hands) > 1 else None,
        )

    def _scores(self, points: FloatArray) -> HandScores:
        """Return the scores of configurations as the kernel gives them, 0 where not reached."""
        scores = new_scores(len(points), self.goals)
        scores.reason[:], scores.contact[:] = Reason.EXCLUDED, -1
        hand = np.zeros(scores.reason.shape, np.uint8)
        rows = np.flatnonzero(~self.forbidden(points))
        if rows.size:
            chosen = points[rows]
            states, state = np.unique(chosen[:, : -len(ROBOT_AXES)], axis=0, return_inverse=True)
            levels, level = np.unique(self._columns(chosen, "torso")[:, 0], return_inverse=True)
            x, y, yaw = self._columns(chosen, "base_x", "base_y", "base_yaw").T
            at = Rows(state.ravel(), x, y, yaw, level.ravel())
            problems = tuple(self._problem(one, states, levels) for one in self.hands)
            parts = [
                self._scores_of(one, problem, at)
                for one, problem in zip(self.hands, problems, strict=True)
            ]
            together_at(parts, dataclasses.replace(self._together, problems=problems), at)
            some = best_of_hands(parts, [one.goals for one in self.hands])
            scores.put(rows, some.scores)
            hand[rows] = some.hand
        reached = scores.reason == Reason.REACHED
        scores.dexterity[~reached], scores.joints[~reached] = 0.0, 0.0
        return HandScores(scores, hand)

    @cached_property
    def _together(self) -> Hands:
        """The hands, to check arms that work at the same time against each other."""
        return Hands.of([(hand.job, hand.lowered) for hand in self.hands], self.measure)

    def forbidden(self, points: FloatArray) -> BoolArray:
        """Return which configurations stand on a forbidden region, shape (n,)."""
        base = self._columns(points, "base_x", "base_y", "base_yaw")
        forbidden = np.zeros(len(base), dtype=np.bool_)
        for region in self.hands[0].job.constraints.forbid:
            forbidden |= self.footprint.overlaps(region, base)
        return forbidden

    def _columns(self, values: FloatArray, *names: str) -> FloatArray:
        """Return the columns of some of the robot's axes, shape (n, names)."""
        order = list(ROBOT_AXES)
        return values[:, [order.index(name) - len(order) for name in names]]

    def _scores_of(self, hand: ScoredHand, problem: Problem, at: Rows) -> Scores:
        """Return the scores of configurations with one hand."""
        approaches = None if hand.lines is None else ApproachScorer(problem, hand.lines)
        return Scorer.of(problem, approaches).score(at, self.jobs)

    def _problem(self, hand: ScoredHand, states: FloatArray, levels: FloatArray) -> Problem:
        """Return the kernel's problem of environment states and torso heights."""
        names = [axis.name for axis in self.grid.environment_axes]
        positions = (
            {**self.observed, **dict(zip(names, map(float, state), strict=True))}
            for state in states
        )
        moved = environment_at(hand.lowered, hand.scene, hand.job.task, positions)
        raised = torso_at(hand.lowered, hand.scene, levels)
        arrays = moved._replace(
            arm_base_R=raised.arm_base_R, arm_base_p=raised.arm_base_p, body=raised.body
        )
        return build_problem(arrays, self.measure)


class RefinedMembers(NamedTuple):
    """The members of a refined set, in the order of the visits."""

    members: tuple[InitialConfiguration, ...]
    """The configurations."""
    scores: ScoreTable
    """Their scores, a row for each."""


def score_members(file: ScoreFile, chosen: RefinedSet, jobs: int = 2) -> RefinedMembers:
    """Return the members of a refined set with their scores, computed by the kernel.

    The file holds what the members reach; this has the reasons, and the bodies in contact, too.

    Args:
        file: A score file with refined sets.
        chosen: The set.
        jobs: Number of threads.

    Raises:
        StoreMismatchError: If the file was made from other models.
        SelectionError: If the table was not refined.
    """
    refined = file.tables[chosen.table].refined_sets
    at = chosen.row, list(chosen.order)
    scorer = PointScorer.of(file, chosen.table, jobs)
    scores = scorer.score_table(refined.values[at], refined.weights)
    members = refined.members(file.configurations, chosen.row)
    return RefinedMembers(tuple(members[i] for i in chosen.order), scores)
