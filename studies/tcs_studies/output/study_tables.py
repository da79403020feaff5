"""The report of a study as text."""

from __future__ import annotations

from typing import Any

from tcs.output.terminal.console import results_console
from tcs.output.terminal.tables import new_table
from tcs.output.words import p_value
from tcs_studies.output.words import NAMES, SCALE


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
