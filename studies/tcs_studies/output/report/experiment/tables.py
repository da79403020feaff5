"""Tables of the experiment with the teleoperated arm; each states who the operators were."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np

from tcs.output.report.blocks import Block, Column, Table, Text
from tcs.output.words import p_value
from tcs_studies.experiment.comparison import Comparison, hypothesis
from tcs_studies.experiment.maps import ControllerMaps
from tcs_studies.experiment.statistics import PostHoc, Tail
from tcs_studies.experiment.trial import END_EFFECTOR, NOVEL
from tcs_studies.experiment.within_subject import SCRIPTED, Experiment
from tcs_studies.output.words import NAMES, SCALE

PAPER = {
    "accuracy": (0.0572, 0.0351),
    "time": (37.09, 36.65),
    "effort": (0.25e-6, 0.11e-6),
    "usefulness": (0.80, 1.20),
    "satisfaction": (0.50, 1.00),
}
"""Medians of end-effector control and of the novel controller: null-space paper, Table II, of 26
people, of whom 24 filled in the questionnaire."""
ABBREVIATIONS = {END_EFFECTOR.name: "EE", NOVEL.name: "NV"}
"""The paper's abbreviations."""
SIGNS: dict[Tail, str] = {"greater": ">", "less": "<", "two-sided": "≠"}
"""Sign between two conditions in an alternative hypothesis."""
NONE = "–"
"""Cell without a value."""


def group_table(comparison: Comparison) -> Table:
    """Return the paper's Table II, with the tests of normality."""
    rows = []
    for name in comparison.hypotheses:
        for condition, title in comparison.titles.items():
            sample, scale = comparison.sample(condition, name), SCALE.get(name, 1.0)
            found = comparison.described(condition, name)
            cells = [NONE] * 7
            if found is not None:
                cells = [number(scale * x) for x in (found.median, found.mean, found.std)]
                cells += [number(found.shapiro_w), p_value(found.shapiro_p)]
                cells += [number(found.francia_w), p_value(found.francia_p)]
            paper = _paper_median(name, condition)
            theirs = NONE if paper is None else number(paper * scale)
            rows.append([NAMES[name], title, str(len(sample)), *cells, theirs])
    titles = (
        *("measure", "controller", "N", "median", "mean", "std"),
        *("Shapiro-Wilk W", "p", "Shapiro-Francia W′", "p"),
    )
    return Table(
        f"Group statistics, as in the paper's Table II; {comparison.operators}. Last column: the "
        "people of the paper.",
        [
            *(Column(title, i > 1) for i, title in enumerate(titles)),
            Column("median, paper"),
        ],
        rows,
    )


def _paper_median(measure: str, condition: str) -> float | None:
    both = (END_EFFECTOR.name, NOVEL.name)
    return PAPER[measure][both.index(condition)] if condition in both else None


def signed_rank_table(comparison: Comparison) -> Table:
    """Return the paper's Table III: its two controllers, or all pairs where one is missing."""
    rows = []
    pairs = compared_pairs(comparison)
    for name in comparison.hypotheses:
        for first, second in pairs:
            test = comparison.compared(name, first, second)
            cells = [NONE] * 7
            if test is not None:
                cells = [
                    *(str(test.count), number(test.levene_f), p_value(test.levene_p)),
                    *(number(test.statistic), number(test.z), p_value(test.p)),
                    f"{test.effect:.3f}",
                ]
            sign = SIGNS[hypothesis(name, first, second)]
            both = (ABBREVIATIONS.get(one, comparison.titles[one]) for one in (first, second))
            rows.append([NAMES[name], f" {sign} ".join(both), *cells])
    titles = ("measure", "alternative", "N", "Levene F", "p", "T", "z", "p", "r = z/√(2N)")
    what = "Pairs of conditions"
    if pairs == [(END_EFFECTOR.name, NOVEL.name)]:
        what = "End-effector control (EE) compared with the novel controller (NV)"
    return Table(
        f"{what}, as in the paper's Table III: Levene's test, Wilcoxon's signed rank test; "
        f"{comparison.operators}.",
        [Column(title, i > 1) for i, title in enumerate(titles)],
        rows,
    )


def compared_pairs(comparison: Comparison) -> list[tuple[str, str]]:
    """Return the paper's two controllers, or all pairs of conditions where one is missing."""
    if {END_EFFECTOR.name, NOVEL.name} <= set(comparison.titles):
        return [(END_EFFECTOR.name, NOVEL.name)]
    return list(combinations(comparison.titles, 2))


def motion_tables(comparison: Comparison) -> list[Table]:
    """Return the thesis's measures over all conditions, and the pairs of conditions."""
    rows, pairs = [], []
    for name in comparison.anova_measures:
        found, cells = comparison.varied(name), []
        for condition in comparison.titles:
            sample = comparison.sample(condition, name)
            std = number(sample.std(ddof=1)) if len(sample) > 1 else NONE
            cells.append(f"{number(sample.mean())} ({std})" if len(sample) else NONE)
        f = p = NONE
        if found is not None:
            f = f"F({found.df_between:g}, {found.df_error:g}) = {number(found.f)}"
            p = p_value(found.p)
            pairs += [_pair_row(comparison, name, pair) for pair in found.post_hoc]
        rows.append([NAMES[name], *cells, f, p])
    titles = comparison.titles.values()
    return [
        Table(
            "Mean (std) over operators, and one-way analysis of variance with repeated measures, "
            f"as in the ITCM thesis; {comparison.operators}.",
            [Column("measure", False), *(Column(t) for t in titles), Column("F"), Column("p")],
            rows,
        ),
        Table(
            "Pairs of controllers: paired t tests of the alternative, one-tailed for time and "
            "steering as in the thesis, p with Bonferroni correction; "
            f"{comparison.operators}.",
            [
                Column("measure", False),
                Column("alternative", False),
                *(Column(title) for title in ("difference", "t", "p", "r")),
            ],
            pairs,
        ),
    ]


def _pair_row(comparison: Comparison, measure: str, pair: PostHoc) -> list[str]:
    both = (comparison.titles[one] for one in (pair.first, pair.second))
    return [
        *(NAMES[measure], f" {SIGNS[pair.tail]} ".join(both)),
        *(number(pair.difference), number(pair.t), p_value(pair.p), f"{pair.effect:.2f}"),
    ]


def trials_table(comparison: Comparison) -> Table:
    """Return means over the evaluated trials: completion, stops, work and planes."""
    rows = []
    for name in ("finished", "stops", "turned", "work", "planes_met"):
        scale = SCALE.get(name, 1.0)
        samples = [scale * comparison.sample(c, name) for c in comparison.titles]
        rows.append([NAMES[name], *(number(s.mean()) if len(s) else NONE for s in samples)])
    return Table(
        f"Means over the evaluated trials; {comparison.operators}.",
        [Column("measure", False), *(Column(title) for title in comparison.titles.values())],
        rows,
    )


def learning_table(comparison: Comparison) -> Table:
    """Return accuracy and time from trial to trial."""
    rows = []
    for condition, title in comparison.titles.items():
        for name, by_condition in comparison.learning.items():
            each = SCALE.get(name, 1.0) * by_condition[condition].T
            medians = [values[~np.isnan(values)] for values in each]
            cells = (number(np.median(one)) if len(one) else NONE for one in medians)
            rows.append([title, NAMES[name], *cells])
    # Every condition has the same trials.
    count = next(iter(next(iter(comparison.learning.values())).values())).shape[1]
    training = comparison.training
    numbered = [f"training {i + 1}" for i in range(training)]
    numbered += [f"trial {i + 1}" for i in range(count - training)]
    return Table(
        f"Learning: median of each trial over operators; {comparison.operators}.",
        [Column("controller", False), Column("measure", False), *(Column(n) for n in numbered)],
        rows,
    )


def maps_blocks(experiment: Experiment, maps: ControllerMaps) -> list[Block]:
    """Return how the capability map changes with the controller."""
    rows = []
    for one in maps.maps:
        best = one.best
        stand = ["–", "–"]
        if best is not None:
            stand = [
                f"{best.x:.2f}, {best.y:.2f} m, {math.degrees(best.yaw):.1f} deg",
                number(best.score),
            ]
        rows.append(
            [
                title_of(experiment, one.condition),
                f"{one.samples:,}",
                f"{len(one.capability.cells):,}",
                f"{100 * one.shared_fraction:.0f}",
                number(one.mean_score),
                str(one.grasp_cells),
                *stand,
            ]
        )
    titles = ("samples", "cells", "also in the first [%]", "mean score", "cells of the grasp")
    return [
        Text(
            "All evaluated trials with a controller form one recording. Its map (ITCM) contains "
            "the base poses from which operators with that controller reach a tool pose. The maps "
            f"are compared for one grasp: tool {maps.height:.2f} m above the floor, pitch "
            f"{math.degrees(maps.pitch):.1f} deg, roll {math.degrees(maps.roll):.1f} deg; base "
            "poses are relative to the tool."
        ),
        Table(
            f"Maps by controller; {SCRIPTED}.",
            [
                Column("controller", False),
                *(Column(title) for title in titles),
                Column("best base pose"),
                Column("score"),
            ],
            rows,
        ),
    ]


def title_of(experiment: Experiment, name: str) -> str:
    """Return the title of a condition in tables."""
    return next(one.title for one in experiment.plan.conditions if one.name == name)


def median_of(experiment: Experiment, condition: str, name: str) -> str:
    """Return the median of a measure in the unit of `NAMES`."""
    return number(SCALE.get(name, 1.0) * np.median(experiment.sample(condition, name)))


def number(value: float) -> str:
    """Return a number with three significant digits, without an unnecessary exponent.

    >>> number(0.01234), number(123.4), number(0.0)
    ('0.0123', '123', '0')
    """
    text = f"{float(value):.3g}"
    return f"{float(text):g}"
