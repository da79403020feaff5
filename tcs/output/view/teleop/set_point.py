"""Set-point of the joints in joint mode, by one slider for each joint."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
JOINT_STEP = 0.5
"""Step of the sliders [deg]."""


def joint_slider(number: int) -> str:
    """Return the name of the slider of a joint's set-point, counted from 0."""
    return f"joint {number + 1} [deg]"


def joint_sliders(
    lower: FloatArray, upper: FloatArray
) -> dict[str, tuple[float, float, float, float]]:
    """Return the sliders of set-points: lowest and highest value, step and initial value [deg].

    Args:
        lower: Lowest joint positions [rad], shape (7,); -inf for a continuous joint.
        upper: Highest joint positions [rad], shape (7,).
    """
    ends = np.degrees(np.clip([lower, upper], -np.pi, np.pi))
    return {
        joint_slider(i): (float(low), float(high), JOINT_STEP, float(np.clip(0.0, low, high)))
        for i, (low, high) in enumerate(ends.T)
    }


class SetPoint:
    """The set-point of the joints, by one slider for each.

    Only a joint whose slider the operator moved since joint mode began has a set-point of its own;
    the others stay where they were.
    """

    def __init__(self, posture: Callable[[], FloatArray]) -> None:
        """Begin without a set-point.

        Args:
            posture: Returns the joint positions as the operator sees them [rad], shape (7,).
        """
        self._posture = posture
        self._wanted: FloatArray | None = None
        self._shown: dict[str, float] = {}

    def drop(self) -> None:
        """Give the set-point up: the sliders begin at the posture when it is read next."""
        self._wanted = None

    def read(
        self, sliders: Mapping[str, float], set_slider: Callable[[str, float], float]
    ) -> FloatArray:
        """Return the set-point [rad], shape (7,).

        Args:
            sliders: Value of each slider.
            set_slider: Sets a slider and returns its value; called with the posture when joint mode
                begins.
        """
        if self._wanted is None:
            self._wanted = np.array(self._posture(), dtype=np.float64)
            self._shown = {
                joint_slider(i): set_slider(joint_slider(i), math.degrees(angle))
                for i, angle in enumerate(self._wanted)
            }
            return self._wanted.copy()
        for i, name in enumerate(self._shown):
            value = sliders[name]
            if value != self._shown[name]:
                self._shown[name] = value
                self._wanted[i] = math.radians(value)
        return self._wanted.copy()
