"""Constraints that every member of a selected set satisfies, preferences, and files of both."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tcs.errors import DataFileError, GridError, SelectionError, UnknownNameError, one_line
from tcs.model.grid import Axis, AxisCondition, Grid
from tcs.model.grid.condition import axis_named, values_text
from tcs.placement.constraints.obstacles import Obstacle
from tcs.placement.constraints.regions import Region

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

SIDES = {"left": ("_left", "_right"), "right": ("_right", "_left")} | {
    "head": ("head", "foot"),
    "foot": ("foot", "head"),
}
"""Sides of the person: parts of the names of the body frames on that side, and on the other."""


MIDDLE = 1e-9
"""Difference of squared distances [m^2] below which a base is on neither side."""


def check_preference(text: str) -> None:
    """Check the form of a preference.

    Raises:
        SelectionError: If it is neither a side nor a condition on an axis.
        GridError: If it is a condition of another form.
        UnknownNameError: If a condition has an unknown unit.
    """
    if text in SIDES:
        return
    if not any(comparison in text for comparison in "<>="):
        raise SelectionError(
            f"Preference '{one_line(text)}' must be a side of the person, {', '.join(SIDES)}, or a "
            "condition on an axis, e.g. torso <= 0.15 m."
        )
    AxisCondition.parse(text)


def disliked_candidates(
    text: str, grid: Grid, candidates: NDArray[np.int32], frames: Mapping[str, FloatArray]
) -> BoolArray:
    """Return which candidates violate a preference, shape (C,).

    A base is on a side of the person if it is nearer to the mean position on the floor of the body
    frames of that side than to that of the other side, in the candidate's environment state.

    Args:
        text: One of `SIDES`, or a condition on an axis.
        grid: Grid of the candidates.
        candidates: Flat indices of the candidates, shape (C,).
        frames: Positions of the body frames in W for each environment state [m], shapes
            (states, 3).

    Raises:
        GridError: If the condition has another unit than its axis, or excludes all its values.
        UnknownNameError: If the grid has no such axis.
        SelectionError: If there are no body frames on that side.
    """
    if text not in SIDES:
        condition = AxisCondition.parse(text)
        along = grid.indices(candidates)[:, grid.axes.index(condition.axis_of(grid))]
        return np.asarray(~condition.admitted(grid)[along])
    wanted, other = (_middle(frames, part) for part in SIDES[text])
    if wanted is None or other is None:
        raise SelectionError(
            f"prefer {text}: the environment has no body frames on this side of the person. "
            f"Known: {', '.join(frames) or 'none'}. Prefer values of an axis instead."
        )
    state = grid.state_of(candidates)
    values = grid.values(candidates)
    base = np.stack([values["base_x"], values["base_y"]], axis=1)
    near, far = (np.sum((base - middle[state]) ** 2, axis=1) for middle in (wanted, other))
    return np.asarray(near > far - MIDDLE)


def _middle(frames: Mapping[str, FloatArray], part: str) -> FloatArray | None:
    """Return the mean position on the floor of the frames whose names hold a part, (states, 2)."""
    positions = [p[:, :2] for name, p in frames.items() if part in f"_{name}"]
    return np.mean(positions, axis=0) if positions else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Constraints:
    """Constraints that every member of a selected set satisfies, and preferences."""

    only: tuple[str, ...] = ()
    """Conditions on axes of the grid, e.g. "head_rest >= 35 deg"; see `AxisCondition`."""
    keep: tuple[str, ...] = ()
    """Axes that stay as they are now, e.g. "bed_height"."""
    forbid: tuple[Region, ...] = ()
    """Regions of the floor on which the robot must not stand."""
    blocked: tuple[Obstacle, ...] = ()
    """Obstacles that neither the robot's body nor its arm may touch."""
    prefer: tuple[str, ...] = ()
    """Preferences, each of which a set may violate at a cost (`UtilityWeights.preference`): a side
    of the person, "left", "right", "head" or "foot", or a condition on an axis."""

    def __post_init__(self) -> None:
        """Turn lists into tuples, and check the form of the constraints.

        Raises:
            SelectionError: If a field is a single text, or holds another type than it should.
            GridError: If a condition is not of the form of `AxisCondition`.
            UnknownNameError: If a condition has an unknown unit.
        """
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, str):
                raise SelectionError(
                    f"Constraint {field.name} is the text '{value}'; must be a tuple of them."
                )
            object.__setattr__(self, field.name, tuple(value))
        for name, type_ in (
            ("only", str),
            ("keep", str),
            ("forbid", Region),
            ("blocked", Obstacle),
        ):
            for value in getattr(self, name):
                if not isinstance(value, type_):
                    raise SelectionError(
                        f"Constraint {name} holds {value!r}; must be of type {type_.__name__}."
                    )
        for text in self.only:
            AxisCondition.parse(text)
        for text in self.prefer:
            check_preference(text)

    @property
    def exclude(self) -> bool:
        """Whether any set may be excluded, rather than disliked."""
        return bool(self.only or self.keep or self.forbid or self.blocked)


SAME_VALUE = 1e-6
"""Difference [m or rad] below which a present value counts as a scored one."""


class AxisConstraint(NamedTuple):
    """A constraint on the values of an axis."""

    name: str
    axis: Axis
    admitted: BoolArray
    """Which values of the axis it admits, shape (count,)."""
    admits: Callable[[FloatArray], BoolArray]
    """Returns which values between those of the axis it admits, shape (n,)."""
    warning: str
    """What the user should know; "" for nothing."""


def axis_constraints(
    constraints: Constraints, now: Mapping[str, float], grid: Grid
) -> Iterator[AxisConstraint]:
    """Yield each constraint on an axis.

    Args:
        constraints: The constraints, of which `only` and `keep` are read.
        now: Present values by axis [m or rad], for `keep`.
        grid: The grid.

    Raises:
        UnknownNameError: If the grid has no such axis.
        GridError: If a condition has another unit than its axis, or excludes all its values.
        SelectionError: If the present value of an axis to keep is missing, or more than half a step
            from every scored one.
    """
    for text in constraints.only:
        condition = AxisCondition.parse(text)
        axis = condition.axis_of(grid)
        admitted = condition.admitted(grid)
        warning = ""
        if np.all(admitted):
            warning = (
                f"only {condition.text} excludes nothing: the grid has {axis.name} "
                f"{values_text(axis)}."
            )
        admits = partial(condition.satisfied, axis)
        yield AxisConstraint(f"only {condition.text}", axis, admitted, admits, warning)
    for name in constraints.keep:
        axis = axis_named(grid, name, where="keep")
        index, error = _present(axis, now)
        warning = ""
        if error > SAME_VALUE:
            warning = (
                f"keep {axis.name}: the present value {_shown(axis, now[axis.name])} is not "
                f"scored; the scores are those of {_shown(axis, float(axis.values[index]))}."
            )
        kept = np.arange(axis.count) == index
        admits = partial(_is_kept, axis, now[axis.name])
        yield AxisConstraint(f"keep {axis.name}", axis, kept, admits, warning)


def _is_kept(axis: Axis, now: float, values: FloatArray) -> BoolArray:
    """Return which values of an axis are the present one, shape (n,)."""
    return np.asarray(_apart(axis, values, now) <= SAME_VALUE)


def _apart(axis: Axis, values: FloatArray, now: float) -> FloatArray:
    """Return the distances of values of an axis from the present one [m or rad]."""
    apart = np.abs(values - now)
    if axis.name == "base_yaw":
        apart = np.abs(np.mod(apart + math.pi, 2.0 * math.pi) - math.pi)
    return apart


def kept_conditions(keep: tuple[str, ...], now: Mapping[str, float], grid: Grid) -> tuple[str, ...]:
    """Return conditions that leave only the value of each axis that is nearest to the present one.

    Args:
        keep: Names of axes.
        now: Present values by axis [m or rad].
        grid: The grid.

    Raises:
        UnknownNameError: If the grid has no such axis, or no axis with a present value.
        SelectionError: As of `axis_constraints`.
    """
    conditions = []
    if keep:
        for name in now:
            # A misspelt name would leave its axis without a value.
            axis_named(grid, name, where="present values")
    for name in keep:
        axis = axis_named(grid, name, where="keep")
        index, _ = _present(axis, now)
        # Twelve decimals, as of a restricted grid: 3 steps of 0.1 m exceed 0.3 m by 6e-17 m.
        value = round(axis.start + index * axis.step, 12)
        conditions.append(f"{axis.name} = {value!r} {axis.unit}")
    return tuple(conditions)


def _present(axis: Axis, now: Mapping[str, float]) -> tuple[int, float]:
    """Return the index of the scored value nearest to the present one, and their difference."""
    if axis.name not in now:
        key = f"{axis.name}_deg" if axis.unit == "deg" else axis.name
        raise SelectionError(
            f"keep {axis.name}: the current state lacks its value. Give it: --at {key}=VALUE."
        )
    apart = _apart(axis, axis.values, now[axis.name])
    index = int(np.argmin(apart))
    half = (math.radians(axis.step) if axis.unit == "deg" else axis.step) / 2.0
    # A single value has no neighbour that shows what range it covers.
    if apart[index] > (half * (1.0 + 1e-9) if axis.count > 1 else SAME_VALUE):
        raise SelectionError(
            f"keep {axis.name}: the present value {_shown(axis, now[axis.name])} is more than half "
            f"a step from the scored ones: {values_text(axis)}."
            if axis.count > 1
            else f"keep {axis.name}: the present value is {_shown(axis, now[axis.name])}, but only "
            f"{values_text(axis)} is scored."
        )
    return index, float(apart[index])


def _shown(axis: Axis, value: float) -> str:
    return f"{math.degrees(value) if axis.unit == 'deg' else value:g} {axis.unit}"


KEYS = ("only", "keep", "forbid", "blocked", "prefer")
"""Keys of the file, each a list of texts as on the command line."""


def read_constraints(path: Path) -> Constraints:
    """Return the constraints of a YAML file.

    Args:
        path: A file with some of `KEYS`, e.g. `keep: [bed_height]`. An entry of `forbid` is a text
            as of `Region.parse` or a list of [x, y]; one of `blocked` a text as of
            `Obstacle.parse`.

    Raises:
        SelectionError: If the file cannot be read, or a value is invalid.
        UnknownNameError: If a key is unknown.
        GridError: If a condition is not of the form of `AxisCondition`.
    """
    from tcs.files.documents import read_mapping

    where = f"constraints file '{path}'"
    try:
        content = read_mapping(path, where, DataFileError, known=KEYS)
    except DataFileError as error:
        raise SelectionError(str(error)) from None
    for key, values in content.items():
        if key not in KEYS:
            raise UnknownNameError("key", str(key), KEYS, where=where)
        if not isinstance(values, list):
            raise SelectionError(f"{where}: '{key}' must be a list.")
    try:
        return Constraints(
            only=tuple(_texts(content, "only")),
            keep=tuple(_texts(content, "keep")),
            forbid=tuple(_region(value) for value in content.get("forbid", [])),
            blocked=tuple(Obstacle.parse(text) for text in _texts(content, "blocked")),
            prefer=tuple(_texts(content, "prefer")),
        )
    except (SelectionError, GridError) as error:
        raise type(error)(f"{where}: {error}") from None


def merged(first: Constraints, second: Constraints) -> Constraints:
    """Return the constraints of both."""
    return Constraints(**{key: (*getattr(first, key), *getattr(second, key)) for key in KEYS})


def _texts(content: Mapping[str, Any], key: str) -> list[str]:
    """Return the texts under a key."""
    values: list[Any] = content.get(key, [])
    for value in values:
        if not isinstance(value, str):
            raise SelectionError(f"'{key}' holds {one_line(repr(value))}; must be a text.")
    return values


def _region(value: object) -> Region:
    """Return the region of a text, or of a list of [x, y]."""
    return Region.parse(value) if isinstance(value, str) else Region.of(value, "'forbid'")
