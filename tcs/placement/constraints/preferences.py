"""Preferences: a side of the person, or values of an axis."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError, one_line
from tcs.model.grid import AxisCondition, Grid

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
