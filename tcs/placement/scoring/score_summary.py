"""The main figures of a score file: counts, best sets and timings."""

from __future__ import annotations

from collections import Counter
from typing import Any

from tcs.placement.constraints import constraint_texts
from tcs.placement.scoring.kernel_start import ANALYTIC
from tcs.placement.store import APPROACH, PAPER, WITHOUT_APPROACH, ScoreFile, state_to_json


def summary(file: ScoreFile) -> dict[str, Any]:
    """Return the main figures of a score file.

    Counts are sums over all observed states. The best sets are those of the nominal state. The
    keys are those of `tcs score --json`, except the name of the file.
    """
    timings = file.metadata["timings"]
    reasons: Counter[str] = Counter()
    for table in file.tables:
        reasons.update(table.scores.reason_counts())
    pairs = sum(reasons.values())
    goals = file.nominal.sets.weights.size
    return {
        "measure": file.metadata["measure"],
        # Files without the entry were solved in closed form.
        "ik": file.metadata.get("ik", ANALYTIC),
        "paper": PAPER in file.metadata,
        "approach": _approach_summary(file, reasons),
        "no_approach": file.metadata.get(WITHOUT_APPROACH),
        "configurations": pairs // goals,
        "goals": goals,
        "pairs": pairs,
        "reached_pairs": reasons["reached"],
        "scoring_seconds": timings["scoring_seconds"],
        "compile_seconds": timings["compile_seconds"],
        "sets_seconds": timings["sets_seconds"],
        "total_seconds": timings["total_seconds"],
        "rule": file.nominal.sets.rule,
        "same_environment": file.nominal.sets.same_environment,
        "max_members": file.nominal.sets.max_members,
        "tile": max(table.sets.tile for table in file.tables),
        "candidates": sum(len(table.sets.candidates) for table in file.tables),
        "sets": sum(table.sets.sets for table in file.tables),
        "best": _set_summary(file, file.nominal.sets.best),
        "best_single": _set_summary(file, file.nominal.sets.best_single),
        "reasons": dict(reasons),
        **({"constraints": texts} if (texts := constraint_texts(file)) else {}),
        **({"person": file.metadata["person"]} if "person" in file.metadata else {}),
        **({"hands": hands_of(file)} if file.hands else {}),
        "self_contact": file.metadata.get("self_contact"),
        "tables": [
            {
                "observed": state_to_json(file.observed_axes, state),
                "candidates": len(table.sets.candidates),
                "sets": table.sets.sets,
            }
            for state, table in zip(file.observed_states, file.tables, strict=True)
        ],
    }


def _approach_summary(file: ScoreFile, reasons: Counter[str]) -> dict[str, Any] | None:
    """Return what scoring with approach found; None for a file scored without."""
    entry = file.metadata.get(APPROACH)
    if entry is None:
        return None
    stopped = [reasons["approach_limits"], reasons["approach_blocked"]]
    return {
        **entry,
        "approachable": reasons["reached"],
        "limits": stopped[0],
        "blocked": stopped[1],
        "fraction": reasons["reached"] / max(reasons["reached"] + sum(stopped), 1),
        "seconds": file.metadata["timings"]["approach_seconds"],
    }


def _set_summary(file: ScoreFile, members: tuple[int, ...]) -> dict[str, Any] | None:
    """Return scores and members of a set of the nominal table; None if no goal is reached."""
    if not members:
        return None
    reachability, manipulability = file.nominal.sets.scores_of(members)
    return {
        # Seven sevenths add up to 1 only after rounding.
        "reachability": round(reachability, 12),
        "manipulability": round(manipulability, 12),
        "members": [file.member_to_json(file.nominal_index, h) for h in members],
    }


def hands_of(file: ScoreFile) -> list[dict[str, Any]]:
    """Return arm, tool and goals of each hand that the goals of a file name."""
    return [{key: entry[key] for key in ("arm", "tool", "goals")} for entry in file.hands]
