"""Values of requests as the arguments of the public functions: radians, states, constraints."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache

from tcs.errors import SelectionError
from tcs.model.grid import Axis, InitialConfiguration
from tcs.placement.constraints import Constraints, Obstacle, Region
from tcs.placement.selection import TravelWeights, UtilityWeights, nearest_table
from tcs.placement.store import ScoreFile
from tcs.service.limits import MOST_VERTICES
from tcs.service.requests import (
    BasePose,
    ForbiddenRegion,
    Limited,
    Observed,
    SelectRequest,
    TravelCosts,
)

_NO_CONSTRAINTS = Constraints()
KEPT_WEIGHTS = 64
"""Most weights that are kept: checking them takes as long as a tenth of a selection."""
_travel = lru_cache(KEPT_WEIGHTS)(TravelWeights)
_utility = lru_cache(KEPT_WEIGHTS)(UtilityWeights)
_WEIGHTS = {
    *("alpha", "beta", "gamma", "delta"),
    *("place_penalty", "environment_penalty", "preference_penalty"),
}
"""Fields of a selection that make the utility decide."""


def settings_of(values: Mapping[str, float], where: str) -> dict[str, float]:
    """Return values of axes or joints in m and rad.

    Args:
        values: Values in m, or in degrees under names that end in `_deg`.
        where: Key of the request, for the message.

    Raises:
        SelectionError: If an axis is set twice.

    >>> settings_of({"bed_height": 0.2, "head_rest_deg": 180.0}, "at")
    {'bed_height': 0.2, 'head_rest': 3.141592653589793}
    """
    found: dict[str, float] = {}
    for name, value in values.items():
        axis = name.removesuffix("_deg")
        if axis in found:
            raise SelectionError(f"'{where}' sets '{axis}' twice. Give it once.")
        found[axis] = math.radians(value) if name.endswith("_deg") else float(value)
    return found


def observed_of(values: Mapping[str, float], axes: Sequence[Axis]) -> dict[str, float]:
    """Return the observed state in m and rad.

    Args:
        values: Values in m, or in degrees under names that end in `_deg`.
        axes: The observed axes of the score file; other names are passed on unchecked.

    Raises:
        SelectionError: If a value is in the unit of another axis, or an axis is set twice.
    """
    found = settings_of(values, "observed")
    for axis in axes:
        right = f"{axis.name}_deg" if axis.unit == "deg" else axis.name
        if axis.name in found and right not in values:
            raise SelectionError(
                f"'observed': '{axis.name}' is scored in {axis.unit}. Use the key {right}."
            )
    return found


def table_of(file: ScoreFile, request: Observed) -> int:
    """Return the number of the table nearest to what is observed.

    Raises:
        TcsError: As `tcs.placement.selection.nearest_table`.
    """
    observed = observed_of(request.observed, file.observed_axes)
    return nearest_table(file, None, observed, request.frames).index


def state_of(here: BasePose, torso: float, at: Mapping[str, float]) -> InitialConfiguration:
    """Return the state of robot and environment.

    Args:
        here: x [m], y [m] and heading [deg] in the environment frame.
        torso: Torso height [m].
        at: Settings of the environment in m, or in degrees under names that end in `_deg`.

    Raises:
        SelectionError: If an axis is set twice.
    """
    x, y, yaw_deg = here
    return InitialConfiguration(
        base_x=x,
        base_y=y,
        base_yaw=math.radians(yaw_deg),
        torso=torso,
        environment=tuple(settings_of(at, "at").items()),
        environment_units=tuple("rad" if name.endswith("_deg") else "m" for name in at),
    )


def constraints_of(request: Limited, prefer: Sequence[str] = ()) -> Constraints:
    """Return the constraints of a request.

    Raises:
        TcsError: If one is not of its form.
    """
    if not (request.only or request.keep or request.forbid or request.blocked or prefer):
        return _NO_CONSTRAINTS
    return Constraints(
        only=tuple(request.only),
        keep=tuple(request.keep),
        forbid=regions_of(request.forbid),
        blocked=tuple(Obstacle.parse(given) for given in request.blocked),
        prefer=tuple(prefer),
    )


def regions_of(given: Sequence[ForbiddenRegion]) -> tuple[Region, ...]:
    """Return the forbidden regions of a request.

    Raises:
        SelectionError: If one is not of its form, or they have too many vertices together.
    """
    vertices = sum(one.count(",") + 1 if isinstance(one, str) else len(one) for one in given)
    if vertices > MOST_VERTICES:
        raise SelectionError(
            f"'forbid': the regions have {vertices:,} vertices; at most {MOST_VERTICES:,} are "
            "accepted. Simplify their outlines."
        )
    return tuple(
        Region.parse(one)
        if isinstance(one, str)
        else Region.of([list(vertex) for vertex in one], "'forbid'")
        for one in given
    )


def travel_of(request: TravelCosts) -> TravelWeights:
    """Return the weights of the travel cost.

    Raises:
        SelectionError: If a weight is invalid.
    """
    return _travel(
        metre=request.metre_weight,
        turn=request.turn_weight,
        torso=request.torso_weight,
        environment=tuple(request.axis_weight.items()),
        route=request.travel,
    )


def utility_of(request: SelectRequest) -> UtilityWeights | None:
    """Return the weights of the utility; None if the request states none.

    Raises:
        SelectionError: If a weight is invalid.
    """
    if not request.model_fields_set & _WEIGHTS:
        return None
    return _utility(
        reachability=request.alpha,
        manipulability=request.beta,
        travel=request.gamma,
        success=request.delta,
        places=request.place_penalty,
        environment=request.environment_penalty,
        preference=request.preference_penalty,
    )
