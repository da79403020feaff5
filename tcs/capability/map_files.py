"""Capability map files: joblib files of plain containers."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from tcs.capability.grid import MapGrid
from tcs.capability.map import MAX_TORSO_HEIGHTS, CapabilityMap
from tcs.errors import StoreError, StoreFormatError, TcsError
from tcs.files.compression import (
    AtMost,
    ascending_from,
    compress,
    decompress,
    differences,
)
from tcs.files.joblib_file import JoblibFormat, check_types
from tcs.files.plain import plain
from tcs.model.robots import robot_names

FORMAT = JoblibFormat(
    what="Capability map",
    name="tcs capability map",
    version=2,
    again="Make the map again with `tcs capability from-ik`, `record` or `from-bag`.",
)


def save_map(path: str | os.PathLike[str], capability: CapabilityMap) -> None:
    """Write a capability map; an interrupted write leaves no file.

    Args:
        path: File to write; its folder must exist.
        capability: The map.

    Raises:
        OutputError: If the file cannot be written.
    """
    FORMAT.save(path, _encode(capability))


def load_map(path: str | os.PathLike[str]) -> CapabilityMap:
    """Read a capability map; the content is validated and never executed.

    Raises:
        StoreError: If the file cannot be read.
        StoreFormatError: If the file is truncated, of another format or version, or inconsistent.
        UnsafeStoreError: If it names an object outside the store's allow-list.
    """
    return FORMAT.load(path, _decode)


def _encode(capability: CapabilityMap) -> dict[str, Any]:
    c = capability
    return {
        "map_type": c.map_type,
        "step": c.grid.step,
        "yaw_bins": c.grid.yaw_bins,
        "tilts": [list(tilt) for tilt in c.grid.tilts],
        "torso_height": c.torso_height,
        "manipulability_scale": c.manipulability_scale,
        "metadata": plain("metadata", dict(c.metadata)),
        "key_step": compress(differences(c.keys).astype(np.uint64)),
        "torso_heights": compress(np.asarray(c.torso_heights, np.float64)),
        **{
            name: compress(getattr(c, name))
            for name in ("manipulability", "visibility", "free_torso_heights", "joints")
        },
    }


def _decode(content: dict[str, Any]) -> CapabilityMap:
    types = {"map_type": str, "step": float, "yaw_bins": int, "tilts": list, "torso_height": float}
    check_types(content, {**types, "manipulability_scale": float, "metadata": dict})
    tilts = content["tilts"]
    if not all(isinstance(t, list) and [type(n) for n in t] == [int, int] for t in tilts):
        raise StoreFormatError("lacks valid 'tilts'")
    grid = MapGrid(content["step"], content["yaw_bins"], tuple((p, r) for p, r in tilts))
    keys = ascending_from(decompress(content, "key_step", "u8", (None,)), 2**62, "cells")
    count = (keys.size,)
    joints = decompress(content, "joints", "f4", (AtMost(keys.size), 7))
    try:
        return CapabilityMap(
            map_type=content["map_type"],
            grid=grid,
            cells=grid.cells_of(keys),
            manipulability=decompress(content, "manipulability", "f4", count),
            visibility=decompress(content, "visibility", "f4", count),
            torso_heights=decompress(content, "torso_heights", "f8", (AtMost(MAX_TORSO_HEIGHTS),)),
            torso_height=content["torso_height"],
            free_torso_heights=decompress(content, "free_torso_heights", "u4", count),
            manipulability_scale=content["manipulability_scale"],
            metadata=plain("metadata", content["metadata"]),
            joints=joints,
        )
    except TcsError as error:
        raise StoreFormatError(str(error)) from None


def stored_name(capability: CapabilityMap, key: str) -> str:
    """Return the name of a map's robot or tool, which only its metadata hold.

    Raises:
        StoreError: If the map has none.
    """
    name = capability.metadata.get(key)
    if not isinstance(name, str) or not name:
        raise StoreError(f"{FORMAT.what}: its metadata do not name its {key}. {FORMAT.again}")
    return name


def robot_reference(
    path: str | os.PathLike[str], capability: CapabilityMap, robot: str | None = None
) -> str:
    """Return the name or file of the robot of a map.

    Args:
        path: File of the map, for messages.
        capability: The map.
        robot: Name or file that replaces the one stored in the map.

    Raises:
        StoreError: If the stored file is missing.
    """
    stored = stored_name(capability, "robot") if robot is None else robot
    if robot is not None or stored in robot_names() or os.path.isfile(stored):
        return stored
    raise StoreError(
        f"{FORMAT.what} '{path}' was made for robot '{stored}', which does not ship with tcs and "
        "whose file is missing. Name its file with --robot FILE."
    )
