"""The view of the operator: the head camera, fixed for a condition, aimed at both markers.

The master commands in the base frame, while the operator sees motions in the camera's. `HeadCamera`
gives the angle between the two, the axis along which positions are hard to judge in one image, and
what is in the image.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tcs.capability.head import View
from tcs.kernel.arrays import FloatArray
from tcs_studies.pick_and_place.task import Condition


@dataclass(frozen=True, eq=False)
class HeadCamera:
    """A camera aimed at the task.

    Attributes:
        p: Position in the base [m], shape (3,).
        pan: Yaw of the view in the base, left positive [rad].
        angle: Angle from the master's frame to the image [rad]: that of the view, since the master
            commands in the base.
        tilt: Pitch of the view, up positive [rad].
        half_width: Half of the horizontal field of view [rad].
        half_height: Half of the vertical field of view [rad].
    """

    p: FloatArray
    pan: float
    angle: float
    tilt: float
    half_width: float
    half_height: float

    def __post_init__(self) -> None:
        """Make the position read-only."""
        self.p.flags.writeable = False

    @property
    def R(self) -> FloatArray:
        """Orientation in the base, x along the view, y left in the image, shape (3, 3)."""
        c, s = math.cos(self.pan), math.sin(self.pan)
        ct, st = math.cos(self.tilt), math.sin(self.tilt)
        return np.array([[c * ct, -s, -c * st], [s * ct, c, -s * st], [st, 0.0, ct]])

    def sees(self, point: FloatArray) -> bool:
        """Return whether a point of the base frame is in the image.

        Args:
            point: Position in the base [m], shape (3,).
        """
        x, y, z = (point - self.p) @ self.R
        return bool(
            x > 0.0
            and abs(y) <= x * math.tan(self.half_width)
            and abs(z) <= x * math.tan(self.half_height)
        )


def aimed_at(condition: Condition, view: View, field_of_view: tuple[float, float]) -> HeadCamera:
    """Return the head camera aimed between pick and place, as far as the head can turn.

    Args:
        condition: The base pose.
        view: Position of the camera and its directions of view, see `tcs.capability.head`.
        field_of_view: Horizontal and vertical field of view [rad].

    Source:
        ITCM thesis, III.C.2: yaw and pitch are fixed per condition, to show both markers at the
        same position on the screen.
    """
    p = np.array(view.p_BoCo_B)
    x, y, z = 0.5 * (condition.cup + condition.place) - p
    half_width, half_height = (0.5 * angle for angle in field_of_view)
    pan = math.atan2(y, x)
    tilt = math.atan2(z, math.hypot(x, y))
    pan = min(max(pan, view.yaw[0] + half_width), view.yaw[1] - half_width)
    return HeadCamera(
        p,
        pan,
        pan,
        min(max(tilt, view.pitch[0] + half_height), view.pitch[1] - half_height),
        half_width,
        half_height,
    )
