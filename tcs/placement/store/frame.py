"""Scores as one wide table (a pandas DataFrame and CSV)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from tcs.files.writing import whole_file
from tcs.model.grid import Grid
from tcs.placement.store import ScoreFile, StateTables, state_to_json
from tcs.placement.tables import Reason


def score_frame(file: ScoreFile, *, everything: bool = False) -> pd.DataFrame:
    """Return one row for each initial configuration, by its flat index.

    Args:
        file: A score file.
        everything: Whether to include configurations that reach no goal.

    Returns:
        Columns: the observed axes and the axes of the grid (angles as `..._deg`), `reachability`
        (P_R), `manipulability` (P_M), and for each goal g `reason_g`, `dexterity_g` and, in a file
        of several hands, `hand_g`. The flat indices start again for each observed state.
    """
    states = zip(file.observed_states, file.tables, strict=True)
    frames = [_frame(file, state, table, everything) for state, table in states]
    return pd.concat(frames) if len(frames) > 1 else frames[0]


def _frame(
    file: ScoreFile, state: Mapping[str, float], table: StateTables, everything: bool
) -> pd.DataFrame:
    """Return the rows of one table."""
    grid, scores = Grid.from_dict(file.grid), table.scores
    rows = np.arange(grid.size) if everything else table.sets.candidates
    values = grid.values(rows)
    columns: dict[str, object] = dict(state_to_json(file.observed_axes, state))
    columns |= {
        (f"{axis.name}_deg" if axis.unit == "deg" else axis.name): (
            np.degrees(values[axis.name]) if axis.unit == "deg" else values[axis.name]
        )
        for axis in grid.axes
    }
    columns["reachability"] = scores.reachability()[rows]
    columns["manipulability"] = scores.manipulability()[rows]
    names = [reason.name.lower() for reason in Reason]
    for g in range(scores.goals):
        columns[f"reason_{g}"] = pd.Categorical.from_codes(scores.reason[rows, g], pd.Index(names))
        columns[f"dexterity_{g}"] = scores.dexterity[rows, g]
        if scores.hand is not None:
            hand = np.where(scores.reached[rows, g], scores.hand[rows, g].astype(np.int64), -1)
            columns[f"hand_{g}"] = pd.Categorical.from_codes(hand, pd.Index(file.hand_names))
    return pd.DataFrame(columns, index=pd.Index(rows, name="configuration"))


def write_csv(path: Path, frame: pd.DataFrame) -> None:
    """Write a table as CSV, whole or not at all, with nine digits, which keep float32 exactly.

    Raises:
        OutputError: If the file cannot be written.
    """
    with whole_file(path, "Table") as stream:
        frame.to_csv(stream, float_format="%.9g")
