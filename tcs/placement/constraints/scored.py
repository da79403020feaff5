"""Constraints under which a task is scored, and their record in a score file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import SelectionError, StoreError
from tcs.model.grid import Grid
from tcs.placement.constraints.constraints import Constraints
from tcs.placement.constraints.obstacles import Obstacle
from tcs.placement.constraints.regions import Footprint, Region
from tcs.placement.store import ScoreFile

BoolArray = NDArray[np.bool_]

KEY = "constraints"
"""Entry of the metadata of a score file."""
_NO_CONSTRAINTS = Constraints()


def excluded_configurations(
    forbid: Sequence[Region], footprint: Footprint, grid: Grid
) -> BoolArray | None:
    """Return which configurations of a grid have their footprint on a forbidden region, shape (H,).

    Args:
        forbid: The regions.
        footprint: The floor that the robot covers.
        grid: The grid.

    Returns:
        The configurations in flat order, or None if none is excluded.

    Raises:
        SelectionError: If all are.
    """
    if not forbid:
        return None
    names = ("base_x", "base_y", "base_yaw")
    axes = [grid.axis(name).values for name in names]
    base = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(names))
    on_region = np.any([footprint.overlaps(region, base) for region in forbid], axis=0)
    if not np.any(on_region):
        return None
    if np.all(on_region):
        raise SelectionError(
            "No initial configuration is left: at every base pose of the grid the robot would "
            "stand on a forbidden region. Make the regions smaller."
        )
    states = grid.size // grid.state_size
    return np.tile(np.repeat(on_region, grid.axis("torso").count), states)


def constraints_entry(constraints: Constraints, excluded: BoolArray | None) -> dict[str, Any]:
    """Return the entries of the metadata that record regions, obstacles and what they exclude.

    Args:
        constraints: The constraints.
        excluded: Configurations that were not scored; None for none.
    """
    if not constraints.forbid and not constraints.blocked:
        return {}
    return {
        KEY: {
            "forbid": [
                [list(vertex) for vertex in region.vertices] for region in constraints.forbid
            ],
            "blocked": [asdict(box) for box in constraints.blocked],
            "excluded": 0 if excluded is None else int(np.count_nonzero(excluded)),
        }
    }


def scored_constraints(file: ScoreFile) -> Constraints:
    """Return the constraints under which a file was scored.

    Raises:
        StoreError: If the file does not hold them in the form of `constraints_entry`.
    """
    return recorded_constraints(file.metadata)


def recorded_constraints(metadata: Mapping[str, Any]) -> Constraints:
    """Return the constraints in the metadata of a score file.

    Raises:
        StoreError: If they are not in the form of `constraints_entry`.
    """
    entry = metadata.get(KEY, {})
    if entry == {} and not metadata.get("only"):
        return _NO_CONSTRAINTS
    where = f"metadata '{KEY}'"
    if not isinstance(entry, dict):
        raise StoreError(f"{where} must be a mapping.")
    try:
        return Constraints(
            only=tuple(metadata.get("only", ())),
            forbid=tuple(Region.of(polygon, where) for polygon in entry.get("forbid", [])),
            blocked=tuple(Obstacle(**box) for box in entry.get("blocked", [])),
        )
    except (SelectionError, TypeError) as error:
        raise StoreError(f"{where}: {error}") from None


def constraint_texts(file: ScoreFile) -> list[str]:
    """Return the constraints under which a file was scored, as options of `tcs score` name them."""
    found = scored_constraints(file)
    return [
        *(f"only {condition}" for condition in found.only),
        *(f"forbid {region.name}" for region in found.forbid),
        *(f"blocked {box.name}" for box in found.blocked),
    ]


def scored_entries(file: ScoreFile) -> dict[str, Any]:
    """Return for whom and under which constraints a file was scored, where that is not the default.

    The keys are `person` and `scored_constraints`, as `tcs select --json` prints them.
    """
    texts = constraint_texts(file)
    return {
        **({"person": file.metadata["person"]} if "person" in file.metadata else {}),
        **({"scored_constraints": texts} if texts else {}),
    }
