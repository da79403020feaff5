"""Distances of the surfaces of two bodies of a robot, over the two joints between them.

Shapes enclose the surface of a link, and are fatter than it. Where at most two joints decide the
relative pose of two bodies, a table holds how far apart their surfaces are at least: a pair is in
contact where its shapes touch and the table does not show that its surfaces are apart.

In: a robot file and its meshes. Out: tables, kept in a file beside the
primitives (`read_tables`, `write_tables`); those that hold for the meshes at hand
(`tables_in_force`); and the distance of two surfaces at one posture by other means
(`surface_distance`), which judges the tables.
"""

from __future__ import annotations

from tcs.model.robots.distances.files import read_tables, write_tables
from tcs.model.robots.distances.in_force import tables_in_force
from tcs.model.robots.distances.sources import body_surface, source_digest
from tcs.model.robots.distances.surface_distance import surface_distance
from tcs.model.robots.distances.table import UNIT, DistanceTable

__all__ = [
    "UNIT",
    "DistanceTable",
    "body_surface",
    "read_tables",
    "source_digest",
    "surface_distance",
    "tables_in_force",
    "write_tables",
]
