"""The pose of a table that was found, with its covariance, and files of it."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tcs.errors import DataFileError, PerceptionError
from tcs.files.documents import AngleDeg, Document, Number, Position, read_document
from tcs.files.writing import whole_file
from tcs.kernel.arrays import FloatArray
from tcs.perception.planar_pose import PlanarPose, moved, wrapped

_MOST_VARIANCE = 100.0
"""Greatest variance in a file [m^2 or rad^2]."""

Row = tuple[Number, Number, Number]


class _Pose(Document):
    """A pose on the floor."""

    x: Position
    y: Position
    yaw_deg: AngleDeg


class LocatedFile(Document):
    """Content of a file made by `tcs locate --out`."""

    table: str
    pose: _Pose
    """Pose of the task frame in the base frame."""
    covariance: tuple[Row, Row, Row]
    """Covariance of x, y [m] and yaw [rad]."""


@dataclass(frozen=True, eq=False)
class Located:
    """Estimated pose X_BF of a task frame in the base frame, with its error."""

    table: str
    """Name of the table."""
    pose: PlanarPose
    """X_BF."""
    covariance: FloatArray
    """Covariance of x, y and yaw in B [m, rad], shape (3, 3)."""
    legs: tuple[tuple[str, int], ...] = ()
    """For each leg of the table, its name and the number of beams that met it."""
    alternatives: tuple[PlanarPose, ...] = ()
    """Other poses that fit the scans as well."""
    scans: int = 0
    """Number of scans."""
    blobs: int = 0
    """Number of blobs in the scans."""

    def __post_init__(self) -> None:
        """Check the covariance.

        Raises:
            PerceptionError: If it is not one.
        """
        matrix = np.array(self.covariance, dtype=np.float64)
        if matrix.shape != (3, 3) or not np.isfinite(matrix).all():
            raise PerceptionError("the covariance of a located table must have 3 x 3 numbers.")
        # Before the eigenvalues, whose sums would overflow.
        if np.abs(matrix).max() > _MOST_VARIANCE:
            raise PerceptionError(f"a variance of a located table exceeds {_MOST_VARIANCE:g}.")
        least = float(np.linalg.eigvalsh(0.5 * (matrix + matrix.T))[0])
        if not np.allclose(matrix, matrix.T, atol=1e-9) or least < -1e-12:
            raise PerceptionError(
                "the covariance of a located table must be symmetric and positive semidefinite."
            )
        matrix.flags.writeable = False
        object.__setattr__(self, "covariance", matrix)

    @property
    def std(self) -> tuple[float, float, float]:
        """Standard deviations of x, y [m] and yaw [rad]."""
        x, y, yaw = np.sqrt(self.covariance.diagonal())
        return float(x), float(y), float(yaw)

    def in_task_frame(self) -> FloatArray:
        """Return the covariance of x, y and yaw along the axes of F [m, rad], shape (3, 3)."""
        R = np.eye(3)
        R[:2, :2] = self.pose.R
        return np.asarray(R.T @ self.covariance @ R)

    def base_in(self, task: PlanarPose) -> tuple[PlanarPose, FloatArray]:
        """Return the pose of the base in a frame W in which the task frame is known.

        Args:
            task: X_WF, the pose of the task frame.

        Returns:
            X_WB, and its covariance of x, y and yaw in W [m, rad], shape (3, 3).
        """
        base = task @ self.pose.inverse()
        # A table seen farther to the left is a base farther to the right.
        turned = np.eye(3)
        turned[:2, :2] = -base.R
        turned[:2, 2] = [task.y - base.y, base.x - task.x]
        turned[:2, 2] *= -1.0
        turned[2, 2] = -1.0
        return base, np.asarray(turned @ self.covariance @ turned.T)

    def shifted(self, step: PlanarPose) -> Located:
        """Return the pose of a frame that is fixed to F, at the pose `step` in it."""
        covariance = moved(self.pose, self.covariance, step)
        others = tuple(pose @ step for pose in self.alternatives)
        return Located(
            self.table, self.pose @ step, covariance, self.legs, others, self.scans, self.blobs
        )

    def error(self, true: PlanarPose) -> dict[str, float]:
        """Return the error against a known pose, as plain numbers.

        Args:
            true: The true X_BF.

        Returns:
            Errors of x, y and of the position [m], of the heading [deg], and the Mahalanobis
            distance of all three.
        """
        dx, dy = self.pose.x - true.x, self.pose.y - true.y
        yaw = wrapped(self.pose.yaw - true.yaw)
        error = np.array([dx, dy, yaw])
        square = float(error @ np.linalg.pinv(self.covariance) @ error)
        return {
            "x": dx,
            "y": dy,
            "position": math.hypot(dx, dy),
            "yaw_deg": math.degrees(yaw),
            "mahalanobis": math.sqrt(max(square, 0.0)),
        }

    def to_json(self) -> dict[str, Any]:
        """Return the result as plain containers, headings in degrees."""
        x, y, yaw = self.std
        return {
            **self._stored(),
            "std": {"x": x, "y": y, "yaw_deg": math.degrees(yaw)},
            "legs": [{"name": name, "beams": beams} for name, beams in self.legs],
            "alternatives": [pose.to_json() for pose in self.alternatives],
            "scans": self.scans,
            "blobs": self.blobs,
        }

    def save(self, path: Path) -> None:
        """Write table, pose and covariance to a JSON file, which `load_located` reads.

        Raises:
            OutputError: If the file cannot be written.
        """
        with whole_file(path, "Located table") as stream:
            stream.write(json.dumps(self._stored(), indent=1).encode() + b"\n")

    def _stored(self) -> dict[str, Any]:
        return {
            "table": self.table,
            "pose": self.pose.to_json(),
            "covariance": self.covariance.tolist(),
        }


def load_located(path: Path) -> Located:
    """Return the table of a file made by `Located.save`.

    Raises:
        DataFileError: If the file cannot be read, or is not such a file.
        PerceptionError: If its covariance is not one.
        UnknownNameError: If it has an unknown key.
    """
    where = f"located table '{path}'"
    found = read_document(path, LocatedFile, where, DataFileError)
    pose = PlanarPose(found.pose.x, found.pose.y, math.radians(found.pose.yaw_deg))
    return Located(found.table, pose, np.array(found.covariance))
