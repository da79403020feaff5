"""Point clouds that obstacles are read from."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tcs.errors import EnvironmentFileError
from tcs.files.reading import read_bytes
from tcs.model.robots.fitting.mesh_shapes import check_positions
from tcs.model.robots.urdf.meshes import MAX_BYTES

FloatArray = NDArray[np.float64]

LEAST_POINTS = 10
"""Fewest points of a cloud that count as an obstacle."""
MOST_POINTS = 5_000_000


def cloud_points(file: Path, scale: float, where: str) -> FloatArray:
    """Return the points of a cloud [m], shape (n, 3).

    Args:
        file: A NumPy array of shape (n, 3 or more), or a PLY file, whose faces are ignored.
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
    if not LEAST_POINTS <= len(points) <= MOST_POINTS:
        raise EnvironmentFileError(
            f"{here} has {len(points):,} point(s), but must have {LEAST_POINTS} to "
            f"{MOST_POINTS:,}. Give single objects as 'box' or 'sphere'."
        )
    points = points[:, :3] * scale
    check_positions(points, here, EnvironmentFileError)
    return points
