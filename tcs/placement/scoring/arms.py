"""Scores of several arms of one robot in one file: each configuration uses one of them."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import RobotError
from tcs.files.mapped import chunks, large_zeros
from tcs.placement.constraints.scored import KEY as CONSTRAINTS
from tcs.placement.scoring.kernel_start import ANALYTIC, NUMERIC
from tcs.placement.store import ARMS, OF_ARM, ScoreFile
from tcs.placement.tables import ScoreTable

if TYPE_CHECKING:
    from tcs.placement.scoring.offline import Scored, ScoringSetup


def score_arms(
    setups: Mapping[str, ScoringSetup],
    *,
    begun: float,
    on_progress: Callable[[int, int], None] | None = None,
    on_compile: Callable[[], None] | None = None,
) -> ScoreFile:
    """Score one arm after the other, and return one file with sets whose members use any of them.

    Args:
        setups: The job of each arm, by its name.
        begun: Start of the work, by `time.perf_counter` [s].
        on_progress: Called with the number of scored configurations and their total.
        on_compile: Called before the kernel compiles, if it has to.

    Raises:
        RobotError: If the arms have different grids: one has a torso joint, another has not.
    """
    first, *others = setups.values()
    for other in others:
        if other.job.grid != first.job.grid:
            raise RobotError(
                f"robots '{first.job.spec.robot.name}' and '{other.job.spec.robot.name}' have "
                "different torso joints, so they are not two arms of one robot. Score them one by "
                "one."
            )
    size = first.job.scored_grid.size
    parts = {
        arm: setup.scored(
            on_progress=shifted(on_progress, number * size, len(setups) * size),
            on_compile=on_compile,
        )
        for number, (arm, setup) in enumerate(setups.items())
    }
    tables = [
        joined(of_state) for of_state in zip(*(p.tables for p in parts.values()), strict=True)
    ]
    grid = dataclasses.replace(first.job.grid, arms=tuple(setups))
    return first.file_of(tables, grid, begun, _entries(setups, parts))


def joined(tables: Sequence[ScoreTable]) -> ScoreTable:
    """Return the scores of several arms as one table, those of the first arm first."""
    rows = [table.configurations for table in tables]
    begins = np.cumsum([0, *rows[:-1]]).tolist()
    every = list(range(tables[0].goals))
    return filled(
        tables,
        [(begin, every) for begin in begins],
        (sum(rows), tables[0].goals),
        weights=tables[0].weights,
        joints_of=lambda _: np.concatenate([table.arm_joints for table in tables]),
    )


def filled(
    tables: Sequence[ScoreTable],
    places: Sequence[tuple[int, Sequence[int]]],
    shape: tuple[int, int],
    *,
    weights: NDArray[np.float64],
    joints_of: Callable[[NDArray[np.uint8]], NDArray[np.float32]],
) -> ScoreTable:
    """Return one table that holds the scores of several.

    Args:
        tables: The tables.
        places: First row and columns of each in the table to return; together they fill it.
        shape: Numbers of rows and columns of that table.
        weights: Weights of its goals, sum 1, shape (goals,).
        joints_of: Returns the joints of all its reached pairs [rad], given its reasons.
    """
    names = tuple(dict.fromkeys(pair for table in tables for pair in table.pair_names))
    number = {pair: i for i, pair in enumerate(names)}
    dexterity: NDArray[np.float32] = large_zeros(shape, np.float32)
    reason: NDArray[np.uint8] = large_zeros(shape, np.uint8)
    pair: NDArray[np.int32] = large_zeros(shape, np.int32)
    for table, (begin, columns) in zip(tables, places, strict=True):
        # The last entry stands for -1, no contact.
        renumbered = np.array([*(number[pair] for pair in table.pair_names), -1], dtype=np.int32)
        at = list(columns)
        for rows in chunks(table.dexterity, table.reason, table.pair, dexterity, reason, pair):
            to = slice(begin + rows.start, begin + rows.stop)
            dexterity[to, at], reason[to, at] = table.dexterity[rows], table.reason[rows]
            pair[to, at] = renumbered[table.pair[rows]]
    return ScoreTable(
        dexterity=dexterity,
        reason=reason,
        pair=pair,
        pair_names=names,
        arm_joints=joints_of(reason),
        weights=weights,
    )


def _entries(setups: Mapping[str, ScoringSetup], parts: Mapping[str, Scored]) -> dict[str, Any]:
    """Return the entries of the metadata: those of each arm, and what sums them up."""
    of_arms = {
        arm: {
            "robot": setup.references["robot"],
            "description": setup.job.spec.robot.model_dump(mode="json"),
            **{key: parts[arm].entries[key] for key in OF_ARM if key in parts[arm].entries},
        }
        for arm, setup in setups.items()
    }
    digests = "".join(entry["scene_digest"] for entry in of_arms.values())
    contacts = (entry["self_contact"] for entry in of_arms.values())
    timings = [part.entries["timings"] for part in parts.values()]
    first = next(iter(parts.values()))
    return {
        **{key: value for key, value in first.entries.items() if key not in OF_ARM},
        **_constraints([part.entries for part in parts.values()]),
        ARMS: of_arms,
        "scene_digest": hashlib.sha256(digests.encode()).hexdigest(),
        "ik": NUMERIC if any(e["ik"] == NUMERIC for e in of_arms.values()) else ANALYTIC,
        "self_contact": next((contact for contact in contacts if contact is not None), None),
        "timings": {key: sum(of_arm[key] for of_arm in timings) for key in timings[0]},
    }


def _constraints(entries: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the entry of the constraints, which are the same for all arms, if there are any."""
    found = [entry[CONSTRAINTS] for entry in entries if CONSTRAINTS in entry]
    if not found:
        return {}
    return {CONSTRAINTS: {**found[0], "excluded": sum(entry["excluded"] for entry in found)}}


def shifted(
    on_progress: Callable[[int, int], None] | None, done: int, total: int
) -> Callable[[int, int], None] | None:
    """Return a report of progress that counts from `done` to `total`."""
    if on_progress is None:
        return None
    return lambda more, _: on_progress(done + more, total)
