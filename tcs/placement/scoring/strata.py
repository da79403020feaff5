"""Strata of the unreached pairs, which of them to scan densely, and the recall that follows."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.files.mapped import chunks
from tcs.placement.tables import Reason

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
