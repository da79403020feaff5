"""The summary of a score report: the set, its scores, and the result of the verification."""

from __future__ import annotations

from tcs.output.report.blocks import Block, Bullets
from tcs.output.report.score.report import ScoreReport
from tcs.output.report.score.tables import stops_table
from tcs.output.words import (
    REASON_TEXTS,
    base_pose_text,
    gain_text,
    goals_text,
    percent,
    percentage,
    person_text,
    settings_text,
    stop_places,
)
from tcs.output.words.success import success_text
from tcs.placement.constraints import constraint_texts
from tcs.placement.store import APPROACH, WITHOUT_APPROACH, state_to_json
from tcs.placement.tables import Reason

_BASES = {
    "success": "the most robust one, with the greatest lower confidence bound of the success under "
    "error",
    "goals": "the one that reaches most goals, of these one with the fewest stops, of these the "
    "one with the greatest P_M",
    "utility": "the one with the greatest utility by the default weights",
}
"""Why a set is recommended, by `Choice.basis`."""
PATHS = "the path of the arm between goals and the path of the base between stops are not"
"""What no score file says anything about."""


def summary_blocks(report: ScoreReport) -> list[Block]:
    """Return the summary: what is reached from where, and the stops."""
    reachability, manipulability = report.scores
    members, goals = len(report.shown.members), report.goals
    if not members:
        text = f"No configuration of the grid reaches any of the {goals} goals."
        return [Bullets([text, *unreached_everywhere(report), _soundness(report), _limits(report)])]
    reached = goals - len(report.unreached)
    stops = ("one base pose", "two base poses", "three base poses")[members - 1]
    items = [
        f"From {stops} the robot reaches {reached} of {goals} goals (P_R "
        f"{percentage(reachability)}); P_M is {manipulability:.3f} ({report.measure})."
    ]
    items += stop_places(report.shown.places)
    if report.unreached:
        items.append(
            f"Not reached: {goals_text(report.unreached, report.goal_names)}. The section Goals "
            "gives the reasons and the changes that would help."
        )
    of_size = "" if report.max_members is None else f" of at most {report.max_members}"
    here = "wherever the robot is now"
    if report.shown.here is not None:
        here = f"for a robot at {base_pose_text(report.shown.here.to_json())}"
    if report.shown.choice is not None:
        why, gain = _BASES[report.shown.choice.basis], gain_text(report.shown.choice)
        items.append(f"Recommended {here}, of the sets{of_size} in the file: {why}.")
        items += [f"{gain}."] if gain else []
    state = report.file.observed_states[report.shown.table]
    if state:
        values = settings_text(state_to_json(report.file.observed_axes, state))
        tables = len(report.file.tables)
        of_states = f" (one of {tables} states in the file)" if tables > 1 else ""
        items.append(f"The scores are those of the observed state {values}{of_states}.")
    items += _person(report) + _constraints(report) + _success(report)
    return [Bullets([*items, _soundness(report), _limits(report)]), stops_table(report)]


def unreached_everywhere(report: ScoreReport) -> list[str]:
    """Return the goals that no configuration reaches, with the last check that stopped them."""
    found: dict[str, list[int]] = {}
    for goal, counts in enumerate(report.distributions):
        if counts.reached == 0 and counts.farthest is not None:
            found.setdefault(REASON_TEXTS[counts.farthest.reason], []).append(goal)
    return [
        f"No configuration reaches {goals_text(goals, report.goal_names)}. Result of the "
        f"configurations that passed the most checks: {reason}."
        for reason, goals in found.items()
    ]


def _person(report: ScoreReport) -> list[str]:
    """Return for whom the file was scored, if not for the papers' man."""
    entry = report.file.metadata.get("person")
    return [] if entry is None else [f"Scored for {person_text(entry)}."]


def _constraints(report: ScoreReport) -> list[str]:
    """Return the constraints under which the file was scored, if there were any."""
    texts = constraint_texts(report.file)
    if not texts:
        return []
    excluded = report.distributions[0].reasons[Reason.EXCLUDED]
    ending = f"; {excluded:,} configurations were excluded and not scored" if excluded else ""
    return [f"Scored under constraints: {'; '.join(texts)}{ending}."]


def _limits(report: ScoreReport) -> str:
    """Return what the scores do not cover."""
    text = "Each goal is checked by itself in a static scene."
    if APPROACH in report.file.metadata:
        return f"{text} Its straight approach is checked; {PATHS}."
    reason = report.file.metadata.get(WITHOUT_APPROACH)
    because = "" if reason is None else f" ({reason})"
    return f"{text} The approach to a goal{because}, {PATHS} checked."


def _soundness(report: ScoreReport) -> str:
    """Return what the verification shows."""
    found = report.verification
    if not report.is_sound:
        return (
            "SOME ANSWERS OF THE FILE ARE FALSE: do not use it. The sections Goals and "
            "Verification show which checks fail."
        )
    parts = []
    if found.checked:
        shown = f"each of the {len(report.findings)} postures shown here and "
        parts.append(
            f"Drake confirms {shown if report.findings else ''}all of {found.checked:,} stored "
            "answers drawn at random"
        )
    elif report.findings:
        parts.append(f"Drake confirms each of the {len(report.findings)} postures shown here")
    if found.dense_checked:
        parts.append(
            f"of {found.dense_checked:,} unreached pairs drawn at random, {found.missed:,} are "
            "reachable"
        )
    if not parts:
        return "Nothing was re-checked with Drake."
    text = "; ".join(parts)
    return f"{text[0].upper()}{text[1:]}."


def _success(report: ScoreReport) -> list[str]:
    """Return the estimated success of the set under error, if there is an estimate."""
    found = report.shown.success
    if found is None:
        return []
    text = success_text(percentage(found.mean), of_rooms=found.of_rooms)
    return [
        f"Estimated success in the randomly perturbed environment: {text} (95% between "
        f"{percent(found.low)} and {percentage(found.high)})."
    ]
