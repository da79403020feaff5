"""Which table of a score file to choose from: the one scored for the nearest observed state.

How the person lies is found, not chosen. A file holds a table for each of some states (shifts of
the person on the bed); the robot tells what it sees, as values of the observed axes or as places
of body frames, and the nearest table is used.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError, UnknownNameError
from tcs.model.grid import Axis, Grid, InitialConfiguration
from tcs.placement.store import ScoreFile

FARTHEST_FRAME = 0.10
"""Greatest distance [m], root mean square over the frames seen, between where they are and where
they were scored: four of the bed's shifts. Farther off, the scores are those of another scene."""
FARTHEST_ALONE = 0.10
"""The same for a single scored value without a step [m or rad]: no neighbour says how far it is
to stand for, and 0.10 rad moves what is a metre from the joint by as much."""


@dataclass(frozen=True, slots=True)
class Match:
    """A table, and how far it is from what was observed."""

    index: int
    """Number of the table in the file."""
    state: dict[str, float]
    """Values of the observed axes it was scored for [m or rad]."""
    off: dict[str, float]
    """Observed minus scored value of each axis that was told [m or rad]."""
    frames_off: float | None
    """Root mean square distance of the frames seen from the scored ones [m], None if none were."""
    axes: tuple[Axis, ...]
    """The observed axes."""


def nearest_table(
    file: ScoreFile,
    here: InitialConfiguration | None = None,
    observed: Mapping[str, float] | None = None,
    seen: Mapping[str, Sequence[float]] | None = None,
) -> Match:
    """Return the table whose observed state is nearest to what is told.

    Args:
        file: A score file.
        here: The current state; how the environment is set tells where frames are to be expected.
            None where that is not known.
        observed: Values of the observed axes [m or rad]; what is not told counts as zero, or as
            the only value that was scored.
        seen: Places of body frames in W [m], by name.

    Raises:
        UnknownNameError: If an axis or a frame has no such name.
        SelectionError: If both are told, a value is not finite, or no table is near enough.
    """
    observed, seen = observed or {}, seen or {}
    if observed and seen:
        raise SelectionError(
            "Told both observed values and frames seen, which might disagree. Give one of them."
        )
    if seen:
        return _nearest_to_frames(file, here, seen)
    names = [axis.name for axis in file.observed_axes]
    for name in observed:
        if name not in names:
            raise UnknownNameError("observed axis", name, names, where="score file")
    # Untold, an axis with a single value is where it was scored: there is nothing to choose.
    untold = [float(axis.values[0]) if axis.count == 1 else 0.0 for axis in file.observed_axes]
    along = [
        _nearest_value(axis, float(observed.get(axis.name, value)))
        for axis, value in zip(file.observed_axes, untold, strict=True)
    ]
    shape = tuple(axis.count for axis in file.observed_axes)
    index = int(np.ravel_multi_index(along, shape)) if along else 0
    state = file.observed_states[index]
    off = {name: float(value) - state[name] for name, value in observed.items()}
    return Match(index, state, off, None, file.observed_axes)


def _nearest_value(axis: Axis, value: float) -> int:
    """Return the index of the value of an axis that is nearest, refusing one that is too far."""
    if not math.isfinite(value):
        raise SelectionError(f"Observed '{axis.name}' is {value}; must be a finite number.")
    distance = np.abs(axis.values - value)
    nearest = int(np.argmin(distance))
    # Half a step beyond the ends is as near as it gets between them.
    half = (math.radians(axis.step) if axis.unit == "deg" else axis.step) / 2.0
    if axis.step == 0.0:
        half = FARTHEST_ALONE
    if distance[nearest] > half * (1.0 + 1e-9):
        unit, first, last = axis.held_unit, axis.values[0], axis.values[-1]
        scored = f"is only {first:g} {unit}"
        if axis.count > 1:
            scored = f"are only {first:g} to {last:g} {unit}, {axis.count} values"
        raise SelectionError(
            f"Observed '{axis.name}' is {value:g} {unit}, but scored {scored}. Score an "
            "environment whose 'observed' axis reaches it, or move the person."
        )
    return nearest


def _nearest_to_frames(
    file: ScoreFile, here: InitialConfiguration | None, seen: Mapping[str, Sequence[float]]
) -> Match:
    """Return the table in which the frames are nearest to where they are seen."""
    known = file.body_frames
    squares = np.zeros((len(file.tables), _states(file)))
    for name, place in seen.items():
        if name not in known:
            raise UnknownNameError("body frame", name, known, where="score file")
        p_WH = np.asarray(place, dtype=np.float64)
        if p_WH.shape != (3,) or not np.all(np.isfinite(p_WH)):
            raise SelectionError(
                f"Frame '{name}' is seen at {place!r}; must be three finite numbers (x y z, m)."
            )
        squares += np.sum((_places(file, name) - p_WH) ** 2, axis=-1)
    off = np.sqrt(squares / len(seen))[:, _possible_states(file, here)]
    index = int(np.argmin(off.min(axis=1)))
    least = float(off[index].min())
    if least > FARTHEST_FRAME:
        raise SelectionError(
            f"What is seen ({', '.join(seen)}) is {least:.2f} m from where it was scored, more "
            f"than {FARTHEST_FRAME:.2f} m. Check the frames and how the environment is set now, "
            "or score the scene as it is."
        )
    return Match(index, file.observed_states[index], {}, least, file.observed_axes)


def _states(file: ScoreFile) -> int:
    """Return how many states of the environment the grid has."""
    return math.prod(Grid.from_dict(file.grid).environment_shape)


def _places(file: ScoreFile, name: str) -> NDArray[np.float64]:
    """Return where a frame is in each table and environment state, shape (tables, states, 3)."""
    return np.asarray(file.body_frames[name], dtype=np.float64).reshape(
        len(file.tables), _states(file), 3
    )


def _possible_states(file: ScoreFile, here: InitialConfiguration | None) -> NDArray[np.bool_]:
    """Return which states of the environment may be the present one, shape (states,)."""
    axes = Grid.from_dict(file.grid).environment_axes
    told = dict(here.environment) if here is not None else {}
    possible = np.ones(tuple(axis.count for axis in axes), dtype=np.bool_)
    for i, axis in enumerate(axes):
        if axis.name in told:
            nearest = int(np.argmin(np.abs(axis.values - told[axis.name])))
            along = np.arange(axis.count) == nearest
            possible &= along.reshape([-1 if j == i else 1 for j in range(len(axes))])
    return possible.ravel()
