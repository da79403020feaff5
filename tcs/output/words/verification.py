"""The result of a verification, line by line."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from tcs.output.words.numbers import percentage
from tcs.output.words.reasons import REASON_NAMES
from tcs.placement.tables import Reason

_SCANS = {"analytic": "11,520 arm angles each", "numeric": "400 starts each"}


class CheckLine(NamedTuple):
    """One line of the result of a verification."""

    text: str
    """What was checked or counted."""
    value: str
    """The result."""
    is_detail: bool = False
    """Whether the line details the one before."""


def check_lines(found: Mapping[str, Any]) -> tuple[CheckLine, ...]:
    """Return the result of a verification, without its verdict.

    Args:
        found: The result, as `Verification.to_json` returns it.
    """

    def greatest(key: str, unit: str = "") -> str:
        return "none checked" if found[key] is None else f"{found[key]:.1e}{unit}"

    measure, scan = found["measure"], _SCANS[found["ik"]]
    shortfall = "not estimated: no reached pair was scanned"
    if found["mean_shortfall"] is not None:
        shortfall = f"{found['mean_shortfall']:.1e}"
    return (
        CheckLine("reached pairs re-checked with Drake", f"{found['checked']:,}"),
        *_refined_line(found),
        CheckLine("false", f"{found['false_reached']:,}", is_detail=True),
        CheckLine("joints beyond their limits", f"{found['limit_violations']:,}", is_detail=True),
        CheckLine("greatest position error", greatest("max_position_error", " m"), is_detail=True),
        CheckLine(
            "greatest orientation error", greatest("max_rotation_error", " rad"), is_detail=True
        ),
        CheckLine(f"greatest error of {measure}", greatest("max_isotropy_error"), is_detail=True),
        *_approach_lines(found),
        CheckLine(f"unreached pairs scanned densely ({scan})", f"{found['dense_checked']:,}"),
        CheckLine("reachable", f"{found['missed']:,}", is_detail=True),
        CheckLine("solutions that Drake refutes", f"{found['unconfirmed_hits']:,}", is_detail=True),
        *(_stratum_line(stratum) for stratum in found["strata"]),
        CheckLine("recall", recall_text(found)),
        CheckLine(f"mean shortfall of {measure}", shortfall),
    )


def _refined_line(found: Mapping[str, Any]) -> tuple[CheckLine, ...]:
    """Return the number of re-checked pairs of refined sets, if there are any."""
    count = found["refined_checked"]
    return (CheckLine("of refined sets", f"{count:,}", is_detail=True),) if count else ()


def _approach_lines(found: Mapping[str, Any]) -> tuple[CheckLine, ...]:
    """Return what the re-check of approaches shows, if the file was scored with approach."""
    checked = found.get("approaches")
    if checked is None:
        return ()
    lines = (
        CheckLine("approaches re-checked with Drake", f"{checked['checked']:,}"),
        *_refined_line(checked),
        CheckLine("false", f"{checked['false']:,}", is_detail=True),
    )
    if checked["max_line_error"] is None:
        return lines
    return (
        *lines,
        CheckLine(
            "greatest error along the line", f"{checked['max_line_error']:.1e}", is_detail=True
        ),
        CheckLine("greatest speed", f"{checked['max_speed']:.2f} of the limit", is_detail=True),
    )


def _stratum_line(stratum: Mapping[str, Any]) -> CheckLine:
    text = f"{stratum['missed']:,} of {stratum['scanned']:,} reachable"
    if stratum["scanned"] < stratum["pairs"]:
        text += f", {stratum['pairs']:,} in all"
    if stratum["recall"] is not None:
        text += f", recall {percentage(stratum['recall'], 2)}"
    name = REASON_NAMES[Reason[stratum["reason"].upper()]]
    return CheckLine(f"stored as {name}", text, is_detail=True)


def recall_text(found: Mapping[str, Any]) -> str:
    """Return the estimated recall with its interval, or why it is not estimated.

    Args:
        found: The result of a verification, as `Verification.to_json` returns it.
    """
    if found["recall"] is None or found["recall_ci95"] is None:
        return str(found["recall_note"])
    low, high = (percentage(end, 2) for end in found["recall_ci95"])
    return f"{percentage(found['recall'], 2)} (95% between {low} and {high})"
