"""Tables and findings of the robustness report."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from tcs.output.report.blocks import Block, Bullets, Cell, Column, Table
from tcs.output.words import p_value, percent, signed
from tcs.placement.robustness import Evaluation
from tcs_studies.output.report.robustness.paper import Compared, Paper
from tcs_studies.output.words import goes_with, lost_goal, mean_and_std, stopped_by
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


def findings(rows: Sequence[RowStudy], paper: Paper) -> list[Block]:
    """Return the main findings as a list of sentences."""
    known = [row for row in rows if paper.published(row.task, row.environment)]
    short = [row for row in known if is_short(row, paper)]
    items = []
    if known:
        items.append(
            f"In {len(known) - len(short)} of {len(known)} rows the mean is equal to or greater "
            "than the paper's."
            + (
                " Below the paper: " + "; ".join(_short_of(row, paper) for row in short) + "."
                if short
                else ""
            )
        )
    contrasts = [(row, m, find_contrast(row, m)) for row in rows for m in (1, 2)]
    tests = [(row, m, contrast) for row, m, contrast in contrasts if contrast is not None]
    if tests:
        above = [one for one in tests if one[2].paired.mean > 0.0]
        significant = [one for one in above if one[2].independent.p < 0.01]
        items.append(
            f"With TC-manipulability the mean is above that without in {len(above)} of "
            f"{len(tests)} comparisons, in {len(significant)} of them with p < 0.01 (rank sum "
            "test, as in the paper)."
        )
        items += [_exception(one[0], one[1]) for one in tests if one not in significant]
    items += _gain_findings(rows, paper)
    found = [
        one.rho
        for row in rows
        for one in row.predictions
        if one.equal_reach and one.rho is not None
    ]
    if found:
        items.append(
            "Among sets with equal P_R, P_M correlates positively with success in "
            f"{sum(rho > 0.0 for rho in found)} of {len(found)} cases; the rank correlation is "
            f"{min(found):+.2f} to {max(found):+.2f}, median {np.median(found):+.2f}."
        )
    return [Bullets(items)]


def _gain_findings(rows: Sequence[RowStudy], paper: Paper) -> list[str]:
    """Return the gain of selecting by success in one item, none without estimates."""
    gains = [(row, row.gain) for row in rows if row.gain is not None]
    if not gains:
        return []
    gained = [row for row, gain in gains if gain.paired.mean > 0.0 and gain.paired.p < 0.01]
    most, greatest = max(gains, key=lambda one: one[1].paired.mean)
    text = (
        f"Selecting by estimated success improves {len(gained)} of {len(gains)} rows (p < 0.01, "
        f"signed rank test), most of all {most.name}: {signed(100.0 * greatest.paired.mean)} "
        "percentage points."
    )
    known = [(row, gain) for row, gain in gains if paper.published(row.task, row.environment)]
    below = [
        f"{row.name} ({percent(gain.robust.summary.mean)})"
        for row, gain in known
        if 100.0 * gain.robust.summary.mean < _published_mean(row, paper) - ROUNDING
    ]
    if known:
        count = len(known) - len(below)
        text += f" With it {count} of {len(known)} rows are equal to or greater than the paper's."
    if below:
        text += f" Below: {', '.join(below)}."
    return [text]


def _short_of(row: RowStudy, paper: Paper) -> str:
    theirs = _published_mean(row, paper)
    return f"{row.name} ({percent(row.best.summary.mean)} against {theirs:.1f} %)"


def _published_mean(row: RowStudy, paper: Paper) -> float:
    published = paper.published(row.task, row.environment)
    return published.mean if published else 0.0


def _exception(row: RowStudy, members: int) -> str:
    found = find_contrast(row, members)
    if found is None or row.methods is None:
        return ""
    drawn = row.methods.paired[members, False]
    text = (
        f"{row.name}, {configurations(members)}: with TC-manipulability the mean differs by "
        f"{signed(100.0 * found.paired.mean)} percentage points from that without (rank sum p "
        f"{p_value(found.independent.p)}, signed rank p {p_value(found.paired.p)})."
    )
    if drawn.choices <= 20:
        text += f" Only {drawn.choices} sets have a P_R equal to that of the best set."
    else:
        text += (
            f" The set with the greatest P_R + P_M is one of {drawn.choices:,} with equal P_R; "
            "dexterity measures such as isotropy consider neither joint limits nor obstacles near "
            "the arm."
        )
    lost = row.single_losses if members == 1 else row.losses
    # A goal that is never reached is not lost because of the errors.
    occasional = [loss for loss in lost.goals if loss.success > 0.0] if lost is not None else []
    if occasional:
        text += f" {lost_goal(occasional[0])}"
    return text


def configurations(members: int) -> str:
    """Return the number of configurations of a set in words."""
    return "one configuration" if members == 1 else "two configurations"
