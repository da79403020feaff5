"""The tables of a score file's report."""

from __future__ import annotations

import math
from collections import Counter

from tcs.output.report.blocks import Cell, Column, Table, Tone
from tcs.output.report.score_report import GoalResult, ScoreReport
from tcs.output.words import (
    REASON_NAMES,
    REASON_TEXTS,
    assigned_goals,
    axis_title,
    axis_value,
    body_name,
    frame_name,
    goal_list,
    member_text,
    pair_text,
    percent,
)
from tcs.placement.reasons.distribution import CHECKS
from tcs.placement.tables import Reason

MOST_PAIRS = 4
"""Pairs of bodies that are told for each reason."""


def stops_table(report: ScoreReport) -> Table:
    """Return where the robot is to stand, stop by stop."""
    members = [member.to_json() for member in report.shown.members]
    names = list(members[0])
    rows = [
        [
            str(number),
            *(axis_value(name, member[name]) for name in names),
            _listed(report, number - 1),
        ]
        for number, member in enumerate(members, start=1)
    ]
    return Table(
        "Where to stand, in the order of the tour. x, y and heading are those of the robot's base "
        f"in the frame of the environment: {report.job.spec.environment.origin}",
        [Column("Stop"), *(Column(axis_title(name)) for name in names), Column("Best at goals")],
        rows,
    )


def goals_table(report: ScoreReport) -> Table:
    """Return what came of each goal at each stop."""
    goals = report.job.task.goals
    weighted = len({goal.weight for goal in goals}) > 1
    stops = range(len(report.shown.members))
    columns = [
        Column("Goal"),
        Column("On the", is_number=False),
        *([Column("Weight")] if weighted else []),
        Column("Reached from", is_number=False),
        *(Column(f"At stop {number + 1}", is_number=False) for number in stops),
        Column("Drake", is_number=False),
        Column("Of the grid"),
    ]
    weights = report.scored.scores.weights
    rows: list[list[Cell | str]] = []
    for g, goal in enumerate(goals):
        number = report.assignment[g]
        where = Cell("nowhere", "bad") if number is None else Cell(f"stop {number + 1}", "good")
        spread = report.distributions[g]
        rows.append(
            [
                str(g),
                frame_name(goal.body_frame),
                *([f"{weights[g]:.3f}"] if weighted else []),
                where,
                *(_verdict(report.results[stop][g], is_used=number == stop) for stop in stops),
                _confirmed(report, g),
                f"{percent(spread.reached / spread.configurations, 2)} %",
            ]
        )
    return Table(
        f"What came of each goal at each stop: {report.measure} of the best arm posture free of "
        "contact, or what keeps the arm from it. Drake: whether it confirms that posture. Of the "
        "grid: share of all configurations that reach the goal.",
        columns,
        rows,
    )


def joints_table(report: ScoreReport) -> Table:
    """Return the stored arm posture for each goal that is reached."""
    names = report.job.spec.robot.arm_joints
    rows = []
    for goal, number in enumerate(report.assignment):
        joints = (
            report.scored.scores.joints_of(report.shown.indices[number], goal)
            if number is not None
            else None
        )
        if number is not None and joints is not None:
            rows.append(
                [str(goal), str(number + 1), *(f"{math.degrees(q):.2f}" for q in joints.tolist())]
            )
    return Table(
        "Arm joints [deg] at each goal, as the file holds them, rounded here.",
        [
            Column("Goal"),
            Column("Stop"),
            *(Column(name.removesuffix("_joint").replace("_", " ")) for name in names),
        ],
        rows,
    )


def reasons_table(report: ScoreReport) -> Table:
    """Return how the reasons of each goal are spread over the grid."""
    kinds = (*CHECKS, Reason.REACHED)
    rows: list[list[Cell | str]] = []
    for goal, spread in enumerate(report.distributions):
        shares = [spread.reasons[kind] / spread.configurations for kind in kinds]
        rows.append(
            [
                str(goal),
                frame_name(report.job.task.goals[goal].body_frame),
                *(percent(share, 2) if share else "0" for share in shares),
            ]
        )
    configurations = report.distributions[0].configurations
    return Table(
        f"What becomes of all {configurations:,} configurations of the grid, goal by goal "
        "[% of them]. Each counts for the first check it fails, in the order of the columns.",
        [
            Column("Goal"),
            Column("On the", is_number=False),
            *(Column(REASON_NAMES[kind]) for kind in kinds),
        ],
        rows,
    )


def pairs_table(report: ScoreReport) -> Table:
    """Return which bodies block most often, over all goals."""
    counts: Counter[tuple[Reason, tuple[str, str]]] = Counter()
    for spread in report.distributions:
        for one in spread.blocking_pairs:
            counts[one.reason, one.pair] += one.count
    rows = []
    for reason in CHECKS:
        found = [(pair, n) for (why, pair), n in counts.most_common() if why == reason]
        total = sum(n for _, n in found)
        for pair, n in found[:MOST_PAIRS]:
            share = f"{percent(n / total)} %"
            rows.append(
                [REASON_NAMES[reason], body_name(pair[0]), body_name(pair[1]), f"{n:,}", share]
            )
        rest = found[MOST_PAIRS:]
        if rest:
            n = sum(times for _, times in rest)
            share = f"{percent(n / total)} %"
            rows.append([REASON_NAMES[reason], f"{len(rest)} other pairs", "", f"{n:,}", share])
    return Table(
        "What touches what, most often first, over all goals and configurations: the first contact "
        "that is found; for the arm, that of its best posture.",
        [
            Column("Reason", is_number=False),
            Column("Part", is_number=False),
            Column("Against", is_number=False),
            Column("Times"),
            Column("Of these"),
        ],
        rows,
    )


def verification_table(report: ScoreReport) -> Table:
    """Return what re-checking found."""
    found = report.verification
    samples = {"analytic": "11,520 arm angles", "numeric": "400 starts"}[found.ik]
    recall = found.recall_note or ""
    if found.recall is not None and found.recall_ci95 is not None:
        low, high = (percent(end, 2) for end in found.recall_ci95)
        recall = f"{percent(found.recall, 2)} % (95 % between {low} and {high})"
    left = "not estimated" if found.mean_shortfall is None else f"{found.mean_shortfall:.1e}"

    def greatest(error: float | None, unit: str = "") -> str:
        return "none checked" if error is None else f"{error:.1e}{unit}"

    wrong = found.false_reached + found.unconfirmed_hits
    rows: list[list[Cell | str]] = [
        ["Stored answers re-checked with Drake, drawn at random", f"{found.checked:,}"],
        ["of them false", Cell(str(found.false_reached), _tone(found.false_reached == 0))],
        ["joints beyond their limits", str(found.limit_violations)],
        ["tool off its goal, at most", greatest(found.max_position_error, " m")],
        ["tool turned off its goal, at most", greatest(found.max_rotation_error, " rad")],
        [f"stored {found.measure} off, at most", greatest(found.max_isotropy_error)],
        [f"Unreached pairs scanned densely ({samples} each)", f"{found.dense_checked:,}"],
        ["of them reachable after all", f"{found.missed:,}"],
        ["solutions of the scan that Drake refuses", str(found.unconfirmed_hits)],
        ["Share of what can be reached that is stored as reached", recall],
        [f"mean {found.measure} left behind", left],
    ]
    verdict = found.verdict
    if not found.is_sound:
        verdict = f"SOME ANSWERS ARE FALSE ({wrong})"
    elif not report.is_sound:
        verdict = "THESE HOLD, BUT NOT ALL THAT ARE SHOWN UNDER GOAL BY GOAL"
    rows.append(["Verdict", Cell(verdict, _tone(report.is_sound))])
    return Table(
        f"Re-checked when this report was made, of all tables of the file, seed "
        f"{report.check.seed}.",
        [Column("Check", is_number=False), Column("Found")],
        rows,
    )


def success_table(report: ScoreReport) -> Table | None:
    """Return the estimates of success under error; None where the file holds none."""
    success = report.success
    if success is None:
        return None
    sets = report.scored.sets
    named = [("the set shown here", tuple(sorted(report.shown.indices)))]
    named += [
        (f"the surest set of {'one' if most == 1 else f'up to {most}'}", found)
        for most in range(1, success.members.shape[1] + 1)
        if (found := success.most_robust(sets, max_members=most))
    ]
    rows: list[list[Cell | str]] = []
    for name, members in named:
        row = success.row_of(members) if members else None
        reachability, manipulability = sets.scores_of(members) if members else (0.0, 0.0)
        rows.append(
            [
                name,
                " and ".join(
                    member_text(report.job.grid.configuration(h).to_json()) for h in members
                )
                or "none",
                f"{percent(reachability)} %",
                f"{manipulability:.3f}",
                "no estimate" if row is None else f"{percent(float(success.success[row]))} %",
                "–"
                if row is None
                else f"{percent(float(success.low[row]))} to {percent(float(success.high[row]))}",
                "–" if row is None else f"{int(success.samples[row]):,}",
            ]
        )
    return Table(
        "Estimated share of the goals that are reached when the room is off at random.",
        [
            Column("Set", is_number=False),
            Column("Where", is_number=False),
            Column("P_R"),
            Column("P_M"),
            Column("Under error"),
            Column("95 %"),
            Column("Samples"),
        ],
        rows,
    )


def _verdict(verdict: GoalResult, *, is_used: bool) -> Cell:
    """Return what came of a goal at a stop."""
    if verdict.reason == Reason.REACHED:
        return Cell(f"{verdict.measure:.3f}", "good" if is_used else "plain")
    said = REASON_TEXTS[verdict.reason]
    if verdict.pair is not None:
        said += f" ({pair_text(verdict.pair)})"
    return Cell(said, "quiet")


def _confirmed(report: ScoreReport, goal: int) -> Cell:
    """Return what Drake says of the posture at a goal that the report shows."""
    if goal not in report.findings:
        return Cell("–", "quiet")
    return Cell("confirms it") if report.is_confirmed(goal) else Cell("REFUSES IT", "bad")


def _listed(report: ScoreReport, stop: int) -> str:
    return goal_list(assigned_goals(report.assignment, stop)) or "none"


def _tone(is_good: bool) -> Tone:
    return "good" if is_good else "bad"
