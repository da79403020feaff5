"""Constraints in a YAML file, for an environment in which they stay the same."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tcs.errors import DataFileError, GridError, SelectionError, UnknownNameError, one_line
from tcs.placement.constraints.constraints import Constraints
from tcs.placement.constraints.obstacles import Obstacle
from tcs.placement.constraints.regions import Region

KEYS = ("only", "keep", "forbid", "blocked", "prefer")
"""Keys of the file, each a list of texts as on the command line."""


def read_constraints(path: Path) -> Constraints:
    """Return the constraints of a YAML file.

    Args:
        path: A file with some of `KEYS`, e.g. `keep: [bed_height]`. An entry of `forbid` is a text
            as of `Region.parse` or a list of [x, y]; one of `blocked` a text as of
            `Obstacle.parse`.

    Raises:
        SelectionError: If the file cannot be read, or a value is invalid.
        UnknownNameError: If a key is unknown.
        GridError: If a condition is not of the form of `AxisCondition`.
    """
    from tcs.files.documents import read_mapping

    where = f"constraints file '{path}'"
    try:
        content = read_mapping(path, where, DataFileError, known=KEYS)
    except DataFileError as error:
        raise SelectionError(str(error)) from None
    for key, values in content.items():
        if key not in KEYS:
            raise UnknownNameError("key", str(key), KEYS, where=where)
        if not isinstance(values, list):
            raise SelectionError(f"{where}: '{key}' must be a list.")
    try:
        return Constraints(
            only=tuple(_texts(content, "only")),
            keep=tuple(_texts(content, "keep")),
            forbid=tuple(_region(value) for value in content.get("forbid", [])),
            blocked=tuple(Obstacle.parse(text) for text in _texts(content, "blocked")),
            prefer=tuple(_texts(content, "prefer")),
        )
    except (SelectionError, GridError) as error:
        raise type(error)(f"{where}: {error}") from None


def merged(first: Constraints, second: Constraints) -> Constraints:
    """Return the constraints of both."""
    return Constraints(**{key: (*getattr(first, key), *getattr(second, key)) for key in KEYS})


def _texts(content: Mapping[str, Any], key: str) -> list[str]:
    """Return the texts under a key."""
    values: list[Any] = content.get(key, [])
    for value in values:
        if not isinstance(value, str):
            raise SelectionError(f"'{key}' holds {one_line(repr(value))}; must be a text.")
    return values


def _region(value: object) -> Region:
    """Return the region of a text, or of a list of [x, y]."""
    return Region.parse(value) if isinstance(value, str) else Region.of(value, "'forbid'")
