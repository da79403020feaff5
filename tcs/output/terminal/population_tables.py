"""Which people the best sets serve, as text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tcs.output.terminal.console import results_console
from tcs.output.terminal.tables import new_table
from tcs.output.words import goal_text, member_text, percentage
from tcs.output.words.population import measure_name, part_text


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
