"""Environment files for tests: the shipped environments on small grids."""

from __future__ import annotations

from pathlib import Path

import yaml

_UNITS = {"base_yaw": "deg", "head_rest": "deg"}

BESIDE = {
    "base_x": (0.5, 0.1, 8),
    "base_y": (-0.95, 1.7, 2),
    "base_yaw": (90, 45, 4),
    "torso": (0.15, 0.15, 2),
}
"""Two strips beside the wheelchair: 128 configurations."""

CORNER = {
    "base_x": (0.95, 0.1, 3),
    "base_y": (-0.7, 0.7, 3),
    "base_yaw": (90, 90, 2),
    "torso": (0.15, 0.15, 2),
}
"""A corner where the PR2 reaches goals of shaving: 36 configurations."""


def write_environment(
    folder: Path,
    name: str,
    grid: dict[str, tuple[float, float, int]],
    *,
    based_on: str = "wheelchair",
    observed: dict[str, tuple[float, float, int]] | None = None,
) -> Path:
    """Write an environment file and return its path.

    Args:
        folder: Folder of the file.
        name: Name of file and environment.
        grid: Start, step and count of each axis, in metres or degrees.
        based_on: The environment that all other keys are inherited from.
        observed: The same for the observed axes.
    """
    content = {"based_on": based_on, "name": name, "title": f"{based_on}, on a small grid"}
    for key, axes in (("grid", grid), ("observed", observed)):
        if axes is not None:
            content[key] = {
                axis: {"unit": _UNITS.get(axis, "m"), "start": start, "step": step, "count": count}
                for axis, (start, step, count) in axes.items()
            }
    path = folder / f"{name}.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    return path
