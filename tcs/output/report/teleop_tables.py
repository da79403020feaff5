"""Tables of the experiment with the teleoperated arm; each states that no people took part."""

from __future__ import annotations

import math

import numpy as np

from tcs.output.report.blocks import Block, Column, Table, Text
from tcs.output.words import p_value
from tcs.output.words.teleop import NAMES, SCALE
from tcs.teleop.experiment.maps import ControllerMaps
from tcs.teleop.experiment.statistics import Tail
from tcs.teleop.experiment.trial import END_EFFECTOR, NOVEL
from tcs.teleop.experiment.within_subject import HYPOTHESES, SCRIPTED, Experiment

PAPER = {"accuracy": (0.0572, 0.0351), "time": (37.09, 36.65), "effort": (0.25e-6, 0.11e-6)}
"""Medians of end-effector control and of the novel controller: null-space paper, Table II, of 26
people."""
SIGNS: dict[Tail, str] = {"greater": ">", "less": "<", "two-sided": "≠"}
"""Sign between two conditions in an alternative hypothesis."""


def group_table(experiment: Experiment) -> Table:
    """Return the paper's Table II, with the tests of normality."""
    rows = []
    for name in HYPOTHESES:
        for condition in experiment.drives:
            found, scale = experiment.described(condition, name), SCALE.get(name, 1.0)
            both = {END_EFFECTOR.name: 0, NOVEL.name: 1}
            paper = PAPER[name][both[condition]] * scale if condition in both else math.nan
            rows.append(
                [
                    NAMES[name],
                    title_of(experiment, condition),
                    str(found.count),
                    *(number(scale * x) for x in (found.median, found.mean, found.std)),
                    number(found.shapiro_w),
                    p_value(found.shapiro_p),
                    number(paper) if math.isfinite(paper) else "–",
                ]
            )
    titles = ("measure", "controller", "N", "median", "mean", "std", "Shapiro-Wilk W", "p")
    return Table(
        f"Group statistics, as in the paper's Table II; {SCRIPTED}. Last column: the people of the "
        "paper.",
        [
            *(Column(title, i > 1) for i, title in enumerate(titles)),
            Column("median, paper"),
        ],
        rows,
    )


def signed_rank_table(experiment: Experiment) -> Table:
    """Return the paper's Table III."""
    rows = []
    for name, test in experiment.tested().items():
        rows.append(
            [
                NAMES[name],
                f"EE {SIGNS[test.tail]} NV",
                number(test.levene_f),
                p_value(test.levene_p),
                number(test.statistic),
                number(test.z),
                p_value(test.p),
                f"{test.effect:.3f}",
            ]
        )
    titles = ("measure", "alternative", "Levene F", "p", "T", "z", "p", "r = z/√(2N)")
    return Table(
        "End-effector control (EE) compared with the novel controller (NV), as in the paper's "
        f"Table III: Levene's test, Wilcoxon's signed rank test; {SCRIPTED}.",
        [Column(title, i > 1) for i, title in enumerate(titles)],
        rows,
    )


def motion_blocks(experiment: Experiment) -> list[Block]:
    """Return steering, smoothness and time, compared as in the ITCM thesis."""
    rows, pairs = [], []
    for name, found in experiment.varied().items():
        cells = []
        for condition in experiment.drives:
            sample = experiment.sample(condition, name)
            cells.append(f"{number(sample.mean())} ({number(sample.std(ddof=1))})")
        rows.append(
            [
                NAMES[name],
                *cells,
                f"F({found.df_between:g}, {found.df_error:g}) = {number(found.f)}",
                p_value(found.p),
            ]
        )
        for pair in found.post_hoc:
            both = (title_of(experiment, one) for one in (pair.first, pair.second))
            pairs.append(
                [
                    NAMES[name],
                    f" {SIGNS[pair.tail]} ".join(both),
                    number(pair.difference),
                    number(pair.t),
                    p_value(pair.p),
                    f"{pair.effect:.2f}",
                ]
            )
    titles = [title_of(experiment, name) for name in experiment.drives]
    return [
        Table(
            "Mean (std) over operators, and one-way analysis of variance with repeated measures, "
            f"as in the ITCM thesis; {SCRIPTED}.",
            [Column("measure", False), *(Column(t) for t in titles), Column("F"), Column("p")],
            rows,
        ),
        Table(
            "Pairs of controllers: paired t tests of the alternative, one-tailed for time and "
            f"steering as in the thesis, p with Bonferroni correction; {SCRIPTED}.",
            [
                Column("measure", False),
                Column("alternative", False),
                *(Column(title) for title in ("difference", "t", "p", "r")),
            ],
            pairs,
        ),
        Text(
            "Steering is the motion of the hand that moves the tool. This hand pauses while the "
            "other one moves the joint group, and pauses increase the spectral arc length. "
            "Operators rotate the hand only in recovery motions, which the novel controller does "
            "not need."
        ),
    ]


def trials_table(experiment: Experiment) -> Table:
    """Return means over the evaluated trials: completion, stops, work and planes."""
    rows = []
    for name in ("finished", "stops", "turned", "work", "planes_met"):
        scale = SCALE.get(name, 1.0)
        means = [scale * experiment.sample(c, name).mean() for c in experiment.drives]
        rows.append([NAMES[name], *(number(mean) for mean in means)])
    titles = [title_of(experiment, name) for name in experiment.drives]
    return Table(
        f"Means over the evaluated trials; {SCRIPTED}.",
        [Column("measure", False), *(Column(title) for title in titles)],
        rows,
    )


def learning_table(experiment: Experiment) -> Table:
    """Return accuracy and time from trial to trial."""
    plan, rows = experiment.plan, []
    for condition, drives in experiment.drives.items():
        for name in ("accuracy", "time"):
            every = np.array([[getattr(t, name) for t in (*d.training, *d.trials)] for d in drives])
            medians = np.median(every, axis=0) * SCALE.get(name, 1.0)
            rows.append(
                [title_of(experiment, condition), NAMES[name], *(number(x) for x in medians)]
            )
    numbered = [f"training {i + 1}" for i in range(plan.training)]
    numbered += [f"trial {i + 1}" for i in range(plan.trials)]
    return Table(
        f"Learning: median of each trial over operators; {SCRIPTED}.",
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
