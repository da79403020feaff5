"""Table III of the TCS paper: one or two configurations, with or without TC-manipulability."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from tcs.placement.robustness.evaluation import Evaluation, evaluate
from tcs.placement.robustness.trials import Errors, Progress, Trials
from tcs.placement.store import ScoreFile
from tcs_studies.robustness.differences import Difference, rank_sum, signed_rank

Method = tuple[int, bool]
"""Number of members of the set, and whether TC-manipulability selects it."""

METHODS: tuple[Method, ...] = ((1, False), (1, True), (2, False), (2, True))
"""The methods that are compared."""

CONTRASTS: tuple[tuple[Method, Method], ...] = (
    ((1, True), (1, False)),
    ((2, True), (2, False)),
    ((2, True), (1, True)),
    ((2, False), (1, False)),
)
"""Pairs of methods that are compared: with against without, two members against one."""


@dataclass(frozen=True, eq=False)
class Contrast:
    """Comparison of one method with another."""

    first: Method
    second: Method
    independent: Difference
    """Rank sum test on samples drawn for each method separately, as in the paper."""
    paired: Difference
    """Signed rank test on the same samples for both."""

    def to_json(self) -> dict[str, Any]:
        """Return the contrast as plain containers."""
        return {
            "first": method_name(self.first),
            "second": method_name(self.second),
            "independent": self.independent.to_json(),
            "paired": self.paired.to_json(),
        }


@dataclass(frozen=True, eq=False)
class MethodComparison:
    """The four methods on one row; a method without a set is missing."""

    paired: dict[Method, Evaluation]
    """Evaluations on the same samples for all."""
    independent: dict[Method, Evaluation]
    """Evaluations on samples drawn for each method separately."""
    contrasts: tuple[Contrast, ...]
    """The comparisons of `CONTRASTS` whose methods are both there."""

    def to_json(self) -> dict[str, Any]:
        """Return the comparison as plain containers."""
        return {
            "methods": {method_name(one): found.to_json() for one, found in self.paired.items()},
            "contrasts": [contrast.to_json() for contrast in self.contrasts],
        }


def method_name(method: Method) -> str:
    """Return the name of a method, which also names its stream of independent samples.

    >>> method_name((2, False))
    'two without'
    """
    return f"{('one', 'two')[method[0] - 1]} {'with' if method[1] else 'without'}"


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
    """Return a row of Table III with its tests.

    With TC-manipulability: the best single configuration, and the best set of two. Without:
    another single or pair in each sample, drawn uniformly from those with P_R of at least 0.98 of
    the greatest. A method is missing if it has no set, e.g. if no pair is better than the best
    single.

    Args:
        file: A score file, or its trials.
        samples: Number of samples of each method, for paired and independent evaluations each.
        seed: Seed of all samples.
        errors: Path of an error file, or errors by joint, in place of those of the environment.
            Not for trials, which include their errors.
        jobs: Number of threads.
        on_progress: Called with the number of evaluations done and of all evaluations.
        on_compile: Called first if the kernel has to be compiled.

    Raises:
        StoreMismatchError: If the file was made from other models.
        TcsError: As `evaluate`.
    """
    if isinstance(file, Trials):
        trials = file
    else:
        trials = Trials.of(file, errors=errors, body_collisions="paper", on_compile=on_compile)
    sets = trials.scored.sets
    has_two = len(sets.best) > 1 and sets.kept_pairs > 0
    compared = [method for method in METHODS if method[0] == 1 or has_two]
    paired: dict[Method, Evaluation] = {}
    independent: dict[Method, Evaluation] = {}
    for i, (members, with_manipulability) in enumerate(compared):
        method = (members, with_manipulability)
        best = "best" if members == 2 else "single"
        for j, (found, stream) in enumerate(((paired, ""), (independent, method_name(method)))):
            found[method] = evaluate(
                trials,
                samples=samples,
                seed=seed,
                select=best if with_manipulability else "uniform",
                members=members,
                stream=stream,
                jobs=jobs,
            )
            if on_progress is not None:
                on_progress(2 * i + j + 1, 2 * len(compared))
    contrasts = tuple(
        Contrast(
            first,
            second,
            rank_sum(independent[first].fractions, independent[second].fractions),
            signed_rank(paired[first].fractions, paired[second].fractions),
        )
        for first, second in CONTRASTS
        if first in paired and second in paired
    )
    return MethodComparison(paired, independent, contrasts)
