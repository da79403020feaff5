"""Tables of the pick-and-place experiment, beside those of the ITCM thesis."""

from __future__ import annotations

import numpy as np

from tcs.output.report.blocks import Column, Table
from tcs.output.words import p_value
from tcs_studies.experiment.statistics import PostHoc, RepeatedMeasures
from tcs_studies.output.report.experiment.tables import number
from tcs_studies.output.words import PICK_AND_PLACE
from tcs_studies.pick_and_place.analysis import (
    LearningCurve,
    compared,
    learning_curve,
    normality,
)
from tcs_studies.pick_and_place.protocol import PickAndPlace, failure_counts
from tcs_studies.pick_and_place.task import EXPERT, ITCM_HIGH, ITCM_LOW

SCRIPTED = "scripted operators, not people"
"""Note of every table."""
THESIS: dict[str, dict[str, str]] = {
    measure: dict(zip((EXPERT.name, ITCM_HIGH.name, ITCM_LOW.name), cells, strict=True))
    for measure, cells in {
        "tct": ("39.68 (12.43)", "37.74 (7.84)", "64.65 (22.03)"),
        "csa": ("7.55 (2.22)", "7.96 (1.45)", "14.20 (2.80)"),
        "cst": ("208.27 (43.94)", "226.46 (31.26)", "304.82 (70.45)"),
        "sal": ("-18.93 (5.95)", "-18.74 (3.05)", "-20.99 (6.05)"),
        "csa_rate": ("0.20 (0.04)", "0.23 (0.08)", "0.24 (0.06)"),
        "cst_rate": ("5.59 (1.40)", "6.33 (1.38)", "5.10 (1.52)"),
        "approach": ("19.31 (7.01)", "18.64 (4.88)", "32.83 (11.68)"),
        "transfer": ("11.43 (3.01)", "9.31 (1.45)", "16.85 (5.12)"),
        "retreat": ("8.93 (3.74)", "9.79 (2.57)", "14.97 (9.83)"),
    }.items()
}
"""Mean (standard deviation) of the thesis's six people: Tables 2, 4 and 7. The unit of cst is
printed as m, for a device of 16 cm; it must be another one."""
THESIS_FAILURES = {EXPERT.name: (3, 1), ITCM_HIGH.name: (1, 0), ITCM_LOW.name: (3, 11)}
"""Failed repetitions of the thesis: in the experiment, and in training."""
TABLE_2 = ("tct", "csa", "cst", "sal")
SEGMENTS = ("approach", "transfer", "retreat", "csa_rate", "cst_rate", "actions", "corrections")
PAIRS = ((ITCM_LOW.name, ITCM_HIGH.name), (ITCM_HIGH.name, EXPERT.name))
"""Pairs that the thesis tests after the analysis of variance: the first should need more."""


def table_2(result: PickAndPlace) -> Table:
    """Return the thesis's Table 2, ours beside the print, with the failed repetitions."""
    return _table(
        result,
        TABLE_2,
        f"Mean (std) over operators, as in the thesis's Table 2; {SCRIPTED}.",
        failures=True,
    )


def segments_table(result: PickAndPlace) -> Table:
    """Return the thesis's Tables 4 and 7: segments of the time, and steering per time."""
    return _table(
        result,
        SEGMENTS,
        f"Segments of the time and steering per time, as in the thesis's Tables 4 and 7; "
        f"{SCRIPTED}.",
    )


def _table(
    result: PickAndPlace, measures: tuple[str, ...], caption: str, *, failures: bool = False
) -> Table:
    """Return a table of measures: ours, the thesis's, and our tests."""
    names = [condition.name for condition in result.plan.conditions]
    tests = compared(result)
    rows = []
    for measure in measures:
        ours = [mean_std(result, name, measure) for name in names]
        theirs = [THESIS.get(measure, {}).get(name, "–") for name in names]
        rows.append([PICK_AND_PLACE[measure], *ours, *theirs, *_tested(tests.get(measure))])
    if failures:
        for title, training in (("failed repetitions", False), ("failed in training", True)):
            ours = [str(result.failures(name, training=training)) for name in names]
            theirs = [
                str(THESIS_FAILURES[name][training]) if name in THESIS_FAILURES else "–"
                for name in names
            ]
            rows.append([title, *ours, *theirs, "–", *("–" for _ in PAIRS)])
    pairs = [f"{first} > {second}: p, r" for first, second in PAIRS]
    return Table(
        caption,
        [
            Column("measure", False),
            *(Column(name) for name in names),
            *(Column(f"{name}, thesis") for name in names),
            *(Column(title) for title in ("analysis of variance", *pairs)),
        ],
        rows,
    )


def mean_std(result: PickAndPlace, condition: str, measure: str) -> str:
    """Return mean (standard deviation) of the operators' means."""
    sample = result.sample(condition, measure)
    sample = sample[np.isfinite(sample)]
    if not len(sample):
        return "–"
    if len(sample) == 1:
        return number(sample[0])
    return f"{number(sample.mean())} ({number(sample.std(ddof=1))})"


def _tested(found: RepeatedMeasures | None) -> list[str]:
    if found is None:
        return ["–"] * (1 + len(PAIRS))
    pairs = {(one.first, one.second): one for one in found.post_hoc}
    variance = (
        f"F({found.df_between:g}, {found.df_error:g}) = {number(found.f)}, p {p_value(found.p)}"
    )
    return [variance, *(_pair(pairs.get(pair)) for pair in PAIRS)]


def _pair(found: PostHoc | None) -> str:
    return "–" if found is None else f"{p_value(found.p)}, {found.effect:.2f}"


def normality_table(result: PickAndPlace) -> Table:
    """Return the thesis's Tables 5 and 6: Kolmogorov-Smirnov tests."""
    names = [condition.name for condition in result.plan.conditions]
    rows = [
        [
            PICK_AND_PLACE[measure],
            *(p_value(found[name]) if name in found else "–" for name in names),
        ]
        for measure, found in normality(result).items()
    ]
    return Table(
        "p of the Kolmogorov-Smirnov test that operators' means are normally distributed, as in "
        f"the thesis's Tables 5 and 6; {SCRIPTED}.",
        [Column("measure", False), *(Column(name) for name in names)],
        rows,
    )


def learning_table(result: PickAndPlace) -> Table:
    """Return the learning curves of familiarisation, training and experiment."""
    parts = {"familiarisation": tuple(one.familiarisation for one in result.operators)}
    for condition in result.plan.conditions:
        name = condition.name
        parts[f"{name}, training"] = tuple(one.training[name] for one in result.operators)
        parts[name] = tuple(one.recorded[name] for one in result.operators)
    rows = [[title, *_curve(learning_curve(part))] for title, part in parts.items()]
    return Table(
        f"Learning curve a x^b + c of the completion time [s]; {SCRIPTED}.",
        [Column("part", False), Column("a"), Column("b"), Column("c")],
        rows,
    )


def _curve(curve: LearningCurve | None) -> list[str]:
    return ["–"] * 3 if curve is None else [number(x) for x in (curve.a, curve.b, curve.c)]


def failures_table(result: PickAndPlace) -> Table:
    """Return how repetitions failed."""
    rows = []
    for condition in result.plan.conditions:
        name = condition.name
        for title, parts in (
            ("training", [one.training[name] for one in result.operators]),
            ("experiment", [one.recorded[name] for one in result.operators]),
        ):
            counts = failure_counts([one for part in parts for one in part.failures])
            text = ", ".join(f"{count} {outcome}" for outcome, count in counts.items())
            rows.append([name, title, text or "none"])
    return Table(
        f"Failed repetitions of all operators; {SCRIPTED}.",
        [Column("base pose", False), Column("part", False), Column("failed", False)],
        rows,
    )
