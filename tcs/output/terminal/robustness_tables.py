"""Results on success under error as text."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from typing import Any

import typer

from tcs.output.terminal.console import results_console
from tcs.output.terminal.tables import members_table, new_table
from tcs.output.words import member_text, settings_text
from tcs.output.words.robustness import BODY_COLLISIONS, error_width


def report_evaluation(result: Mapping[str, Any]) -> None:
    """Print the success of a set under error."""
    out = results_console()
    if result["members"]:
        out.print(members_table(result["members"]))
    else:
        out.print(f"one of {result['choices']:,} sets with equal P_R is drawn for each sample")
    interval = ""
    if result["ci95"] is not None:
        low, high = result["ci95"]
        interval = f" (95 % interval {low:.1%} to {high:.1%})"
    out.print(
        f"without error {result['reachability']:.1%} of the goals, manipulability "
        f"{result['manipulability']:.3f}"
    )
    out.print(
        f"under error {result['mean']:.1%} of the goals{interval}, "
        f"standard deviation {result['std']:.1%}; all goals in {result['complete']:.1%} of "
        f"{result['samples']:,} samples"
    )
    goals = ", ".join(f"{i}: {part:.1%}" for i, part in enumerate(result["per_goal"], start=1))
    out.print(f"by goal  {goals}")
    widths = ", ".join(f"{joint} {error_width(error)}" for joint, error in result["errors"].items())
    out.print(f"errors  {widths}")
    out.print(f"collisions  {BODY_COLLISIONS[result['body_collisions']]}")
    if result["approach"]:
        out.print("a goal counts only if a posture there can be approached, as in the file")
    if result["clipped"]:
        out.print(f"in {result['clipped']:,} samples an error was limited by a joint limit")
    out.print(f"seed {result['seed']}, {result['seconds']:.1f} s")


def report_plan_success(result: Mapping[str, Any]) -> None:
    """Print how often the motions of a plan stay free under error."""
    out = results_console()
    samples = f"{result['samples']:,} samples"
    played = _with_interval(result["blind"])
    out.print(f"played as planned, all motions stay free of contact in {played} of {samples}")
    if result["replanned"] is not None:
        again = _with_interval(result["replanned"])
        out.print(f"planned anew, all goals of the plan can be done in {again}")
    widths = ", ".join(f"{joint} {error_width(error)}" for joint, error in result["errors"].items())
    out.print(f"errors  {widths}")
    if result["clipped"]:
        out.print(f"in {result['clipped']:,} samples an error was limited by a joint limit")
    out.print(f"seed {result['seed']}, {result['seconds']:.1f} s")


def _with_interval(found: Mapping[str, Any]) -> str:
    """Return a mean with its interval, if it has one."""
    if found["ci95"] is None:
        return f"{found['mean']:.1%}"
    low, high = found["ci95"]
    return f"{found['mean']:.1%} (95 % interval {low:.1%} to {high:.1%})"


def report_robustified(result: Mapping[str, Any]) -> None:
    """Print the most robust set of each size with its estimate."""
    out = results_console()
    table = new_table("observed", "set", ">success", ">95 % interval", ">sets", "members")
    for row in result["tables"]:
        state = settings_text(row["observed"]) or "-"
        for best in row["best"]:
            low, high = best["ci95"]
            table.add_row(
                state,
                f"of {len(best['members'])}",
                f"{best['success']:.1%}",
                f"{low:.1%} to {high:.1%}",
                f"{best['sets']:,}",
                "; ".join(member_text(member) for member in best["members"]),
            )
        if (refined := row["refined"]) is not None:
            low, high = refined["ci95"]
            table.add_row(
                state,
                "refined",
                f"{refined['success']:.1%}",
                f"{low:.1%} to {high:.1%}",
                f"{refined['sets']:,}",
                "; ".join(member_text(member) for member in refined["members"]),
            )
    out.print(table)
    out.print(f"wrote {result['file']}. To select by success, with the current base X Y YAW_DEG:")
    typer.echo(f"tcs select {shlex.quote(result['file'])} --here X Y YAW_DEG --delta 1")
