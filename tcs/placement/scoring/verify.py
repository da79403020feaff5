"""Re-check of stored solutions with Drake, and dense scans for solutions that the search missed."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import TcsError
from tcs.files.mapped import large_zeros
from tcs.files.memory import CODE, THREAD, check_room
from tcs.placement.scoring.drake_check import (
    DEXTERITY_BAR,
    POSITION_BAR,
    ROTATION_BAR,
    Finding,
)
from tcs.placement.scoring.file_checker import (
    OF_PAIRS,
    STRATA,
    FileChecker,
    RefinedPair,
    Stratum,
    count_of,
    estimated_recall,
    random_pairs,
    scan_counts,
    stratum_of,
)
from tcs.placement.store import ScoreFile
from tcs.placement.tables import Reason

FALSE_VERDICT = "SOME ANSWERS ARE FALSE"
"""What a check shows that refutes an answer."""


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
    refined_checked: int
    """Number of these that are of refined sets: all of them are re-checked."""
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
    """Interval of the recall: the sum of exact binomial limits of each stratum; of no width where
    every stratum was scanned as a whole."""
    strata: tuple[Stratum, ...]
    """The findings by stratum of the unreached pairs."""
    scan_seconds: float = field(compare=False)
    """Time of the dense scan of the unreached pairs [s]."""
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
            return FALSE_VERDICT
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
        return "not defined: no pair is stored as reached, and none was found reachable"

    def to_json(self) -> dict[str, Any]:
        """Return the findings as plain containers."""
        interval = None if self.recall_ci95 is None else list(self.recall_ci95)
        return {
            **asdict(self),
            "recall_ci95": interval,
            "strata": [stratum.to_json() for stratum in self.strata],
            "recall_note": self.recall_note,
            "verdict": self.verdict,
        }


def verify(
    file: ScoreFile,
    *,
    pairs: int = 500,
    dense: int = 200,
    strata: bool = False,
    limit: int | None = None,
    jobs: int = 2,
    seed: int = 0,
    on_progress: Callable[[int, int], None] | None = None,
) -> Verification:
    """Check a score file against Drake and against a dense scan.

    Random reached pairs are re-checked with Drake: forward kinematics at the goal, joint limits,
    contacts, and dexterity by the file's measure; so is every solution of the refined sets. Random
    unreached pairs, stratified over those whose body and gripper are free of contact and whose goal
    is within reach, are scanned densely; so are random reached pairs, for dexterity that the search
    missed. A dense scan tries 11,520 values of the free joint or, for an arm without a closed form,
    400 starts over its joint limits. Drake must confirm each solution that the scan finds at an
    unreached pair.

    Args:
        file: A score file.
        pairs: Number of reached pairs to re-check.
        dense: Number of unreached, and of reached, pairs to scan densely; at least one pair of each
            stratum unless it is 0.
        strata: Whether to scan every unreached pair of each stratum in place of `dense` random
            ones, and the stratum of the goals out of reach as well.
        limit: With `strata`, the greatest number of random pairs to scan in each stratum.
        jobs: Number of threads of the dense scan; the findings do not depend on it.
        seed: Seed of the random samples.
        on_progress: Called with the number of checked pairs and their total.

    Raises:
        StoreMismatchError: If the models differ from those the file was made from.
        TcsError: If a number is negative, `jobs` is not positive, or there is a limit without
            `strata`.
        MemoryError: If the address space is limited, and too little is left.
    """
    if pairs < 0 or dense < 0:
        raise TcsError(f"verify: pairs is {pairs}, dense is {dense}; neither may be negative.")
    if jobs < 1:
        raise TcsError(f"verify: jobs is {jobs}; it must be at least 1.")
    if limit is not None and (limit < 1 or not strata):
        raise TcsError(f"verify: limit is {limit}; it must be at least 1, and needs strata=True.")
    measure = file.metadata["measure"]
    checker = FileChecker.of(file, jobs)
    rng = np.random.default_rng(seed)
    reason = _reasons(file)
    reached = random_pairs(rng, reason, Reason.REACHED, pairs)
    counts = dict.fromkeys(STRATA, limit) if strata else scan_counts(reason, dense)
    if any(partner is not None for partner in checker.partner):
        counts |= dict.fromkeys(OF_PAIRS, limit if strata else dense)
    unreached = {r: random_pairs(rng, reason, r, count) for r, count in counts.items()}
    again = random_pairs(rng, reason, Reason.REACHED, dense)
    of_refined = checker.refined_pairs()
    total = len(reached) + len(of_refined) + sum(map(len, unreached.values())) + len(again)
    count = itertools.count(1)

    def step() -> None:
        if on_progress is not None:
            on_progress(next(count), total)

    findings = checker.stored(reached, step) + checker.refined(of_refined, step)
    # The threads load the machine code of the scans.
    check_room(CODE + jobs * THREAD)
    begun = time.perf_counter()
    hits = {r: checker.hits(part, step) for r, part in unreached.items()}
    scan_seconds = time.perf_counter() - begun
    shortfall = checker.shortfall(again, step)
    stored = count_of(reason, Reason.REACHED)
    found = tuple(stratum_of(r, stored, count_of(reason, r), part) for r, part in hits.items())
    recall, interval = estimated_recall(
        stored, [s.pairs for s in found], [s.scanned for s in found], [s.missed for s in found]
    )
    return Verification(
        measure=measure,
        ik=checker.ik,
        checked=len(findings),
        refined_checked=len(of_refined),
        false_reached=sum(not finding.is_true for finding in findings),
        max_position_error=max((finding.position_error for finding in findings), default=None),
        max_rotation_error=max((finding.rotation_error for finding in findings), default=None),
        max_isotropy_error=max((finding.dexterity_error for finding in findings), default=None),
        limit_violations=sum(finding.limit_violations for finding in findings),
        dense_checked=sum(s.scanned for s in found),
        missed=sum(s.missed for s in found),
        unconfirmed_hits=sum(s.unconfirmed_hits for s in found),
        recall=recall,
        recall_ci95=interval,
        strata=found,
        scan_seconds=scan_seconds,
        shortfall_checked=len(shortfall),
        mean_shortfall=float(np.mean(shortfall)) if shortfall else None,
    )


def _reasons(file: ScoreFile) -> NDArray[np.uint8]:
    """Return the reasons of all tables, those of the first one first."""
    tables = [table.scores.reason for table in file.tables]
    if len(tables) == 1:
        return tables[0]
    rows = sum(map(len, tables))
    joined: NDArray[np.uint8] = large_zeros((rows, tables[0].shape[1]), np.uint8)
    return np.concatenate(tables, out=joined)


def check_pairs(file: ScoreFile, table: int, pairs: Sequence[tuple[int, int]]) -> list[Finding]:
    """Return Drake's findings on the stored solutions of certain reached pairs.

    Args:
        file: A score file.
        table: Number of the observed state.
        pairs: Configurations of its tables, each with a goal that it reaches.

    Raises:
        StoreMismatchError: If the models differ from those the file was made from.
    """
    checker = FileChecker.of(file, jobs=1)
    return checker.stored([(table * checker.size + h, g) for h, g in pairs], lambda: None)


def check_refined(
    file: ScoreFile, table: int, row: int, pairs: Sequence[tuple[int, int]]
) -> list[Finding]:
    """Return Drake's findings on the stored solutions of a refined set.

    Args:
        file: A score file with refined sets.
        table: Number of the observed state.
        row: Number of the set.
        pairs: Numbers of its members, each with a goal that it reaches.

    Raises:
        StoreMismatchError: If the models differ from those the file was made from.
    """
    checker = FileChecker.of(file, jobs=1)
    return checker.refined([RefinedPair(table, row, i, g) for i, g in pairs], lambda: None)
