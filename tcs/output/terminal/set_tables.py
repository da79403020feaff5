"""What becomes of sets as text: success under error, people served, motions, refinement."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from typing import Any

import typer

from tcs.output.terminal.console import results_console
from tcs.output.terminal.tables import members_table, new_table
from tcs.output.words import (
    base_pose_text,
    goal_text,
    member_text,
    percentage,
    scores_text,
    settings_text,
)
from tcs.output.words.success import (
    BODY_COLLISIONS,
    DONE_BY,
    NOT_DONE_TEXTS,
    error_width,
    measure_name,
    not_done_text,
    part_text,
    place_text,
)


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
        f"standard deviation {result['std']:.1%}"
    )
    exact = ""
    if result["samples"] > 1:
        low, high = result["rooms_done_ci95"]
        exact = f" (95 % interval {low:.1%} to {high:.1%})"
    out.print(
        f"all goals done in {result['rooms_done']:.1%} of {result['samples']:,} samples{exact}, "
        f"reached in {result['complete']:.1%}"
    )
    out.print(DONE_BY[result["done_by"]])
    goals = ", ".join(f"{i}: {part:.1%}" for i, part in enumerate(result["per_goal"], start=1))
    out.print(f"by goal  {goals}")
    widths = ", ".join(f"{joint} {error_width(error)}" for joint, error in result["errors"].items())
    out.print(f"errors  {widths}")
    out.print(f"collisions  {BODY_COLLISIONS[result['body_collisions']]}")
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
        low, high = result["rooms_done_ci95"]
        out.print(
            f"all goals of the task can be done in {result['rooms_done']:.1%} "
            f"(95 % interval {low:.1%} to {high:.1%})"
        )
    out.print(f"collisions  {BODY_COLLISIONS[result['body_collisions']]}")
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
    for row in result["tables"]:
        by = row["settings"].get("done_by")
        if by is not None and any(best["rooms_done"] == best["success"] for best in row["best"]):
            out.print(f"success: the fraction of rooms in which all goals are done; {DONE_BY[by]}")
            break
    out.print(f"wrote {result['file']}. To select by success, with the current base X Y YAW_DEG:")
    typer.echo(f"tcs select {shlex.quote(result['file'])} --here X Y YAW_DEG --delta 1")


def report_population(result: Mapping[str, Any]) -> None:
    """Print whom each set serves, and who is left out."""
    out = results_console()
    table = new_table(">set", ">served", ">95 % interval", ">goals, mean", "members")
    for number, one in enumerate(result["sets"], 1):
        members = "; ".join(member_text(member) for member in one["members"])
        mean = percentage(one["mean"])
        table.add_row(str(number), percentage(one["served"]), _interval(one), mean, members)
    out.print(table)
    people = f"{result['bodies']:,} people ({result['women']:,} women)"
    errors = "" if result["errors"] is None else ", each under random errors"
    out.print(f"{people}{errors}; a set serves those for whom it reaches all goals")
    if result["without_approach"]:
        out.print("for them a goal counts that a posture reaches, approached or not")
    most = result["sets"][result["serves_most"]]
    out.print(f"set {result['serves_most'] + 1} serves most: {percentage(most['served'])}")
    two = result["two_sets"]
    if two is not None:
        first, second = (number + 1 for number in two["sets"])
        out.print(
            f"sets {first} and {second} together serve most: {percentage(two['served'])} "
            f"({_interval(two)})"
        )
    _report_not_served(result)
    if "map" in result:
        out.print(f"wrote {result['map']}")
    out.print(f"seed {result['seed']}, {result['seconds']:.1f} s")


def _report_not_served(result: Mapping[str, Any]) -> None:
    """Print whom the best set does not serve, and which goals it does not reach."""
    out, lost = results_console(), result["not_served"]
    if lost["criterion"] != "all goals":
        out.print(
            "the best set does not reach all goals for the person who was scored; those that it "
            f"reaches then, it reaches for {percentage(result['served_as_scored'])} of the people"
        )
    if not lost["bodies"]:
        return
    out.print(f"set 1 does not serve {lost['bodies']:,} people:")
    table = new_table("people with", ">people", ">served by set 1")
    for part in lost["parts"]:
        table.add_row(part_text(part), f"{part['bodies']:,}", percentage(part["served"]))
    out.print(table)
    telling = [
        f"{measure_name(one['measure'])} ({'greater' if one['auc'] > 0.5 else 'smaller'} in "
        f"{percentage(max(one['auc'], 1.0 - one['auc']), 0)} of the pairs)"
        for one in lost["measures"]
    ]
    out.print(f"compared with a person who is served: {', '.join(telling)}")
    for goal in lost["goals"]:
        touching = ""
        if goal["gripper_touches"] > 0.0:
            touching = (
                f"; the gripper touches something at the goal itself for "
                f"{percentage(goal['gripper_touches'])}"
            )
        out.print(
            f"goal {goal_text(goal['goal'], goal['name'])} is not reached for "
            f"{percentage(goal['not_reached'])}{touching}"
        )


def _interval(one: Mapping[str, Any]) -> str:
    low, high = one["ci95"]
    return f"{percentage(low)} to {percentage(high)}"


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


def report_refined(result: Mapping[str, Any]) -> None:
    """Print the best refined set and what it gained."""
    out = results_console()
    before, after = result["before"], result["after"]
    out.print(members_table(after["members"]))
    for name, found in (("best of the grid", before), ("refined", after)):
        scores = scores_text(found["reachability"], found["manipulability"], result["measure"])
        out.print(f"{name}: {scores}")
    total = after["reachability"] + after["manipulability"]
    gain = total - before["reachability"] - before["manipulability"]
    out.print(f"P_R + P_M changes by {gain:+.4f} to {total:.4f}")
    if result["success"] is not None:
        success = result["success"]
        cause = "with the base displaced" if result["displaced"] else "under error"
        out.print(
            f"success {cause} from {success['before']:.1%} to {success['after']:.1%}, in "
            f"{success['samples']:,} other samples than those that chose the set"
        )
        if not result["displaced"]:
            out.print(f"under error, collisions {BODY_COLLISIONS[result['body_collisions']]}")
    out.print(
        f"{result['sets']} sets refined, {result['scored']:,} configurations scored in "
        f"{result['seconds']:.1f} s; wrote {result['file']}"
    )
