"""The report of one score file: where to stand, how good that is, why, and how it was checked."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

from tcs.output.report.blocks import (
    Block,
    Bullets,
    Code,
    Facts,
    Folded,
    Page,
    Picture,
    Section,
    Text,
)
from tcs.output.report.machine import machine, today, versions
from tcs.output.report.reproduce import as_given, commands, estimated
from tcs.output.report.score_report import ScoreReport
from tcs.output.report.score_tables import (
    goals_table,
    joints_table,
    pairs_table,
    reasons_table,
    stops_table,
    success_table,
    verification_table,
)
from tcs.output.words import (
    REASON_TEXTS,
    assigned_goals,
    base_pose_text,
    frame_name,
    goal_list,
    goals_text,
    percent,
    settings_text,
)
from tcs.output.words.robustness import error_width
from tcs.placement.store import state_to_json
from tcs.placement.tables import SetTable

LIMITS = (
    "Goals are checked one by one, with everything standing still: no approach, no way of the arm "
    "from one goal to the next, and no way of the base between stops has been checked."
)


def score_page(report: ScoreReport, *, command: str) -> Page:
    """Return the report as a page.

    Args:
        report: What a score file answers.
        command: What made this report.
    """
    spec = report.job.spec
    sections = [Section("In short", _summary(report)), Section("From above", _map(report))]
    if report.states is not None:
        sections.append(Section("For each state of the room", _states(report)))
    if report.views:
        sections.append(Section("Each stop", _views(report)))
    sections += [
        Section("Goal by goal", _goals(report)),
        Section("Why not elsewhere", _reasons(report)),
        Section("Checked again", _verification(report)),
        Section("When the room is a little off", _success(report)),
        Section("How to make it again", _made(report, command)),
    ]
    return Page(
        title=report.job.task.title,
        lead=f"Where should the robot stand? {spec.environment.title}. {spec.robot.title}.",
        sections=sections,
        foot=f"tcs {versions()[0][1]}, {today()}.",
    )


def _summary(report: ScoreReport) -> list[Block]:
    """Return the answer in a few sentences, and the stops."""
    reachability, manipulability = report.scores
    members, goals = len(report.shown.members), report.goals
    if not members:
        said = [f"None of the {goals} goals is reached from anywhere on the grid."]
        return [Bullets([*said, *_hopeless(report), _soundness(report), LIMITS])]
    reached = goals - len(report.unreached)
    places = ("one place", "two places together", "three places together")[members - 1]
    said = [
        f"From {places} the robot reaches {reached} of {goals} goals (P_R "
        f"{percent(reachability)} %); P_M is {manipulability:.3f} ({report.measure})."
    ]
    if report.unreached:
        said.append(
            f"Not reached: {goal_list(report.unreached)}. "
            "Goal by goal says why, and what would help."
        )
    if report.shown.here is not None:
        here = base_pose_text(report.shown.here.to_json())
        said.append(f"At the default weights it is the set to choose for a robot at {here}.")
    else:
        of_all = "" if report.max_members is None else f" of at most {report.max_members}"
        said.append(
            f"Of the sets{of_all} that the file keeps, it is the one with the greatest P_R + P_M, "
            "wherever the robot is now."
        )
    state = report.file.observed_states[report.shown.table]
    if state:
        shown = state_to_json(report.file.observed_axes, state)
        tables = len(report.file.tables)
        said.append(
            f"It holds where this is found: {settings_text(shown)}"
            + (f"; the file answers for {tables} such states." if tables > 1 else ".")
        )
    said += _success_in_short(report)
    return [Bullets([*said, _soundness(report), LIMITS]), stops_table(report)]


def _hopeless(report: ScoreReport) -> list[str]:
    """Return what stopped the configurations that came nearest to reaching a goal."""
    found: dict[str, list[int]] = {}
    for goal, spread in enumerate(report.distributions):
        if spread.reached == 0 and spread.farthest is not None:
            found.setdefault(REASON_TEXTS[spread.farthest.reason], []).append(goal)
    return [
        f"{goals_text(goals).capitalize()}: reached from nowhere on the grid; what came nearest "
        f"was stopped by this: {why}."
        for why, goals in found.items()
    ]


def _soundness(report: ScoreReport) -> str:
    found = report.verification
    if not report.is_sound:
        return (
            "SOME ANSWERS OF THE FILE ARE FALSE: do not use it. What is wrong is told under Goal "
            "by goal and Checked again."
        )
    said = []
    if found.checked:
        shown = f"each of the {len(report.findings)} postures shown here and "
        said.append(
            f"Drake confirms {shown if report.findings else ''}all of {found.checked:,} stored "
            "answers drawn at random"
        )
    elif report.findings:
        said.append(f"Drake confirms each of the {len(report.findings)} postures shown here")
    if found.dense_checked:
        said.append(
            f"of {found.dense_checked:,} unreached pairs drawn at random {found.missed:,} turned "
            "out to be reachable"
        )
    return f"{'; '.join(said) or 'Nothing was re-checked with Drake'}."


def _success_in_short(report: ScoreReport) -> list[str]:
    if report.success is None:
        return []
    row = report.success.row_of(tuple(sorted(report.shown.indices)))
    if row is None:
        return []
    low, high = float(report.success.low[row]), float(report.success.high[row])
    return [
        "With the room off at random it is estimated to reach "
        f"{percent(float(report.success.success[row]))} % (95 % between {percent(low)} and "
        f"{percent(high)} %)."
    ]


def _map(report: ScoreReport) -> list[Block]:
    return [
        Picture(
            report.map,
            "png",
            "The room from above, twice: every place coloured by the share of the goals reached "
            "from it, and by manipulability, with the bases of the robot at the chosen places.",
            "Each place shows the best that a robot standing there can do by itself; two places "
            "together can do more than either. Grey: it cannot stand there.",
        )
    ]


def _states(report: ScoreReport) -> list[Block]:
    assert report.states is not None
    return [
        Picture(
            report.states,
            "png",
            "The same map once for each state of the room that can be set, in rows and columns.",
            "One colour scale for all. Each stop is marked in the panel of the state it wants.",
        )
    ]


def _views(report: ScoreReport) -> list[Block]:
    blocks: list[Block] = []
    for number, view in enumerate(report.views, start=1):
        goals = assigned_goals(report.assignment, number - 1)
        served = goals_text(goals) if goals else "no goal"
        blocks.append(
            Picture(
                view,
                "png",
                f"The robot at stop {number} with its arm at a goal, and the tool there, nearer.",
                f"Stop {number}, serves {served}. The robot is drawn as the shapes that "
                "contacts are checked with; they enclose it. Arrows end where the tool has to be.",
            )
        )
    return blocks


def _goals(report: ScoreReport) -> list[Block]:
    blocks: list[Block] = [goals_table(report)]
    blocks += [Text(said) for said in _hopeless(report)]
    for goal in report.unreached if report.shown.members else ():
        fix = report.explanation(goal).fix
        if fix is not None:
            blocks.append(Text(f"Goal {goal} would be reached from stop 1 so: {fix.sentence}"))
    if report.shown.members:
        blocks.append(Folded("Arm joints", [joints_table(report)]))
    return blocks


def _reasons(report: ScoreReport) -> list[Block]:
    blocks: list[Block] = [
        Text(
            "Checked in this order: does the body of the robot touch anything; does the gripper at "
            "the goal; is the goal within reach; is there a posture within the joint limits; is "
            "there one in which the arm touches nothing."
        ),
        reasons_table(report),
    ]
    pairs = pairs_table(report)
    if pairs.rows:
        blocks.append(pairs)
    return blocks


def _verification(report: ScoreReport) -> list[Block]:
    if not report.check.pairs and not report.check.dense:
        return [Text("Nothing was re-checked when this report was made: no pairs were asked for.")]
    return [
        Text(
            "Each stored answer that is drawn is set in Drake's own model of the scene: is the "
            "tool at the goal, are the joints within their limits, is everything as far apart as "
            "it has to be, and is the measure that of Drake's Jacobian?"
        ),
        verification_table(report),
    ]


def _success(report: ScoreReport) -> list[Block]:
    table = success_table(report)
    made = estimated(report)
    if table is None or made is None:
        return [
            Text("Nothing is estimated in this file. This estimates it, for the best sets:"),
            Code(shlex.join(["tcs", "robustify", str(report.path)])),
        ]
    widths = "; ".join(
        f"{frame_name(joint)} ({error_width(error)})" for joint, error in made["errors"].items()
    )
    base = "the base must stay free" if made["check_base"] else "the base is not checked again"
    blocks: list[Block] = [
        Text(
            f"Estimated by tcs {made['program_version']} from up to {made['samples']:,} samples, "
            f"seed {made['seed']}, with errors on {widths}; {base}. The configuration is not "
            "planned anew, the arm is."
        ),
        table,
    ]
    if len(report.shown.indices) and report.success is not None:
        if report.success.row_of(tuple(sorted(report.shown.indices))) is None:
            blocks.append(
                Text(
                    "The set shown here was none of those that raced; tcs evaluate tries the best "
                    "set of a file."
                )
            )
    return blocks


def _kept(sets: SetTable) -> str:
    """Return which sets a table holds, and how many."""
    apart = f", members {sets.min_distance:g} m apart or more" if sets.max_members > 1 else ""
    return f"rule {sets.rule}{apart}, {sets.sets:,} in this table"


def _configurations(report: ScoreReport) -> str:
    size, tables = report.job.grid.size, len(report.file.tables)
    return f"{size:,}" if tables == 1 else f"{size:,} in each of {tables} tables"


def _made(report: ScoreReport, command: str) -> list[Block]:
    file = report.file
    timings, metadata = file.metadata["timings"], file.metadata
    seconds = timings["total_seconds"] - timings["compile_seconds"]
    scored: Sequence[tuple[str, str]] = (
        ("Score file", f"{report.path.name}, SHA-256 {report.sha256}"),
        ("Scored by", f"tcs {metadata['program_version']}, {metadata['created']}"),
        ("Task", as_given(file, "task")),
        ("Environment", as_given(file, "environment")),
        ("Robot", as_given(file, "robot")),
        ("Scene", f"SHA-256 {metadata['scene_digest']}; the models of today are the same"),
        ("Inverse kinematics", report.verification.ik),
        ("Configurations", _configurations(report)),
        ("Sets kept", _kept(report.scored.sets)),
        ("Time to score", f"{seconds:.1f} s when the file was made, compiling aside"),
    )
    return [
        Code(commands(report, command)),
        Facts(scored),
        Facts(
            [
                *versions(),
                *machine(),
                ("Re-checked", f"{report.check.pairs:,} pairs, {report.check.dense:,} scanned"),
                ("Time of this report", f"{report.seconds:.1f} s"),
            ]
        ),
    ]
