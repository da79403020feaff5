"""Tables of a score report about its set: the stops, the goals and the arm joints."""

from __future__ import annotations

import math

from tcs.output.report.blocks import Cell, Column, Table
from tcs.output.report.score.report import GoalResult, ScoreReport
from tcs.output.words import (
    REASON_TEXTS,
    assigned_goals,
    axis_title,
    axis_value,
    frame_name,
    goal_list,
    goal_place,
    pair_text,
    percentage,
)
from tcs.placement.tables import Reason


def stops_table(report: ScoreReport) -> Table:
    """Return the configuration of each stop, in the order of the tour."""
    members = [member.to_json() for member in report.shown.members]
    rows = [
        [
            str(number + 1),
            *(axis_value(key, value) for key, value in member.items()),
            goal_list(assigned_goals(report.assignment, number), report.goal_names) or "none",
        ]
        for number, member in enumerate(members)
    ]
    return Table(
        "The stops in the order of the tour. The base pose is given in the frame of the "
        f"environment: {report.job.spec.environment.origin}",
        [Column("Stop"), *(Column(axis_title(key)) for key in members[0]), Column("Serves goals")],
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
