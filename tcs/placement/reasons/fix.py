"""The nearest configuration that reaches a goal and keeps the others, by the cost of changes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError
from tcs.model.grid import Grid, InitialConfiguration
from tcs.placement.reasons.explained import (
    Change,
    ExplainedConfiguration,
    ahead_and_left,
    changes_between,
    sentence,
)
from tcs.placement.selection import TravelWeights
from tcs.placement.selection.distances import Distances, LatticeDistances, StraightDistances
from tcs.placement.selection.travel import legs_from
from tcs.placement.store import ScoreFile
from tcs.placement.tables import BaseLattice, Reason, ScoreTable, tc_manipulability, tc_reachability

TURN_WEIGHT = 0.3
"""Cost of a radian of turning: the sides of a base as large as the PR2's move by 0.33 m."""
AXIS_WEIGHTS = {"m": 2.0, "rad": 1.0}
"""Cost of a metre or radian of an axis of the environment. Such axes move the person, which costs
double: 2 for a metre, and 1 for a radian of the head rest, which moves the upper body by about half
a metre."""
DETOUR = 1.1
"""A path longer than the straight line by this factor is reported as a detour: the lattice alone
makes paths up to 8 percent longer in free space."""
TIE = 1e-9
"""Costs that differ by less are equal: steps of 0.05 m are not binary fractions, and a step to one
side can cost 1e-16 less than a step to the other."""


@dataclass(frozen=True, kw_only=True)
class Fix:
    """The configuration to change to, and the changes to get there."""

    index: int
    """Flat index of the configuration."""
    configuration: InitialConfiguration
    """The configuration."""
    start: InitialConfiguration
    """The configuration before the changes."""
    cost: float
    """Cost of the changes, by the given weights."""
    driving: float
    """Driving distance [m]."""
    route: str
    """Route of the driving distance: "around" the furniture; "straight" if requested, or if the
    base is in contact at the start."""
    dexterity: float
    """Dexterity at the goal from there."""
    reachability: float
    """P_R of this configuration by itself."""
    manipulability: float
    """P_M of this configuration by itself."""
    reached: tuple[int, ...]
    """All goals it reaches."""
    lost: tuple[int, ...]
    """Goals reached from the explained configuration and not from this one."""
    hand: str = ""
    """The hand to use in words, if it is another one than the explained one."""

    @property
    def changes(self) -> tuple[Change, ...]:
        """The changes, axis by axis."""
        return changes_between(self.start, self.configuration)

    @property
    def sentence(self) -> str:
        """The changes as a sentence; forward and left are those of the base at the start."""
        straight = math.hypot(*ahead_and_left(self.start, self.configuration))
        is_detour = self.route == "around" and self.driving > DETOUR * straight
        around = self.driving if is_detour else None
        return sentence(self.start, self.configuration, around=around, hand=self.hand)

    def to_json(self) -> dict[str, Any]:
        """Return the configuration and the changes as plain containers."""
        ahead, left = ahead_and_left(self.start, self.configuration)
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
    """Return the cost of each type of change.

    Args:
        grid: The grid; its environment axes get a cost each.
        metre: Cost of a metre of driving.
        turn: Cost of a radian of rotation of the base.
        torso: Cost of a metre of torso height.
        environment: Costs of some environment axes; the others get those of `AXIS_WEIGHTS`.
        route: Driving distances "around" the furniture, or "straight".

    Raises:
        SelectionError: If a weight is not a number from 0 to 1e9, or an axis is named twice.
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
    start: ExplainedConfiguration,
    weights: TravelWeights,
) -> tuple[Fix | None, int]:
    """Return the cheapest configuration that reaches the goal and loses fewest others.

    It loses none if there is such a configuration: a cheaper change that makes the task worse is no
    help. Ties go to the greatest P_M, then to the first configuration.

    Args:
        grid: The grid that was scored.
        scores: Its scores.
        lattice: Where the base can drive.
        goal: Number of the goal.
        start: The configuration that the changes start from.
        weights: Cost of each type of change.

    Returns:
        The configuration, None if there is none; and how many configurations reach the goal but
        are unreachable around the furniture.

    Raises:
        UnknownNameError: If a weight names an axis that the environment does not have.
    """
    rows = np.flatnonzero(scores.reached[:, goal]).astype(np.int32)
    at = grid.values(rows)
    cell_xy = np.stack([at["base_x"], at["base_y"]], axis=1)
    route, distances = _distances(weights.route, cell_xy, lattice, start)
    # Every row is a base cell of its own: each leg ends at one, and no leg starts there.
    legs = legs_from(
        start.stated, grid, rows, np.arange(len(rows), dtype=np.int32), distances, weights
    )
    cost = np.where(legs.reachable, legs.from_here, np.inf)
    unreachable = int(np.count_nonzero(~legs.reachable))
    if unreachable == len(rows):
        return None, unreachable
    held, kept = scores.reached[start.index], scores.reached[rows]
    losses = np.count_nonzero(held & ~kept, axis=1)
    cost[losses > losses[np.isfinite(cost)].min()] = np.inf
    near = np.flatnonzero(cost <= cost.min() + TIE)
    manipulability = tc_manipulability(scores.dexterity[rows[near]], scores.weights)
    best = int(near[np.argmax(manipulability)])
    driving = distances.from_position(start.stated.base_x, start.stated.base_y)[best]
    index = int(rows[best])
    there = scores.reached[index]
    fix = Fix(
        index=index,
        configuration=grid.configuration(index),
        start=start.stated,
        cost=float(cost[best]),
        driving=float(driving),
        route=route,
        dexterity=float(scores.dexterity[index, goal]),
        reachability=float(tc_reachability(there, scores.weights)),
        manipulability=float(tc_manipulability(scores.dexterity[index], scores.weights)),
        reached=tuple(np.flatnonzero(there).tolist()),
        lost=tuple(np.flatnonzero(held & ~kept[best]).tolist()),
    )
    return fix, unreachable


def with_hand(
    file: ScoreFile, scores: ScoreTable, goal: int, fix: Fix | None, start: ExplainedConfiguration
) -> Fix | None:
    """Return the fix with the hand to use, if it is another one than the explained one."""
    if fix is None or scores.hand is None or scores.hand[fix.index, goal] == start.hand:
        return fix
    entry = file.hands[int(scores.hand[fix.index, goal])]
    arm = f"{entry['arm']} arm" if entry["arm"] else "bare hand"
    return replace(fix, hand=" with ".join(filter(None, (arm, entry["tool"]))))


def _distances(
    route: str, cell_xy: NDArray[np.float64], lattice: BaseLattice, start: ExplainedConfiguration
) -> tuple[str, Distances]:
    """Return the route that is possible from the start, and the distances to the cells.

    From a configuration in contact, or one that was not scored, the base cannot drive, so distances
    are straight. A stated configuration counts as free, even if the nearest one of the grid is in
    contact.
    """
    here = start.stated
    stuck = (Reason.BODY_BLOCKED, Reason.EXCLUDED)
    if route == "around" and (start.offset or start.reason not in stuck):
        around = LatticeDistances(cell_xy, lattice)
        try:
            around.from_position(here.base_x, here.base_y)
        except SelectionError:
            return "straight", StraightDistances(cell_xy)
        return route, around
    return "straight", StraightDistances(cell_xy)
