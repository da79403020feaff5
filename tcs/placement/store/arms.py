"""The files of single arms within a score file of several arms."""

from __future__ import annotations

import dataclasses
from functools import partial

import numpy as np

from tcs.errors import StoreError
from tcs.model.grid import Grid
from tcs.placement.store.score_file import ARMS, ScoreFile, StateTables
from tcs.placement.tables import Reason, ScoreTable, SetTable

OF_ARM = ("scene_digest", "robot_shapes", "ik", "self_contact")
"""Entries of the metadata that differ between the arms of one file."""


def files_of_arms(file: ScoreFile) -> tuple[ScoreFile, ...]:
    """Return the file of each arm, in the order of the grid; the file itself if it has one arm."""
    return tuple(file_of_arm(file, arm) for arm in file.arms) or (file,)


def file_of_arm(file: ScoreFile, arm: str) -> ScoreFile:
    """Return the scores of one arm as a file of one arm.

    Its configurations are those of the arm, numbered from 0, and its sets have one member: sets of
    several are kept for all arms together. Estimates of success are left out.

    Args:
        file: A score file of several arms.
        arm: Name of one of them.

    Raises:
        StoreError: If the file has no such arm.
    """
    if arm not in file.arms:
        raise StoreError(
            f"there is no arm '{arm}' in the file: {', '.join(file.arms) or 'one arm'}."
        )
    grid = Grid.from_dict(file.grid)
    entry = file.metadata[ARMS][arm]
    kept = {
        key: value
        for key, value in file.metadata.items()
        if key not in (ARMS, "robustness", *OF_ARM)
    }
    of_arm = {key: entry[key] for key in OF_ARM if key in entry}
    number = grid.arm_number(arm)
    return dataclasses.replace(
        file,
        metadata={**kept, **of_arm, "robot": entry["robot"]},
        robot=entry["description"],
        grid=grid.of_one_arm.to_dict(),
        tables=tuple(_tables_of(table, number) for table in file.tables),
    )


def _tables_of(table: StateTables, number: int) -> StateTables:
    """Return scores and single configurations of one arm, given its number."""
    return StateTables(_sets_of(table.sets, number), partial(_scores_of, table, number))


def _scores_of(table: StateTables, number: int) -> ScoreTable:
    """Return the scores of one arm."""
    scores, size = table.scores, table.sets.arm_size
    rows = slice(number * size, (number + 1) * size)
    before = np.count_nonzero(scores.reason[: rows.start] == Reason.REACHED)
    count = np.count_nonzero(scores.reason[rows] == Reason.REACHED)
    return ScoreTable(
        dexterity=scores.dexterity[rows],
        reason=scores.reason[rows],
        pair=scores.pair[rows],
        pair_names=scores.pair_names,
        arm_joints=scores.arm_joints[before : before + count],
        weights=scores.weights,
    )


def _sets_of(sets: SetTable, number: int) -> SetTable:
    """Return the sets of one configuration of one arm."""
    of_arm = sets.candidates // sets.arm_size == number
    places, cell = np.unique(sets.cell[of_arm], return_inverse=True)
    single = sets.single_reachability[of_arm] + sets.single_manipulability[of_arm]
    candidates = sets.candidates[of_arm] - number * sets.arm_size
    best = (int(candidates[np.argmax(single)]),) if single.size else ()
    count = single.size
    return dataclasses.replace(
        sets,
        max_members=1,
        candidates=candidates.astype(np.int32),
        reached=sets.reached[of_arm],
        dexterity=sets.dexterity[of_arm],
        cell=cell.astype(np.int32),
        cell_xy=sets.cell_xy[places],
        pair_cells=np.empty((0, 2), dtype=np.int32),
        pair_count=np.empty(0, dtype=np.int64),
        pair_reachability=np.empty(0),
        pair_manipulability=np.empty(0, dtype=np.float32),
        pair_sum=np.empty(0, dtype=np.float32),
        member_reachability=np.zeros(count),
        member_manipulability=np.zeros(count, dtype=np.float32),
        member_sum=np.zeros(count, dtype=np.float32),
        triples=None,
        best=best,
        best_single=best,
    )
