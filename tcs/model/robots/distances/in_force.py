"""The tables of distances of a robot that hold for the meshes at hand."""

from __future__ import annotations

import logging
from functools import lru_cache
from pathlib import Path

from tcs.errors import RobotError
from tcs.model.robots.distances.files import read_tables
from tcs.model.robots.distances.sources import source_digest
from tcs.model.robots.distances.table import DistanceTable
from tcs.model.robots.robot_file import RobotFile

_LOG = logging.getLogger(__name__)


def tables_in_force(robot: RobotFile) -> tuple[DistanceTable, ...]:
    """Return the tables of a robot's file that were made from the meshes and joints at hand.

    Of pairs that the others describe, shapes alone decide, and one warning says so; of pairs that
    need no check, nothing is returned.

    Raises:
        RobotError: If the file of the tables cannot be read.
    """
    if robot.distances is None:
        return ()
    off = {frozenset(pair) for pair in robot.disabled_pairs}
    # A file may hold tables of both arms of a robot.
    tables = [
        table
        for table in read_tables(Path(robot.distances))
        if frozenset(table.pair) not in off and set(table.joints) <= set(robot.arm_joints)
    ]
    kept = [table for table in tables if _holds(robot, table)]
    others = [" / ".join(table.pair) for table in tables if table not in kept]
    if others:
        _warn_once(robot.name, robot.distances, ", ".join(others))
    return tuple(kept)


@lru_cache(maxsize=64)
def _warn_once(robot: str, file: str, pairs: str) -> None:
    """Say of which pairs the tables do not hold, once."""
    _LOG.warning(
        "Robot '%s': other meshes or joints than those of its tables of distances, '%s': the "
        "shapes alone decide on contact of %s.",
        robot,
        file,
        pairs,
    )


def _holds(robot: RobotFile, table: DistanceTable) -> bool:
    """Return whether a table was made from the meshes and joints at hand."""
    try:
        return source_digest(robot, table.pair) == table.source
    except RobotError:
        return False
