"""The commands that reproduce a score file and its report."""

from __future__ import annotations

import os
import shlex
from pathlib import Path
from typing import Any

from tcs.output.report.score.report import ScoreReport
from tcs.placement.constraints import constraint_texts
from tcs.placement.store import APPROACH, PAPER, WITHOUT_APPROACH, ScoreFile, state_to_json

PAPER_DISTANCE = 0.40
"""Default distance of two members [m], from the TCS paper."""


def commands(report: ScoreReport, command: str) -> str:
    """Return the commands that make the file and the report, one per line.

    Args:
        report: The report.
        command: The command that made the report.
    """
    return "\n".join(
        part
        for part in (
            score_command(report),
            robustify_command(report),
            refine_command(report),
            command,
        )
        if part
    )


def refine_command(report: ScoreReport) -> str:
    """Return the command that refined the table of the report; "" if none did."""
    settings = report.file.metadata.get("refinement", [None] * len(report.file.tables))
    found = settings[report.shown.table]
    if found is None:
        return ""
    words = ["tcs", "refine", str(report.path), "--objective", found["objective"]]
    words += ["--starts", str(found["starts"]), "--rounds", str(found["rounds"])]
    if found["samples"] is not None:
        words += ["--samples", str(found["samples"])]
    if found["objective"] == "score" and not found["keep_success"]:
        words.append("--no-keep-success")
    words += _collisions(report, found.get("body_collisions", "paper"))
    words += ["--seed", str(found["seed"])]
    if report.shown.table != report.file.nominal_index:
        words += _observed(report)
    return shlex.join(words)


def score_command(report: ScoreReport) -> str:
    """Return the command that scores the file; the current models are those of the file."""
    file, sets = report.file, report.scored.sets
    words = ["tcs", "score", as_given(file, "task")]
    words += ["--environment", as_given(file, "environment"), "--robot", as_given(file, "robot")]
    words += ["--measure", report.measure, "--rules", sets.rule]
    words += ["--max-members", str(sets.max_members)]
    if sets.same_environment:
        words.append("--same-environment")
    if PAPER in file.metadata:
        words.append("--paper")
    elif APPROACH in file.metadata:
        words.append("--approach")
    elif WITHOUT_APPROACH not in file.metadata:
        words.append("--no-approach")
    for key, value in file.metadata.get("person", {}).get("given", {}).items():
        words += ["--person", f"{key}={value}"]
    for constraint in constraint_texts(file):
        option, _, value = constraint.partition(" ")
        words += [f"--{option}", value]
    if "observation" in file.metadata:
        words += _observed(report)
    line = shlex.join([*words, "--out", str(report.path)])
    if abs(sets.min_distance - PAPER_DISTANCE) > 1e-9:
        line += f"  # in Python, with min_distance={sets.min_distance:g}"
    return line


def as_given(file: ScoreFile, key: str) -> str:
    """Return the name or path of a data file as it was given to `tcs score`.

    A relative path that is not valid in the current folder is returned as an absolute path.

    Args:
        file: The score file.
        key: "task", "environment" or "robot".
    """
    located = str(file.metadata[key])
    given = str(file.metadata.get("given", {}).get(key, located))
    return given if str(Path(os.path.expanduser(given)).absolute()) == located else located


def robustify_command(report: ScoreReport) -> str:
    """Return the command that estimates the success; "" if the file holds no estimates."""
    record = success_record(report)
    if record is None:
        return ""
    words = ["tcs", "robustify", str(report.path)]
    words += ["--sets", str(record["sets"]), "--samples", str(record["samples"])]
    words += ["--seed", str(record["seed"])]
    words += _collisions(report, record["body_collisions"])
    if not record["environment_errors"]:
        words += ["--errors", "ERRORS.yaml"]
    records = report.file.metadata["robustness"]
    if any(other != record for other in records):
        words += _observed(report)
    return shlex.join(words)


def _collisions(report: ScoreReport, counted: str) -> list[str]:
    """Return the option that names the counted collisions, [] if they are those by default."""
    default = "paper" if PAPER in report.file.metadata else "all"
    return [] if counted == default else ["--body-collisions", counted]


def success_record(report: ScoreReport) -> dict[str, Any] | None:
    """Return the record of how the success was estimated; None without estimates."""
    records = report.file.metadata.get("robustness")
    if not isinstance(records, list) or report.success is None:
        return None
    record = records[report.shown.table]
    return record if isinstance(record, dict) else None


def _observed(report: ScoreReport) -> list[str]:
    """Return the options that name the observed state of the table."""
    state = report.file.observed_states[report.shown.table]
    shown = state_to_json(report.file.observed_axes, state)
    return [word for name, value in shown.items() for word in ("--observed", f"{name}={value:.9g}")]
