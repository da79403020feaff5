"""Point clouds that obstacles are read from; `tcs.model.robots.mesh_shapes` reads meshes."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import EnvironmentFileError
from tcs.files.reading import read_bytes
from tcs.model.robots.mesh_shapes import check_positions
from tcs.model.robots.urdf.meshes import MAX_BYTES

FloatArray = NDArray[np.float64]

LEAST_POINTS = 10
"""Fewest points of a cloud that count as an obstacle."""
MOST_POINTS = 5_000_000


def cloud_points(file: Path, scale: float, where: str) -> FloatArray:
    """Return the points of a cloud [m], shape (n, 3).

    Args:
        file: A NumPy array of shape (n, 3 or more), a PLY file, or a PCD file. Points with a
            coordinate that is not a number are left out: a depth camera saw nothing there.
        scale: Metres per unit of the file.
        where: Name of the obstacle in messages.

    Raises:
        EnvironmentFileError: If it cannot be read, or has too few points or other numbers.
    """
    here = f"{where}: point cloud '{file}'"
    content = read_bytes(file, here, EnvironmentFileError, limit=MAX_BYTES)
    try:
        if file.suffix.lower() == ".npy":
            read: Any = np.load(io.BytesIO(content), allow_pickle=False)
        elif file.suffix.lower() == ".pcd":
            read = _pcd_points(content)
        else:
            import trimesh

            # Numbers that its types cannot hold become infinite, which is refused below.
            with np.errstate(over="ignore", invalid="ignore"):
                loaded: Any = trimesh.load(io.BytesIO(content), file_type="ply", process=False)
            read = loaded.vertices
        points = np.asarray(read, dtype=np.float64)
    except Exception as error:  # readers raise errors of many classes
        text = " ".join(str(error).split()) or type(error).__name__
        raise EnvironmentFileError(f"{here} cannot be used: {text}.") from None
    if points.ndim != 2 or points.shape[1] < 3:
        raise EnvironmentFileError(
            f"{here} has the shape {points.shape}, but must have x, y, z in each row: (n, 3)."
        )
    points = points[~np.isnan(points[:, :3]).any(axis=1)]
    if not LEAST_POINTS <= len(points) <= MOST_POINTS:
        raise EnvironmentFileError(
            f"{here} has {len(points):,} point(s), but must have {LEAST_POINTS} to "
            f"{MOST_POINTS:,} whose coordinates are numbers. Give single objects as 'box' or "
            "'sphere'."
        )
    points = points[:, :3] * scale
    check_positions(points, here, EnvironmentFileError)
    return points


_PCD_TYPES = {"F": "f", "I": "i", "U": "u"}


def _pcd_points(content: bytes) -> FloatArray:
    """Return x, y, z of a PCD file in ASCII or binary, shape (n, 3).

    Raises:
        ValueError: If it is compressed, or no such file.
    """
    head: dict[str, list[str]] = {}
    start = 0
    while "DATA" not in head:
        end = content.find(b"\n", start)
        if end < 0 or end > 65_536:
            raise ValueError("it has no line DATA")
        key, *words = content[start:end].decode("ascii", "replace").split() or ["#"]
        head[key] = words
        start = end + 1
    fields, form = head.get("FIELDS", []), " ".join(head["DATA"]).lower()
    counts = [int(n) for n in head.get("COUNT", ["1"] * len(fields))]
    if not {"x", "y", "z"} <= set(fields):
        raise ValueError(f"its fields are {', '.join(fields) or 'none'}, without x, y and z")
    if form == "ascii":
        columns = [sum(counts[: fields.index(axis)]) for axis in "xyz"]
        rows = [line.split() for line in content[start:].decode("ascii", "replace").splitlines()]
        return np.array([[float(row[k]) for k in columns] for row in rows if row]).reshape(-1, 3)
    if form != "binary":
        raise ValueError(f"its points are '{form}'; save it in ASCII or binary")
    types = zip(fields, head.get("TYPE", []), head.get("SIZE", []), counts, strict=True)
    layout = np.dtype(
        [(f"{k} {f}", f"<{_PCD_TYPES[t]}{size}", (n,)) for k, (f, t, size, n) in enumerate(types)]
    )
    rows_of = np.frombuffer(content, layout, int(head.get("POINTS", ["0"])[0]), start)
    named = {name.split()[1]: name for name in layout.names or ()}
    return np.stack([rows_of[named[axis]][:, 0].astype(np.float64) for axis in "xyz"], axis=1)
