"""Find the surest pair of the whole grid exactly: under all checks, and under the gripper's alone.

Usage: python benchmarks/surest_exact.py [--rows TASK/ENVIRONMENT ...] [--checks NAME ...]
           [--samples 5000] [--judged 20000]

Which two configurations of the grid lose the fewest goals in samples that are the same for all? A
problem of maximum coverage, solved without leaving any pair out: a configuration's goals in all
samples are bits, samples in which much is lost come first, and a pair is dropped once it has lost
more goals in some of the samples than a known pair loses in all of them. The pair that remains is
the surest of the grid in these samples; its success there flatters it: it is judged in others, too.

The configurations are those whose body stands free without errors and, but for the check `gripper`,
that reach a goal then. The checks in the samples:

- `gripper`: only the gripper's, with the environment and the robot's body: what no posture of the
  arm can exceed. Reach and joint limits count; contacts of body and arm do not.
- `original`: those of gripper and arm, as in hrl_base_selection in gt-ros-pkg/hrl-assistive (BSD),
  state of 30 April 2015.
- `tcs`: as `tcs evaluate`: those of gripper, arm and body, but for base and furniture.
"""

from __future__ import annotations

import argparse
import dataclasses
import itertools
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from optimum import label, on_grid
from surest_search import FIRST_SAMPLE, ROWS, points_of
from table import header, parser, record, row, save

import tcs
from tcs.kernel.arrays import BoolArray, FloatArray, IntArray
from tcs.placement.robustness import PerturbedPoints, Trials
from tcs.placement.tables import Reason
from tcs_studies.output.report.robustness.paper import load_paper

COLUMNS = (
    *("task, environment: checks", "paper, Table I (standard deviation)"),
    *("configurations", "surest pair, same samples (standard error)", "goals lost, of"),
    *("in other samples (standard error)", "samples with all goals", "by the checks of `tcs`"),
    *("base x, y [m], heading [deg], torso [m] of both", "samples"),
)
CHECKS = {
    "gripper": "the gripper's alone",
    "original": "gripper and arm, as the original program",
    "tcs": "as `tcs`",
}
GRIPPER = 7
"""Frame of the shapes that belong to the gripper."""
STREAM = "surest exact"
"""Name of the random stream of the samples in which pairs are compared."""
FIRST_END = 32
"""Samples after the first stage; each of the others doubles them."""
GUESSES, PARTNERS = 300, 3
"""Best singles whose best partners are the first pairs, and partners of each contender that are
remembered."""
SCREENED, SCREENING, TRIED = 100, 256, 6
"""Pairs that are evaluated in some more samples after a stage, the number of these samples, and
pairs that are evaluated in all of them."""
CHUNK = 2000
"""Configurations evaluated at a time: some ten megabytes."""


class Contenders(NamedTuple):
    """Configurations that may belong to the surest pair."""

    flat: IntArray
    """Flat indices in the grid, shape (n,)."""
    xy: FloatArray
    """Base positions [m], shape (n, 2)."""
    bits: NDArray[np.uint64]
    """Goals reached in the samples so far, a bit each, shape (n, words)."""

    def rows(self, which: IntArray | BoolArray) -> Contenders:
        """Return some of them."""
        return Contenders(*(part[which] for part in self))


class Pairs(NamedTuple):
    """Pairs of contenders, the fewest losses first."""

    first: IntArray
    second: IntArray
    lost: IntArray
    """Goals lost in the samples so far."""


class Known(NamedTuple):
    """A pair that was evaluated in all samples."""

    lost: int
    """Goals lost in them."""
    members: IntArray
    """Flat indices in the grid, shape (2,)."""


@dataclasses.dataclass(frozen=True)
class Row:
    """A task and an environment under some checks."""

    file: tcs.ScoreFile
    checks: str
    samples: PerturbedPoints

    @classmethod
    def of(cls, file: tcs.ScoreFile, checks: str, count: int, seed: int, stream: str = "") -> Row:
        """Return a row with samples."""
        trials = Trials.of(file, body_collisions="paper" if checks == "tcs" else "none")
        if checks == "gripper":
            trials = without_arm(trials)
        drawn = trials.errors.draw(count, seed, stream=stream)
        return cls(file, checks, PerturbedPoints(trials, drawn, 1))

    @property
    def goals(self) -> int:
        """Number of goals, whose weights are equal."""
        weights = self.samples.trials.weights
        assert np.allclose(weights, weights[0]), "goals are counted: their weights must be equal"
        return int(weights.size)

    def contenders(self) -> Contenders:
        """Return all configurations, without samples."""
        reason = self.file.nominal.scores.reason
        free = ~np.any(reason == Reason.BODY_BLOCKED, axis=1)
        if self.checks != "gripper":
            free &= np.any(reason == Reason.REACHED, axis=1)
        flat = np.flatnonzero(free)
        xy = on_grid(self.file, flat)[:, -4:-2]
        return Contenders(flat, xy, np.zeros((flat.size, 0), np.uint64))

    def reached(self, flat: IntArray, which: IntArray) -> Iterator[BoolArray]:
        """Yield the goals of configurations in some samples, shapes (n, samples, goals)."""
        some = self.samples.only(which)
        for start in range(0, len(flat), CHUNK):
            yield some.reached(points_of(on_grid(self.file, flat[start : start + CHUNK])))


def main() -> None:
    """Search the rows and print a table."""
    command_line = parser(__doc__)
    command_line.add_argument("--rows", nargs="*", default=ROWS, metavar="TASK/ENVIRONMENT")
    command_line.add_argument("--checks", nargs="*", default=[*CHECKS], choices=[*CHECKS])
    command_line.add_argument("--samples", type=int, default=5000)
    command_line.add_argument("--judged", type=int, default=20_000)
    options = command_line.parse_args()
    header()
    rows = []
    print(" | ".join(COLUMNS))
    for name in options.rows:
        file = tcs.score(*name.split("/"), "pr2", jobs=1, paper=True)
        for checks in options.checks:
            rows.append(measured(name, file, checks, options))
            print(" | ".join(rows[-1]), flush=True)
            record("rows", COLUMNS, rows)
            save(options, keep=True)
    row("rows", str(len(rows)))


def measured(name: str, file: tcs.ScoreFile, checks: str, options: argparse.Namespace) -> list[str]:
    """Return the row of the table for a task and an environment under some checks."""
    here = Row.of(file, checks, options.samples, 0, STREAM)
    members = surest_pair(here)
    found = success_of(here, members)
    other = success_of(Row.of(file, checks, options.judged, FIRST_SAMPLE), members)
    by_tcs = success_of(Row.of(file, "tcs", options.judged, FIRST_SAMPLE), members)
    lost = round((1.0 - float(found.mean())) * found.size * here.goals)
    published = load_paper().published(*name.split("/"))
    assert published is not None
    return [
        f"{label(name)}: {CHECKS[checks]}",
        f"{published.mean:.1f} ({published.std:.1f})",
        f"{here.contenders().flat.size:,}",
        *(text(found), f"{lost} of {found.size * here.goals:,}", text(other)),
        f"{100.0 * float((other > 1.0 - 1e-9).mean()):.2f} %",
        text(by_tcs),
        "; ".join(placed(values) for values in on_grid(file, members)[:, -4:]),
        f"{found.size:,} and {other.size:,}",
    ]


def text(found: FloatArray) -> str:
    """Return the mean of P_R over samples and its standard error, in percent."""
    return f"{100.0 * found.mean():.3f} ({100.0 * found.std() / np.sqrt(found.size):.3f})"


def placed(values: FloatArray) -> str:
    """Return a robot's configuration in words."""
    x, y, yaw, torso = values.tolist()
    return f"{x:.2f}, {y:.2f}, {np.rad2deg(yaw):.0f}, {torso:.2f}"


def success_of(here: Row, members: IntArray) -> FloatArray:
    """Return P_R of a pair in each sample, shape (samples,)."""
    every = np.arange(here.samples.samples)
    reached = np.concatenate([*here.reached(members, every)])
    return np.logical_or.reduce(reached) @ here.samples.trials.weights


def without_arm(trials: Trials) -> Trials:
    """Return trials of a robot whose arm touches nothing but with its gripper."""
    arm = trials.hands[0]
    arrays = arm.lowered.arrays
    of_gripper = (arrays.arm.frame == GRIPPER)[:, None]
    none = arrays._replace(
        arm_vs_arm=np.zeros_like(arrays.arm_vs_arm),
        arm_vs_body=arrays.arm_vs_body & of_gripper,
        arm_vs_environment=arrays.arm_vs_environment & of_gripper,
    )
    lowered = dataclasses.replace(arm.lowered, arrays=none)
    return dataclasses.replace(trials, hands=(dataclasses.replace(arm, lowered=lowered),))


def surest_pair(here: Row) -> IntArray:
    """Return the members of the pair of the grid that loses the fewest goals in all samples."""
    order, apart = here.samples.order, here.file.nominal.sets.min_distance
    of = here.contenders()
    known = Known(order.size * here.goals, np.zeros(2, np.int64))
    for start, end in itertools.pairwise([0, *ends_of(order.size)]):
        found = [packed(part) for part in here.reached(of.flat, order[start:end])]
        of = of._replace(bits=np.concatenate([of.bits, np.concatenate(found)], axis=1))
        total = end * here.goals
        if start == 0:
            known, _ = tried(here, of, first_guesses(of, total, apart), order[end:], known)
        _, pairs = within(of, total, known.lost, apart)
        known, lost = tried(here, of, pairs, order[end:], known)
        # Where the best pairs lose goals, others lose more of them, and are dropped the sooner.
        order = np.concatenate([order[:end], order[end:][np.argsort(-lost, kind="stable")]])
        kept, _ = within(of, total, known.lost, apart)
        print(f"{end} samples: {known.lost} lost, of {len(kept)} remain {kept.sum()}", flush=True)
        of = of.rows(kept)
    return known.members


def tried(
    here: Row, of: Contenders, pairs: Pairs, further: IntArray, known: Known
) -> tuple[Known, IntArray]:
    """Return the pair that loses the fewest goals in all samples: a known one or one of the first.

    Args:
        here: The row.
        of: The contenders.
        pairs: Pairs of contenders.
        further: Samples in which their losses have not been counted.
        known: The pair that is known.

    Returns:
        The pair, and how many goals the best of the first lose in each of the further samples.
    """
    few = np.stack([pairs.first, pairs.second], axis=1)[:SCREENED]
    lost, in_each = pairs.lost[:SCREENED], np.empty((min(SCREENED, len(pairs.lost)), 0), np.int64)
    for part in (further[:SCREENING], further[SCREENING:]):
        if part.size:
            members, where = np.unique(few, return_inverse=True)
            reached = np.concatenate([*here.reached(of.flat[members], part)])
            either = reached[where.reshape(few.shape)].any(axis=1)
            in_each = np.concatenate([in_each, np.count_nonzero(~either, axis=2)], axis=1)
        total = lost + in_each.sum(axis=1)
        fewest = np.argsort(total, kind="stable")[:TRIED]
        few, lost, in_each = few[fewest], lost[fewest], in_each[fewest]
    least = int(lost[0] + in_each[0].sum())
    best = known if least > known.lost else Known(least, of.flat[few[0]])
    return best, in_each.sum(axis=0)


def ends_of(samples: int) -> list[int]:
    """Return the samples after each stage.

    >>> ends_of(100)
    [32, 64, 100]
    """
    ends = [FIRST_END]
    while 2 * ends[-1] < samples:
        ends.append(2 * ends[-1])
    return [*(end for end in ends if end < samples), samples]


def packed(reached: BoolArray) -> NDArray[np.uint64]:
    """Return goals in samples as bits, those of the last word that are left over 0."""
    flat = reached.reshape(len(reached), -1)
    filled = np.pad(flat, ((0, 0), (0, -flat.shape[1] % 64)))
    return np.packbits(filled, axis=1).view(np.uint64)


def counted(bits: NDArray[np.uint64]) -> IntArray:
    """Return the number of bits that are set in each row."""
    return np.bitwise_count(bits).sum(axis=1, dtype=np.int64)


def first_guesses(of: Contenders, total: int, apart: float) -> Pairs:
    """Return the best partner of each of the best singles, the fewest losses first."""
    found = []
    for i in np.argsort(-counted(of.bits), kind="stable")[:GUESSES]:
        lost = total - counted(of.bits[i] | of.bits)
        lost[~_far(of.xy[i], of.xy, apart)] = total + 1
        found.append((i, int(np.argmin(lost)), int(lost.min())))
    first, second, lost = np.array(sorted(found, key=lambda pair: pair[2])).T
    return Pairs(first, second, lost)


def within(of: Contenders, total: int, most: int, apart: float) -> tuple[BoolArray, Pairs]:
    """Return which contenders belong to a pair that loses no more goals than that, and some pairs.

    Args:
        of: The contenders.
        total: Number of goals in the samples so far.
        most: Greatest number of goals lost in them.
        apart: Least base distance of two members [m].
    """
    reached = counted(of.bits)
    order = np.argsort(-reached, kind="stable")
    bits, xy, most_first = of.bits[order], of.xy[order], -reached[order]
    kept, best = np.zeros(len(order), dtype=np.bool_), [np.empty((0, 3), np.int64)]
    for i in range(len(order)):
        # Both together reach no more than the sum of what each reaches.
        stop = int(np.searchsorted(most_first, most - most_first[i] - total, side="right"))
        if stop <= i:
            break
        lost = total - counted(bits[i] | bits[i:stop])
        allowed = (lost <= most) & _far(xy[i], xy[i:stop], apart)
        # Alone it may do, too.
        allowed[0] = lost[0] <= most
        others = np.flatnonzero(allowed)
        if others.size:
            kept[i] = True
            kept[i + others] = True
            few = others[np.argsort(lost[others], kind="stable")[:PARTNERS]]
            best.append(np.stack([np.full(few.size, i), i + few, lost[few]], axis=1))
    pairs = np.concatenate(best)
    pairs = pairs[np.argsort(pairs[:, 2], kind="stable")]
    of_order = np.zeros(len(order), dtype=np.bool_)
    of_order[order[kept]] = True
    return of_order, Pairs(order[pairs[:, 0]], order[pairs[:, 1]], pairs[:, 2])


def _far(at: FloatArray, others: FloatArray, apart: float) -> BoolArray:
    """Return which base positions are far enough from another for a set of two, shape (n,)."""
    return np.asarray(np.hypot(*(others - at).T) >= apart - 1e-9)


if __name__ == "__main__":
    main()
