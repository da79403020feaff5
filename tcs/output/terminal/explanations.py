"""Explanations as text: why a goal is not reached, and the cheapest change that reaches it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.console import Console

from tcs.output.terminal.console import results_console
from tcs.output.terminal.tables import members_table, new_table
from tcs.output.words import (
    REASON_NAMES,
    REASON_TEXTS,
    axis_name,
    axis_unit,
    body_name,
    deviation_text,
    frame_name,
    goal_list,
    goal_text,
    goals_text,
    member_text,
    pair_text,
    reason_of,
    settings_text,
)
from tcs.placement.tables import Reason

MOST_PAIRS = 4
"""Most pairs of bodies printed for each reason; `--json` has all of them. The base is blocked a
thousand times as often as the arm, so one common list would show pairs of the base only."""


_FROM_AFAR = (Reason.EXCLUDED, Reason.BODY_BLOCKED, Reason.TOO_FAR)
"""Reasons of configurations from which the arm is not asked, which are most."""


def report_explanation(result: Mapping[str, Any]) -> None:
    """Print an explanation, given as `Explanation.to_json` returns it."""
    out = results_console()
    frame = f", on {result['body_frame']}" if result["body_frame"] else ""
    goal = goal_text(result["goal"], result["goal_name"])
    free = f" ({result['goal_free']})" if "goal_free" in result else ""
    out.print(f"Goal {goal} of {result['task']} in {result['environment']}{frame}{free}")
    if result["observed"]:
        error = "".join(
            f"; {deviation_text(name, value)}" for name, value in result["observed_error"].items()
        )
        out.print(f"Scored for {settings_text(result['observed'])}{error}.")
    for one in result.get("frames", ()):
        if one["frame"] == result["body_frame"]:
            out.print(
                f"Goals on {frame_name(one['frame'])} also as scored for "
                f"{settings_text(one['observed'])}, {one['position_error']:.3f} m from it."
            )
    if result["explained"] is not None:
        _print_explained(out, result)
    _print_fix(out, result)
    _print_reasons(out, result)
    _print_pairs(out, result)


def report_explanations(result: Mapping[str, Any]) -> None:
    """Print a line for each goal, given the explanations of all."""
    out = results_console()
    goals = result["goals"]
    explained = goals[0]["explained"]
    if explained is not None and explained["place"]:
        out.print(f"From configuration {explained['configuration']}: {explained['place']}")
    table = new_table(
        "goal", "from there", ">configurations that reach it", "the others most often"
    )
    for one in goals:
        here = one["explained"]
        from_there = "" if here is None else "reached"
        if here is not None and not here["reached"]:
            from_there = REASON_NAMES[reason_of(here["reason"])]
        near = [check for check in one["checks"] if reason_of(check["reason"]) not in _FROM_AFAR]
        stopping = max(near, key=lambda check: check["stopped"])
        table.add_row(
            goal_text(one["goal"], one["goal_name"]),
            from_there,
            f"{one['reasons']['reached']:,}",
            REASON_NAMES[reason_of(stopping["reason"])] if stopping["stopped"] else "",
        )
    out.print(table)
    out.print("More about one of them, and the nearest change that reaches it: --goal NAME.")


def _print_explained(out: Console, result: Mapping[str, Any]) -> None:
    """Print the result at the explained configuration."""
    explained = result["explained"]
    name = f"configuration {explained['configuration']}"
    if explained["offset"]:
        number = explained["configuration"]
        offset = ", ".join(_with_unit(axis, value) for axis, value in explained["offset"].items())
        out.print(f"The nearest scored configuration is {number}; it differs by {offset}.")
    if explained["place"]:
        out.print(explained["place"])
    if explained["reached"]:
        out.print(f"It is reached from {name}, {result['measure']} {explained['dexterity']:.3f}.")
        _print_refined(out, result)
        return
    pair = ""
    if explained["pair"] is not None:
        best = "the best one: " if explained["reason"] == "arm_blocked" else ""
        pair = f" ({best}{pair_text(explained['pair'])})"
    out.print(
        f"It is not reached from {name}: {REASON_TEXTS[reason_of(explained['reason'])]}{pair}."
    )
    reaching = result["best_set"]["reaching"]
    if reaching:
        members = " and ".join(str(h) for h in reaching)
        out.print(f"The recommended set reaches it from configuration {members}.")
    _print_refined(out, result)


def _print_refined(out: Console, result: Mapping[str, Any]) -> None:
    """Print whether the best refined set reaches the goal, if there is one."""
    refined = result["refined_set"]
    if refined is None:
        return
    if not refined["reaching"]:
        out.print("The recommended set, refined between the grid points, does not reach it.")
        return
    members = " and ".join(member_text(refined["members"][i]) for i in refined["reaching"])
    out.print(f"The recommended set, refined between the grid points, reaches it from {members}.")


def _print_fix(out: Console, result: Mapping[str, Any]) -> None:
    """Print the nearest configuration that reaches the goal, or why none does."""
    fix, explained = result["nearest_reaching"], result["explained"]
    if fix is None:
        _print_unreached(out, result)
        return
    if fix["configuration"] == explained["configuration"] and not fix["changes"]:
        return
    lost, names = fix["lost_goals"], result["goal_names"]
    also = " and loses no other goal"
    if lost:
        also = f" and loses fewest others ({len(lost)})"
    out.print(f"The nearest configuration that reaches it{also} is {fix['configuration']}:")
    out.print(f"  {fix['sentence']}")
    if fix["place"]:
        out.print(f"  {fix['place']}")
    out.print(
        members_table(
            [explained["members"][0], fix["members"][0]], "", ("explained", "nearest reaching")
        )
    )
    loses = f", and no longer {goal_list(lost, names)}" if lost else ""
    out.print(
        f"It reaches {goals_text(fix['reached_goals'], names)}{loses}; "
        f"manipulability {fix['manipulability']:.3f}, at this goal {fix['dexterity']:.3f}."
    )
    out.print(f"Cost {fix['cost']:.2f}, at {_weights(result['weights'], fix)}.")
    if fix["route"] != result["weights"]["route"]:
        start = "in collision" if explained["reason"] != "excluded" else "where nothing was scored"
        out.print(
            f"Travel is measured in straight lines: the base starts {start}, so no path exists."
        )


def _print_unreached(out: Console, result: Mapping[str, Any]) -> None:
    """Print why no configuration reaches the goal."""
    if result["unreachable"]:
        out.print(
            f"{result['unreachable']:,} configurations reach it, but the furniture blocks every "
            "path to them."
        )
        return
    farthest = result["farthest"]
    pairs = [pair for pair in result["blocking_pairs"] if pair["reason"] == farthest["reason"]]
    often = f", most often {pair_text(pairs[0]['pair'])}" if pairs else ""
    out.print(
        f"No configuration of the grid reaches it. {farthest['stopped']:,} passed the most checks: "
        f"{REASON_TEXTS[reason_of(farthest['reason'])]}{often}."
    )
    remedies = [remedy["words"] for remedy in result.get("missing") or ()]
    if remedies:
        out.print(f"It would be reached {', or '.join(remedies)}.")


def _print_reasons(out: Console, result: Mapping[str, Any]) -> None:
    """Print the reasons over the whole grid, in the order of the checks."""
    total = result["configurations"]
    table = new_table("over the grid", ">configurations", ">of all", ">of those checked")
    for check in result["checks"]:
        fraction = f"{check['stopped'] / check['of']:.1%}" if check["of"] else "-"
        table.add_row(
            REASON_TEXTS[reason_of(check["reason"])],
            f"{check['stopped']:,}",
            f"{check['stopped'] / total:.1%}",
            fraction,
        )
    reached = result["reasons"]["reached"]
    table.add_row(REASON_TEXTS[Reason.REACHED], f"{reached:,}", f"{reached / total:.1%}", "")
    out.print(table)


def _print_pairs(out: Console, result: Mapping[str, Any]) -> None:
    """Print the pairs of bodies that block most often."""
    pairs = result["blocking_pairs"]
    if not pairs:
        return
    table = new_table("reason", "part", "against", ">configurations")
    for check in result["checks"]:
        blocking = [pair for pair in pairs if pair["reason"] == check["reason"]]
        what = REASON_NAMES[reason_of(check["reason"])]
        for pair in blocking[:MOST_PAIRS]:
            table.add_row(what, *map(body_name, pair["pair"]), f"{pair['count']:,}")
        rest = blocking[MOST_PAIRS:]
        if rest:
            count = sum(pair["count"] for pair in rest)
            others = f"{len(rest)} other pair{'' if len(rest) == 1 else 's'}"
            table.add_row(what, others, "", f"{count:,}")
    out.print(table)


def _weights(weights: Mapping[str, Any], fix: Mapping[str, Any]) -> str:
    """Return the cost of each type of change, in words."""
    where = " around the furniture" if fix["route"] == "around" else ""
    parts = [
        f"{weights['metre']:g} per metre driven{where}",
        f"{weights['turn']:g} per radian of base rotation",
        f"{weights['torso']:g} per metre of torso",
    ]
    for name, cost in weights["environment"].items():
        unit = "metre" if name in fix["members"][0] else "radian"
        parts.append(f"{cost:g} per {unit} of {frame_name(name)}")
    return ", ".join(parts)


def _with_unit(axis: str, value: float) -> str:
    """Return the value of an axis with its name and unit."""
    return f"{axis_name(axis)} {value:+g} {axis_unit(axis)}"
