"""Results of experiments and studies as text for the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tcs.output.terminal.console import results_console
from tcs.output.terminal.tables import new_table
from tcs.output.words import p_value
from tcs_studies.output.words import NAMES, PICK_AND_PLACE, SCALE

if TYPE_CHECKING:
    from tcs_studies.experiment.trial import LineResult


def line_text(result: LineResult) -> str:
    """Return how accurately a line was followed, in one line."""
    from tcs_studies.experiment.metrics import PLANES

    if result.time is None or result.accuracy is None:
        left = 1e3 * result.distance_left
        return f"the end of the line was not reached: {left:.0f} mm remain."
    worst, met = 1e3 * result.accuracy.worst, result.accuracy.planes_met
    return (
        f"the line took {result.time:.1f} s; the greatest error of the mean path was {worst:.1f} "
        f"mm ({met} of {PLANES} planes crossed)."
    )


def report_work(result: dict[str, Any]) -> None:
    """Print the work on the device by phase."""
    out = results_console()
    table = new_table("phase", ">time [s]", ">work [mJ]", ">of the total [%]")
    total = result["work"]
    for name, part in result["phases"].items():
        fraction = 100.0 * part["work"] / total if total else 0.0
        cells = (f"{part['seconds']:.2f}", f"{1e3 * part['work']:.3g}", f"{fraction:.1f}")
        table.add_row(name.upper(), *cells)
    table.add_row("total", f"{result['seconds']:.2f}", f"{1e3 * total:.3g}", "")
    out.print(table)
    if result["solution"] is None:
        out.print("the arm did not stop: there is no solution phase")
    if result["picture"]:
        out.print(f"wrote {result['picture']}")


def report_experiment(result: dict[str, Any]) -> None:
    """Print medians, tests and files."""
    from tcs_studies.experiment.within_subject import SCRIPTED

    out = results_console()
    out.print(f"{result['operators']} {SCRIPTED}, robot {result['robot']}, seed {result['seed']}")
    if "command_latency" in result:
        late = f"{result['command_latency']:g} s, of pictures {result['picture_latency']:g} s"
        out.print(f"latency of commands {late}")
    conditions = list(result["medians"])
    table = new_table("median", *(f">{name}" for name in conditions), ">EE vs NV p", ">r")
    for name in result["medians"][conditions[0]]:
        scale = SCALE.get(name, 1.0)
        cells = [f"{scale * result['medians'][c][name]:.3g}" for c in conditions]
        test = result["tests"].get(name)
        cells += ["", ""] if test is None else [f"{test['p']:.2g}", f"{test['effect']:.3f}"]
        table.add_row(NAMES[name], *cells)
    out.print(table)
    for one in result["maps"] or ():
        best = one["best"]
        where = "no base pose reaches the grasp"
        if best is not None:
            pose = f"x {best['x']:.2f} m, y {best['y']:.2f} m, {best['yaw_deg']:.1f} deg"
            where = f"best base pose {pose}, score {best['score']:.3f}"
        out.print(f"map of {one['condition']}: {one['cells']:,} cells; {where}")
    out.print(f"wrote {', '.join(result['files'])}")
    if result["runs"]:
        out.print(f"runs in {result['runs']}")


def report_pick_and_place(result: dict[str, Any]) -> None:
    """Print the measures of each base pose beside those of the thesis, and the tests."""
    out = results_console()
    out.print(
        f"{result['operators']} scripted operators, not people, {result['repetitions']} "
        f"repetitions after {result['training']} of training, control {result['control']}, seed "
        f"{result['seed']}"
    )
    table = new_table("mean (std)", *(f">{name}" for name in result["conditions"]), ">F", ">p")
    for name, text in PICK_AND_PLACE.items():
        cells = [_mean_std(one[name]) for one in result["conditions"].values()]
        test = result["variance"].get(name)
        cells += ["", ""] if test is None else [f"{test['f']:.3g}", p_value(test["p"])]
        table.add_row(text, *cells)
    for key, text in (("failures", "failed"), ("training_failures", "failed in training")):
        counts = [str(one[key]) for one in result["conditions"].values()]
        table.add_row(f"{text} repetitions", *counts, "", "")
    out.print(table)
    if result["files"]:
        out.print(f"wrote {', '.join(result['files'])}")


def _mean_std(spread: dict[str, float | None]) -> str:
    mean, std = spread["mean"], spread["std"]
    if mean is None:
        return "–"
    return f"{mean:.3g}" if std is None else f"{mean:.3g} ({std:.3g})"


def report_study(result: dict[str, Any]) -> None:
    """Print medians, tests, preferences, what is missing, and files."""
    out = results_console()
    included = sum(one["included"] for one in result["participants"])
    out.print(f"{result['title']}: {included} of {len(result['participants'])} participants")
    conditions = list(result["preferred"])
    table = new_table("median", *(f">{name}" for name in conditions), ">N", ">signed rank p", ">r")
    for name, groups in result["groups"].items():
        scale = SCALE.get(name, 1.0)
        medians = [groups[condition]["median"] for condition in conditions]
        cells = ["–" if one is None else f"{scale * one:.3g}" for one in medians]
        tests = list(result["tests"].get(name, {}).values())
        # Several pairs do not fit the line; the page has them.
        test = tests[0] if len(tests) == 1 else None
        cells += ["", "", ""] if test is None else [
            str(test["count"]), p_value(test["p"]), f"{test['effect']:.3f}",
        ]  # fmt: skip
        table.add_row(NAMES[name], *cells)
    out.print(table)
    preferred = ", ".join(f"{name} {count}" for name, count in result["preferred"].items())
    out.print(f"preferred: {preferred}")
    for note in result["notes"]:
        out.print(note)
    page, *tables = result["files"]
    out.print(f"wrote {page}, and {len(tables)} tables as CSV beside it")
