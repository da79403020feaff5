"""Self-collision of a robot: which of its bodies touch, and which pairs need no check.

In: a robot file with its primitives. Out: the pairs of bodies that touch in a posture
(`SelfCollision`), random and collision-free postures, pairs to disable with the reason, and the
fraction of postures that the primitives block although the surfaces touch neither each other nor a
box.
"""

from __future__ import annotations

from tcs.model.robots.self_collision.blocked import Blocked, blocked_by_shapes
from tcs.model.robots.self_collision.blocked_at_boxes import blocked_at_boxes
from tcs.model.robots.self_collision.clearance import SurfaceDistance, carried_surfaces
from tcs.model.robots.self_collision.disabled_pairs import (
    propose_disabled_pairs,
    renewed_groups,
)
from tcs.model.robots.self_collision.plant import BodyPair, SelfCollision
from tcs.model.robots.self_collision.postures import DRAWS, free_posture, sample_positions

__all__ = [
    "DRAWS",
    "Blocked",
    "BodyPair",
    "SelfCollision",
    "SurfaceDistance",
    "blocked_at_boxes",
    "blocked_by_shapes",
    "carried_surfaces",
    "free_posture",
    "propose_disabled_pairs",
    "renewed_groups",
    "sample_positions",
]
