"""Select the table of a score file that was scored for the observed state.

The state of the person is observed, not chosen. A score file may hold several tables, one for each
observed state (shifts of the person on the bed). An observation gives values of the observed axes
or positions of body frames; the table scored for the nearest state is used.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError, UnknownNameError
from tcs.model.grid import Axis, InitialConfiguration
from tcs.placement.store import ScoreFile, state_to_json

MAX_FRAME_ERROR = 0.10
"""Greatest root mean square distance [m] of the observed frames from their scored positions: two
steps between the shifts on the bed. Beyond it, the scores are those of another scene."""
MAX_SINGLE_ERROR = 0.10
"""The same for an axis with a single scored value and no step [m or rad]: no neighbour shows what
range the value covers, and 0.10 rad moves a point one metre from the joint by as much."""


SAME_ERROR = 1e-9
"""Difference of errors [m] below which a frame is equally near in two tables, as one that does not
move with the person."""


@dataclass(frozen=True, slots=True)
class FrameMatch:
    """The table that is nearest to one of several observed frames."""

    frame: str
    """Name of the body frame."""
    index: int
    """Number of the table in the file."""
    state: dict[str, float]
    """Values of the observed axes this table was scored for [m or rad]."""
    position_error: float
    """Distance of the frame from its scored position there [m]."""


@dataclass(frozen=True, slots=True)
class Match:
    """A table of a score file and its distance from the observation."""

    index: int
    """Number of the table in the file."""
    state: dict[str, float]
    """Values of the observed axes the table was scored for [m or rad]."""
    observed_error: dict[str, float]
    """Observed minus scored value of each axis that was given [m or rad]."""
    frame_position_error: float | None
    """Root mean square distance of the observed frames from their scored positions [m]; None
    without frames."""
    axes: tuple[Axis, ...]
    """The observed axes."""
    by_frame: tuple[FrameMatch, ...] = ()
    """The nearest table of each frame by itself, if several are observed."""

    def to_json(self) -> dict[str, Any]:
        """Return the match as plain containers, angles in degrees under `..._deg` names."""
        plain: dict[str, Any] = {
            "observed": state_to_json(self.axes, self.state),
            "observed_error": state_to_json(self.axes, self.observed_error),
            "frame_position_error": self.frame_position_error,
        }
        if self.by_frame:
            plain["frames"] = [
                {
                    "frame": one.frame,
                    "observed": state_to_json(self.axes, one.state),
                    "position_error": one.position_error,
                }
                for one in self.by_frame
            ]
        return plain


def nearest_table(
    file: ScoreFile,
    here: InitialConfiguration | None = None,
    observed: Mapping[str, float] | None = None,
    frames: Mapping[str, Sequence[float]] | None = None,
) -> Match:
    """Return the table whose observed state is nearest to an observation.

    Args:
        file: A score file.
        here: The current state; its environment axes determine where frames are expected. None if
            unknown.
        observed: Values of the observed axes [m or rad]. An axis that is not given counts as zero,
            or as its only scored value.
        frames: Positions of body frames in W [m], by name; in place of `observed`.

    Raises:
        UnknownNameError: If an axis or a frame has no such name.
        SelectionError: If both are given, a value is not finite, or no table is near enough.
    """
    observed, frames = observed or {}, frames or {}
    if observed and frames:
        raise SelectionError(
            "Both observed values and observed frames are given, and they might disagree. Give "
            "one of them."
        )
    if frames:
        return _nearest_to_frames(file, here, frames)
    names = [axis.name for axis in file.observed_axes]
    for name in observed:
        if name not in names:
            raise UnknownNameError("observed axis", name, names, where="score file")
    # An axis with a single value leaves no choice, so that value is its default.
    default = [float(axis.values[0]) if axis.count == 1 else 0.0 for axis in file.observed_axes]
    along = [
        _nearest_value(axis, float(observed.get(axis.name, value)))
        for axis, value in zip(file.observed_axes, default, strict=True)
    ]
    shape = tuple(axis.count for axis in file.observed_axes)
    index = int(np.ravel_multi_index(along, shape)) if along else 0
    state = file.observed_states[index]
    error = {name: float(value) - state[name] for name, value in observed.items()}
    return Match(index, state, error, None, file.observed_axes)


def _nearest_value(axis: Axis, value: float) -> int:
    """Return the index of the value of an axis that is nearest, or refuse a distant one."""
    if not math.isfinite(value):
        raise SelectionError(f"Observed '{axis.name}' is {value}; must be a finite number.")
    distance = np.abs(axis.values - value)
    nearest = int(np.argmin(distance))
    # Between two values the nearest is at most half a step away; the same holds beyond the ends.
    half = (math.radians(axis.step) if axis.unit == "deg" else axis.step) / 2.0
    if axis.step == 0.0:
        half = MAX_SINGLE_ERROR
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
    file: ScoreFile, here: InitialConfiguration | None, frames: Mapping[str, Sequence[float]]
) -> Match:
    """Return the table whose scored frame positions are nearest to the observed ones."""
    known = file.body_frames
    squares_of: dict[str, NDArray[np.float64]] = {}
    for name, position in frames.items():
        if name not in known:
            raise UnknownNameError("body frame", name, known, where="score file")
        p_WH = np.asarray(position, dtype=np.float64)
        if p_WH.shape != (3,) or not np.all(np.isfinite(p_WH)):
            raise SelectionError(
                f"Position of frame '{name}' is {position!r}; must be three finite numbers "
                "(x y z, m)."
            )
        squares_of[name] = np.sum((_scored_positions(file, name) - p_WH) ** 2, axis=-1)
    possible = _possible_states(file, here)
    squares = np.sum(list(squares_of.values()), axis=0)
    error = np.sqrt(squares / len(frames))[:, possible]
    index = int(np.argmin(error.min(axis=1)))
    least = float(error[index].min())
    if least > MAX_FRAME_ERROR:
        raise SelectionError(
            f"Observed frames ({', '.join(frames)}) are {least:.2f} m from their scored positions, "
            f"more than {MAX_FRAME_ERROR:.2f} m. Check the frames and the state of the "
            "environment, or score the scene as it is."
        )
    by_frame: tuple[FrameMatch, ...] = ()
    if len(frames) > 1:
        # All frames are seen in one state of the environment: the one that fits them best.
        state = int(np.argmin(error[index]))
        by_frame = tuple(
            _frame_match(file, name, np.sqrt(of_frame[:, possible][:, state]), index)
            for name, of_frame in squares_of.items()
        )
    return Match(index, file.observed_states[index], {}, least, file.observed_axes, by_frame)


def _frame_match(file: ScoreFile, name: str, error: NDArray[np.float64], index: int) -> FrameMatch:
    """Return the nearest table of a frame, given its error in each [m]; `index` if equally near."""
    nearest = int(np.argmin(error))
    if error[index] <= error[nearest] + SAME_ERROR:
        nearest = index
    return FrameMatch(name, nearest, file.observed_states[nearest], float(error[nearest]))


def _scored_positions(file: ScoreFile, name: str) -> NDArray[np.float64]:
    """Return a frame's position in each table and state [m], shape (tables, states, 3)."""
    positions = np.asarray(file.body_frames[name], dtype=np.float64)
    return positions.reshape(len(file.tables), -1, 3)


def _possible_states(file: ScoreFile, here: InitialConfiguration | None) -> NDArray[np.bool_]:
    """Return which states of the environment may be the present one, shape (states,)."""
    axes = file.configurations.environment_axes
    known = dict(here.environment) if here is not None else {}
    possible = np.ones(tuple(axis.count for axis in axes), dtype=np.bool_)
    for i, axis in enumerate(axes):
        if axis.name in known:
            nearest = int(np.argmin(np.abs(axis.values - known[axis.name])))
            along = np.arange(axis.count) == nearest
            possible &= along.reshape([-1 if j == i else 1 for j in range(len(axes))])
    return possible.ravel()
