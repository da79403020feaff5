"""Tables of a score report about the whole grid: the reasons, and the bodies in contact."""

from __future__ import annotations

from collections import Counter

from tcs.output.report.blocks import Cell, Column, Table
from tcs.output.report.score.report import ScoreReport
from tcs.output.words import REASON_NAMES, body_name, goal_place, percent, percentage
from tcs.placement.reasons.distribution import CHECKS, checks_of
from tcs.placement.tables import Reason

MOST_PAIRS = 4
"""Most pairs of bodies that are listed for each reason."""


def reasons_table(report: ScoreReport) -> Table:
    """Return how many configurations of the grid have each reason, goal by goal."""
    reasons = (*checks_of(report.distributions[0].reasons), Reason.REACHED)
    rows: list[list[Cell | str]] = []
    for goal, counts in enumerate(report.distributions):
        fractions = [counts.reasons[reason] / counts.configurations for reason in reasons]
        rows.append(
            [
                str(goal + 1),
                goal_place(report.job.task.goals[goal]),
                *(percent(fraction, 2) if fraction else "0" for fraction in fractions),
            ]
        )
    return Table(
        f"Percentage of the {report.distributions[0].configurations:,} configurations of the grid "
        "with each reason. A configuration counts for the first check it fails, in the order of "
        "the columns.",
        [
            Column("Goal"),
            Column("Where", is_number=False),
            *(Column(REASON_NAMES[reason]) for reason in reasons),
        ],
        rows,
    )


def pairs_table(report: ScoreReport) -> Table:
    """Return the pairs of bodies in contact over all goals, most frequent first."""
    counts: Counter[tuple[Reason, tuple[str, str]]] = Counter()
    for distribution in report.distributions:
        for one in distribution.blocking_pairs:
            counts[one.reason, one.pair] += one.count
    rows = []
    for reason in CHECKS:
        found = [(pair, n) for (why, pair), n in counts.most_common() if why == reason]
        total = sum(n for _, n in found)
        for (part, other), n in found[:MOST_PAIRS]:
            names = (body_name(part), body_name(other))
            rows.append([REASON_NAMES[reason], *names, f"{n:,}", percentage(n / total)])
        rest = found[MOST_PAIRS:]
        if rest:
            n = sum(times for _, times in rest)
            names = (f"{len(rest)} other pair{'' if len(rest) == 1 else 's'}", "")
            rows.append([REASON_NAMES[reason], *names, f"{n:,}", percentage(n / total)])
    return Table(
        "Bodies in contact over all goals and configurations, most frequent first. Each "
        "configuration counts with its first contact; where every arm posture is in contact, with "
        "that of the best posture.",
        [
            Column("Reason", is_number=False),
            Column("Part", is_number=False),
            Column("Against", is_number=False),
            Column("Times"),
            Column("Of this reason"),
        ],
        rows,
    )
