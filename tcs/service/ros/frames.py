"""Poses of robot and person out of transforms, as tf publishes them."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from tcs.errors import ServiceError, UnknownNameError
from tcs.kernel.arrays import FloatArray

MAX_TILT = math.radians(5.0)
"""Greatest angle between the vertical axes of environment and base. Bases of the grid are upright:
beyond it, a frame does not have its z axis up, or the environment is localised wrongly."""
_UNIT = 1e-3
"""Greatest deviation of the norm of a quaternion from 1."""
_LONGEST = 100
"""Most transforms between two frames: a longer chain is a loop."""


@dataclass(frozen=True, slots=True)
class Pose:
    """The pose of frame B in frame A."""

    p_AoBo_A: FloatArray
    """Position [m], shape (3,)."""
    R_AB: FloatArray
    """Rotation matrix, shape (3, 3)."""

    @classmethod
    def of_quaternion(cls, position: FloatArray, xyzw: FloatArray) -> Pose:
        """Return the pose of a position and a quaternion in the order of ROS.

        Args:
            position: Position [m], shape (3,).
            xyzw: Quaternion of unit norm, shape (4,).

        Raises:
            ServiceError: If a number is not finite, or the quaternion is not of unit norm.
        """
        position = np.asarray(position, dtype=np.float64)
        x, y, z, w = (float(value) for value in xyzw)
        norm = math.sqrt(x * x + y * y + z * z + w * w)
        if not (np.all(np.isfinite(position)) and abs(norm - 1.0) <= _UNIT):
            raise ServiceError(
                f"the transform has the position {position.tolist()} and the quaternion "
                f"{[x, y, z, w]}; its numbers must be finite and the quaternion of norm 1."
            )
        x, y, z, w = x / norm, y / norm, z / norm, w / norm
        return cls(
            position,
            np.array(
                [
                    [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
                ]
            ),
        )

    def __matmul__(self, other: Pose) -> Pose:
        """Return X_AC = X_AB @ X_BC."""
        return Pose(self.R_AB @ other.p_AoBo_A + self.p_AoBo_A, self.R_AB @ other.R_AB)

    def inverse(self) -> Pose:
        """Return X_BA."""
        return Pose(-self.R_AB.T @ self.p_AoBo_A, self.R_AB.T)

    def base_pose(self) -> tuple[float, float, float]:
        """Return x [m], y [m] and heading [deg] of an upright frame B.

        Raises:
            ServiceError: If the frame is not upright.
        """
        tilt = math.acos(min(max(float(self.R_AB[2, 2]), -1.0), 1.0))
        if tilt > MAX_TILT:
            raise ServiceError(
                f"the robot's base is tilted by {math.degrees(tilt):.0f} deg in the frame of the "
                "environment; both must have z up. Check the frames of the environment and the "
                "base."
            )
        heading = math.degrees(math.atan2(self.R_AB[1, 0], self.R_AB[0, 0]))
        return float(self.p_AoBo_A[0]), float(self.p_AoBo_A[1]), heading

    def quaternion_wxyz(self) -> tuple[float, float, float, float]:
        """Return the rotation as a quaternion with w >= 0."""
        # Of the four components, the one with the greatest magnitude divides: it is at least 1/2.
        R = self.R_AB
        diagonal = np.array([np.trace(R), R[0, 0], R[1, 1], R[2, 2]])
        largest = int(np.argmax(diagonal))
        if largest == 0:
            q = [1 + diagonal[0], R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]
        else:
            i, j, k = [(0, 1, 2), (1, 2, 0), (2, 0, 1)][largest - 1]
            q = [R[k, j] - R[j, k], 0.0, 0.0, 0.0]
            q[1 + i] = 1 + R[i, i] - R[j, j] - R[k, k]
            q[1 + j], q[1 + k] = R[j, i] + R[i, j], R[k, i] + R[i, k]
        scaled = np.array(q) / np.linalg.norm(q)
        w, x, y, z = (float(value) for value in (-scaled if scaled[0] < 0.0 else scaled))
        return w, x, y, z


class TransformTree:
    """The latest transforms between frames, from several threads."""

    def __init__(self, max_age: float) -> None:
        """Hold no transform yet.

        Args:
            max_age: Longest time since the last message of a transform that is not static [s].
        """
        self._max_age = max_age
        self._lock = threading.Lock()
        self._parent: dict[str, tuple[str, Pose, float]] = {}

    def set(self, parent: str, child: str, pose: Pose, *, is_static: bool) -> None:
        """Record a transform that was received now.

        Args:
            parent: Frame A.
            child: Frame B.
            pose: X_AB.
            is_static: Whether it holds for ever.
        """
        received = math.inf if is_static else time.monotonic()
        with self._lock:
            self._parent[child.lstrip("/")] = (parent.lstrip("/"), pose, received)

    def pose(self, frame: str, within: str) -> Pose:
        """Return the pose of a frame B in a frame A.

        Args:
            frame: Frame B.
            within: Frame A.

        Raises:
            UnknownNameError: If there is no transform of a frame.
            ServiceError: If the frames are not connected, or a transform is too old.
        """
        with self._lock:
            to_a, root_of_a = self._to_root(within.lstrip("/"))
            to_b, root_of_b = self._to_root(frame.lstrip("/"))
        if root_of_a != root_of_b:
            raise ServiceError(
                f"tf does not connect the frames '{frame}' and '{within}': their roots are "
                f"'{root_of_b}' and '{root_of_a}'. Publish a transform between them."
            )
        return to_a.inverse() @ to_b

    def _to_root(self, frame: str) -> tuple[Pose, str]:
        """Return the pose of a frame in the root of its tree, and the root."""
        known = {*self._parent, *(parent for parent, _, _ in self._parent.values())}
        if frame not in known:
            raise UnknownNameError("frame", frame, sorted(known), where="tf")
        pose = Pose(np.zeros(3), np.eye(3))
        for _ in range(_LONGEST):
            if frame not in self._parent:
                return pose, frame
            parent, X_PF, received = self._parent[frame]
            age = time.monotonic() - received
            if age > self._max_age:
                raise ServiceError(
                    f"the last transform of '{frame}' is {age:.1f} s old, more than "
                    f"{self._max_age:g} s. Check what publishes it, or give --max-age."
                )
            pose, frame = X_PF @ pose, parent
        raise ServiceError(f"the transforms above '{frame}' form a loop.")


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameNames:
    """Names of the frames in tf."""

    environment: str = "environment"
    """The origin of the environment, as `tcs list` prints it: z up."""
    base: str = "base_footprint"
    """The base of the robot on the floor."""
    person: Mapping[str, str] = field(default_factory=dict)
    """Frames of the person by the name of the body frame, e.g. {"head": "human/head"}."""
