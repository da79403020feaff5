"""Main findings of the robustness report, as sentences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tcs.output.report.blocks import Block, Bullets
from tcs.output.words import p_value, percent, signed
from tcs_studies.output.report.robustness.paper import Paper
from tcs_studies.output.report.robustness.tables import ROUNDING, find_contrast, is_short
from tcs_studies.output.words import lost_goal
from tcs_studies.robustness.study import RowStudy


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
