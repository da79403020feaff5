"""Re-check of stored solutions with Drake, and dense scans for solutions that the search missed."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import TcsError
from tcs.kernel.problem import Problem, build_problem
from tcs.kernel.verification.dense import DENSE_SAMPLES, dense_scan
from tcs.kernel.verification.reference import measured
from tcs.model.scene import Scene, goal_poses
from tcs.placement.scoring.job import Job
from tcs.placement.scoring.rebuild import rebuild_scene
from tcs.placement.scoring.sweep import ik_of
from tcs.placement.store import ScoreFile, StateTables
from tcs.placement.tables import Reason

POSITION_BAR = 1e-6
"""Greatest distance [m] of the tool from its goal. Joints are stored as float32: rounding moves
the tool by up to 1.2e-7 rad x 1 m for each of seven joints, 4e-7 m in practice."""
ROTATION_BAR = 2e-6
"""Greatest rotation [rad] of the tool from its goal: seven roundings of 1.2e-7 rad add up to
8.4e-7, and the angle of a rotation matrix near the identity loses as much again."""
DEXTERITY_BAR = 1e-6
"""Greatest difference of a stored dexterity from that of Drake's Jacobian. Float32 keeps 6e-8; a
least singular value from the eigenvalues of J J^T is good to 1e-7 next to a singularity."""
CLEARANCE_ROUNDING = 2e-6
"""Tolerance of a clearance measured by Drake [m]: rounding of the joints
moves a far corner of a link by 1e-6 m, and Drake's distance between boxes is accurate to 1e-6 m."""
UNREACHED = (Reason.JOINT_LIMITS, Reason.ARM_BLOCKED)
"""Strata of the dense scan: body and gripper are free of contact, the goal within reach."""
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Verification:
    """Result of re-checking a score file; None for values that no check gave."""

    measure: str
    """Name of the file's dexterity measure."""
    ik: str
    """Inverse kinematics of the arm, "analytic" or "numeric". A dense scan tries 11,520 values of
    the free joint, or 400 starts of the numeric solver."""
    checked: int
    """Number of reached pairs re-checked with Drake."""
    false_reached: int
    """Number of these that miss the goal, exceed a joint limit or are in contact."""
    max_position_error: float | None
    """Greatest distance of the tool from its goal [m]."""
    max_rotation_error: float | None
    """Greatest rotation of the tool from its goal [rad]."""
    max_isotropy_error: float | None
    """Greatest difference of the stored dexterity, by whichever measure, from that of Drake's
    Jacobian."""
    limit_violations: int
    """Number of joints beyond their limits."""
    dense_checked: int
    """Number of unreached pairs scanned densely."""
    missed: int
    """Number of these with a solution that Drake confirms."""
    unconfirmed_hits: int
    """Number of solutions of the dense scan that Drake refutes."""
    recall: float | None
    """Estimated fraction of the reachable pairs that are stored as reached."""
    recall_ci95: tuple[float, float] | None
    """Interval of the recall: the sum of exact binomial limits of each stratum."""
    shortfall_checked: int
    """Number of reached pairs scanned densely."""
    mean_shortfall: float | None
    """Mean of how much more dexterity the dense scan finds at these."""

    @property
    def is_sound(self) -> bool:
        """Whether no checked answer is false; true also if there was none to check."""
        errors = (
            (self.max_position_error, POSITION_BAR),
            (self.max_rotation_error, ROTATION_BAR),
            (self.max_isotropy_error, DEXTERITY_BAR),
        )
        return (
            self.false_reached == 0
            and self.limit_violations == 0
            and self.unconfirmed_hits == 0
            and all(error is None or error <= bar for error, bar in errors)
        )

    @property
    def verdict(self) -> str:
        """What the checks show, as a clause."""
        if not self.is_sound:
            return "SOME ANSWERS ARE FALSE"
        if self.checked:
            return "every answer holds"
        if self.dense_checked:
            return f"no reached pair was checked; {self.missed} of the scanned pairs are reachable"
        return "nothing was checked"

    @property
    def recall_note(self) -> str | None:
        """Why the recall is not estimated, None if it is."""
        if self.recall is not None:
            return None
        if not self.dense_checked:
            return "not estimated: no unreached pair was scanned"
        if self.recall_ci95 is None:
            return "not defined: no pair is stored as reached, and none was found reachable"
        return "not estimated: too few unreached pairs were scanned"

    def to_json(self) -> dict[str, Any]:
        """Return the findings as plain containers."""
        interval = None if self.recall_ci95 is None else list(self.recall_ci95)
        return {
            **asdict(self),
            "recall_ci95": interval,
            "recall_note": self.recall_note,
            "verdict": self.verdict,
        }


def verify(
    file: ScoreFile,
    *,
    pairs: int = 500,
    dense: int = 200,
    seed: int = 0,
    on_progress: Callable[[int, int], None] | None = None,
) -> Verification:
    """Check a score file against Drake and against a dense scan.

    Random reached pairs are re-checked with Drake: forward kinematics at the goal, joint limits,
    contacts, and dexterity by the file's measure. Random unreached pairs, stratified over those
    whose body and gripper are free of contact and whose goal is within reach, are scanned densely;
    so are random reached pairs, for dexterity that the search missed. A dense scan tries 11,520
    values of the free joint or, for an arm without a closed form, 400 starts over its joint limits.
    Drake must confirm each solution that the scan finds at an unreached pair.

    Args:
        file: A score file.
        pairs: Number of reached pairs to re-check.
        dense: Number of unreached, and of reached, pairs to scan densely.
        seed: Seed of the random samples.
        on_progress: Called with the number of checked pairs and their total.

    Raises:
        StoreMismatchError: If the models differ from those the file was made from.
        TcsError: If a number is negative.
    """
    if pairs < 0 or dense < 0:
        raise TcsError(f"verify: pairs is {pairs}, dense is {dense}; neither may be negative.")
    job, scene, lowered = rebuild_scene(file)
    rng = np.random.default_rng(seed)
    reason = np.concatenate([table.scores.reason for table in file.tables])
    reached = _sample(rng, reason == Reason.REACHED, pairs)
    unreached = [_sample(rng, reason == r, n) for r, n in _scan_counts(reason, dense).items()]
    again = _sample(rng, reason == Reason.REACHED, dense)
    total = len(reached) + sum(map(len, unreached)) + len(again)
    count = itertools.count(1)

    def step() -> None:
        if on_progress is not None:
            on_progress(next(count), total)

    measure = file.metadata["measure"]
    problem = build_problem(lowered.arrays, lowered.grid, measure)
    checker = _FileChecker(file.tables, job.grid.size, problem, _DrakeChecker(job, scene, measure))
    findings = checker.stored(reached, step)
    hits = [checker.hits(part, step) for part in unreached]
    shortfall = checker.shortfall(again, step)
    scanned, missed = [len(part) for part in unreached], [sum(part) for part in hits]
    sizes = [int(np.count_nonzero(reason == r)) for r in UNREACHED]
    recall, interval = estimated_recall(
        int(np.count_nonzero(reason == Reason.REACHED)), sizes, scanned, missed
    )
    return Verification(
        measure=measure,
        ik=ik_of(problem),
        checked=len(findings),
        false_reached=sum(not finding.is_true for finding in findings),
        max_position_error=max((finding.position_error for finding in findings), default=None),
        max_rotation_error=max((finding.rotation_error for finding in findings), default=None),
        max_isotropy_error=max((finding.dexterity_error for finding in findings), default=None),
        limit_violations=sum(finding.limit_violations for finding in findings),
        dense_checked=sum(scanned),
        missed=sum(missed),
        unconfirmed_hits=sum(not confirmed for part in hits for confirmed in part),
        recall=recall,
        recall_ci95=interval,
        shortfall_checked=len(shortfall),
        mean_shortfall=float(np.mean(shortfall)) if shortfall else None,
    )


def check_pairs(file: ScoreFile, table: int, pairs: Sequence[tuple[int, int]]) -> list[Finding]:
    """Return Drake's findings on the stored solutions of certain reached pairs.

    Args:
        file: A score file.
        table: Number of the observed state.
        pairs: Configurations of its tables, each with a goal that it reaches.

    Raises:
        StoreMismatchError: If the models differ from those the file was made from.
    """
    job, scene, lowered = rebuild_scene(file)
    measure = file.metadata["measure"]
    problem = build_problem(lowered.arrays, lowered.grid, measure)
    checker = _FileChecker(file.tables, job.grid.size, problem, _DrakeChecker(job, scene, measure))
    return checker.stored([(table * job.grid.size + h, g) for h, g in pairs], lambda: None)


Pairs = list[tuple[int, int]]
"""Configurations, numbered through all tables, and goals: (h, g)."""


@dataclass(frozen=True)
class _FileChecker:
    """The three types of checks on the scores of a file."""

    tables: tuple[StateTables, ...]
    size: int
    """Number of configurations per table."""
    problem: Problem
    drake: _DrakeChecker

    def dexterity(self, h: int, g: int) -> float:
        """Return the stored dexterity."""
        table, row = divmod(h, self.size)
        return float(self.tables[table].scores.dexterity[row, g])

    def stored(self, pairs: Pairs, step: Callable[[], None]) -> list[Finding]:
        """Return Drake's findings on the stored solutions of reached pairs."""
        findings = []
        for h, g in pairs:
            table, row = divmod(h, self.size)
            q = np.asarray(self.tables[table].scores.joints_of(row, g), dtype=np.float64)
            findings.append(self.drake.check(h, g, q, self.dexterity(h, g)))
            step()
        return findings

    def hits(self, pairs: Pairs, step: Callable[[], None]) -> list[bool]:
        """Return whether Drake confirms each solution of a dense scan at unreached pairs."""
        found, q = [], np.empty(7)
        for h, g in pairs:
            value = dense_scan(self.problem, h, g, DENSE_SAMPLES, q)
            if value >= 0.0:
                found.append(self.drake.check(h, g, q, value).is_true)
            step()
        return found

    def shortfall(self, pairs: Pairs, step: Callable[[], None]) -> list[float]:
        """Return how much greater the dexterity of the dense scan is at reached pairs."""
        short, q = [], np.empty(7)
        for h, g in pairs:
            value = dense_scan(self.problem, h, g, DENSE_SAMPLES, q)
            short.append(max(0.0, value - self.dexterity(h, g)))
            step()
        return short


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
        together are conservative. The estimate is None if a stratum has pairs and none was
        scanned; both are None if no pair is known to be reachable.

    >>> estimated_recall(990, [1000], [100], [1])[0]
    0.99
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
        if k > 0:
            lowest += size * float(betaincinv(k, n - k + 1, tail))
        highest += size * (float(betaincinv(k + 1, n - k, 1.0 - tail)) if k < n else 1.0)
    if reached == 0:
        return (0.0, (0.0, 0.0)) if expected > 0.0 else (None, None)
    return reached / (reached + expected) if is_known else None, (
        reached / (reached + highest),
        reached / (reached + lowest),
    )


def _scan_counts(reason: NDArray[np.uint8], dense: int) -> dict[Reason, int]:
    """Return the number of pairs of each stratum to scan, in proportion and not 0."""
    sizes = {r: int(np.count_nonzero(reason == r)) for r in UNREACHED}
    total = sum(sizes.values())
    if total == 0 or dense == 0:
        return dict.fromkeys(UNREACHED, 0)
    first, second = UNREACHED
    least = min(dense // 2, sizes[first], max(1, dense // 10)) if sizes[first] else 0
    count = min(max(round(dense * sizes[first] / total), least), dense)
    rest = min(dense - count, sizes[second])
    if sizes[second]:
        rest = max(rest, min(max(1, dense // 10), sizes[second]))
    return {first: min(dense - rest, sizes[first]), second: rest}


def _sample(rng: np.random.Generator, chosen: NDArray[np.bool_], count: int) -> Pairs:
    """Return up to `count` distinct random (h, g) at which `chosen` is true."""
    flat = np.flatnonzero(chosen)
    picked = rng.choice(flat, size=min(count, len(flat)), replace=False)
    goals = chosen.shape[1]
    return [(int(i // goals), int(i % goals)) for i in picked]


@dataclass(frozen=True)
class Finding:
    """Drake's finding on one solution."""

    position_error: float
    """Distance of the tool from its goal [m]."""
    rotation_error: float
    """Rotation of the tool from its goal [rad]."""
    dexterity_error: float
    """Absolute difference of the stored dexterity from that of Drake's Jacobian."""
    limit_violations: int
    """Number of joints beyond their limits."""
    contacts: int
    """Number of pairs of bodies closer than required."""

    @property
    def is_true(self) -> bool:
        """Whether the solution is at its goal, within its limits and free of contact."""
        return (
            self.position_error <= POSITION_BAR
            and self.rotation_error <= ROTATION_BAR
            and self.limit_violations == 0
            and self.contacts == 0
        )


class _DrakeChecker:
    """Checks solutions of one job with Drake."""

    def __init__(self, job: Job, scene: Scene, measure: str) -> None:
        self._job, self._scene, self._measure = job, scene, measure
        self._lower, self._upper = scene.arm_limits
        self._grid = job.scored_grid
        self._axes = [axis.name for axis in self._grid.environment_axes]

    def check(self, h: int, g: int, q: NDArray[np.float64], value: float) -> Finding:
        """Return the finding for configuration h, goal g and joint angles q."""
        scene = self._scene
        at = self._grid.values(np.array([h]))
        scene.place_base(*(float(at[name][0]) for name in ("base_x", "base_y", "base_yaw")))
        scene.set_torso(float(at["torso"][0]))
        for name in self._axes:
            scene.set_joint(name, float(at[name][0]))
        scene.set_arm(q)
        X_WT, X_WG = scene.tool_pose(), goal_poses(scene, self._job.task)[g]
        X_TG = X_WT.inverse() @ X_WG
        rotation = X_TG.rotation().ToAngleAxis().angle()
        contacts = [
            distance
            for first, second, distance in scene.violations()
            if distance < scene.required_clearance(first, second) - CLEARANCE_ROUNDING
        ]
        exact = measured(scene.tool_jacobian(), q, self._lower, self._upper, self._measure)
        return Finding(
            position_error=float(np.linalg.norm(X_TG.translation())),
            rotation_error=float(rotation),
            dexterity_error=abs(exact - float(value)),
            limit_violations=int(np.sum((q < self._lower) | (q > self._upper))),
            contacts=len(contacts),
        )
