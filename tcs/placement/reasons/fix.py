"""The nearest configuration from which a goal is reached, in stated weights."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError
from tcs.model.grid import Grid, InitialConfiguration
from tcs.placement.reasons.changes import Change, ahead_and_left, changes_between, sentence
from tcs.placement.reasons.explained import Standing
from tcs.placement.selection import TravelWeights
from tcs.placement.selection.distances import Distances, LatticeDistances, StraightDistances
from tcs.placement.selection.travel import legs_from
from tcs.placement.tables import BaseLattice, Reason, ScoreTable, tc_manipulability, tc_reachability

TURN_WEIGHT = 0.3
"""Cost of a radian of turning: the sides of a base as large as the PR2's move by 0.33 m."""
AXIS_WEIGHTS = {"m": 2.0, "rad": 1.0}
"""Cost of a metre or radian of an axis of the environment. It moves the person as well, and what
moves the person shall cost double: a metre 2, and a radian of the head rest, which takes the upper
body along by half a metre, 1."""
DETOUR = 1.1
"""A way around the furniture that is longer than the straight line by this factor goes round
something: in the open, the lattice alone makes it up to 8 percent longer."""
TIE = 1e-9
"""Costs that differ by less are equal: steps of 0.05 m are no binary fractions, and a step to one
side comes out 1e-16 cheaper than a step to the other."""


@dataclass(frozen=True, kw_only=True)
class Fix:
    """The cheapest configuration that reaches the goal, and what to change to get there."""

    index: int
    """Its flat index."""
    configuration: InitialConfiguration
    """It itself."""
    place: InitialConfiguration
    """Where the robot is before, and how everything is set."""
    cost: float
    """What the changes cost, in the weights given."""
    driving: float
    """How far it is to drive [m]."""
    route: str
    """How it drives: "around" the furniture; "straight" where that was asked for, or where the
    base cannot be."""
    dexterity: float
    """How evenly the arm can move at the goal from there."""
    reachability: float
    """P_R of this configuration by itself."""
    manipulability: float
    """P_M of this configuration by itself."""
    reached: tuple[int, ...]
    """All goals it reaches."""
    lost: tuple[int, ...]
    """Goals reached from the explained configuration and not from this one."""

    @property
    def changes(self) -> tuple[Change, ...]:
        """What to change, axis by axis."""
        return changes_between(self.place, self.configuration)

    @property
    def sentence(self) -> str:
        """What to change, in words; forward and left as the base heads before."""
        straight = math.hypot(*ahead_and_left(self.place, self.configuration))
        is_detour = self.route == "around" and self.driving > DETOUR * straight
        around = self.driving if is_detour else None
        return sentence(self.place, self.configuration, around=around)

    def to_json(self) -> dict[str, Any]:
        """Return it as plain containers."""
        ahead, left = ahead_and_left(self.place, self.configuration)
        return {
            "members": [self.configuration.to_json()],
            "configuration": self.index,
            "changes": [change.to_json() for change in self.changes],
            "sentence": self.sentence,
            "cost": round(self.cost, 9),
            "driving": round(self.driving, 9),
            "route": self.route,
            "ahead": round(ahead, 9),
            "left": round(left, 9),
            "dexterity": self.dexterity,
            # Seven sevenths add up to 1 only after rounding.
            "reachability": round(self.reachability, 12),
            "manipulability": round(self.manipulability, 12),
            "reached_goals": list(self.reached),
            "lost_goals": list(self.lost),
        }


def fix_weights(
    grid: Grid,
    *,
    metre: float = 1.0,
    turn: float = TURN_WEIGHT,
    torso: float = 1.0,
    environment: tuple[tuple[str, float], ...] = (),
    route: str = "around",
) -> TravelWeights:
    """Return what each change costs by default, or as given.

    Args:
        grid: Grid whose environment axes are to be weighted.
        metre: Cost of a metre of driving.
        turn: Cost of a radian of turning.
        torso: Cost of a metre of torso lift.
        environment: Costs of some environment axes; the others get those of `AXIS_WEIGHTS`.
        route: "around" the furniture, or "straight": the other side of a bed is near by line.

    Raises:
        SelectionError: If a weight is no number from 0 to 1e9, or an axis is named twice.
        UnknownNameError: If there is no such route.
    """
    named = {name for name, _ in environment}
    rest = tuple(
        (axis.name, AXIS_WEIGHTS[axis.held_unit])
        for axis in grid.environment_axes
        if axis.name not in named
    )
    return TravelWeights(
        metre=metre, turn=turn, torso=torso, environment=(*environment, *rest), route=route
    )


def nearest_fix(
    grid: Grid,
    scores: ScoreTable,
    lattice: BaseLattice,
    goal: int,
    standing: Standing,
    weights: TravelWeights,
) -> tuple[Fix | None, int]:
    """Return the cheapest configuration that reaches the goal from where the robot stands.

    Of those that cost the same the one with the greatest P_M is taken, then the first.

    Args:
        grid: The grid that was scored.
        scores: Its scores.
        lattice: Where the base can drive.
        goal: Number of the goal.
        standing: Where the robot stands.
        weights: What each kind of change costs.

    Returns:
        The configuration, None where there is none; and how many reach the goal but cannot be
        driven to around the furniture.

    Raises:
        UnknownNameError: If a weight names an axis that the environment does not have.
    """
    rows = np.flatnonzero(scores.reached[:, goal]).astype(np.int32)
    at = grid.values(rows)
    cell_xy = np.stack([at["base_x"], at["base_y"]], axis=1)
    route, ways = _ways(weights.route, cell_xy, lattice, standing)
    # Every row is a base cell of its own: legs start here and end there, none lead on.
    legs = legs_from(
        standing.place, grid, rows, np.arange(len(rows), dtype=np.int32), ways, weights
    )
    cost = np.where(legs.reachable, legs.from_here, np.inf)
    unreachable = int(np.count_nonzero(~legs.reachable))
    if unreachable == len(rows):
        return None, unreachable
    near = np.flatnonzero(cost <= cost.min() + TIE)
    manipulability = tc_manipulability(scores.dexterity[rows[near]], scores.weights)
    best = int(near[np.argmax(manipulability)])
    driving = ways.from_position(standing.place.base_x, standing.place.base_y)[best]
    index = int(rows[best])
    here, there = scores.reached[standing.index], scores.reached[index]
    fix = Fix(
        index=index,
        configuration=grid.configuration(index),
        place=standing.place,
        cost=float(cost[best]),
        driving=float(driving),
        route=route,
        dexterity=float(scores.dexterity[index, goal]),
        reachability=float(tc_reachability(there, scores.weights)),
        manipulability=float(tc_manipulability(scores.dexterity[index], scores.weights)),
        reached=tuple(np.flatnonzero(there).tolist()),
        lost=tuple(np.flatnonzero(here & ~there).tolist()),
    )
    return fix, unreachable


def _ways(
    route: str, cell_xy: NDArray[np.float64], lattice: BaseLattice, standing: Standing
) -> tuple[str, Distances]:
    """Return the route that can be taken from where the robot stands, and the ways to the cells.

    From a configuration in which the body touches something nobody drives: lines tell what is
    near. A stated place is where the robot is, even if the nearest configuration is blocked.
    """
    place = standing.place
    if route == "around" and (standing.off or standing.reason != Reason.BODY_BLOCKED):
        around = LatticeDistances(cell_xy, lattice)
        try:
            around.from_position(place.base_x, place.base_y)
        except SelectionError:
            return "straight", StraightDistances(cell_xy)
        return route, around
    return "straight", StraightDistances(cell_xy)
