"""The grid of initial configurations that is scored, eta in the TCS paper."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tcs.errors import GridError, SelectionError, UnknownNameError
from tcs.model.grid.axis import Axis
from tcs.model.grid.configuration import InitialConfiguration

ROBOT_AXES = {"base_x": "m", "base_y": "m", "base_yaw": "deg", "torso": "m"}
"""The last axes of every grid, in flat order, and the unit of each."""

MAX_CONFIGURATIONS = 100_000_000
"""Largest number of configurations of a grid, a thousand times the paper's: with twenty goals, a
score file has two billion reasons, the most that are read (`tcs.files.compression.MAX_BYTES`)."""


@dataclass(frozen=True)
class Grid:
    """Every combination of the values of its axes.

    A configuration is identified by its flat index in C order over the axes: the last axis, the
    torso, changes fastest. Axes of the environment come first, then `ROBOT_AXES`.

    >>> grid = Grid.from_spec({
    ...     "base_x": {"unit": "m", "start": -1.5, "step": 0.05, "count": 61},
    ...     "base_y": {"unit": "m", "start": -1.5, "step": 0.05, "count": 61},
    ...     "base_yaw": {"unit": "deg", "start": 0, "step": 45, "count": 8},
    ...     "torso": {"unit": "m", "start": 0, "step": 0.15, "count": 3},
    ... })
    >>> grid.size
    89304
    >>> grid.indices(4).tolist()
    [0, 0, 1, 1]
    """

    axes: tuple[Axis, ...]

    def __post_init__(self) -> None:
        """Check the axes.

        Raises:
            GridError: If a robot axis is missing, out of place or in a wrong unit, an axis or a
                heading is repeated, or there are more than `MAX_CONFIGURATIONS`.
        """
        names = [axis.name for axis in self.axes]
        for name in names:
            if names.count(name) > 1:
                raise GridError(f"grid: axis '{name}' is repeated. Remove one of the two.")
        missing = [name for name in ROBOT_AXES if name not in names]
        if missing:
            raise GridError(
                f"grid: needs axis {', '.join(missing)}. Every grid has {', '.join(ROBOT_AXES)}; "
                "give an axis count 1 to fix its value."
            )
        if names[-len(ROBOT_AXES) :] != list(ROBOT_AXES):
            raise GridError(
                f"grid: axes are {', '.join(names)}, but must end with {', '.join(ROBOT_AXES)}."
            )
        for name, unit in ROBOT_AXES.items():
            if self.axis(name).unit != unit:
                raise GridError(
                    f"grid: axis '{name}': unit is '{self.axis(name).unit}', but must be '{unit}'."
                )
        yaw = self.axis("base_yaw")
        # A span within a micro-degree of a full turn is a full turn, rounded.
        if (yaw.count - 1) * yaw.step > 360.0 - 1e-6:
            raise GridError(
                f"grid: axis 'base_yaw': {yaw.count} values {yaw.step:g} deg apart exceed a full "
                f"turn and repeat headings. Give at most {max(1, math.ceil(360.0 / yaw.step))}."
            )
        if self.size > MAX_CONFIGURATIONS:
            counts = " x ".join(str(count) for count in self.shape)
            raise GridError(
                f"grid: would be {self.size:,} configurations ({counts}), but at most "
                f"{MAX_CONFIGURATIONS:,} are allowed. Take larger steps or fewer values."
            )

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each axis."""
        return tuple(axis.count for axis in self.axes)

    @cached_property
    def size(self) -> int:
        """Number of configurations."""
        return math.prod(self.shape)

    @cached_property
    def state_size(self) -> int:
        """Number of configurations in each state of the environment."""
        return math.prod(axis.count for axis in self.axes[-len(ROBOT_AXES) :])

    def state_of(self, flat: ArrayLike) -> NDArray[np.int64]:
        """Return the number of the environment's state of configurations, in C order over its axes.

        Args:
            flat: Flat indices, shape (...).

        Raises:
            GridError: If an index is not one of this grid.
        """
        return np.asarray(self._checked(flat) // self.state_size)

    @cached_property
    def environment_axes(self) -> tuple[Axis, ...]:
        """The axes that move the environment, e.g. the bed; they come first."""
        return self.axes[: -len(ROBOT_AXES)]

    @property
    def environment_shape(self) -> tuple[int, ...]:
        """Number of values of each environment axis; () without any."""
        return tuple(axis.count for axis in self.environment_axes)

    def environment_states(self) -> Iterator[dict[str, float]]:
        """Yield the values of the environment axes [m or rad], in flat order."""
        axes = self.environment_axes
        for values in itertools.product(*(axis.values.tolist() for axis in axes)):
            yield {axis.name: value for axis, value in zip(axes, values, strict=True)}

    def axis(self, name: str) -> Axis:
        """Return the axis of a name.

        Raises:
            UnknownNameError: If the grid has no such axis.
        """
        for axis in self.axes:
            if axis.name == name:
                return axis
        raise UnknownNameError("axis", name, (axis.name for axis in self.axes), where="grid")

    def indices(self, flat: ArrayLike) -> NDArray[np.int64]:
        """Return the index of configurations along each axis.

        Args:
            flat: Flat indices, shape (...).

        Returns:
            Index along each axis in the order of `axes`, shape (..., n_axes).

        Raises:
            GridError: If an index is not one of this grid.
        """
        checked = self._checked(flat)
        return np.stack(np.unravel_index(checked, self.shape), axis=-1).astype(np.int64)

    def flat(self, indices: ArrayLike) -> NDArray[np.int64]:
        """Return flat indices, the inverse of `indices`.

        Args:
            indices: Index along each axis in the order of `axes`, shape (..., n_axes).

        Returns:
            Flat indices, shape (...).

        Raises:
            GridError: If the indices do not fit the axes of this grid.
        """
        along = np.asarray(indices)
        if along.ndim == 0 or along.shape[-1] != len(self.axes) or along.dtype.kind not in "iu":
            raise GridError(
                f"grid: needs {len(self.axes)} whole-number indices for each configuration, "
                f"but got shape {along.shape} of {along.dtype}."
            )
        if np.any(along < 0) or np.any(along >= self.shape):
            raise GridError(f"grid: an index lies outside the shape {self.shape}.")
        return np.asarray(np.ravel_multi_index(tuple(np.moveaxis(along, -1, 0)), self.shape))

    def values(self, flat: ArrayLike) -> dict[str, NDArray[np.float64]]:
        """Return the coordinates of configurations.

        Args:
            flat: Flat indices, shape (...).

        Returns:
            Values of each axis, by its name [m or rad], shape (...).

        Raises:
            GridError: If an index is not one of this grid.
        """
        along = self.indices(flat)
        return {axis.name: axis.values[along[..., i]] for i, axis in enumerate(self.axes)}

    def configuration(self, flat_index: int) -> InitialConfiguration:
        """Return one configuration by its flat index.

        Raises:
            GridError: If the index is not one of this grid.
        """
        # Plain numbers: arrays of one element take five times as long.
        rest, values = int(self._checked(flat_index)), []
        for axis in reversed(self.axes):
            rest, along = divmod(rest, axis.count)
            values.append(axis.value(along))
        return self.between(values[::-1])

    def between(self, values: Sequence[float]) -> InitialConfiguration:
        """Return a configuration that need not be on the grid.

        Args:
            values: Values in the order of the axes [m or rad].

        Raises:
            GridError: If a value is missing.
        """
        if len(values) != len(self.axes):
            raise GridError(f"grid: {len(values)} values for {len(self.axes)} axes.")
        at = {axis.name: float(v) for axis, v in zip(self.axes, values, strict=True)}
        return InitialConfiguration(
            base_x=at["base_x"],
            base_y=at["base_y"],
            base_yaw=at["base_yaw"],
            torso=at["torso"],
            environment=tuple((axis.name, at[axis.name]) for axis in self.environment_axes),
            environment_units=tuple(axis.held_unit for axis in self.environment_axes),
        )

    def overridden(self, changes: Mapping[str, Mapping[str, object]], *, where: str = "") -> Self:
        """Return this grid with some axes changed, e.g. by a task.

        Args:
            changes: For each axis to change, new values of its start, step or count.
            where: The source of the changes, for the message.

        Raises:
            UnknownNameError: If the grid has no such axis, or an axis has no such key.
            GridError: If the resulting grid is invalid.
        """
        names = [axis.name for axis in self.axes]
        for name in changes:
            if name not in names:
                raise UnknownNameError("axis", name, names, where=where)
        return self._located(
            tuple(
                axis.overridden(changes[axis.name], where=where) if axis.name in changes else axis
                for axis in self.axes
            ),
            where,
        )

    def to_dict(self) -> dict[str, object]:
        """Return the grid as plain containers, for a file."""
        return {"axes": [axis.to_dict() for axis in self.axes]}

    @classmethod
    def from_dict(cls, plain: Mapping[str, object], *, where: str = "") -> Self:
        """Return the grid that `to_dict` wrote.

        Raises:
            GridError: If it is not of that form, or the grid is invalid.
            UnknownNameError: If an axis has no such key.
        """
        axes = plain.get("axes")
        if not isinstance(axes, list | tuple) or not all(isinstance(a, Mapping) for a in axes):
            raise GridError(f"{where or 'grid'}: needs 'axes', a list of axes.")
        return cls._located(tuple(Axis.from_dict(axis, where=where) for axis in axes), where)

    @classmethod
    def from_spec(cls, spec: Mapping[str, Mapping[str, object]], *, where: str = "") -> Self:
        """Return the grid of an environment file's field `grid`.

        Args:
            spec: For each axis its unit, start, step and count. The robot's axes may be in any
                order; axes of the environment keep their order.
            where: The source of the axes, for the message.

        Raises:
            GridError: If the grid is invalid.
            UnknownNameError: If an axis has no such key.
        """
        order = [name for name in spec if name not in ROBOT_AXES]
        order += [name for name in ROBOT_AXES if name in spec]
        for name in order:
            if not isinstance(spec[name], Mapping):
                raise GridError(
                    f"{where or 'grid'}: axis '{name}' is {spec[name]!r}, "
                    "but needs unit, start, step and count."
                )
        return cls._located(
            tuple(Axis.from_dict({**spec[name], "name": name}, where=where) for name in order),
            where,
        )

    @classmethod
    def _located(cls, axes: tuple[Axis, ...], where: str) -> Self:
        """Return the grid of these axes; errors name their source."""
        try:
            return cls(axes)
        except GridError as error:
            text = str(error).removeprefix("grid: ") if where.endswith("'grid'") else str(error)
            raise GridError(f"{where}: {text}" if where else text) from None

    def _checked(self, flat: ArrayLike | int) -> NDArray[np.int64]:
        """Return flat indices as an array; raise for those that are not of this grid."""
        if type(flat) is int and 0 <= flat < self.size:
            return np.asarray(flat, dtype=np.int64)
        checked = np.asarray(flat)
        if checked.dtype.kind not in "iu" and checked.size:
            raise GridError(f"grid: a configuration has a whole number as its index, not {flat!r}.")
        outside = (checked < 0) | (checked >= self.size)
        if np.any(outside):
            first = np.atleast_1d(checked)[np.atleast_1d(outside)][0]
            raise GridError(
                f"grid: there is no configuration {first}; indices are 0 to {self.size - 1}."
            )
        return checked.astype(np.int64)


def thinned(grid: Grid, every: int, around: tuple[float, float] | None = None) -> Grid:
    """Return a grid with every so many of its base positions along x and along y.

    Args:
        grid: The grid with all base positions.
        every: 1 for all, 2 for every second one, ...
        around: x and y [m] of a position whose nearest one of the grid remains; by default the
            first one.

    Raises:
        SelectionError: If `around` is given although all positions remain.

    >>> spec = {name: {"unit": "m", "start": 0, "step": 0.1, "count": 6}
    ...         for name in ("base_x", "base_y", "torso")}
    >>> spec["base_yaw"] = {"unit": "deg", "start": 0, "step": 0, "count": 1}
    >>> grid = Grid.from_spec(spec)
    >>> thinned(grid, 2, (0.52, 0.0)).axis("base_x").values.round(3).tolist()
    [0.1, 0.3, 0.5]
    """
    if every == 1:
        if around is not None:
            raise SelectionError("'around' requires 'every' above 1.")
        return grid
    positions = dict(zip(("base_x", "base_y"), around or (None, None), strict=True))
    axes = []
    for axis in grid.axes:
        if axis.name not in positions or axis.count == 1:
            axes.append(axis)
            continue
        at = positions[axis.name]
        nearest = 0 if at is None else int(np.argmin(np.abs(axis.values - at)))
        first = nearest % min(every, axis.count)
        count = 1 + (axis.count - 1 - first) // every
        start = axis.start + first * axis.step
        axes.append(dataclasses.replace(axis, start=start, step=every * axis.step, count=count))
    return dataclasses.replace(grid, axes=tuple(axes))
