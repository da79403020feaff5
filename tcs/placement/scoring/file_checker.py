"""Checks of the scores of a file: with Drake, and by dense scans."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from tcs.kernel.problem import Problem
from tcs.kernel.rows import rows_at
from tcs.kernel.verification.dense import DENSE_SAMPLES, dense_scans
from tcs.model.tasks import partners
from tcs.placement.scoring.drake_check import DrakeChecker, Finding, of_both
from tcs.placement.scoring.hands import whole_task
from tcs.placement.scoring.kernel_start import ANALYTIC, NUMERIC, ik_of
from tcs.placement.scoring.rebuild import rebuild_scenes
from tcs.placement.scoring.strata import Pairs
from tcs.placement.scoring.together import Hands, searched
from tcs.placement.store import ScoreFile, StateTables

SLICE = 16
"""Pairs that a thread scans at a time: up to half a second of work, so that progress is visible."""
DENSE_SAMPLES_OF_TWO, DENSE_POSTURES_OF_TWO = 5760, 2000
"""Values of the free joint of either arm in a dense scan of two, one every sixteenth of a degree
of a full turn, and the number of postures that they should not exceed, as every pair is checked."""


class Posture(NamedTuple):
    """A posture at a goal, and that of the arm that works at the same time."""

    value: float
    """Dexterity, of two arms the lesser; -1 if there is no posture."""
    q: NDArray[np.float64]
    """Joints [rad], shape (7,)."""
    other: NDArray[np.float64] | None
    """Joints of the other arm [rad], shape (7,); None for a goal by itself."""


class RefinedPair(NamedTuple):
    """A goal that a member of a refined set reaches, by their numbers."""

    table: int
    set: int
    member: int
    goal: int


@dataclass(frozen=True)
class FileChecker:
    """The three types of checks on the scores of a file.

    Configurations are numbered through all tables, those of the first one first.
    """

    tables: tuple[StateTables, ...]
    size: int
    """Number of configurations per table."""
    hand_of_goal: tuple[tuple[int, int], ...]
    """The hand of each goal, and its number there; () if the file is not of several hands."""
    drakes: tuple[DrakeChecker, ...]
    """The checker of each arm, or of each hand."""
    partner: tuple[int | None, ...]
    """The goal that another arm reaches at the same time, of each goal."""
    hands: Hands
    """The scenes of the hands, or arms."""
    jobs: int
    """Number of threads of the dense scans."""

    @classmethod
    def of(cls, file: ScoreFile, jobs: int) -> Self:
        """Return the checker of a file.

        Raises:
            StoreMismatchError: If the models differ from those the file was made from.
        """
        measure = file.metadata["measure"]
        built = rebuild_scenes(file)
        jobs_of_hands = [job for job, *_ in built]
        task = whole_task(jobs_of_hands) if file.hands else jobs_of_hands[0].task
        return cls(
            tables=file.tables,
            size=file.configurations.size,
            hand_of_goal=file.hand_of_goal,
            drakes=tuple(DrakeChecker(job, scene, measure) for job, scene, _ in built),
            partner=partners(task.goals),
            hands=Hands([lowered for *_, lowered in built], measure),
            jobs=jobs,
        )

    @property
    def problems(self) -> tuple[Problem, ...]:
        """The problem of each arm, or of each hand."""
        return self.hands.problems

    @property
    def ik(self) -> str:
        """Inverse kinematics of the arms: NUMERIC if that of one of them is."""
        return NUMERIC if NUMERIC in map(ik_of, self.problems) else ANALYTIC

    def scored(self, h: int, g: int) -> tuple[int, int, int]:
        """Return the number of the problem of a pair, its index in the scored grid, and its goal.

        The problem is that of the arm of configuration h, or of the hand of goal g.
        """
        if self.hand_of_goal:
            hand, goal = self.hand_of_goal[g]
            return hand, h, goal
        table, row = divmod(h, self.size)
        arm_size = self.size // len(self.problems)
        arm, of_arm = divmod(row, arm_size)
        return arm, table * arm_size + of_arm, g

    def check(self, h: int, g: int, scan: Posture) -> Finding:
        """Return Drake's finding for configuration h and goal g, and for the goal of its pair."""
        part, scored, goal = self.scored(h, g)
        partner = self.partner[g]
        if partner is None or scan.other is None:
            return self.drakes[part].check(scored, goal, scan.q, scan.value)
        other, _, goal_of_other = self.scored(h, partner)
        self.drakes[part].pose_other_arm(scan.other)
        self.drakes[other].pose_other_arm(scan.q)
        return of_both(
            self.drakes[part].check(scored, goal, scan.q, scan.value),
            self.drakes[other].check(scored, goal_of_other, scan.other, scan.value),
            scan.value,
        )

    def dexterity(self, h: int, g: int) -> float:
        """Return the stored dexterity."""
        table, row = divmod(h, self.size)
        return float(self.tables[table].scores.dexterity[row, g])

    def stored(self, pairs: Pairs, step: Callable[[], None]) -> list[Finding]:
        """Return Drake's findings on the stored solutions of reached pairs."""
        findings = []
        for h, g in pairs:
            partner = self.partner[g]
            other = None if partner is None else self.joints(h, partner)
            scan = Posture(self.dexterity(h, g), self.joints(h, g), other)
            findings.append(self.check(h, g, scan))
            step()
        return findings

    def joints(self, h: int, g: int) -> NDArray[np.float64]:
        """Return the stored joints of a reached pair [rad], shape (7,)."""
        table, row = divmod(h, self.size)
        return np.asarray(self.tables[table].scores.joints_of(row, g), dtype=np.float64)

    def refined_pairs(self) -> list[RefinedPair]:
        """Return every goal that a member of a refined set reaches."""
        return [
            RefinedPair(table, int(k), int(i), int(g))
            for table, tables in enumerate(self.tables)
            if tables.refined is not None
            for k, i, g in np.argwhere(tables.refined.reached)
        ]

    def refined(self, pairs: Sequence[RefinedPair], step: Callable[[], None]) -> list[Finding]:
        """Return Drake's findings on the solutions of refined sets."""
        findings = []
        for pair in pairs:
            refined = self.tables[pair.table].refined
            assert refined is not None
            at = pair.set, pair.member
            # The origin has the arm and the observed state of the refined member.
            origin = pair.table * self.size + int(refined.origin[at])
            part, scored, goal = self.scored(origin, pair.goal)
            findings.append(
                self.drakes[part].check_at(
                    self.drakes[part].values(scored, refined.values[at]),
                    goal,
                    refined.arm_joints[*at, pair.goal].astype(np.float64),
                    float(refined.dexterity[*at, pair.goal]),
                )
            )
            step()
        return findings

    def hits(self, pairs: Pairs, step: Callable[[], None]) -> list[bool | None]:
        """Return whether Drake confirms the solution of a dense scan at each unreached pair.

        None stands for a pair at which the scan finds no solution.
        """
        hits: list[bool | None] = []
        for (h, g), scan in self._scans(pairs):
            hits.append(self.check(h, g, scan).is_true if scan.value >= 0.0 else None)
            step()
        return hits

    def shortfall(self, pairs: Pairs, step: Callable[[], None]) -> list[float]:
        """Return how much greater the dexterity of the dense scan is at reached pairs."""
        short = []
        for (h, g), scan in self._scans(pairs):
            short.append(max(0.0, scan.value - self.dexterity(h, g)))
            step()
        return short

    def _runs(self, pairs: Pairs) -> list[Pairs]:
        """Return the pairs divided where the problem, or that of the other arm, changes."""

        def problems_of(pair: tuple[int, int]) -> tuple[int, int | None]:
            h, g = pair
            partner = self.partner[g]
            other = None if partner is None else self.scored(h, partner)[0]
            return self.scored(h, g)[0], other

        return [list(run) for _, run in itertools.groupby(pairs, problems_of)]

    def _scans(self, pairs: Pairs) -> Iterator[tuple[tuple[int, int], Posture]]:
        """Yield each pair with the best posture of its dense scan, in order."""
        # Pairs of one problem at a time, in their order.
        parts = [
            run[start : start + SLICE]
            for run in self._runs(pairs)
            for start in range(0, len(run), SLICE)
        ]
        pool = Parallel(n_jobs=self.jobs, prefer="threads", return_as="generator")
        for part, postures in zip(parts, pool(map(delayed(self._scan), parts)), strict=True):
            yield from zip(part, postures, strict=True)

    def _scan(self, part: Pairs) -> list[Posture]:
        """Return the best posture of the dense scans of pairs of one problem."""
        first = self.scored(*part[0])[0]
        partner = self.partner[part[0][1]]
        if partner is not None:
            return self._scan_together(part, first, self.scored(part[0][0], partner)[0])
        scored = np.array([self.scored(h, g)[1:] for h, g in part])
        rows, joints = (
            rows_at(self.hands.lowered[first].grid, scored[:, 0]),
            np.empty((len(part), 7)),
        )
        pairs = np.stack([np.arange(len(part)), scored[:, 1]], axis=1)
        values = dense_scans(self.problems[first], rows, pairs, DENSE_SAMPLES, joints)
        return [Posture(float(v), q, None) for v, q in zip(values, joints, strict=True)]

    def _scan_together(self, part: Pairs, first: int, second: int) -> list[Posture]:
        """Return the best pair of postures of dense scans of both arms."""
        two = self.hands.two(first, second)
        none = np.empty((0, 7))
        found = []
        for h, g in part:
            _, scored, goal = self.scored(h, g)
            partner = self.partner[g]
            assert partner is not None
            goals = goal, self.scored(h, partner)[2]
            best = searched(
                two,
                rows_at(self.hands.lowered[first].grid, [scored]),
                goals,
                (none, none),
                finest=DENSE_SAMPLES_OF_TWO,
                most=DENSE_POSTURES_OF_TWO,
            )
            found.append(Posture(-1.0, np.zeros(7), None) if best is None else Posture(*best))
        return found
