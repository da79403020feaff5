"""Plain containers: the only things beside arrays that a score file may hold."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from tcs.errors import StoreError

MAX_DEPTH = 32
"""Deepest nesting allowed; our own descriptions need less than ten levels."""

MAX_ITEMS = 100_000
"""Most values allowed; our own descriptions need some thousand. A few lists that contain each
other twice, thirty levels deep, fit into a hundred bytes and expand to a billion values."""


def plain(what: str, value: object) -> Any:
    """Return a copy made of dict, list, tuple, str, int, float, bool and None alone.

    Mappings become dicts and numpy scalars become Python numbers.

    Args:
        what: Name of the value for the error message, e.g. "metadata".
        value: What to copy.

    Raises:
        StoreError: If anything else is inside, or it is absurdly deep or large.
    """
    return _Copier().copy(what, value, 0)


class _Copier:
    """Copies one value, counting what it has copied."""

    def __init__(self) -> None:
        self._items = 0

    def copy(self, what: str, value: object, depth: int) -> Any:
        self._items += 1
        if depth > MAX_DEPTH or self._items > MAX_ITEMS:
            raise StoreError(
                f"{what[:80]}: more than {MAX_DEPTH} levels or {MAX_ITEMS} values; a description "
                "has far fewer."
            )
        if isinstance(value, np.generic):
            value = value.item()
        # Exactly these types: a subclass would be stored under its own name, and refused on load.
        if value is None or isinstance(value, bool):
            return value
        for kind in (str, int, float):
            if isinstance(value, kind):
                return kind(value)
        if isinstance(value, Mapping):
            if not all(isinstance(key, str) for key in value):
                raise StoreError(f"{what[:80]}: keys must be text.")
            return {
                str(key): self.copy(f"{what}.{key}", item, depth + 1) for key, item in value.items()
            }
        if isinstance(value, list | tuple):
            items = (self.copy(f"{what}[{i}]", item, depth + 1) for i, item in enumerate(value))
            return list(items) if isinstance(value, list) else tuple(items)
        raise StoreError(
            f"{what[:80]} is {type(value).__name__}; a score file holds plain containers only: "
            "dict, list, tuple, str, int, float, bool, None."
        )
