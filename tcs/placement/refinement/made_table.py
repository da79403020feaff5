"""Refined sets as a table of the score file, with the record of how they were refined."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from tcs.errors import SelectionError
from tcs.placement.refinement.points import PointScorer
from tcs.placement.refinement.search import Walk
from tcs.placement.robustness import Trials, with_success
from tcs.placement.store import ScoreFile
from tcs.placement.tables import RefinedTable
from tcs.placement.tables.success import NO_MEMBER

KEY = "refinement"
"""Entry of the metadata: for each table, None or the settings and figures of its refinement."""


def as_table(
    walks: Sequence[Walk], weights: np.ndarray[Any, Any], *, has_hands: bool
) -> RefinedTable:
    """Return refined sets as one table, in their order.

    Args:
        walks: The refined sets.
        weights: Weights of the goals, sum 1, shape (G,).
        has_hands: Whether the file is of several hands.
    """
    width = max(walk.members for walk in walks)

    def filled(arrays: Sequence[np.ndarray[Any, Any]], fill: float) -> np.ndarray[Any, Any]:
        first = arrays[0]
        out = np.full((len(arrays), width, *first.shape[1:]), fill, dtype=first.dtype)
        for row, array in zip(out, arrays, strict=True):
            row[: len(array)] = array
        return out

    return RefinedTable(
        origin=filled([np.array(walk.origin, dtype=np.int32) for walk in walks], NO_MEMBER),
        values=filled([walk.present.values for walk in walks], 0.0),
        reached=filled([walk.present.reached for walk in walks], False),
        dexterity=filled([walk.present.dexterity for walk in walks], 0.0),
        arm_joints=filled([walk.present.joints for walk in walks], 0.0),
        hand=filled([walk.present.hand for walk in walks], 0) if has_hands else None,
        objective=np.array([walk.value for walk in walks]),
        weights=weights,
    )


def with_estimates(
    file: ScoreFile, table: int, scorer: PointScorer, refined: RefinedTable
) -> RefinedTable:
    """Return refined sets with their success if that of the table's sets was estimated.

    Errors that were given in place of those of the environment are not in the file: `tcs robustify`
    estimates both kinds of sets then.
    """
    record = file.metadata.get("robustness", [None] * len(file.tables))[table]
    if file.tables[table].success is None or record is None or not record["environment_errors"]:
        return refined
    trials = Trials.built(file, table, scorer.built, body_collisions=record["body_collisions"])
    return with_success(
        trials, refined, samples=record["samples"], seed=record["seed"], jobs=scorer.jobs
    )


def with_refined(
    file: ScoreFile, table: int, refined: RefinedTable, settings: dict[str, Any]
) -> ScoreFile:
    """Return the file with the refined sets of one table."""
    tables = list(file.tables)
    tables[table] = dataclasses.replace(tables[table], refined=refined)
    records = list(file.metadata.get(KEY, [None] * len(tables)))
    records[table] = settings
    return dataclasses.replace(file, metadata={**file.metadata, KEY: records}, tables=tuple(tables))


def refinement_summary(file: ScoreFile, table: int | None = None) -> dict[str, Any]:
    """Return what a refinement gained, as printed by `tcs refine --json`.

    Args:
        file: A score file with refined sets.
        table: Number of the refined table; by default the nominal one.

    Raises:
        SelectionError: If the table was not refined.
    """
    number = file.nominal_index if table is None else table
    scored = file.tables[number]
    settings = file.metadata.get(KEY, [None] * len(file.tables))[number]
    if scored.refined is None or settings is None:
        raise SelectionError("No sets of this table were refined. Refine them: tcs refine FILE.")
    reachability, manipulability = scored.sets.scores_of(scored.sets.best)
    refined = scored.refined
    return {
        "measure": file.metadata["measure"],
        **settings,
        "before": {
            "reachability": round(reachability, 12),
            "manipulability": round(manipulability, 12),
            "members": [file.configurations.configuration(h).to_json() for h in scored.sets.best],
        },
        "after": {
            "reachability": round(float(refined.reachability[0]), 12),
            "manipulability": round(float(refined.manipulability[0]), 12),
            "members": [member.to_json() for member in refined.members(file.configurations, 0)],
        },
        "sets": len(refined.origin),
    }
