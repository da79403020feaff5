"""Candidates that constraints admit: which remain, and what each constraint leaves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError
from tcs.model.grid import Grid, InitialConfiguration
from tcs.placement.constraints import (
    Constraints,
    Footprint,
    Obstacle,
    Postures,
    axis_constraints,
    blocked_bodies,
    blocked_solutions,
)
from tcs.placement.selection.travel import current_values

if TYPE_CHECKING:
    from tcs.placement.selection.choice import SelectionTables

BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Left:
    """What a constraint and those before it leave."""

    constraint: str
    """The constraint, e.g. "keep bed_height"."""
    configurations: int
    """Number of candidates."""
    solutions: int | None = None
    """Number of their stored solutions, for obstacles."""

    def to_json(self) -> dict[str, Any]:
        """Return the numbers as plain containers."""
        plain: dict[str, Any] = {
            "constraint": self.constraint,
            "configurations": self.configurations,
        }
        return plain if self.solutions is None else {**plain, "solutions": self.solutions}


@dataclass(frozen=True, slots=True)
class Admitted:
    """The candidates that satisfy all constraints, and what they still reach."""

    candidates: BoolArray
    """Whether a candidate satisfies them, shape (C,)."""
    reached: BoolArray
    """Whether a candidate reaches a goal by a solution that no obstacle blocks, shape (C, G)."""
    dexterity: NDArray[np.float32]
    """Its dexterity there, 0 where not reached, shape (C, G)."""
    left: tuple[Left, ...]
    """What each constraint leaves."""
    warnings: tuple[str, ...]
    """What the user should know about the constraints."""
    footprint: Footprint | None
    """The floor that the robot covers; None without forbidden regions."""

    has_lower_scores: bool = False
    """Whether `reached` and `dexterity` may be less than those of the sets."""


def admitted_candidates(
    constraints: Constraints, here: InitialConfiguration | None, tables: SelectionTables
) -> Admitted:
    """Return the candidates that satisfy all constraints.

    Args:
        constraints: The constraints.
        here: The current state, for `keep`; None if it is not known.
        tables: The candidates.

    Raises:
        UnknownNameError: If the grid has no such axis.
        GridError: If a condition has another unit than its axis, or excludes all its values.
        SelectionError: If the current state is not known or lacks an axis to keep, or is beyond
            the scored values, an obstacle is given and the robot's shapes are not known, or no
            candidate is left.
    """
    sets, grid = tables.sets, tables.grid
    remaining = np.ones(len(sets.candidates), dtype=np.bool_)
    reached, dexterity = sets.reached, sets.dexterity
    left: list[Left] = []
    warnings: list[str] = []
    now = {}
    if constraints.keep:
        if here is None:
            raise SelectionError(
                f"Keeping {', '.join(constraints.keep)} requires the current state. Give --here, "
                "with --torso and --at."
            )
        now = current_values(here, grid, ())
    of_axes = list(axis_constraints(constraints, now, grid))
    along = grid.indices(sets.candidates) if of_axes else np.empty((0, 0), np.int64)
    for name, axis, admitted, warning in of_axes:
        remaining &= admitted[along[:, grid.axes.index(axis)]]
        warnings += [warning] if warning else []
        _note(left, Left(name, _count(remaining)), remaining.size)
    footprint = Footprint.of(tables.shapes) if constraints.forbid else None
    if footprint is not None:
        base, which = _bases(grid, sets.candidates)
        for region in constraints.forbid:
            remaining &= ~footprint.overlaps(region, base)[which]
            _note(left, Left(f"forbid {region.name}", _count(remaining)), remaining.size)
        if footprint.radius:
            warnings.append(
                "forbid: the robot's shapes are not stored, so it counts as a circle of "
                f"{footprint.radius:g} m about its base. Score the task again for its footprint."
            )
    for obstacle in constraints.blocked:
        candidate, goal = blocked_pairs(obstacle, tables.postures, remaining)
        reached, dexterity = reached.copy(), dexterity.copy()
        reached[candidate, goal], dexterity[candidate, goal] = False, 0.0
        remaining &= reached.any(axis=1)
        found = Left(f"blocked {obstacle.name}", _count(remaining), _count(reached[remaining]))
        _note(left, found, remaining.size)
    return Admitted(
        remaining, reached, dexterity, tuple(left), tuple(warnings), footprint,
        has_lower_scores=bool(constraints.blocked),
    )  # fmt: skip


def blocked_pairs(
    obstacle: Obstacle, hands: Sequence[Postures], admitted: BoolArray
) -> tuple[IntArray, IntArray]:
    """Return candidates and goals whose stored solution an obstacle blocks, shapes (n,).

    It blocks all solutions of a hand where it touches the robot's body as it is with that hand.

    Args:
        obstacle: The obstacle.
        hands: Postures of each hand.
        admitted: Candidates to examine, shape (C,).
    """
    candidates, goals = [], []
    for postures in hands:
        body = blocked_bodies(obstacle, postures)
        candidate, goal = postures.pairs
        hit = blocked_solutions(obstacle, postures, admitted & ~body)
        hit |= (body & admitted)[candidate]
        candidates.append(candidate[hit])
        goals.append(goal[hit])
    return np.concatenate(candidates), np.concatenate(goals)


def _bases(
    grid: Grid, candidates: NDArray[np.int32]
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Return the distinct base poses (U, 3) [m, m, rad], and the pose of each candidate (C,)."""
    # Neither the environment's state nor the torso level, the fastest axis, moves the base.
    pose = candidates.astype(np.int64) % grid.state_size // grid.shape[-1]
    _, first, which = np.unique(pose, return_index=True, return_inverse=True)
    at = grid.values(candidates[first])
    return np.stack([at[name] for name in ("base_x", "base_y", "base_yaw")], axis=1), which


def _count(remaining: BoolArray) -> int:
    return int(np.count_nonzero(remaining))


def _note(left: list[Left], found: Left, candidates: int) -> None:
    """Record what a constraint leaves; refuse one that leaves no candidate."""
    before = f"the {candidates:,} that reach a goal"
    if left:
        before = f"the {left[-1].configurations:,} that '{left[-1].constraint}' leaves"
    left.append(found)
    if not found.configurations:
        raise SelectionError(
            f"No initial configuration is left: '{found.constraint}' excludes all of {before}. "
            "Relax a constraint, or score a grid that covers it."
        )
