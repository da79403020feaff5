"""Travel cost D(h_k, h_0) of TCS eq. (5): the shortest open tour through the members of a set.

The tour starts at the current state h_0 and visits every member. Each leg is driven straight or
around the furniture, see `tcs.placement.selection.distances`.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError, UnknownNameError
from tcs.model.grid import Grid, InitialConfiguration
from tcs.placement.selection.distances import ON_EDGE, ROUTES, Distances, LatticeDistances
from tcs.placement.selection.utility import check_coordinate, check_weight, check_within_axis

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class TravelWeights:
    """Cost of each type of motion; by default only driving costs.

    Each is a number from 0 to 1e9. D has the unit of the metres driven.
    """

    metre: float = 1.0
    """Per metre of driving."""
    turn: float = 0.0
    """Per radian of base rotation, the shorter way round (0 to pi)."""
    torso: float = 0.0
    """Per metre of torso height."""
    environment: tuple[tuple[str, float], ...] = ()
    """Per metre or radian of each named environment axis, e.g. ("bed_height", 2.0)."""
    route: str = "straight"
    """How the base drives: "straight", as in the paper, or "around" the furniture."""

    def __post_init__(self) -> None:
        """Refuse weights that are negative or not finite, and unknown routes.

        Raises:
            SelectionError: If a weight is not a number from 0 to 1e9, or an axis is named twice.
            UnknownNameError: If there is no such route.
        """
        if self.route not in ROUTES:
            raise UnknownNameError("route", str(self.route), ROUTES, where="travel")
        for name in ("metre", "turn", "torso"):
            check_weight(f"of travel per {name}", getattr(self, name))
        for name, value in self.environment:
            check_weight(f"of travel along '{name}'", value)
        names = [name for name, _ in self.environment]
        if len(set(names)) < len(names):
            raise SelectionError(f"Travel weights name an environment axis twice: {names}.")


@dataclass(frozen=True)
class Legs:
    """Costs of single legs between the current state, candidates and base cells.

    A leg is summed in a fixed order, driving first: in floating point too, the cost of driving is
    then never more than that of the whole leg, and can bound it.
    """

    cell: NDArray[np.int32]
    """Base cells of the candidates, shape (C,)."""
    distances: Distances
    """Driving distances between the cells."""
    here_to_cell: FloatArray
    """Cost of driving from the current position to each cell, 0 where no path leads, shape (N,)."""
    reachable: NDArray[np.bool_]
    """Whether a path leads from the current position to each cell, shape (N,)."""
    levels: FloatArray
    """Coordinates of the candidates beside x and y that have a weight: heading, torso height,
    environment axes [rad or m], shape (C, L)."""
    level_weights: tuple[float, ...]
    """Weight of each column of `levels`."""
    turns: bool
    """Whether the first column of `levels` is the heading, which is periodic."""
    here_levels: FloatArray
    """The current values of `levels`, shape (L,)."""
    metre: float
    """Weight of driving, per metre."""

    def between(self, a: NDArray[np.int64], b: NDArray[np.int64]) -> FloatArray:
        """Return the cost of the leg between candidates a and b, shape (...)."""
        driving = self.metre * self.distances.between(self.cell[a], self.cell[b])
        return self._with_levels(driving, self.levels[a], self.levels[b])

    @cached_property
    def from_here(self) -> FloatArray:
        """Cost of the leg from the current state to each candidate, shape (C,)."""
        return self._with_levels(self.here_to_cell[self.cell], self.here_levels, self.levels)

    def from_here_to(self, member: NDArray[np.int64]) -> FloatArray:
        """Return the cost of the leg from the current state to some candidates, shape (n,)."""
        driving = self.here_to_cell[self.cell[member]]
        return self._with_levels(driving, self.here_levels, self.levels[member])

    @cached_property
    def levels_from_here(self) -> FloatArray:
        """Cost of that leg without driving, shape (C,)."""
        nothing = np.zeros(len(self.cell))
        return self._with_levels(nothing, self.here_levels, self.levels)

    def levels_between(self, a: NDArray[np.int64], b: NDArray[np.int64]) -> FloatArray:
        """Return the cost of the leg between candidates without driving, shape (...)."""
        return self._with_levels(np.zeros(np.shape(a)), self.levels[a], self.levels[b])

    def _with_levels(
        self, driving: FloatArray, from_levels: FloatArray, to_levels: FloatArray
    ) -> FloatArray:
        """Return the cost of legs whose cost of driving is known, shape (...)."""
        cost = driving
        for column, weight in enumerate(self.level_weights):
            change = np.abs(to_levels[..., column] - from_levels[..., column])
            if column == 0 and self.turns:
                change = np.abs(np.mod(change + np.pi, 2.0 * np.pi) - np.pi)
            cost = cost + weight * change
        return cost


def legs_from(
    here: InitialConfiguration | None,
    grid: Grid,
    candidates: NDArray[np.int32],
    cell: NDArray[np.int32],
    distances: Distances,
    weights: TravelWeights,
    off_grid: FloatArray | None = None,
) -> Legs:
    """Return the legs between the current state and the candidates of a grid.

    Args:
        here: The current state h_0. Environment axes matter only if they have a weight. None if it
            is not known: then only the driving between the candidates costs.
        grid: Grid of the candidates.
        candidates: Flat indices of the candidates, shape (C,).
        cell: Base cells of these and of those off the grid, shape (C + M,).
        distances: Driving distances between the cells.
        weights: Cost of each type of motion.
        off_grid: Values of the axes of further candidates [m or rad], shape (M, axes).

    Raises:
        UnknownNameError: If a weight names an axis that the environment does not have.
        SelectionError: If the current state is not finite, is out of the range of an axis, lacks an
            axis with a weight, or if no path starts at its position.
    """
    names, level_weights = _weighted_levels(grid, weights)
    current: dict[str, float] = {}
    metres = np.zeros(len(distances.cell_xy))
    if here is None:
        names, level_weights = (), ()
    else:
        current = current_values(here, grid, names)
        _check_range(current, grid)
        metres = distances.from_position(float(here.base_x), float(here.base_y))
    # Coordinates are looked up only if they have a weight: that takes longer than selecting.
    values = grid.values(candidates) if names else {}
    levels = [values[name] for name in names]
    if off_grid is not None:
        number = {axis.name: i for i, axis in enumerate(grid.axes)}
        levels = [
            np.concatenate([column, off_grid[:, number[name]]])
            for name, column in zip(names, levels, strict=True)
        ]
    reachable = np.isfinite(metres)
    return Legs(
        cell=cell,
        distances=distances,
        here_to_cell=float(weights.metre) * np.where(reachable, metres, 0.0),
        reachable=reachable,
        levels=np.stack(levels, axis=1) if names else np.zeros((len(cell), 0)),
        level_weights=level_weights,
        turns=bool(names) and weights.turn > 0.0,
        here_levels=np.array([current[name] for name in names], dtype=np.float64),
        metre=float(weights.metre),
    )


def shortest_tour(from_here: Sequence[float], between: FloatArray) -> tuple[float, tuple[int, ...]]:
    """Return the cost of the shortest open tour through all members, and the order of visits.

    Args:
        from_here: Cost of the leg from the current state to each member, shape (m,), m >= 1.
        between: Cost of the leg between two members, symmetric, shape (m, m).

    Returns:
        Cost D, and the members in the order they are visited; ties go to the first in
        lexicographic order.

    >>> shortest_tour([5.0, 1.0], np.array([[0.0, 2.0], [2.0, 0.0]]))
    (3.0, (1, 0))
    """
    best, best_order = math.inf, tuple(range(len(from_here)))
    for order in itertools.permutations(range(len(from_here))):
        cost = float(from_here[order[0]])
        for a, b in itertools.pairwise(order):
            cost += float(between[a, b])
        if cost < best:
            best, best_order = cost, order
    return best, best_order


def warning_outside(
    legs: Legs, here: InitialConfiguration, cells: tuple[int, ...], grid: Grid
) -> str | None:
    """Return a warning if the path around the furniture leaves the grid, else None.

    Args:
        legs: Travel from the current state, by either route; a straight path, which ignores the
            furniture, causes no warning.
        here: The current state.
        cells: Base cells of the members, in the order of the tour.
        grid: The scored grid.
    """
    distances = legs.distances
    if not isinstance(distances, LatticeDistances):
        return None
    axes = (grid.axis("base_x"), grid.axis("base_y"))
    low = np.array([axis.values[0] for axis in axes])
    high = np.array([axis.values[-1] for axis in axes])
    covered = f"x {low[0]:g} to {high[0]:g} m, y {low[1]:g} to {high[1]:g} m"
    start = np.array([here.base_x, here.base_y])
    if np.any((start < low - ON_EDGE) | (start > high + ON_EDGE)):
        return (
            f"The path around the furniture starts outside the scored grid ({covered}), where the "
            "scores do not show what blocks the base."
        )
    metres = [float(legs.here_to_cell[cells[0]]) / legs.metre if legs.metre else np.inf]
    metres += [
        float(distances.between(np.array(one), np.array(other)))
        for one, other in itertools.pairwise(cells)
    ]
    stops = np.concatenate([start[None], distances.cell_xy[list(cells)]])
    to_edge = np.minimum(stops - low, high - stops).min(axis=1)
    # A leg that is too short to reach the edge and return needs no search.
    if np.all(np.array(metres) <= to_edge[:-1] + to_edge[1:]):
        return None
    path = distances.path(float(start[0]), float(start[1]), cells, low, high)
    outside = np.any((path < low - ON_EDGE) | (path > high + ON_EDGE), axis=1)
    if not np.any(outside):
        return None
    x, y = path[int(np.argmax(outside))]
    return (
        f"The path around the furniture leaves the scored grid ({covered}) at ({x:.2f}, {y:.2f}) "
        "m; beyond it the scores do not show what blocks the base."
    )


def _weighted_levels(
    grid: Grid, weights: TravelWeights
) -> tuple[tuple[str, ...], tuple[float, ...]]:
    """Return names and weights of the axes beside x and y that have a weight, heading first."""
    known = [axis.name for axis in grid.environment_axes]
    for name, _ in weights.environment:
        if name not in known:
            raise UnknownNameError("environment axis", name, known, where="travel weights")
    levels = (("base_yaw", weights.turn), ("torso", weights.torso), *weights.environment)
    used = [(name, float(weight)) for name, weight in levels if weight > 0.0]
    return tuple(name for name, _ in used), tuple(weight for _, weight in used)


def current_values(
    here: InitialConfiguration, grid: Grid, names: tuple[str, ...]
) -> dict[str, float]:
    """Return the checked current value of every axis that the state gives [m or rad].

    Args:
        here: The current state.
        grid: The grid whose axes it refers to.
        names: Axes that must be given.

    Raises:
        UnknownNameError: If an environment axis has no such name.
        SelectionError: If a value is out of its physical range or in another unit, or an axis is
            missing.
    """
    values = {
        "base_x": here.base_x,
        "base_y": here.base_y,
        "base_yaw": here.base_yaw,
        "torso": here.torso,
    }
    known = {axis.name: axis.held_unit for axis in grid.environment_axes}
    for (name, value), unit in zip(here.environment, here.environment_units, strict=True):
        if name not in known:
            raise UnknownNameError("environment axis", name, known, where="current state")
        if unit != known[name]:
            raise SelectionError(
                f"Current state: '{name}' is given in '{unit}'; must be in '{known[name]}'."
            )
        values[name] = value
    units = {"base_yaw": "rad", **known}
    for name, value in values.items():
        check_coordinate(name, value, units.get(name, "m"))
    # Full rotations have no effect, and would reduce the accuracy of differences of headings.
    values["base_yaw"] = math.remainder(here.base_yaw, 2.0 * math.pi)
    missing = [name for name in names if name not in values]
    if missing:
        raise SelectionError(
            f"Current state lacks {', '.join(missing)}, which has a travel weight. Give its "
            "current value, or weight 0."
        )
    return values


def _check_range(values: dict[str, float], grid: Grid) -> None:
    """Refuse a torso or environment out of range; the base may be anywhere."""
    # A lowered torso is possible even if the grid starts higher.
    check_within_axis(grid.axis("torso"), values["torso"], lowest=0.0)
    for axis in grid.environment_axes:
        if axis.name in values:
            check_within_axis(axis, values[axis.name])
