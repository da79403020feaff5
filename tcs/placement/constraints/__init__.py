"""Constraints on initial configurations, and preferences.

In: conditions on axes, regions of the floor, obstacles and preferences, from Python, the command
line or a file; the robot's shapes. Out: which base poses overlap a region, which bodies and stored
solutions touch an obstacle, which configurations are not preferred.
"""

from __future__ import annotations

from tcs.placement.constraints.blocking import Postures, blocked_bodies, blocked_solutions
from tcs.placement.constraints.constraints import (
    SAME_VALUE,
    Constraints,
    axis_constraints,
    disliked_candidates,
    kept_conditions,
    merged,
    read_constraints,
)
from tcs.placement.constraints.obstacles import Obstacle
from tcs.placement.constraints.regions import Footprint, Region
from tcs.placement.constraints.scored import (
    constraint_texts,
    constraints_entry,
    excluded_configurations,
    recorded_constraints,
    scored_constraints,
    scored_entries,
)

__all__ = [
    "SAME_VALUE",
    "Constraints",
    "Footprint",
    "Obstacle",
    "Postures",
    "Region",
    "axis_constraints",
    "blocked_bodies",
    "blocked_solutions",
    "constraint_texts",
    "constraints_entry",
    "disliked_candidates",
    "excluded_configurations",
    "kept_conditions",
    "merged",
    "read_constraints",
    "recorded_constraints",
    "scored_constraints",
    "scored_entries",
]
