"""Plans of motions, and what can be done, as text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tcs.output.terminal.console import results_console
from tcs.output.terminal.tables import new_table
from tcs.output.words import base_pose_text
from tcs.output.words.motions import NOT_DONE_TEXTS, not_done_text, place_text


def report_plan(result: Mapping[str, Any]) -> None:
    """Print the tour of each stop, and why goals are not done."""
    out = results_console()
    for number, stop in enumerate(result["stops"], start=1):
        out.print(f"stop {number}: {base_pose_text(stop)}, torso {stop['torso']:.2f} m")
        if not stop["segments"]:
            out.print("  no goal can be done from here")
            continue
        table = new_table("motion", "from", "to", ">duration [s]", ">edges")
        for segment in stop["segments"]:
            ends = [place_text(segment[key]) for key in ("from", "to")]
            table.add_row(
                segment["type"], *ends, f"{segment['duration']:.2f}", str(segment["edges"])
            )
        out.print(table)
        out.print(f"{stop['duration']:.1f} s in all")
        if not stop["returns"]:
            out.print("no path back to the rest posture was found")
    for goal in result["results"]:
        if not goal["done"]:
            out.print(not_done_text(goal))
    verified = result["verified"]
    out.print(
        f"{result['goals_done']} of {result['goals']} goals done "
        f"({result['goals_reached']} reached by a posture). Drake re-checked "
        f"{verified['edges']:,} edges, {verified['false']} of them false. "
        f"{result['seconds']:.1f} s."
    )


def report_motions(result: Mapping[str, Any]) -> None:
    """Print which goals can be done from the examined configurations."""
    out = results_console()
    table = new_table("goal", ">reached", ">can be done", ">not")
    for one in result["goals"]:
        reached, done = one["pairs"], one["done"]
        share = f"{1.0 - done / reached:.1%}" if reached else ""
        table.add_row(str(one["goal"] + 1), f"{reached:,}", f"{done:,}", share)
    out.print(table)
    for reason, count in result["not_done"].items():
        if count:
            out.print(f"{count:,} pairs: {NOT_DONE_TEXTS[reason]}")
    out.print(
        f"{result['done']:,} of {result['pairs']:,} reached pairs can be done, from "
        f"{result['configurations']:,} of {result['candidates']:,} configurations. "
        f"{result['seconds']:.1f} s. Wrote {result['file']}"
    )


def report_plan_check(result: Mapping[str, Any]) -> None:
    """Print what a re-check of a plan found."""
    results_console().print(
        f"{result['verdict']}: {result['edges']:,} edges re-checked, {result['false']} false, "
        f"{result['jumps']} jumps; {result['goals']} goals, tool within "
        f"{result['max_position_error']:.1e} m; at most {result['velocity']:.1%} of the velocity "
        f"limits and {result['acceleration']:.1%} of the acceleration limits"
        + ("" if result["jerk"] is None else f", {result['jerk']:.1%} of the jerk limits")
        + f"; straight motions within {result['max_line_error']:.1e} m and rad of their lines, "
        f"the tool at most at {result['tool_speed']:.4f} m/s"
    )
