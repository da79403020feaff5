"""A pair of goals for both arms of the PR2, and a small grid from which some are reached."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

GRID = {
    "base_x": (0.65, 0.05, 2),
    "base_y": (-0.8, 0.05, 2),
    "base_yaw": (45, 45, 2),
    "torso": (0.0, 0.15, 2),
}
"""Beside the wheelchair: 16 configurations."""

PAIR: list[dict[str, Any]] = [
    {
        "name": "hold",
        "body_frame": "head",
        "position": [0.1, -0.28, -0.1],
        "quaternion_wxyz": [0.0, 0.484769, 0.874642, 0.0],
        "arm": "left",
        "together_with": "wipe",
    },
    {
        "name": "wipe",
        "body_frame": "head",
        "position": [0.28, -0.16, -0.1],
        "quaternion_wxyz": [0.0, 0.275683, 0.961249, 0.0],
        "arm": "right",
    },
]
"""Beside the right cheek: the forearms come close, and touch each other from some base poses."""


def write_pair(folder: Path, goals: list[dict[str, Any]], **more: Any) -> Path:
    """Write a task of these goals and return its path."""
    path = folder / "pair.yaml"
    content = {"name": "pair", "title": "Two arms", "source": "made up"}
    content |= {"environments": ["wheelchair"], "goals": goals}
    path.write_text(yaml.safe_dump({**content, **more}))
    return path
