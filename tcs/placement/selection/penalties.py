"""Flat penalties of sets: for moving the environment, and for what is not preferred."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tcs.model.grid import Grid, InitialConfiguration
from tcs.placement.constraints import SAME_VALUE
from tcs.placement.selection.index import SetIndex
from tcs.placement.selection.utility import UtilityWeights

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Penalties:
    """Penalties that a set pays once if any of its members is flagged."""

    flags: tuple[BoolArray, ...]
    """Whether a candidate is flagged, by penalty, shapes (C,)."""
    amounts: tuple[float, ...]
    """Amount of each penalty."""

    @cached_property
    def of_candidates(self) -> FloatArray:
        """What every set with a candidate pays at least, shape (C,)."""
        total = np.zeros(len(self.flags[0]))
        for flag, amount in zip(self.flags, self.amounts, strict=True):
            total += amount * flag
        return total

    def of_sets(self, members: tuple[IntArray, ...]) -> FloatArray:
        """Return what sets pay, given their members of shapes (n,), shape (n,).

        Summed in one order: in floating point too, no set pays less than one of its members alone.
        """
        total = np.zeros(len(members[0]))
        for flag, amount in zip(self.flags, self.amounts, strict=True):
            pays = flag[members[0]]
            for member in members[1:]:
                pays = pays | flag[member]
            total += amount * pays
        return total


def penalties_of(
    weights: UtilityWeights,
    here: InitialConfiguration | None,
    index: SetIndex,
    disliked: tuple[BoolArray, ...],
) -> Penalties | None:
    """Return the penalties of a selection, None if no set pays any.

    Args:
        weights: Amounts of the penalties.
        here: The current state, if it is known; without a value of any environment axis, moving it
            is free.
        index: The candidates.
        disliked: Whether a candidate violates each of the preferences, shapes (C,).
    """
    flags, amounts = list(disliked), [float(weights.preference)] * len(disliked)
    if weights.environment > 0.0 and here is not None and here.environment:
        of_grid = moves_environment(here, index.grid)[index.sets.state]
        flags.append(np.concatenate([of_grid, _moves_off_grid(here, index)]))
        amounts.append(float(weights.environment))
    if not flags or not any(amounts):
        return None
    return Penalties(tuple(flags), tuple(amounts))


def moves_environment(here: InitialConfiguration, grid: Grid) -> BoolArray:
    """Return which states of the environment differ from the present one, shape (states,).

    The present state is the nearest scored one; axes that it lacks count as unchanged.
    """
    now = dict(here.environment)
    keeps = np.ones(grid.environment_shape, dtype=np.bool_)
    for number, axis in enumerate(grid.environment_axes):
        if axis.name in now:
            away = np.arange(axis.count) != int(np.argmin(np.abs(axis.values - now[axis.name])))
            keeps[(slice(None),) * number + (away,)] = False
    return np.asarray(~keeps.ravel())


def _moves_off_grid(here: InitialConfiguration, index: SetIndex) -> BoolArray:
    """Return which candidates off the grid need another environment than the present, (M,)."""
    now = dict(here.environment)
    moves = np.zeros(len(index.off_grid), dtype=np.bool_)
    for axis, values in zip(index.grid.environment_axes, index.off_grid.T, strict=False):
        if axis.name in now:
            moves |= np.abs(values - now[axis.name]) > SAME_VALUE
    return moves
