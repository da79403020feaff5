"""The page of a score report, as HTML, as Markdown or both, and what is on it."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tcs.errors import OutputError
from tcs.files.writing import check_writable, whole_file
from tcs.output.report.blocks import Block, Code, Collapsible, Facts, Page, Picture, Section, Text
from tcs.output.report.html import as_html
from tcs.output.report.machine import machine, today, versions
from tcs.output.report.markdown import as_markdown
from tcs.output.report.score.report import ScoreReport
from tcs.output.report.score.reproduce import commands, success_record
from tcs.output.report.score.summary import summary_blocks, unreached_everywhere
from tcs.output.report.score.tables import (
    goals_table,
    joints_table,
    pairs_table,
    reasons_table,
    success_table,
    verification_table,
)
from tcs.output.report.score.tours import tours_blocks
from tcs.output.words import (
    assigned_goals,
    frame_name,
    goal_text,
    goals_text,
    member_text,
    scores_text,
)
from tcs.output.words.success import BODY_COLLISIONS, error_width
from tcs.placement.refinement import refinement_summary
from tcs.placement.store import APPROACH
from tcs.placement.tables import SetTable


def make_score_page(report: ScoreReport, *, command: str) -> Page:
    """Return a score report as a page.

    Args:
        report: The report.
        command: The command that made it.
    """
    spec = report.job.spec
    sections = [Section("Summary", summary_blocks(report)), Section("Map", _map(report))]
    if report.states is not None:
        sections.append(Section("Maps by environment state", _states(report)))
    if report.views:
        sections.append(Section("Robot at each stop", _views(report)))
    sections.append(Section("Goals", _goals(report)))
    if report.tours is not None:
        frames = [goal.body_frame for goal in report.job.task.goals]
        sections.append(Section("Motions", tours_blocks(report.tours, frames)))
    sections += [
        Section("Reasons over the grid", _reasons(report)),
        Section("Verification", _verification(report)),
        Section("Success under error", _success(report)),
        *_refined(report),
        Section("How to reproduce", _provenance(report, command)),
    ]
    return Page(
        title=report.job.task.title,
        lead=f"Base placement. {spec.environment.title}. {spec.robot.title}.",
        sections=sections,
        foot=f"tcs {versions()[0][1]}, {today()}.",
    )


def _map(report: ScoreReport) -> list[Block]:
    return [
        Picture(
            report.map,
            "png",
            "Two maps of the environment from above, coloured by the percentage of goals reached "
            "and by manipulability, with the robot's base at each stop.",
            "The colour of a base position is the best score of a single configuration there; the "
            "score of a set can exceed those of its members. Grey: the base is blocked.",
        )
    ]


def _states(report: ScoreReport) -> list[Block]:
    if report.states is None:
        return []
    return [
        Picture(
            report.states,
            "png",
            "The map of each state of the environment, in rows and columns.",
            "All maps share one colour scale. Each stop is marked in the map of its state.",
        )
    ]


def _views(report: ScoreReport) -> list[Block]:
    blocks: list[Block] = []
    for number, view in enumerate(report.views):
        goals = assigned_goals(report.assignment, number)
        served = goals_text(goals, report.goal_names) if goals else "no goal"
        blocks.append(
            Picture(
                view,
                "png",
                f"The robot at stop {number + 1} with its arm at a goal, and a close view of the "
                "tool.",
                f"Stop {number + 1}, serves {served}. The robot is drawn as its collision shapes, "
                "which enclose it. Arrows end at the goals.",
            )
        )
    return blocks


def _goals(report: ScoreReport) -> list[Block]:
    blocks: list[Block] = [goals_table(report)]
    blocks += [Text(sentence) for sentence in unreached_everywhere(report)]
    for goal in report.unreached if report.shown.members else ():
        fix = report.explanation(goal).fix
        if fix is not None:
            lost = ""
            if fix.lost:
                lost = f" No longer reached then: {goals_text(fix.lost, report.goal_names)}."
            blocks.append(
                Text(
                    f"The cheapest change from stop 1 that reaches goal "
                    f"{goal_text(goal, report.goal_names[goal])} and loses "
                    f"{'fewest others' if fix.lost else 'no other'}: {fix.sentence}{lost}"
                )
            )
    if report.shown.members:
        blocks.append(Collapsible("Arm joints", [joints_table(report)]))
    return blocks


def _reasons(report: ScoreReport) -> list[Block]:
    blocks: list[Block] = [
        Text(
            "The checks in their order: contact of the robot's body; contact of the gripper at "
            "the goal with the environment or the person; reach of the arm; contact of the "
            "gripper with the robot; joint limits; contact of the arm."
        ),
        reasons_table(report),
    ]
    pairs = pairs_table(report)
    return [*blocks, pairs] if pairs.rows else blocks


def _verification(report: ScoreReport) -> list[Block]:
    if not report.sizes.pairs and not report.sizes.dense:
        return [Text("Nothing was re-checked: this report was made with --pairs 0 --dense 0.")]
    return [
        Text(
            "Stored answers drawn at random are re-checked with Drake's model of the scene: the "
            "pose of the tool, the joint limits, all distances between bodies, and the dexterity "
            "measure, computed from Drake's Jacobian."
        ),
        verification_table(report),
    ]


def _success(report: ScoreReport) -> list[Block]:
    table, record = success_table(report), success_record(report)
    if table is None or record is None:
        return [
            Text("The file contains no estimates. This command makes them for the best sets:"),
            Code(shlex.join(["tcs", "robustify", str(report.path)])),
        ]
    widths = "; ".join(
        f"{frame_name(joint)} ({error_width(error)})" for joint, error in record["errors"].items()
    )
    collisions = BODY_COLLISIONS[record["body_collisions"]]
    blocks: list[Block] = [
        Text(
            f"Estimated by tcs {record['program_version']} from up to {record['samples']:,} "
            f"samples, seed {record['seed']}, with errors of {widths}; collisions {collisions}. In "
            "each sample the configurations are unchanged and the arm postures are computed again"
            f"{', with their approaches' if APPROACH in report.file.metadata else ''}"
            f"{', and motions for the best sets' if record.get('done_by') == 'motion' else ''}."
        ),
        table,
    ]
    if report.shown.members and report.shown.success is None:
        blocks.append(
            Text(
                "There is no estimate for the set shown here. `tcs evaluate` estimates the best "
                "set of a file."
            )
        )
    return blocks


def _refined(report: ScoreReport) -> list[Section]:
    """Return what the refinement of the table gained, if there was one."""
    if report.scored.refined is None:
        return []
    found = refinement_summary(report.file, report.shown.table)
    before, after = (
        scores_text(found[key]["reachability"], found[key]["manipulability"], report.measure)
        for key in ("before", "after")
    )
    stops = "; ".join(member_text(member) for member in found["after"]["members"])
    return [
        Section(
            "Between the grid points",
            [Text(f"Best set of the grid: {before}. Refined: {after}, from {stops}.")],
        )
    ]


def _provenance(report: ScoreReport, command: str) -> list[Block]:
    metadata, timings = report.file.metadata, report.file.metadata["timings"]
    seconds = timings["total_seconds"] - timings["compile_seconds"]
    scored: Sequence[tuple[str, str]] = (
        ("Score file", f"{report.path.name}, SHA-256 {report.sha256}"),
        ("Scored by", f"tcs {metadata['program_version']}, {metadata['created']}"),
        ("Task", metadata["task"]),
        ("Environment", metadata["environment"]),
        ("Robot", metadata["robot"]),
        ("Scene", f"SHA-256 {metadata['scene_digest']}; the current models are the same"),
        ("Inverse kinematics", report.verification.ik),
        ("Configurations", _configurations(report)),
        ("Sets", _sets(report.scored.sets)),
        ("Time to score", f"{seconds:.1f} s without compilation"),
    )
    made = (
        *versions(),
        *machine(),
        ("Re-checked", f"{report.sizes.pairs:,} pairs, {report.sizes.dense:,} scanned"),
        ("Time to make this report", f"{report.seconds:.1f} s"),
    )
    return [Code(commands(report, command)), Facts(scored), Facts(made)]


def _sets(sets: SetTable) -> str:
    """Return the rule of the sets in a table, and their number."""
    apart = f", members at least {sets.min_distance:g} m apart" if sets.max_members > 1 else ""
    return f"rule {sets.rule}{apart}, {sets.sets:,} in this state table"


def _configurations(report: ScoreReport) -> str:
    size, tables = report.job.grid.size, len(report.file.tables)
    return f"{size:,}" if tables == 1 else f"{size:,} in each of {tables} state tables"


_FORMATS = {".html": as_html, ".md": as_markdown}


def report_paths(out: Path, *, markdown: bool = False) -> tuple[Path, ...]:
    """Return the files of a report, after a check that each can be written.

    Args:
        out: The page; its ending, .html or .md, decides the format.
        markdown: Whether to write the page as Markdown, too, under the same name.

    Raises:
        OutputError: If the ending is another one, or a file cannot be written.
    """
    if out.suffix.lower() not in _FORMATS:
        raise OutputError(f"Report '{out}': its name must end in one of {', '.join(_FORMATS)}.")
    beside = out.with_suffix(".md")
    paths = (out, beside) if markdown and beside != out else (out,)
    for path in paths:
        check_writable(path)
    return paths


def write_score_report(
    report: ScoreReport, paths: Sequence[Path], *, command: str
) -> dict[str, Any]:
    """Write the page of a report, and return a summary of both as plain containers.

    Args:
        report: The report.
        paths: Files to write, from `report_paths`.
        command: Command that makes the page; the page shows it.

    Raises:
        OutputError: If a file cannot be written.
    """
    page = make_score_page(report, command=command)
    sizes = [_write_page(path, page) for path in paths]
    return {"files": [str(path) for path in paths], "bytes": sizes, **report.to_json()}


def _write_page(path: Path, page: Page) -> int:
    """Write a page in the format of its ending, and return its size in bytes."""
    content = _FORMATS[path.suffix.lower()](page).encode()
    with whole_file(path, "Report") as stream:
        stream.write(content)
    return len(content)
