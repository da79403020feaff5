"""Tables of the robustness report: results of tcs compared with those of the TCS paper."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from tcs.output.report.blocks import Cell, Column, Table
from tcs.output.words import p_value, percent, signed
from tcs.placement.robustness import Evaluation
from tcs_studies.output.report.robustness.paper import Compared, Paper
from tcs_studies.output.words import goes_with, mean_and_std, stopped_by
from tcs_studies.robustness.comparison import Contrast, method_name
from tcs_studies.robustness.gains import Prediction
from tcs_studies.robustness.study import RowStudy

ROUNDING = 0.05
"""Percentage points within which two printed means are equal: both are rounded to a tenth."""


def table_1(rows: Sequence[RowStudy], paper: Paper) -> Table:
    """Return Table I: the best set of each row, the paper's figure, and the difference."""
    columns = [
        Column("Task, environment", is_number=False),
        Column("tcs"),
        Column("Paper"),
        Column("Difference"),
        Column("95 % interval"),
        Column("Members"),
        Column("All goals"),
        Column("Best single"),
    ]
    body = []
    for row in rows:
        published = paper.published(row.task, row.environment)
        body.append(
            [
                row.name,
                mean_and_std(row.best),
                f"{published.mean:.1f} ({published.std:.1f})" if published else "–",
                _difference(row.best, published.mean if published else None),
                _interval(row.best.summary.ci95, percent),
                str(row.best.sets.shape[1]),
                percent(row.best.complete),
                mean_and_std(row.single),
            ]
        )
    return Table(
        "Table I. Percentage of goals reached in randomly perturbed environments: mean (standard "
        "deviation) over the samples, of the best set of one or two configurations. 95 % interval: "
        "confidence interval of the mean. All goals: percentage of the samples in which every goal "
        "is reached. Best single: the best single configuration.",
        columns,
        body,
    )


def table_3(rows: Sequence[RowStudy], paper: Paper) -> Table:
    """Return Table III: one or two configurations, with and without TC-manipulability."""
    columns = [
        Column("Task", is_number=False),
        Column("Members"),
        Column("Without"),
        Column("Without, paper"),
        Column("With"),
        Column("With, paper"),
        Column("Gain"),
        Column("p, rank sum"),
        Column("p, signed rank"),
        Column("Spread"),
    ]
    body: list[list[Cell | str]] = []
    for row in rows:
        for members in (1, 2) if row.methods is not None else ():
            body.append(
                _methods_row(row, members, paper.compared(row.task, row.environment, members))
            )
    return Table(
        "Table III. Percentage of goals reached, mean (standard deviation). Without "
        "TC-manipulability: another set in each sample, drawn uniformly from the sets with P_R "
        "of at least 0.98 of the greatest. With: the best set. Gain: with minus without, in "
        "percentage points. Rank sum test on independent samples, as in the paper; signed rank "
        "test on the same samples for both. Spread: whether the standard deviation with is "
        "smaller than the one without.",
        columns,
        body,
    )


def contrasts_table(rows: Sequence[RowStudy]) -> Table:
    """Return all comparisons of Table III with their tests."""
    columns = [
        Column("Task", is_number=False),
        Column("Contrast", is_number=False),
        Column("Paired difference [points]"),
        Column("95 % interval"),
        Column("p, signed rank"),
        Column("Independent difference [points]"),
        Column("p, rank sum"),
    ]
    body = [
        [
            row.name,
            f"{method_name(contrast.first)} – {method_name(contrast.second)}",
            signed(100.0 * contrast.paired.mean),
            _interval(contrast.paired.ci95, _points_of),
            p_value(contrast.paired.p),
            signed(100.0 * contrast.independent.mean),
            p_value(contrast.independent.p),
        ]
        for row in rows
        if row.methods is not None
        for contrast in row.methods.contrasts
    ]
    return Table("All comparisons of Table III with both tests.", columns, body)


def gain_table(rows: Sequence[RowStudy]) -> Table:
    """Return the gain of selecting by estimated success over selecting by P_R + P_M."""
    columns = [
        Column("Task", is_number=False),
        Column("Members"),
        Column("By P_R + P_M"),
        Column("By success"),
        Column("Gain"),
        Column("95 % interval"),
        Column("p"),
        Column("All goals"),
        Column("Loss of P_M"),
    ]
    body: list[list[Cell | str]] = [
        [
            row.name,
            "1" if gain.members == 1 else "1 or 2",
            mean_and_std(gain.scored),
            mean_and_std(gain.robust),
            _toned(100.0 * gain.paired.mean),
            _interval(gain.paired.ci95, _points_of),
            p_value(gain.paired.p),
            f"{percent(gain.scored.complete)} → {percent(gain.robust.complete)}",
            f"{gain.scored.manipulability - gain.robust.manipulability:.3f}",
        ]
        for row in rows
        for gain in row.gains
    ]
    return Table(
        "The most robust set compared with the set with the greatest P_R + P_M: percentage of "
        "goals reached, mean (standard deviation), on the same fresh samples for both. Gain: in "
        "percentage points, with its confidence interval and the p-value of the signed rank "
        "test. All goals: percentage of the samples in which every goal is reached, by P_R + P_M "
        "and by success.",
        columns,
        body,
    )


def prediction_table(rows: Sequence[RowStudy]) -> Table:
    """Return how well P_M predicts success, row by row."""
    cases = [(1, True), (2, True), (1, False), (2, False)]
    columns = [
        Column("Task", is_number=False),
        *(
            Column(f"{('one', 'two')[members - 1]}, {'equal' if equal else 'any'} P_R")
            for members, equal in cases
        ),
    ]
    body = [
        [
            row.name,
            *(
                next(
                    (
                        _correlation(found)
                        for found in row.predictions
                        if (found.members, found.equal_reach) == case
                    ),
                    "–",
                )
                for case in cases
            ),
        ]
        for row in rows
    ]
    return Table(
        "How well P_M, computed without error, predicts the mean fraction of goals reached under "
        "error: Spearman's rank correlation with its 95 % interval, among sets of one and two "
        "configurations drawn evenly over P_M. Equal P_R: only sets with P_R of at least 0.98 of "
        "the greatest, among which P_M decides. A dash: too few sets, or all equally successful.",
        columns,
        body,
    )


def _correlation(found: Prediction) -> str:
    if found.rho is None or found.ci95 is None:
        return "–"
    return f"{found.rho:+.2f} ({found.ci95[0]:+.2f} to {found.ci95[1]:+.2f})"


def losses_table(row: RowStudy) -> Table:
    """Return the goals that the best set of a row does not reach in every sample, and why."""
    columns = [
        Column("Goal"),
        Column("Body", is_number=False),
        Column("Reached"),
        Column("Stop"),
        Column("Reasons for failure", is_number=False),
        Column("Mean error in the losses [sd]", is_number=False),
    ]
    body = [
        [
            str(loss.goal + 1),
            loss.body_frame.replace("_", " "),
            percent(loss.success),
            str(loss.member + 1),
            stopped_by(loss),
            goes_with(loss),
        ]
        for loss in row.losses.goals
    ]
    return Table(
        f"{row.name}: {mean_and_std(row.best)} % of the goals reached, ceiling "
        f"{percent(row.losses.ceiling)} %.",
        columns,
        body,
    )


def find_contrast(row: RowStudy, members: int) -> Contrast | None:
    """Return the comparison of with and without TC-manipulability, None if there is none."""
    for contrast in row.methods.contrasts if row.methods is not None else ():
        if contrast.first == (members, True) and contrast.second == (members, False):
            return contrast
    return None


def is_short(row: RowStudy, paper: Paper) -> bool:
    """Return whether the best set's mean, as printed, is below the paper's."""
    published = paper.published(row.task, row.environment)
    return published is not None and 100.0 * row.best.summary.mean < published.mean - ROUNDING


def _methods_row(row: RowStudy, members: int, published: Compared | None) -> list[Cell | str]:
    cells = row.methods.paired if row.methods is not None else {}
    without, with_ = cells.get((members, False)), cells.get((members, True))
    contrast = find_contrast(row, members)
    ours = [mean_and_std(cell) if cell is not None else "–" for cell in (without, with_)]
    theirs = [
        f"{cell[0]:.1f} ({cell[1]:.1f})" if cell is not None else "N/A"
        for cell in ((published.without, published.with_) if published else (None, None))
    ]
    spread: Cell | str = "–"
    if without is not None and with_ is not None:
        is_smaller = with_.summary.std < without.summary.std
        spread = Cell("smaller" if is_smaller else "not smaller", "good" if is_smaller else "bad")
    return [
        row.name,
        str(members),
        ours[0],
        theirs[0],
        ours[1],
        theirs[1],
        _points(contrast),
        p_value(contrast.independent.p) if contrast else "–",
        p_value(contrast.paired.p) if contrast else "–",
        spread,
    ]


def _points(contrast: Contrast | None) -> Cell | str:
    return "–" if contrast is None else _toned(100.0 * contrast.paired.mean)


def _points_of(fraction: float) -> str:
    return signed(100.0 * fraction)


def _interval(ends: tuple[float, float] | None, text: Callable[[float], str]) -> str:
    """Return both ends of a confidence interval, a dash for a single sample."""
    return "–" if ends is None else f"{text(ends[0])} to {text(ends[1])}"


def _difference(ours: Evaluation, theirs: float | None) -> Cell | str:
    return "–" if theirs is None else _toned(100.0 * ours.summary.mean - theirs)


def _toned(points: float) -> Cell:
    """Return percentage points, coloured by their sign if they are not 0 as printed."""
    if abs(points) <= ROUNDING:
        return Cell(signed(points))
    return Cell(signed(points), "good" if points > 0.0 else "bad")
