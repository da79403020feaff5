"""Results of a refinement as text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tcs.output.terminal.console import results_console
from tcs.output.terminal.tables import members_table
from tcs.output.words import scores_text
from tcs.output.words.robustness import BODY_COLLISIONS


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
        if not result["displaced"] and result["body_collisions"] != "paper":
            out.print(f"under error, collisions {BODY_COLLISIONS[result['body_collisions']]}")
    out.print(
        f"{result['sets']} sets refined, {result['scored']:,} configurations scored in "
        f"{result['seconds']:.1f} s; wrote {result['file']}"
    )
