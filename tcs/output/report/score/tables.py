"""Tables of a score report: its set, the whole grid, and how reliable they are."""

from __future__ import annotations

import math
from collections import Counter

from tcs.output.report.blocks import Cell, Column, Table, Tone
from tcs.output.report.score.report import GoalResult, ScoreReport
from tcs.output.report.score.shown_set import estimate_of
from tcs.output.words import (
    REASON_NAMES,
    REASON_TEXTS,
    assigned_goals,
    axis_title,
    axis_value,
    body_name,
    frame_name,
    goal_list,
    goal_place,
    member_text,
    pair_text,
    percent,
    percentage,
)
from tcs.output.words.verification import check_lines
from tcs.placement.reasons.distribution import CHECKS, checks_of
from tcs.placement.tables import Reason, window_text


def stops_table(report: ScoreReport) -> Table:
    """Return the configuration of each stop, in the order of the tour."""
    members = [member.to_json() for member in report.shown.members]
    windows = report.shown.windows
    off = ["not known" if one is None else window_text(one.to_json()) for one in windows]
    rows = [
        [
            str(number + 1),
            *(axis_value(key, value) for key, value in member.items()),
            goal_list(assigned_goals(report.assignment, number), report.goal_names) or "none",
            *off[number : number + 1],
        ]
        for number, member in enumerate(members)
    ]
    columns = [Column("Stop"), *(Column(axis_title(key)) for key in members[0])]
    columns += [Column("Serves goals"), *([Column("May be", is_number=False)] if windows else [])]
    return Table(
        "The stops in the order of the tour. The base pose is given in the frame of the "
        f"environment: {report.job.spec.environment.origin}",
        columns,
        rows,
    )


def goals_table(report: ScoreReport) -> Table:
    """Return the result for each goal at each stop."""
    goals = report.job.task.goals
    is_weighted = len({goal.weight for goal in goals}) > 1
    stops = range(len(report.shown.members))
    columns = [
        Column("Goal"),
        Column("Where", is_number=False),
        *([Column("Weight")] if is_weighted else []),
        Column("Reached from", is_number=False),
        *(Column(f"At stop {number + 1}", is_number=False) for number in stops),
        Column("Drake", is_number=False),
        Column("Of the grid"),
    ]
    weights = report.scored.scores.weights
    rows: list[list[Cell | str]] = []
    for g, goal in enumerate(goals):
        number = report.assignment[g]
        stop = Cell("nowhere", "bad") if number is None else Cell(f"stop {number + 1}", "good")
        counts = report.distributions[g]
        rows.append(
            [
                str(g),
                goal_place(goal),
                *([f"{weights[g]:.3f}"] if is_weighted else []),
                stop,
                *(_result_cell(report.results[one][g], is_used=number == one) for one in stops),
                _drake_cell(report, g),
                percentage(counts.reached / counts.configurations, 2),
            ]
        )
    return Table(
        f"Each goal at each stop: the {report.measure} of the best arm posture free of contact, or "
        "the reason why the goal is not reached. Drake: whether it confirms that posture. Of the "
        "grid: percentage of all configurations that reach the goal.",
        columns,
        rows,
    )


def joints_table(report: ScoreReport) -> Table:
    """Return the stored arm posture for each goal that is reached."""
    rows, arm_joints = [], report.job.spec.robot.arm_joints
    for goal, number in enumerate(report.assignment):
        if number is None:
            continue
        joints = report.shown.scores.joints_of(report.shown.rows[number], goal)
        if joints is not None:
            angles = (f"{math.degrees(q):.2f}" for q in joints[-len(arm_joints) :].tolist())
            rows.append([str(goal + 1), str(number + 1), *angles])
    names = (frame_name(name.removesuffix("_joint")) for name in arm_joints)
    return Table(
        "Arm joints [deg] at each goal, rounded from those in the file.",
        [Column("Goal"), Column("Stop"), *(Column(name) for name in names)],
        rows,
    )


def _result_cell(result: GoalResult, *, is_used: bool) -> Cell:
    """Return the result for a goal at a stop."""
    if result.reason == Reason.REACHED:
        return Cell(f"{result.measure:.3f}", "good" if is_used else "plain")
    contact = "" if result.pair is None else f" ({pair_text(result.pair)})"
    return Cell(REASON_TEXTS[result.reason] + contact, "quiet")


def _drake_cell(report: ScoreReport, goal: int) -> Cell:
    """Return whether Drake confirms the posture at a goal."""
    if goal not in report.findings:
        return Cell("–", "quiet")
    return Cell("confirmed") if report.is_confirmed(goal) else Cell("REFUTED", "bad")


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


def verification_table(report: ScoreReport) -> Table:
    """Return the result of the verification, and its verdict."""
    found = report.verification
    rows: list[list[Cell | str]] = []
    for line in check_lines(found.to_json()):
        value: Cell | str = line.value
        if line.text == "false":
            value = Cell(line.value, _tone(found.false_reached == 0))
        rows.append([f"– {line.text}" if line.is_detail else _sentence_case(line.text), value])
    verdict = found.verdict
    if found.is_sound and not report.is_sound:
        verdict = "THESE ANSWERS HOLD, BUT SOME POSTURES IN THE SECTION GOALS ARE FALSE"
    rows.append(["Verdict", Cell(verdict, _tone(report.is_sound))])
    return Table(
        "Verification made with this report: pairs drawn at random from all state tables of the "
        f"file, seed {report.sizes.seed}.",
        [Column("Check", is_number=False), Column("Result")],
        rows,
    )


def success_table(report: ScoreReport) -> Table | None:
    """Return the estimated success under error; None if the file holds no estimates."""
    success = report.success
    if success is None:
        return None
    sets = report.scored.sets
    shown = report.shown
    named = [("the set shown here", shown.members, report.scores, shown.success)]
    for most in range(1, success.members.shape[1] + 1):
        if flat := success.most_robust(sets, max_members=most):
            name = f"most robust set of {'one' if most == 1 else f'up to {most}'}"
            configurations = tuple(report.job.grid.configuration(h) for h in flat)
            named.append((name, configurations, sets.scores_of(flat), estimate_of(success, flat)))
    rows: list[list[Cell | str]] = []
    for name, members, scores, found in named:
        estimate = ["no estimate", "–", "–"]
        if found is not None:
            interval = f"{percent(found.low)} to {percent(found.high)}"
            estimate = [percentage(found.mean), interval, f"{found.samples:,}"]
        rows.append(
            [
                name,
                " and ".join(member_text(member.to_json()) for member in members) or "none",
                percentage(scores[0]),
                f"{scores[1]:.3f}",
                *estimate,
            ]
        )
    what = "the rooms in which all goals are done" if success.counts_rooms else "the goals reached"
    return Table(
        f"Estimated percentage of {what}, in the randomly perturbed environment. The most robust "
        "set has the greatest lower confidence bound.",
        [
            Column("Set", is_number=False),
            Column("Configurations", is_number=False),
            Column("P_R"),
            Column("P_M"),
            Column("Under error"),
            Column("95% interval"),
            Column("Samples"),
        ],
        rows,
    )


def _tone(is_good: bool) -> Tone:
    return "good" if is_good else "bad"


def _sentence_case(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}"
