"""Results as compact tables with units, rounded to the digits that matter."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping, Sequence
from typing import Any

import typer
from rich import box
from rich.table import Table

from tcs.output.terminal.console import results_console
from tcs.output.words import (
    HAND,
    REASON_TEXTS,
    WINDOW,
    axis_name,
    axis_title,
    axis_value,
    basis_text,
    body_name,
    deviation_text,
    frame_name,
    goal_list,
    goal_text,
    hands_text,
    percentage,
    person_text,
    place_in_line,
    reason_of,
    scores_text,
    settings_text,
    stop_places,
    stop_windows,
)
from tcs.output.words.success import success_text
from tcs.output.words.verification import check_lines

NUMERIC_NOTE = (
    "Numeric inverse kinematics, since this arm has no closed-form solution: scoring takes longer "
    "and may miss a few reachable pairs. `tcs verify` estimates how many."
)
_ROWS_WIDTH = 170
"""Width of the table of all rows, in columns."""


def report_catalogue(known: Mapping[str, Sequence[Mapping[str, Any]]]) -> None:
    """Print the known tasks, environments and robots."""
    out = results_console()
    tasks = new_table("task", "title", ">goals", "environments")
    for task in known["tasks"]:
        names = ", ".join(task["environments"])
        tasks.add_row(task["name"], task["title"], str(task["goals"]), names)
    environments = new_table("environment", "title", "origin and axes")
    for environment in known["environments"]:
        environments.add_row(environment["name"], environment["title"], environment["origin"])
    robots = new_table("robot", "title")
    for robot in known["robots"]:
        robots.add_row(robot["name"], robot["title"])
    for table in (tasks, environments, robots):
        out.print(table)


_ON_REQUEST = (
    "excluded",
    "approach_limits",
    "approach_blocked",
    "other_goal_unreached",
    "arms_blocked",
)
"""Reasons of files scored under constraints or with approach, left out where there are none."""


def report_estimates(result: Mapping[str, Any]) -> None:
    """Print what scoring would take."""
    rows = result["rows"]
    table = new_table(
        "task",
        "environment",
        ">configurations",
        ">goals",
        ">scoring",
        ">memory",
        ">scratch",
        ">disk",
    )
    for row in rows:
        seconds, error = row["scoring_seconds"], row["scoring_seconds_error"]
        table.add_row(
            row["task"],
            row["environment"],
            f"{row['configurations']:,}",
            str(row["goals"]),
            f"{seconds:.1f} s +- {error:.1f}",
            f"{row['memory_bytes'] / 1e6:.1f} MB",
            f"{row['scratch_bytes'] / 1e6:.1f} MB",
            f"{row['disk_bytes'] / 1e6:.1f} MB",
        )
    out = results_console()
    out.print(table)
    if len(rows) > 1:
        out.print(f"together {sum(row['scoring_seconds'] for row in rows):.1f} s of scoring")


def report_scores(result: Mapping[str, Any]) -> None:
    """Print the summary of a scored task."""
    out = results_console()
    if "person" in result:
        out.print(f"scored for {person_text(result['person'])}")
        for goal in result["person"]["touching_goals"]:
            out.print(
                f"goal {goal_text(goal['goal'], goal.get('name'))}: the gripper touches "
                f"{body_name(goal['part'])} of this person"
            )
    candidates = "reach at least one goal"
    if result["tile"]:
        candidates = f"stand for all others within squares of {result['tile']:g} m"
    out.print(
        f"{result['configurations']:,} configurations x {result['goals']} goals scored in "
        f"{result['scoring_seconds']:.2f} s; {result['candidates']:,} {candidates}, "
        f"{result['sets']:,} sets kept."
    )
    if result["paper"]:
        out.print("scored as in the papers: each goal at its exact pose, without approach.")
    if result["approach"] is not None:
        out.print(_approach_text(result["approach"]))
    if result["ik"] == "numeric":
        out.print(NUMERIC_NOTE)
    reasons = new_table("configuration and goal", ">pairs", ">of all")
    if "constraints" in result:
        out.print(f"scored under constraints: {'; '.join(result['constraints'])}")
    for name, count in result["reasons"].items():
        if name in _ON_REQUEST and not count:
            continue
        fraction = percentage(count / result["pairs"])
        reasons.add_row(REASON_TEXTS[reason_of(name)], f"{count:,}", fraction)
    out.print(reasons)
    found = result["recommended"]
    if found is None:
        out.print("recommended: no set, no configuration reaches a goal.")
        out.print(f"wrote {result['file']}")
        return
    scores = scores_text(found["reachability"], found["manipulability"], result["measure"])
    out.print(f"recommended ({basis_text(found['basis'])}): {scores}")
    for line in stop_places(found["places"]):
        out.print(line)
    out.print(members_table(found["members"]))
    if "gain" in found:
        out.print(found["gain"])
        fewer = found["fewer"]
        scores = scores_text(fewer["reachability"], fewer["manipulability"], result["measure"])
        out.print(f"best with fewer stops: {scores}")
        out.print(members_table(fewer["members"]))
    out.print(f"wrote {result['file']}")
    if not result.get("hands"):
        out.print(
            f"next: tcs robustify {shlex.quote(result['file'])} estimates which set still does the "
            "task when person and robot are not quite where they were scored.",
            soft_wrap=True,
        )


def _approach_text(found: Mapping[str, Any]) -> str:
    """Return which of the pairs that a posture reaches can be approached."""
    pairs = found["approachable"] + found["limits"] + found["blocked"]
    return (
        f"scored with approach: of {pairs:,} pairs that a posture reaches, "
        f"{found['approachable']:,} ({percentage(found['fraction'])}) can be approached."
    )


def report_observed(result: Mapping[str, Any]) -> None:
    """Print the result of scoring an observed environment."""
    out = results_console()
    observation = result["observation"]
    state = result["tables"][0]["observed"]
    moved = {key: float(f"{value:.4g}") for key, value in state.items() if value}
    out.print(f"scored as observed: {settings_text(moved) or 'everything at its nominal position'}")
    if observation["frame_position_error"] is not None:
        rotation = observation["frame_rotation_error"]
        angle = "" if rotation is None else f" and {math.degrees(rotation):.1f} deg"
        out.print(f"observed frames fit to {observation['frame_position_error']:.4f} m{angle}")
    report_scores(result)


def report_rows(result: Mapping[str, Any]) -> None:
    """Print the rows of every task in every environment, one line each."""
    table = new_table(
        *("task", "environment", ">configurations", ">goals", ">reached", ">candidates", ">sets"),
        *(">P_R P_M one", ">P_R P_M set", ">scored [s]", ">all [s]", ">file [MB]"),
    )
    for row in result["rows"]:
        best = (row["best_single"], row["best"])
        table.add_row(
            row["task"],
            row["environment"],
            *(f"{row[key]:,}" for key in ("configurations", "goals", "reached_pairs")),
            *(f"{row[key]:,}" for key in ("candidates", "sets")),
            *(f"{b['reachability']:.3f} {b['manipulability']:.3f}" if b else "-" for b in best),
            f"{row['scoring_seconds']:.2f}",
            f"{row['total_seconds']:.2f}",
            f"{row['file_bytes'] / 1e6:.2f}",
        )
    results_console(_ROWS_WIDTH).print(table)


def report_choice(result: Mapping[str, Any]) -> None:
    """Print a selected set."""
    out = results_console()
    if result["here_place"]:
        out.print(f"Now: {place_in_line(result['here_place'])}.")
    for line in stop_places(result["places"]):
        out.print(line)
    out.print(members_table(result["members"]))
    for line in stop_windows(result["members"]):
        out.print(line)
    scores = scores_text(result["reachability"], result["manipulability"], result["measure"])
    travel = f", travel cost {result['cost']:.2f}"
    if result["here"] is None:
        travel = f", {result['cost']:.2f} between the stops" if len(result["members"]) > 1 else ""
    out.print(
        f"{basis_text(result['basis'])}: {scores}{travel}, utility {result['utility']:.3f} "
        f"(selected in {1e3 * result['seconds']:.1f} ms)"
    )
    if "gain" in result:
        out.print(result["gain"])
    if "parking" in result:
        sets = result["parking"]["sets_looked_at"]
        out.print(f"parking windows of {sets:,} set{'s' * (sets > 1)} were looked at")
    if "success" in result:
        low, high = result["success_ci95"]
        of_rooms = result.get("rooms_done") == result["success"]
        text = success_text(f"{result['success']:.1%}", of_rooms=of_rooms)
        out.print(f"under error {text} (95 % between {low:.1%} and {high:.1%})")
    if result["moves"]:
        out.print(f"moves the environment: {', '.join(axis_name(n) for n in result['moves'])}")
    if "executable" in result:
        out.print(_executable_text(result["executable"]))
    if "alternatives" in result:
        for number, one in enumerate((result, *result["alternatives"]), 1):
            if any(one["places"]):
                out.print(f"Set {number}: {'; '.join(map(place_in_line, one['places']))}.")
        out.print(_alternatives_table(result))
    if "person" in result:
        out.print(f"scored for {person_text(result['person'])}")
    if "scored_constraints" in result:
        out.print(f"scored under constraints: {'; '.join(result['scored_constraints'])}")
    for constraint in result.get("constraints", ()):
        left = f"{constraint['configurations']:,} configurations"
        if "solutions" in constraint:
            left += f" with {constraint['solutions']:,} solutions"
        out.print(f"{constraint['constraint']}: {left} left")
    if "located" in result:
        here = result["located"]["here"]
        out.print(
            f"located at x {here['x']:.3f} m, y {here['y']:.3f} m, yaw {here['yaw_deg']:.2f} deg; "
            f"the same set from {result['located']['same_set']:.0%} of the base poses within the "
            "error"
        )
    if result["unreachable"]:
        out.print(
            f"unreachable from here: {result['unreachable']:,} configurations, not considered"
        )
    if "observed" in result:
        errors = [deviation_text(name, value) for name, value in result["observed_error"].items()]
        if result["frame_position_error"] is not None:
            errors.append(f"observed frames differ by {result['frame_position_error']:.3f} m")
        state = settings_text(result["observed"])
        out.print(
            f"scored for {state}" + (f"; {', '.join(errors)}" if errors else ", not observed")
        )
        for one in result.get("frames", ()):
            out.print(
                f"goals on {frame_name(one['frame'])} also as scored for "
                f"{settings_text(one['observed'])}, {one['position_error']:.3f} m from it"
            )


def _executable_text(found: Mapping[str, Any]) -> str:
    """Return which goals can be done, and what it costs to count those alone."""
    other, goals = found["by_postures"], goal_list(found["goals_done"])
    text = (
        f"goals with motions: {goals}; motions were planned for {found['examined']:,} of "
        f"{found['candidates']:,} configurations\n"
        f"by postures alone: P_R {other['reachability']:.3f}, P_M {other['manipulability']:.3f}, "
        f"utility {other['utility']:.3f}"
    )
    if not other["examined"]:
        return f"{text}; not examined"
    return f"{text}; with motions P_R {other['reachability_done']:.3f}"


def _alternatives_table(result: Mapping[str, Any]) -> Table:
    """Return the offered sets, the best first, and what each trades against the best."""
    table = new_table(
        *("set", "base poses (x y heading)", ">P_R", ">P_M", ">travel", ">net utility", "moves"),
    )
    for number, one in enumerate((result, *result["alternatives"]), 1):
        poses = "; ".join(
            f"{m['base_x']:.2f} {m['base_y']:.2f} {m['base_yaw_deg']:.0f} "
            f"{hands_text(m.get(HAND, ()))}".rstrip()
            for m in one["members"]
        )
        trades = one.get("trades")
        cells = []
        for name in ("reachability", "manipulability", "cost", "net_utility"):
            difference = "" if trades is None else f" ({trades[name]:+.3f})"
            cells.append(f"{one[name]:.3f}{difference}")
        table.add_row(str(number), poses, *cells, ", ".join(one["moves"]) or "-")
    return table


def report_verification(found: Mapping[str, Any]) -> None:
    """Print the result of a verification, given as `Verification.to_json` returns it."""
    table = new_table("check", ">result")
    for line in check_lines(found):
        table.add_row(f"  {line.text}" if line.is_detail else line.text, line.value)
    if found["dense_checked"]:
        table.add_row("time of the scan of unreached pairs", f"{found['scan_seconds']:.1f} s")
    table.add_row("verdict", found["verdict"])
    results_console().print(table)


def report_page(result: Mapping[str, Any]) -> None:
    """Print the size of an exported page, and the source of the meshes in it."""
    run = ""
    if "samples" in result:
        run = f", {result['seconds']:.1f} s of {result['samples']} samples"
    typer.echo(f"wrote {result['file']}: {result['bytes'] / 1e6:.1f} MB{run}")
    if result["meshes"]:
        typer.echo(
            "The page contains the robot's meshes; their licence applies when you share it. "
            f"Origin and licence, from the robot file: {result['source']}"
        )


def members_table(
    members: Sequence[Mapping[str, Any]], heading: str = "stop", names: Sequence[str] = ()
) -> Table:
    """Return configurations as a table, by name if they have names, else numbered."""
    shown = [{k: value for k, value in member.items() if k != WINDOW} for member in members]
    table = new_table(heading, *(f">{axis_title(key)}" for key in shown[0]))
    for number, member in enumerate(shown):
        cells = (axis_value(key, value) for key, value in member.items())
        table.add_row(names[number] if names else str(number + 1), *cells)
    return table


def new_table(*headings: str) -> Table:
    """Return an empty table; a heading that starts with ">" is set flush right."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, header_style="bold")
    for heading in headings:
        right = heading.startswith(">")
        # Names wrap in a narrow terminal; truncated names of the left and right arm look alike.
        table.add_column(
            heading.removeprefix(">"), justify="right" if right else "left", overflow="fold"
        )
    return table
