"""Files of ARPlace models and of probability maps: joblib files of plain containers."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.capability.arplace.boundary import Boundary
from tcs.capability.arplace.model import Arplace
from tcs.capability.arplace.probability_map import ProbabilityMap
from tcs.capability.arplace.task import MAX_LABELS, TableTask
from tcs.errors import StoreFormatError, TcsError
from tcs.files.compression import AtMost, compress, decompress
from tcs.files.joblib_file import JoblibFormat, check_types
from tcs.files.plain import plain
from tcs.files.reader import read_joblib

MODEL = JoblibFormat(
    what="ARPlace model",
    name="tcs arplace model",
    version=1,
    again="Learn the model again with `tcs arplace learn`.",
)
MAP = JoblibFormat(
    what="Probability map",
    name="tcs arplace probability map",
    version=1,
    again="Make the map again with `tcs arplace query`.",
)


def save_arplace(path: str | os.PathLike[str], arplace: Arplace) -> None:
    """Write an ARPlace model; an interrupted write leaves no file.

    Args:
        path: File to write; its folder must exist.
        arplace: The model.

    Raises:
        OutputError: If the file cannot be written.
    """
    MODEL.save(path, _encode(arplace))


def load_arplace(path: str | os.PathLike[str]) -> Arplace:
    """Read an ARPlace model; the content is validated and never executed.

    Raises:
        StoreError: If the file cannot be read.
        StoreFormatError: If the file is truncated, of another format or version, or inconsistent.
        UnsafeStoreError: If it names an object outside the store's allow-list.
    """
    return MODEL.load(path, _decode)


def save_probability_map(path: str | os.PathLike[str], found: ProbabilityMap) -> None:
    """Write a probability map; an interrupted write leaves no file.

    Args:
        path: File to write; its folder must exist.
        found: The map.

    Raises:
        OutputError: If the file cannot be written.
    """
    content = {
        "base_yaw": float(found.base_yaw),
        "torso_height": float(found.torso_height),
        "metadata": {},
        **{name: compress(getattr(found, name)) for name in ("x", "y", "probability")},
    }
    MAP.save(path, content)


def load_probability_map(path: str | os.PathLike[str]) -> ProbabilityMap:
    """Read a probability map; the content is validated and never executed.

    Raises:
        StoreError: If the file cannot be read.
        StoreFormatError: If the file is truncated, of another format or version, or inconsistent.
        UnsafeStoreError: If it names an object outside the store's allow-list.
    """
    return MAP.load(path, _decode_map)


def is_probability_map(path: str | os.PathLike[str]) -> bool:
    """Return whether a file is a probability map rather than a model.

    Raises:
        StoreError: If the file cannot be read.
    """
    content = read_joblib(Path(path), MODEL.what, MODEL.again)
    return isinstance(content, dict) and content.get("format") == MAP.name


def _encode(arplace: Arplace) -> dict[str, Any]:
    polygons = [polygon for boundary in arplace.boundaries for polygon in boundary]
    corners = np.concatenate([np.empty((0, 2)), *polygons])
    return {
        "task": plain("task", arplace.task.to_dict()),
        "representation": arplace.representation,
        "rule": arplace.rule,
        "energy": float(arplace.energy),
        "torso_height": float(arplace.torso_height),
        "base_radius": float(arplace.base_radius),
        "metadata": plain("metadata", dict(arplace.metadata)),
        "reached": compress(np.packbits(arplace.reached.ravel())),
        "used": compress(arplace.used.astype(np.uint8)),
        "vectors": compress(arplace.vectors),
        "polygons": compress(np.array([len(b) for b in arplace.boundaries], np.uint32)),
        "corners": compress(np.array([len(p) for p in polygons], np.uint32)),
        "points": compress(corners),
    }


def _decode(content: dict[str, Any]) -> Arplace:
    numbers = dict.fromkeys(("energy", "torso_height", "base_radius"), float)
    check_types(
        content, {"task": dict, "representation": str, "rule": str, "metadata": dict, **numbers}
    )
    metadata = plain("metadata", content["metadata"])
    try:
        task = TableTask.from_dict(plain("task", content["task"]))
        count = (len(task), task.base_x.count, task.base_y.count)
        labels = int(np.prod(count))
        bits = decompress(content, "reached", "u1", (-(-labels // 8),))
        used = decompress(content, "used", "u1", (len(task),)) > 0
        size = (int(np.count_nonzero(used)), AtMost(MAX_LABELS))
        return Arplace(
            task=task,
            reached=np.unpackbits(bits, count=labels).astype(np.bool_).reshape(count),
            boundaries=_boundaries(content, len(task)),
            representation=content["representation"],
            vectors=decompress(content, "vectors", "f8", size),
            used=used,
            rule=content["rule"],
            energy=content["energy"],
            torso_height=content["torso_height"],
            base_radius=content["base_radius"],
            metadata=metadata,
        )
    except StoreFormatError:
        raise
    except TcsError as error:
        raise StoreFormatError(str(error)) from None


def _boundaries(content: dict[str, Any], grasps: int) -> tuple[Boundary, ...]:
    """Return the stored boundaries of each grasp.

    Raises:
        StoreFormatError: If they are inconsistent.
    """
    polygons = decompress(content, "polygons", "u4", (grasps,))
    corners = decompress(content, "corners", "u4", (int(polygons.sum(dtype=np.uint64)),))
    points = decompress(content, "points", "f8", (int(corners.sum(dtype=np.uint64)), 2))
    if not np.isfinite(points).all() or np.any(corners < 3):
        raise StoreFormatError("has invalid boundaries")
    divided: list[NDArray[np.float64]] = np.split(points, np.cumsum(corners)[:-1].astype(int))
    ends = np.cumsum(polygons).astype(int)
    return tuple(
        tuple(divided[end - int(count) : end]) for end, count in zip(ends, polygons, strict=True)
    )


def _decode_map(content: dict[str, Any]) -> ProbabilityMap:
    check_types(content, {"base_yaw": float, "torso_height": float, "metadata": dict})
    plain("metadata", content["metadata"])
    x = decompress(content, "x", "f8", (AtMost(MAX_LABELS),))
    y = decompress(content, "y", "f8", (AtMost(MAX_LABELS),))
    probability = decompress(content, "probability", "f8", (len(x), len(y)))
    try:
        return ProbabilityMap(x, y, probability, content["base_yaw"], content["torso_height"])
    except TcsError as error:
        raise StoreFormatError(str(error)) from None
