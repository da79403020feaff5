"""Table III of the TCS paper: one or two configurations, with or without TC-manipulability."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from tcs.placement.robustness.evaluation import Evaluation, evaluate
from tcs.placement.robustness.statistics import Difference, rank_sum, signed_rank
from tcs.placement.robustness.trials import Errors, Progress, Trials
from tcs.placement.store import ScoreFile

Cell = tuple[int, bool]
"""Members of the set, and whether TC-manipulability decided."""

METHODS: tuple[Cell, ...] = ((1, False), (1, True), (2, False), (2, True))
"""The methods that are compared."""

CONTRASTS: tuple[tuple[Cell, Cell], ...] = (
    ((1, True), (1, False)),
    ((2, True), (2, False)),
    ((2, True), (1, True)),
    ((2, False), (1, False)),
)
"""Which is compared with which: with against without, two against one."""


@dataclass(frozen=True, eq=False)
class Contrast:
    """One method against another."""

    first: Cell
    second: Cell
    independent: Difference
    """Rank sum of samples drawn for each method by itself, as in the paper."""
    paired: Difference
    """Signed rank on the same samples for both."""

    def to_json(self) -> dict[str, Any]:
        """Return it as plain containers."""
        return {
            "first": method_name(self.first),
            "second": method_name(self.second),
            "independent": self.independent.to_json(),
            "paired": self.paired.to_json(),
        }


@dataclass(frozen=True, eq=False)
class MethodComparison:
    """The four methods on one row; a method that has no set is missing."""

    paired: dict[Cell, Evaluation]
    """On the same samples for all."""
    independent: dict[Cell, Evaluation]
    """On samples drawn for each by itself."""
    contrasts: tuple[Contrast, ...]

    def to_json(self) -> dict[str, Any]:
        """Return it as plain containers."""
        return {
            "methods": {method_name(cell): found.to_json() for cell, found in self.paired.items()},
            "contrasts": [contrast.to_json() for contrast in self.contrasts],
        }


def method_name(cell: Cell) -> str:
    """Return a method in words.

    >>> method_name((2, False))
    'two without'
    """
    return f"{('one', 'two')[cell[0] - 1]} {'with' if cell[1] else 'without'}"


def compare_methods(
    file: ScoreFile | Trials,
    *,
    samples: int = 1000,
    seed: int = 0,
    errors: Errors = None,
    jobs: int = 2,
    on_progress: Progress = None,
    on_compile: Callable[[], None] | None = None,
) -> MethodComparison:
    """Return a row of Table III, with its tests.

    With TC-manipulability: the best single configuration, and the best set of two. Without:
    in each sample another single or pair, drawn uniformly from those with P_R of at least 0.98 of
    the greatest. A method is missing where there is no such set, as where no pair is better than
    the best single.

    Args:
        file: A score file, or its trials.
        samples: How many samples for each method, twice: paired, and drawn by itself.
        seed: Seed of all of them.
        errors: Path of an error file, or errors by joint, in place of the environment's own. Not
            for trials, which have theirs.
        jobs: Number of threads.
        on_progress: Called with evaluations done and in all.
        on_compile: Called first, when the kernel has to be compiled.

    Raises:
        StoreMismatchError: If the models are not those the file was made from.
        TcsError: Whatever `evaluate` raises.
    """
    if isinstance(file, Trials):
        trials = file
    else:
        trials = Trials.of(file, errors=errors, on_compile=on_compile)
    sets = trials.scored.sets
    has_two = len(sets.best) > 1 and sets.kept_pairs > 0
    shown = [cell for cell in METHODS if cell[0] == 1 or has_two]
    paired: dict[Cell, Evaluation] = {}
    alone: dict[Cell, Evaluation] = {}
    for i, (members, with_manipulability) in enumerate(shown):
        best = "best" if members == 2 else "single"
        for j, (found, stream) in enumerate(
            ((paired, ""), (alone, method_name((members, with_manipulability))))
        ):
            found[members, with_manipulability] = evaluate(
                trials,
                samples=samples,
                seed=seed,
                select=best if with_manipulability else "uniform",
                members=members,
                stream=stream,
                jobs=jobs,
            )
            if on_progress is not None:
                on_progress(2 * i + j + 1, 2 * len(shown))
    contrasts = tuple(
        Contrast(
            first,
            second,
            rank_sum(alone[first].fractions, alone[second].fractions),
            signed_rank(paired[first].fractions, paired[second].fractions),
        )
        for first, second in CONTRASTS
        if first in paired and second in paired
    )
    return MethodComparison(paired, alone, contrasts)
