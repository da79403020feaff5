"""Words for the error of a joint, and for the collisions that count under error."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

BODY_COLLISIONS = {
    "paper": "of the robot's body count, except those of the base with the furniture",
    "all": "of the robot's body count",
    "none": "of the robot's body are ignored",
}
"""What the collisions of base, torso, head and other arm mean for a sample."""


def error_width(error: Mapping[str, Any]) -> str:
    """Return the width of the distribution of an error.

    >>> error_width({"distribution": "normal", "std": 0.05})
    'standard deviation 0.05 m'
    >>> error_width({"distribution": "uniform", "half_width_deg": 5.0})
    'uniform ±5 deg'
    """
    (key, width) = next((k, v) for k, v in error.items() if k != "distribution")
    unit = "deg" if key.endswith("_deg") else "m"
    sign = "standard deviation " if error["distribution"] == "normal" else "uniform ±"
    return f"{sign}{width:g} {unit}"
