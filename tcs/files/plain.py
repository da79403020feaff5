"""Plain containers, the only content of a stored file besides arrays, and what JSON cannot hold."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from tcs.errors import StoreError

MAX_DEPTH = 32
"""Greatest depth allowed; files written by `tcs` have fewer than ten levels."""

MAX_ITEMS = 100_000
"""Greatest number of values allowed; files written by `tcs` have a few thousand. Thirty nested
lists that each contain the next one twice fit into a hundred bytes and expand to a billion
values."""


def plain(what: str, value: object) -> Any:
    """Return a copy that consists of dict, list, tuple, str, int, float, bool and None only.

    Mappings become dicts and numpy scalars become Python numbers.

    Args:
        what: Name of the value in messages, e.g. "metadata".
        value: The value to copy.

    Raises:
        StoreError: If the value contains any other type, or exceeds `MAX_DEPTH` or `MAX_ITEMS`.
    """
    return _Copier().copy(what, value, 0)


class _Copier:
    """Copies one value and counts the items copied."""

    def __init__(self) -> None:
        self._items = 0

    def copy(self, what: str, value: object, depth: int) -> Any:
        self._items += 1
        # A long key would be copied into the name of each of its values.
        what = what[:80]
        if depth > MAX_DEPTH or self._items > MAX_ITEMS:
            raise StoreError(
                f"{what}: more than {MAX_DEPTH} levels or {MAX_ITEMS} values; a file of tcs "
                "has far fewer."
            )
        if isinstance(value, np.generic):
            value = value.item()
        # Convert subclasses: they would be stored under their own name and rejected on loading.
        if value is None or isinstance(value, bool):
            return value
        for scalar in (str, int, float):
            if isinstance(value, scalar):
                return scalar(value)
        if isinstance(value, Mapping):
            if not all(isinstance(key, str) for key in value):
                raise StoreError(f"{what}: keys must be text.")
            return {
                str(key): self.copy(f"{what}.{key[:80]}", item, depth + 1)
                for key, item in value.items()
            }
        if isinstance(value, list | tuple):
            items = (self.copy(f"{what}[{i}]", item, depth + 1) for i, item in enumerate(value))
            return list(items) if isinstance(value, list) else tuple(items)
        raise StoreError(
            f"{what} is {type(value).__name__}, but a file may contain plain types only: "
            "dict, list, tuple, str, int, float, bool, None."
        )


def without_infinities(value: Any) -> Any:
    """Return plain containers with None for numbers that JSON cannot hold: infinities and NaN.

    >>> without_infinities({"cost": [1.0, math.inf]})
    {'cost': [1.0, None]}
    """
    # Numbers and texts first: they are most of what an answer holds.
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, str | int):
        return value
    if isinstance(value, dict):
        return {key: without_infinities(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [without_infinities(entry) for entry in value]
    return value
