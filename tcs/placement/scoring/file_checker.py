"""Checks of the scores of a file: with Drake, and by dense scans of unreached pairs."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple, Self

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from tcs.files.mapped import chunks
from tcs.kernel.problem import Problem
from tcs.kernel.rows import rows_at
from tcs.kernel.verification.dense import DENSE_SAMPLES
from tcs.kernel.verification.scans import dense_scans
from tcs.model.tasks import partners
from tcs.placement.scoring.drake_check import DrakeChecker, Finding, of_both
from tcs.placement.scoring.job import whole_task
from tcs.placement.scoring.kernel_start import ANALYTIC, NUMERIC, ik_of
from tcs.placement.scoring.rebuild import rebuild_scenes
from tcs.placement.scoring.together import Hands, searched
from tcs.placement.store import ScoreFile, StateTables
from tcs.placement.tables import Reason

SLICE = 16
"""Pairs that a thread scans at a time: up to half a second of work, so that progress is visible."""
DENSE_SAMPLES_OF_TWO, DENSE_POSTURES_OF_TWO = 5760, 2000
"""Values of the free joint of either arm in a dense scan of two, one every sixteenth of a degree
of a full turn, and the number of postures that they should not exceed, as every pair is checked."""


class Posture(NamedTuple):
    """A posture at a goal, and that of the arm that works at the same time."""

    hand: int
    """Number of the hand."""
    value: float
    """Dexterity, of two arms the lesser; -1 if there is no posture."""
    q: NDArray[np.float64]
    """Joints [rad], shape (7,)."""
    other: NDArray[np.float64] | None
    """Joints of the other arm [rad], shape (7,); None for a goal by itself."""
    other_hand: int | None = None
    """Number of the other hand; None for that of the stored scores."""


class _Scan(NamedTuple):
    """A pair of configuration and goal that is scanned with a hand."""

    h: int
    g: int
    hand: int


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
    goals: tuple[tuple[int, ...], ...]
    """Numbers of the goals of each hand."""
    drakes: tuple[DrakeChecker, ...]
    """The checker of each hand."""
    partner: tuple[int | None, ...]
    """The goal that another arm reaches at the same time, of each goal."""
    hands: Hands
    """The scenes of the hands."""
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
        task = whole_task([job for job, *_ in built])
        return cls(
            tables=file.tables,
            size=file.configurations.size,
            goals=file.goals_of_hands,
            drakes=tuple(DrakeChecker(job, scene, measure) for job, scene, _ in built),
            partner=partners(task.goals),
            hands=Hands.of([(job, lowered) for job, _, lowered in built], measure),
            jobs=jobs,
        )

    @property
    def problems(self) -> tuple[Problem, ...]:
        """The problem of each hand."""
        return self.hands.problems

    @property
    def ik(self) -> str:
        """Inverse kinematics of the arms: NUMERIC if that of one of them is."""
        return NUMERIC if NUMERIC in map(ik_of, self.problems) else ANALYTIC

    def hand(self, h: int, g: int) -> int:
        """Return the hand that reaches a goal, or comes nearest to it."""
        table, row = divmod(h, self.size)
        hand = self.tables[table].scores.hand
        return 0 if hand is None else int(hand[row, g])

    def check(
        self,
        h: int,
        g: int,
        posture: Posture,
        off_grid: NDArray[np.float64] | None = None,
    ) -> Finding:
        """Return Drake's finding for configuration h and goal g, and for the goal of its pair.

        Args:
            h: The configuration, or the one whose observed state is that of one off the grid.
            g: The goal.
            posture: How it is reached.
            off_grid: Values of the axes [m or rad] in place of those of h.
        """
        hand, partner = posture.hand, self.partner[g]
        drake, goal = self.drakes[hand], self.goals[hand].index(g)
        if partner is None or posture.other is None:
            return drake.check_at(drake.values(h, off_grid), goal, posture.q, posture.value)
        other = self.hand(h, partner) if posture.other_hand is None else posture.other_hand
        drake_of_other, goal_of_other = self.drakes[other], self.goals[other].index(partner)
        drake.pose_other_arm(posture.other)
        drake_of_other.pose_other_arm(posture.q)
        at = drake_of_other.values(h, off_grid)
        return of_both(
            drake.check_at(drake.values(h, off_grid), goal, posture.q, posture.value),
            drake_of_other.check_at(at, goal_of_other, posture.other, posture.value),
            posture.value,
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
            hand, value, q = self.hand(h, g), self.dexterity(h, g), self.joints(h, g)
            findings.append(self.check(h, g, Posture(hand, value, q, other)))
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
            refined = self.tables[pair.table].refined_sets
            at = pair.set, pair.member
            hands = (
                np.zeros(refined.reached.shape, np.uint8) if refined.hand is None else refined.hand
            )
            joints, partner = refined.arm_joints[at].astype(np.float64), self.partner[pair.goal]
            posture = Posture(
                int(hands[*at, pair.goal]),
                float(refined.dexterity[*at, pair.goal]),
                joints[pair.goal],
                None if partner is None else joints[partner],
                None if partner is None else int(hands[*at, partner]),
            )
            # The origin has the observed state of the refined member.
            origin = pair.table * self.size + int(refined.origin[at])
            findings.append(self.check(origin, pair.goal, posture, refined.values[at]))
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

    def _scans(self, pairs: Pairs) -> Iterator[tuple[tuple[int, int], Posture]]:
        """Yield each pair with the best posture of its dense scans with all hands, in order."""
        scans = [
            _Scan(h, g, hand)
            for h, g in pairs
            for hand, goals in enumerate(self.goals)
            if g in goals
        ]
        # Pairs of one hand, or two, at a time, in their order.
        parts = [
            run[start : start + SLICE]
            for run in (
                list(run)
                for _, run in itertools.groupby(
                    sorted(scans, key=lambda one: one.hand),
                    lambda one: (one.hand, self._other(one)),
                )
            )
            for start in range(0, len(run), SLICE)
        ]
        pool = Parallel(n_jobs=self.jobs, prefer="threads", return_as="generator")
        best: dict[tuple[int, int], Posture] = {}
        count = Counter((one.h, one.g) for one in scans)
        waiting = iter(pairs)
        pair = next(waiting, None)
        for part, postures in zip(parts, pool(map(delayed(self._scan), parts)), strict=True):
            for one, posture in zip(part, postures, strict=True):
                at = one.h, one.g
                count[at] -= 1
                if at not in best or posture.value > best[at].value:
                    best[at] = posture
            while pair is not None and not count[pair]:
                yield pair, best[pair]
                pair = next(waiting, None)

    def _other(self, scan: _Scan) -> int | None:
        """Return the hand of the goal that is reached at the same time; None for none."""
        partner = self.partner[scan.g]
        return None if partner is None else self.hand(scan.h, partner)

    def _scan(self, part: Sequence[_Scan]) -> list[Posture]:
        """Return the best posture of the dense scans of pairs of one hand."""
        hand, other = part[0].hand, self._other(part[0])
        if other is not None:
            return self._scan_together(part, hand, other)
        rows = rows_at(self.hands.lowered[hand].grid, [one.h for one in part])
        joints = np.empty((len(part), 7))
        goals = [self.goals[hand].index(one.g) for one in part]
        pairs = np.stack([np.arange(len(part)), goals], axis=1)
        values = dense_scans(self.problems[hand], rows, pairs, DENSE_SAMPLES, joints)
        return [Posture(hand, float(v), q, None) for v, q in zip(values, joints, strict=True)]

    def _scan_together(self, part: Sequence[_Scan], first: int, second: int) -> list[Posture]:
        """Return the best pair of postures of dense scans of both arms."""
        two = self.hands.two(first, second)
        none = np.empty((0, 7))
        found = []
        for scan in part:
            partner = self.partner[scan.g]
            assert partner is not None
            best = searched(
                two,
                rows_at(self.hands.lowered[first].grid, [scan.h]),
                (self.goals[first].index(scan.g), self.goals[second].index(partner)),
                (none, none),
                finest=DENSE_SAMPLES_OF_TWO,
                most=DENSE_POSTURES_OF_TWO,
            )
            found.append(
                Posture(first, -1.0, np.zeros(7), None) if best is None else Posture(first, *best)
            )
        return found


SAMPLED = (Reason.JOINT_LIMITS, Reason.ARM_BLOCKED)
"""Strata of a random sample: body and gripper are free of contact, the goal within reach."""
STRATA = (*SAMPLED, Reason.TOO_FAR)
"""Strata of a whole scan: all pairs that only a search of the arm's postures can decide."""
OF_PAIRS = (Reason.OTHER_GOAL_UNREACHED, Reason.ARMS_BLOCKED)
"""Strata of the goals that two arms reach at the same time."""
CONFIDENCE = 0.95

Pairs = list[tuple[int, int]]
"""Configurations, numbered through all tables, and goals: (h, g)."""


@dataclass(frozen=True)
class Stratum:
    """The unreached pairs with one reason, and what a dense scan found among them."""

    reason: Reason
    """Why they are stored as unreached."""
    pairs: int
    """Number of pairs in the file."""
    scanned: int
    """Number of these that were scanned."""
    missed: int
    """Number of these that have a solution, which Drake confirms."""
    unconfirmed_hits: int
    """Number of these at which Drake refutes the solution of the scan."""
    recall: float | None
    """Estimated fraction of the reachable pairs that are stored as reached, if none were missed in
    the other strata. None if no pair was scanned, or none is known to be reachable."""

    def to_json(self) -> dict[str, Any]:
        """Return the findings as plain containers."""
        return {**asdict(self), "reason": self.reason.name.lower()}


def stratum_of(reason: Reason, reached: int, pairs: int, hits: list[bool | None]) -> Stratum:
    """Return the findings in one stratum.

    Args:
        reason: The reason of its pairs.
        reached: Number of pairs that are stored as reached.
        pairs: Number of pairs in the stratum.
        hits: For each scanned pair whether Drake confirms the solution of the scan, None where the
            scan found none.
    """
    missed = sum(hit is True for hit in hits)
    recall, _ = estimated_recall(reached, [pairs], [len(hits)], [missed])
    return Stratum(reason, pairs, len(hits), missed, sum(hit is False for hit in hits), recall)


def estimated_recall(
    reached: int, sizes: list[int], scanned: list[int], missed: list[int]
) -> tuple[float | None, tuple[float, float] | None]:
    """Return the estimated recall and its 95 % interval.

    Args:
        reached: Number of pairs that are stored as reached, R.
        sizes: Number of unreached pairs in each stratum, U.
        scanned: Number of these that were scanned, n.
        missed: Number of these that are reachable, k.

    Returns:
        R / (R + sum of U k / n), and the same at the Clopper-Pearson limits of each stratum, which
        together are conservative; a stratum that was scanned as a whole, n = U, has the limits k.
        The estimate is None if a stratum has pairs and none was scanned; both are None if no pair
        is known to be reachable.

    >>> estimated_recall(990, [1000], [100], [1])[0]
    0.99
    >>> estimated_recall(990, [1000], [1000], [10])
    (0.99, (0.99, 0.99))
    """
    # Imported here: importing this package, which drawing does too, is faster without SciPy.
    from scipy.special import betaincinv

    tail = (1.0 - CONFIDENCE) / 2.0
    expected = lowest = highest = 0.0
    is_known = True
    for size, n, k in zip(sizes, scanned, missed, strict=True):
        if n == 0:
            # Without a scan, none or all of the stratum may be reachable.
            highest += size
            is_known &= size == 0
            continue
        expected += size * k / n
        if n == size:
            lowest += k
            highest += k
            continue
        if k > 0:
            lowest += size * float(betaincinv(k, n - k + 1, tail))
        highest += size * (float(betaincinv(k + 1, n - k, 1.0 - tail)) if k < n else 1.0)
    if reached == 0:
        return (0.0, (0.0, 0.0)) if expected > 0.0 else (None, None)
    return reached / (reached + expected) if is_known else None, (
        reached / (reached + highest),
        reached / (reached + lowest),
    )


def scan_counts(reason: NDArray[np.uint8], dense: int) -> dict[Reason, int]:
    """Return the number of pairs of each stratum of `SAMPLED` to scan, in proportion.

    Args:
        reason: A `Reason` for each pair.
        dense: Number of pairs in all. Unless it is 0, a tenth of it, and at least one pair, is of
            each stratum that has so many: without any, the recall would be unknown. So two pairs
            are scanned if `dense` is 1 and neither stratum is empty.
    """
    sizes = {r: count_of(reason, r) for r in SAMPLED}
    total = sum(sizes.values())
    if total == 0 or dense == 0:
        return dict.fromkeys(SAMPLED, 0)
    first, second = SAMPLED
    tenth = max(1, dense // 10)
    least = min(tenth, sizes[first])
    count = min(max(round(dense * sizes[first] / total), least), dense)
    rest = max(min(dense - count, sizes[second]), min(tenth, sizes[second]))
    return {first: max(min(dense - rest, sizes[first]), least), second: rest}


def count_of(reason: NDArray[np.uint8], one: Reason) -> int:
    """Return the number of pairs with a reason."""
    return sum(int(np.count_nonzero(reason[rows] == one)) for rows in chunks(reason))


def random_pairs(
    rng: np.random.Generator, reason: NDArray[np.uint8], one: Reason, count: int | None
) -> Pairs:
    """Return up to `count` distinct random pairs that have a reason; all if it is None.

    Args:
        rng: Where the random numbers come from.
        reason: A `Reason` for each pair, shape (H, G).
        one: The reason.
        count: The number.
    """
    total, goals = count_of(reason, one), reason.shape[1]
    picked = np.arange(total)
    if count is not None:
        picked = rng.choice(total, size=min(count, total), replace=False)
    order = np.argsort(picked)
    flat = np.empty(picked.size, dtype=np.int64)
    before = done = 0
    for rows in chunks(reason):
        here = np.flatnonzero(reason[rows] == one)
        end = int(np.searchsorted(picked, before + here.size, sorter=order))
        of_rows = order[done:end]
        flat[of_rows] = here[picked[of_rows] - before] + rows.start * goals
        before, done = before + here.size, end
    return [(int(i // goals), int(i % goals)) for i in flat]
