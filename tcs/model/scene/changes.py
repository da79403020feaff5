"""An environment that somebody has changed: things moved, furniture added, joints set."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml
from pydrake.math import RollPitchYaw, RotationMatrix

from tcs.errors import EnvironmentFileError, UnknownNameError
from tcs.files.paths import data_folder
from tcs.model.grid import Axis
from tcs.model.scene.environment.environment_file import E, EnvironmentFile
from tcs.model.scene.pieces import PlacedPiece, with_pieces

SUFFIX = " changed"
"""End of the name of a changed environment, which is no longer that of the papers."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Shift:
    """How a thing is moved on the floor, along the axes of its parent."""

    x: float = 0.0
    """Along x [m]."""
    y: float = 0.0
    """Along y [m]."""
    yaw: float = 0.0
    """Rotation about its own origin, positive to the left [rad]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EnvironmentChanges:
    """What is changed in an environment."""

    shifts: Mapping[str, Shift] = field(default_factory=dict)
    """Models and obstacles that are moved; what stands on them moves with them."""
    pieces: tuple[PlacedPiece, ...] = ()
    """Furniture that is added."""
    joints: Mapping[str, float] = field(default_factory=dict)
    """Positions of joints [m or rad], e.g. of the person."""


def changed_environment(
    environment: EnvironmentFile, changes: EnvironmentChanges, axes: Mapping[str, Axis]
) -> EnvironmentFile:
    """Return a changed environment; it has yet to be checked as any other.

    Args:
        environment: The environment.
        changes: What is changed.
        axes: The axes of the grid, by name.

    Raises:
        UnknownNameError: If nothing has the name of something that is moved, or there is no such
            piece of furniture.
    """
    known = [entry.name for entry in environment.placed]
    for name in changes.shifts:
        if name not in known:
            where = f"environment '{environment.name}'"
            raise UnknownNameError("thing to move", name, known, where=where)
    shifts, name = changes.shifts, environment.name.removesuffix(SUFFIX)
    changed = environment.model_copy(
        update={
            "name": f"{name}{SUFFIX}",
            "title": f"{environment.title.removesuffix(',' + SUFFIX)},{SUFFIX}",
            "models": tuple(_shifted(m, shifts.get(m.name)) for m in environment.models),
            "obstacles": tuple(_shifted(o, shifts.get(o.name)) for o in environment.obstacles),
            "joints": {**environment.joints, **changes.joints},
            "grid": {axis: _plain(values) for axis, values in axes.items()},
            # What can only be observed is as the joints state.
            "observed": {},
        }
    )
    return with_pieces(changed, changes.pieces)


def environment_text(environment: EnvironmentFile, *, portable: bool = False) -> str:
    """Return an environment as the text of a file.

    Args:
        environment: The environment.
        portable: Whether model files are named relative to the data folder, as other installations
            have them.

    Raises:
        EnvironmentFileError: If the text is to be portable, and a model does not ship.
    """
    content = environment.model_dump(mode="json", exclude_defaults=True)
    if portable:
        for entry in (*content.get("models", ()), *content.get("obstacles", ())):
            if "file" in entry:
                entry["file"] = _relative(entry["file"], entry["name"], environment.name)
    return yaml.safe_dump(content, sort_keys=False, allow_unicode=True)


def _shifted(entry: E, shift: Shift | None) -> E:
    if shift is None:
        return entry
    x, y, z = entry.xyz
    roll, pitch, yaw = entry.rpy_deg
    if roll or pitch:
        turned = RotationMatrix.MakeZRotation(shift.yaw) @ RotationMatrix(RollPitchYaw(entry.rpy))
        roll, pitch, yaw = (math.degrees(a) for a in RollPitchYaw(turned).vector())
    else:
        yaw += math.degrees(shift.yaw)
    update = {"xyz": (x + shift.x, y + shift.y, z), "rpy_deg": (roll, pitch, yaw)}
    return entry.model_copy(update=update)


def _plain(axis: Axis) -> dict[str, Any]:
    return {key: value for key, value in axis.to_dict().items() if key != "name"}


def _relative(file: str, name: str, environment: str) -> str:
    """Return the path of a model file from the data folder."""
    folder = Path(os.path.realpath(data_folder()))
    path = Path(os.path.realpath(file))
    if not path.is_relative_to(folder):
        raise EnvironmentFileError(
            f"environment '{environment}', '{name}': its model does not ship with tcs. Keep the "
            "environment beside the model."
        )
    return path.relative_to(folder).as_posix()
