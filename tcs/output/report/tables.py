"""The tables of the robustness report, ours beside the paper's."""

from __future__ import annotations

from collections.abc import Sequence

from tcs.output.report.blocks import Cell, Column, Table
from tcs.output.report.paper import Compared, Paper
from tcs.output.words import p_value, percent, signed
from tcs.output.words.robustness import goes_with, mean_and_std, stopped_by
from tcs.placement.robustness import Contrast, Evaluation, Prediction, RowStudy

NEAR = 0.05
"""Percentage points within which two printed means are the same: both are rounded to a tenth."""


def table_1(rows: Sequence[RowStudy], paper: Paper) -> Table:
    """Return Table I: the best set of each row, the paper's figure and the difference."""
    columns = [
        Column("Task, room", is_number=False),
        Column("Ours"),
        Column("Paper"),
        Column("Difference"),
        Column("95 % of our mean"),
        Column("Places"),
        Column("All at once"),
        Column("Best single"),
    ]
    body = []
    for row in rows:
        published = paper.published(row.task, row.environment)
        low, high = row.best.summary.ci95
        body.append(
            [
                row.name,
                mean_and_std(row.best),
                f"{published.mean:.1f} ({published.std:.1f})" if published else "–",
                _difference(row.best, published.mean if published else None),
                f"{percent(low)} to {percent(high)}",
                str(row.best.sets.shape[1]),
                percent(row.best.complete),
                mean_and_std(row.single),
            ]
        )
    return Table(
        "Table I. Percentage of goals reached with the room off at random: mean (standard "
        "deviation) over the samples, of the best set of one or two places. 95 %: interval of the "
        "mean. All at once: share of the samples in which nothing is lost. Best single: the best "
        "set of one place.",
        columns,
        body,
    )


def table_3(rows: Sequence[RowStudy], paper: Paper) -> Table:
    """Return Table III: one or two configurations, with and without TC-manipulability."""
    columns = [
        Column("Task", is_number=False),
        Column("Places"),
        Column("Without"),
        Column("Paper's"),
        Column("With"),
        Column("Paper's"),
        Column("Gain"),
        Column("p, rank sum"),
        Column("p, signed"),
        Column("Spread"),
    ]
    body: list[list[Cell | str]] = []
    for row in rows:
        for members in (1, 2) if row.methods is not None else ():
            body.append(
                _methods_row(row, members, paper.compared(row.task, row.environment, members))
            )
    return Table(
        "Table III. Without TC-manipulability: in each sample another set, drawn uniformly from "
        "those that reach as much (P_R of at least 0.98 of the greatest). With: the best set. Mean "
        "(std) of the percentage of goals reached. Gain: with less without, in points. Rank sum on "
        "independent draws, as in the paper; signed rank on the same samples for both. Spread: of "
        "with, beside that of without.",
        columns,
        body,
    )


def contrasts_table(rows: Sequence[RowStudy]) -> Table:
    """Return every contrast of Table III with its tests."""
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
            f"{_method(contrast.first)} – {_method(contrast.second)}",
            signed(100.0 * contrast.paired.mean),
            " to ".join(signed(100.0 * end) for end in contrast.paired.ci95),
            p_value(contrast.paired.p),
            signed(100.0 * contrast.independent.mean),
            p_value(contrast.independent.p),
        ]
        for row in rows
        if row.methods is not None
        for contrast in row.methods.contrasts
    ]
    return Table("Every comparison of Table III with both tests.", columns, body)


def gain_table(rows: Sequence[RowStudy]) -> Table:
    """Return what choosing by estimated success gains over choosing by P_R + P_M."""
    columns = [
        Column("Task", is_number=False),
        Column("Places"),
        Column("By P_R + P_M"),
        Column("By success"),
        Column("Gain"),
        Column("95 %"),
        Column("p"),
        Column("All at once"),
        Column("P_M given up"),
    ]
    body: list[list[Cell | str]] = [
        [
            row.name,
            "1" if gain.members == 1 else "1 or 2",
            mean_and_std(gain.scored),
            mean_and_std(gain.robust),
            _toned(100.0 * gain.paired.mean),
            " to ".join(signed(100.0 * end) for end in gain.paired.ci95),
            p_value(gain.paired.p),
            f"{percent(gain.scored.complete)} → {percent(gain.robust.complete)}",
            f"{gain.scored.manipulability - gain.robust.manipulability:.3f}",
        ]
        for row in rows
        for gain in row.gains
    ]
    return Table(
        "The surest set against the set with the greatest P_R + P_M: percentage of goals reached, "
        "on the same samples for both, none of which had a part in the "
        "estimate. Gain: in points, with its interval and the p of the signed rank test. All at "
        "once: share of the samples in which nothing is lost, before and after.",
        columns,
        body,
    )


def prediction_table(rows: Sequence[RowStudy]) -> Table:
    """Return how well P_M predicts success, row by row."""
    kinds = [(1, True), (2, True), (1, False), (2, False)]
    columns = [
        Column("Task", is_number=False),
        *(
            Column(f"{places}, {'equal' if equal else 'any'} reach")
            for places, equal in ((("one", "two")[m - 1], e) for m, e in kinds)
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
                        if (found.members, found.equal_reach) == kind
                    ),
                    "–",
                )
                for kind in kinds
            ),
        ]
        for row in rows
    ]
    return Table(
        "How well P_M, computed without error, orders sets by the mean share of goals reached with "
        "it: Spearman's rank correlation and its 95 % interval, among sets of one and two drawn "
        "evenly over P_M. Equal reach: only sets whose P_R is at least 0.98 of the greatest, those "
        "between which P_M decides. A dash where sets are too few or all do equally well.",
        columns,
        body,
    )


def _correlation(found: Prediction) -> str:
    if found.rho is None or found.ci95 is None:
        return "–"
    return f"{found.rho:+.2f} ({found.ci95[0]:+.2f} to {found.ci95[1]:+.2f})"


def losses_table(row: RowStudy) -> Table:
    """Return the goals that the best set of a row loses at times, and why."""
    columns = [
        Column("Goal"),
        Column("On the", is_number=False),
        Column("Reached"),
        Column("Stop"),
        Column("What stops it there otherwise", is_number=False),
        Column("Off in the losses", is_number=False),
    ]
    body = [
        [
            str(loss.goal),
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
    """Return the contrast of with against without TC-manipulability, None where there is none."""
    for contrast in row.methods.contrasts if row.methods is not None else ():
        if contrast.first == (members, True) and contrast.second == (members, False):
            return contrast
    return None


def is_short(row: RowStudy, paper: Paper) -> bool:
    """Return whether the best set's mean, as printed, is below the paper's."""
    published = paper.published(row.task, row.environment)
    return published is not None and 100.0 * row.best.summary.mean < published.mean - NEAR


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


def _difference(ours: Evaluation, theirs: float | None) -> Cell | str:
    return "–" if theirs is None else _toned(100.0 * ours.summary.mean - theirs)


def _toned(points: float) -> Cell:
    """Return percentage points: above, below, or the same as printed."""
    if abs(points) <= NEAR:
        return Cell(signed(points))
    return Cell(signed(points), "good" if points > 0.0 else "bad")


def _method(cell: tuple[int, bool]) -> str:
    return f"{('one', 'two')[cell[0] - 1]} {'with' if cell[1] else 'without'}"
