"""Pairs of goals that two arms reach at the same time: the arms are checked against each other."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol, Self

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from tcs.kernel.contacts import NO_CONTACT
from tcs.kernel.problem import Problem, build_problem
from tcs.kernel.rows import Rows, rows_at
from tcs.kernel.scores import Scores
from tcs.model.scene import LoweredScene
from tcs.model.tasks import partners
from tcs.placement.scoring.job import Job, whole_task
from tcs.placement.tables import Reason, ScoreTable

if TYPE_CHECKING:
    from tcs.kernel.together.arms import TwoArms

SLICE = 64
"""Configurations that a thread checks at a time: up to some seconds if postures are searched."""

FIRST_SAMPLES, FINEST_SAMPLES = 64, 3072
"""Values of the free joint of either arm that are tried where their best postures touch: at first,
and then at most."""
MOST_POSTURES = 800
"""Postures of an arm that the finer samples should not exceed: all pairs of them are tried."""


class PlacedGoal(NamedTuple):
    """A goal by the hand that reaches it."""

    hand: int
    """Number of the hand."""
    goal: int
    """Number of the goal among those of the hand."""


@dataclass(frozen=True)
class Hands:
    """The scenes of hands, to check them against each other."""

    lowered: Sequence[LoweredScene]
    """The scene of each hand, without the arm that works at the same time."""
    problems: tuple[Problem, ...]
    """The problem of each hand."""
    pairs: tuple[tuple[PlacedGoal, PlacedGoal], ...] = ()
    """The pairs of goals that two arms reach at the same time, each goal by its hand."""

    @classmethod
    def of(cls, built: Sequence[tuple[Job, LoweredScene]], measure: str) -> Self:
        """Return the hands of a task.

        Args:
            built: The job of each hand, and its scene.
            measure: Name of the dexterity measure.
        """
        places = {
            goal: PlacedGoal(hand, place)
            for hand, (job, _) in enumerate(built)
            for place, goal in enumerate(job.goal_numbers)
        }
        task = whole_task([job for job, _ in built])
        pairs = tuple(
            (places[i], places[j])
            for i, j in enumerate(partners(task.goals))
            if j is not None and i < j
        )
        lowered = [scene for _, scene in built]
        problems = tuple(build_problem(scene.arrays, measure) for scene in lowered)
        return cls(lowered, problems, pairs)

    def two(self, first: int, second: int) -> TwoArms:
        """Return two of the hands, with memory of their own."""
        # Imported here: scoring of goals by themselves does not import this part of the kernel.
        from tcs.kernel.together.arms import TwoArms

        scenes = self.lowered[first].arrays, self.lowered[second].arrays
        return TwoArms(self.problems[first], self.problems[second], scenes)

    def names(self, first: int, second: int, bodies: NDArray[np.int64]) -> tuple[str, str]:
        """Return the names of a body of the first hand's arm and of one of the second's."""
        a, b = (self.lowered[hand].robot_bodies for hand in (first, second))
        return a[int(bodies[0])], b[int(bodies[1])]


class _Scored(Protocol):
    """The scores of one hand, to be changed goal by goal."""

    reason: NDArray[np.uint8]
    dexterity: NDArray[np.float32]

    def joints_at(self, rows: NDArray[np.intp], goal: int) -> NDArray[np.float64]:
        """Return the joints at a reached goal [rad], shape (n, 7)."""

    def block(self, row: int, goal: int, names: tuple[str, str]) -> None:
        """Name the bodies of a contact."""

    def reach(self, row: int, goal: int, joints: NDArray[np.float64]) -> None:
        """Replace the joints of a reached pair."""


class _OfRows:
    """Scores of rows as the kernel gives them."""

    def __init__(self, scores: Scores) -> None:
        self.reason, self.dexterity = scores.reason, scores.dexterity
        self._scores = scores

    def joints_at(self, rows: NDArray[np.intp], goal: int) -> NDArray[np.float64]:
        """Return the joints at a reached goal [rad], shape (n, 7)."""
        return np.asarray(self._scores.joints[rows, goal], dtype=np.float64)

    def block(self, row: int, goal: int, _: tuple[str, str]) -> None:
        """Leave the contact without a code: the scene of either arm lacks the other one."""
        self._scores.contact[row, goal] = NO_CONTACT

    def reach(self, row: int, goal: int, joints: NDArray[np.float64]) -> None:
        """Replace the joints of a reached pair."""
        self._scores.joints[row, goal] = joints


class _Columns:
    """Scores of a table."""

    def __init__(self, table: ScoreTable) -> None:
        self.reason, self.pair = table.reason.copy(), table.pair.astype(np.int32)
        self.dexterity, self.joints = table.dexterity.copy(), table.arm_joints.copy()
        self.names = dict.fromkeys(table.pair_names)
        self._weights = table.weights
        reached = table.reason == Reason.REACHED
        # Row of the joints of each pair, -1 where it is not reached.
        self._row = np.where(reached, np.cumsum(reached).reshape(reached.shape) - 1, -1)

    def joints_at(self, rows: NDArray[np.intp], goal: int) -> NDArray[np.float64]:
        """Return the joints at a reached goal [rad], shape (n, 7)."""
        return np.asarray(self.joints[self._row[rows, goal]], dtype=np.float64)

    def block(self, row: int, goal: int, names: tuple[str, str]) -> None:
        """Name the bodies of a contact."""
        self.names.setdefault(names)
        self.pair[row, goal] = list(self.names).index(names)

    def reach(self, row: int, goal: int, joints: NDArray[np.float64]) -> None:
        """Replace the joints of a reached pair."""
        self.joints[self._row[row, goal]] = joints

    def table(self) -> ScoreTable:
        """Return the scores."""
        reached = self.reason == Reason.REACHED
        return ScoreTable(
            dexterity=self.dexterity,
            reason=self.reason,
            pair=self.pair,
            pair_names=tuple(self.names),
            arm_joints=self.joints[self._row[reached]],
            weights=self._weights,
        )


def together(
    tables: Sequence[ScoreTable], hands: Hands, *, first_row: int, jobs: int
) -> list[ScoreTable]:
    """Return the scores of hands with pairs of goals reached by two arms at the same time.

    Both goals of a pair are reached where some pair of postures holds each tool at its goal, and
    neither arm touches the other. Of these the one with the greatest lesser dexterity is stored,
    with that dexterity at both goals.

    Args:
        tables: The scores of each hand by itself, in one observed state.
        hands: The hands.
        first_row: Index of the first row of the tables in the scored grid.
        jobs: Number of threads; the scores do not depend on it.
    """
    columns = [_Columns(table) for table in tables]
    grid = hands.lowered[0].grid
    _check(columns, hands, lambda rows: rows_at(grid, first_row + rows), jobs)
    return [column.table() for column in columns]


def together_at(parts: Sequence[Scores], hands: Hands, rows: Rows) -> None:
    """Change the scores of rows with each hand by itself to those of both arms at once.

    Args:
        parts: The scores of each hand; changed.
        hands: The hands.
        rows: The configurations.
    """
    if hands.pairs:
        _check([_OfRows(part) for part in parts], hands, rows.at, 1)


def _check(
    columns: Sequence[_Scored],
    hands: Hands,
    rows_of: Callable[[NDArray[np.intp]], Rows],
    jobs: int,
) -> None:
    """Change the scores of hands by themselves to those of both arms at once.

    Args:
        columns: The scores of each hand.
        hands: The hands.
        rows_of: Returns configurations, given by rows of the scores.
        jobs: Number of threads.
    """
    for a, b in hands.pairs:
        one, other = columns[a.hand], columns[b.hand]
        alone = [
            column.reason[:, goal] == Reason.REACHED for column, (_, goal) in ((one, a), (other, b))
        ]
        _refuse(one, np.flatnonzero(alone[0] & ~alone[1]), a.goal, Reason.OTHER_GOAL_UNREACHED)
        _refuse(other, np.flatnonzero(alone[1] & ~alone[0]), b.goal, Reason.OTHER_GOAL_UNREACHED)
        rows = np.flatnonzero(alone[0] & alone[1])
        slices = [rows[start : start + SLICE] for start in range(0, rows.size, SLICE)]
        known = [(one.joints_at(some, a.goal), other.joints_at(some, b.goal)) for some in slices]
        found = Parallel(n_jobs=jobs, prefer="threads")(
            delayed(_pairs_of_postures)(hands, a, b, rows_of(some), *joints)
            for some, joints in zip(slices, known, strict=True)
        )
        for some, of_slice in zip(slices, found, strict=True):
            for row, pair in zip(some.tolist(), of_slice, strict=True):
                if pair.joints is None:
                    for column, goal in ((one, a.goal), (other, b.goal)):
                        _refuse(column, np.array([row]), goal, Reason.ARMS_BLOCKED)
                    names = hands.names(a.hand, b.hand, pair.bodies)
                    one.block(row, a.goal, names)
                    other.block(row, b.goal, names[::-1])
                    continue
                lesser = min(one.dexterity[row, a.goal], other.dexterity[row, b.goal])
                lesser = lesser if pair.value is None else np.float32(pair.value)
                for column, goal, q in ((one, a.goal, 0), (other, b.goal, 1)):
                    column.dexterity[row, goal] = lesser
                    column.reach(row, goal, pair.joints[q])


def _refuse(column: _Scored, rows: NDArray[np.intp], goal: int, reason: Reason) -> None:
    """Replace reached pairs by a reason."""
    column.reason[rows, goal], column.dexterity[rows, goal] = reason, 0.0


class _Found(NamedTuple):
    """What two arms can do at a configuration."""

    joints: tuple[NDArray[np.float64], NDArray[np.float64]] | None
    """Joints of both arms [rad]; None if they touch each other in every pair of postures."""
    value: float | None
    """Lesser dexterity; None where the best posture of each arm by itself is free of the other."""
    bodies: NDArray[np.int64]
    """The bodies in contact where the arms take their best postures; -1 without contact."""


def _pairs_of_postures(
    hands: Hands,
    a: PlacedGoal,
    b: PlacedGoal,
    rows: Rows,
    first: NDArray[np.float64],
    second: NDArray[np.float64],
) -> list[_Found]:
    """Return the best pair of postures of each configuration that reaches both goals."""
    two = hands.two(a.hand, b.hand)
    bodies = two.contacts(rows.torso, first, second)
    is_posed = all(hands.lowered[hand].arrays.is_single_pose(goal) for hand, goal in (a, b))
    found = []
    for n in range(len(rows.state)):
        if bodies[n, 0] < 0:
            found.append(_Found((first[n], second[n]), None, bodies[n]))
            continue
        if is_posed and two.grippers_meet((int(bodies[n, 0]), int(bodies[n, 1]))):
            # The goals place the grippers, whatever the postures.
            found.append(_Found(None, None, bodies[n]))
            continue
        known = first[n : n + 1], second[n : n + 1]
        best = searched(two, rows.at(slice(n, n + 1)), (a.goal, b.goal), known)
        value, joints = (None, None) if best is None else (best[0], best[1:])
        found.append(_Found(joints, value, bodies[n]))
    return found


def searched(
    two: TwoArms,
    row: Rows,
    goals: tuple[int, int],
    known: tuple[NDArray[np.float64], NDArray[np.float64]],
    *,
    finest: int = FINEST_SAMPLES,
    most: int = MOST_POSTURES,
) -> tuple[float, NDArray[np.float64], NDArray[np.float64]] | None:
    """Return the best pair of postures that are free of each other, None if none is found.

    Where the first samples give none, finer ones follow: the fewer postures the arms have, the
    finer.

    Args:
        two: The two arms.
        row: The configuration.
        goals: The goal of each arm.
        known: A free posture of each arm by itself [rad], shape (0 or 1, 7).
        finest: Greatest number of values of each free joint.
        most: Number of postures of an arm that the finer samples should not exceed.
    """
    best = two.best_pair(row, goals, known, FIRST_SAMPLES)
    if best is not None:
        return best
    counts = [len(two.postures(k, row, goals[k], known[k], FIRST_SAMPLES)[0]) for k in range(2)]
    samples = min(finest, FIRST_SAMPLES * most // max(*counts, 1))
    return two.best_pair(row, goals, known, samples) if samples > FIRST_SAMPLES else None
