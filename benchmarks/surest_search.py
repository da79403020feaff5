"""Search the surest pairs of a row anew, from random configurations off the grid.

Usage: python benchmarks/surest_search.py [--rows TASK/ENVIRONMENT ...] [--drawn 120000]
           [--samples 20000] [--seed 5]

A check of `tcs refine --objective success`, whose starts are pairs of the grid: where its set stays
below the paper's print, is there a surer one elsewhere? Configurations are drawn anywhere between
the ends of the axes. All pairs of those that reach two goals or more are compared in the samples of
the refinement, and the local search goes on from the best pairs that differ. The surest of the sets
found, chosen in other samples, and that of the refinement are judged in further samples, which
neither has seen, with the standard error of the mean.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from optimum import SUREST, first_set, label
from table import header, parser, record, row, save

import tcs
from tcs.kernel.arrays import FloatArray
from tcs.model.random_streams import named_generator
from tcs.placement.refinement.local_search import Space, Walk
from tcs.placement.refinement.points import PointScorer
from tcs.placement.refinement.success_under_error import RememberedSamples, at_surest
from tcs.placement.refinement.surest import StagedSamples, SurestSearch, best_pairs
from tcs.placement.robustness import PerturbedPoints, Trials
from tcs_studies.output.report.robustness.paper import load_paper

COLUMNS = (
    *("task, environment", "paper, Table I", "refined (standard error)"),
    *("from random configurations", "configurations compared", "samples"),
)
ROWS = ("brushing/wheelchair", "shaving/wheelchair")
"""Rows of Table I in which the refined set stays below the paper."""
LEAST_GOALS = 2
"""Goals that a drawn configuration must reach to be compared."""
PAIRS = (20_000, 3000, 400, 60)
"""Pairs that remain after each stage of the samples."""
STARTS = 5
"""Pairs that the local search goes on from."""
APART = 0.15
"""Difference in an axis [m or rad] at which pairs count as different."""
LEVELS = 7
"""Values of the axes of the environment and of the torso."""
ROUNDS = 20
SAMPLES = 2000
"""Samples of the search, and of the choice among what it finds."""
FIRST_SAMPLE = 100_000
"""Seed of the samples of the judge, apart from those of the refinement."""


class FromRandom(NamedTuple):
    """What the search from random configurations found."""

    values: FloatArray
    """Values of the members of the surest set, shape (members, axes)."""
    compared: int
    """Number of configurations whose pairs were compared."""


def main() -> None:
    """Search the rows and print a table."""
    command_line = parser(__doc__)
    command_line.add_argument("--rows", nargs="*", default=ROWS, metavar="TASK/ENVIRONMENT")
    command_line.add_argument("--drawn", type=int, default=120_000)
    command_line.add_argument("--samples", type=int, default=20_000)
    command_line.add_argument("--seed", type=int, default=5)
    options = command_line.parse_args()
    header()
    rows = []
    for name in options.rows:
        task, environment = name.split("/")
        file = tcs.score(task, environment, "pr2", jobs=1, paper=True)
        robust = tcs.robustify(file, sets=400, samples=256, jobs=1)
        refined = first_set(tcs.refine(robust, jobs=1, **SUREST))
        anew = from_random(file, options.drawn, options.seed)
        trials = Trials.of(file)
        offsets = trials.errors.draw(options.samples, FIRST_SAMPLE)
        judge = PerturbedPoints(trials, offsets, 1)
        found = [judged(judge, trials.weights, values) for values in (refined, anew.values)]
        published = load_paper().published(task, environment)
        assert published is not None
        cells = label(name), f"{published.mean:.1f} %", *found
        rows.append([*cells, f"{anew.compared:,}", f"{options.samples:,}"])
        print(" | ".join(rows[-1]), flush=True)
        record("rows", COLUMNS, rows)
        save(options, keep=True)
    row("rows", str(len(rows)))


def judged(samples: PerturbedPoints, weights: FloatArray, values: FloatArray) -> str:
    """Return the success of a set and its standard error."""
    found = np.logical_or.reduce(samples.reached(points_of(values))) @ weights
    error = found.std() / np.sqrt(found.size)
    return f"{100.0 * found.mean():.2f} ({100.0 * error:.2f}) %"


def from_random(file: tcs.ScoreFile, drawn: int, seed: int) -> FromRandom:
    """Return the surest set that the search finds from drawn configurations."""
    scorer = PointScorer.of(file, file.nominal_index, 1)
    space = Space.of(file.configurations, file.nominal.sets)
    trials = Trials.of(file)
    searching, choosing = (
        PerturbedPoints(trials, trials.errors.draw(SAMPLES, seed, stream=name), 1)
        for name in ("search", "choice")
    )
    staged = StagedSamples.of(searching, trials.weights)
    rng = named_generator(seed, "random configurations")
    search = SearchFromPoints.of(scorer, space, staged, rng)
    values = rng.uniform(space.low, space.high, (drawn, space.low.size))
    # Each state of the environment and height of the torso costs a call of Drake.
    for axis in [*range(space.environment_axes), space.low.size - 1]:
        levels = np.linspace(space.low[axis], space.high[axis], LEVELS)
        values[:, axis] = rng.choice(levels, drawn)
    reached = scorer.score(points_of(values)).reached.sum(axis=1)
    values = values[reached >= LEAST_GOALS]
    compared = len(values)
    starts = tuple(differing(best_of_pairs(staged, space, values)))
    search = dataclasses.replace(search, sets=starts)
    walks, _ = search.run([], ROUNDS, lambda done, total: None)
    best = at_surest(walks, RememberedSamples(choosing), trials.weights)[0]
    return FromRandom(best.present.values, compared)


def best_of_pairs(staged: StagedSamples, space: Space, values: FloatArray) -> FloatArray:
    """Return the surest pairs of configurations, the surest first, shape (n, 2, axes)."""
    pairs = np.empty((0, 2), dtype=np.int64)
    for stage, remaining in zip(range(staged.stages), PAIRS, strict=True):
        features = staged.features(points_of(values), stage)
        allowed = np.zeros((len(values), len(values)), dtype=np.bool_)
        for i in range(len(values) - 1):
            others = values[i + 1 :]
            together = np.stack([np.broadcast_to(values[i], others.shape), others], axis=1)
            allowed[i, i + 1 :] = space.allowed(together)
        nothing = np.zeros((len(values), 1))
        first, second = best_pairs(features, features, allowed, nothing, remaining)
        kept, where = np.unique(np.concatenate([first, second]), return_inverse=True)
        pairs, values = where.reshape(2, -1).T, values[kept]
    return values[pairs]


def differing(pairs: FloatArray) -> list[FloatArray]:
    """Return the first pairs that differ from those before."""
    chosen: list[FloatArray] = []
    for pair in pairs:
        if all(np.abs(pair - other).max() > APART for other in chosen):
            chosen.append(pair)
    return chosen[:STARTS]


@dataclass(frozen=True, eq=False)
class SearchFromPoints(SurestSearch):
    """The local search of the refinement, from sets off the grid."""

    sets: tuple[FloatArray, ...] = ()
    """Values of the members of each set, shape (members, axes)."""

    def _started(self, starts: Sequence[tuple[int, ...]]) -> list[Walk]:
        """Return walks that stand on the sets, whatever starts on the grid are given."""
        present = [self._evaluated(points_of(values)) for values in self.sets]
        walks = [Walk((0,) * len(of.values), of, 0.0) for of in present]
        for walk, value in zip(walks, self._valued(present), strict=True):
            walk.value = float(value)
            self._rest(walk)
        return walks


def points_of(values: FloatArray) -> FloatArray:
    """Return configurations of a robot with one arm."""
    return values


if __name__ == "__main__":
    main()
