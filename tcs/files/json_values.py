"""Values that JSON cannot hold."""

from __future__ import annotations

import math
from typing import Any


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
