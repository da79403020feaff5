"""The visibility score: how well the operator sees the tool through the head camera."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from tcs.errors import UnknownNameError
from tcs.kernel.arrays import BoolArray, FloatArray

if TYPE_CHECKING:
    from tcs.capability.head import View

YAW_GOAL = 0.0
"""Straight ahead: hand motions at the master then agree with motions in the image."""
PITCH_GOAL = -math.pi / 4.0
"""45 deg down: shadows and heights both indicate distance."""

CORRECTED, THESIS = "corrected", "thesis"
VISIBILITIES = (CORRECTED, THESIS)


def visibility(view: View, p_BT: FloatArray, rule: str = CORRECTED) -> FloatArray:
    """Return the visibility score of tool positions.

    Args:
        view: The camera.
        p_BT: Tool positions in the base [m], shape (n, 3).
        rule: "corrected" or "thesis".

    Returns:
        Scores in [0, 1], shape (n,): 1 straight ahead and 45 deg down.

    Raises:
        UnknownNameError: If there is no such rule.

    Source:
        ITCM thesis eqs. (12) to (17). "thesis" is as printed: atan maps directions behind the
        camera to directions ahead; an axis out of view leaves half the score of the other axis;
        and the difference from the goal is divided by that of the upper bound on both sides, so a
        pitch 37.5 deg below the goal, at the lower bound, still scores 2/3. "corrected" uses atan2,
        is 0 if either axis is out of view, and falls to 0 at both bounds.

    >>> from tcs.capability.head import View
    >>> view = View((0.0, 0.0, 1.0), (-1.8, 1.8), (-1.4, 1.2))
    >>> points = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    >>> visibility(view, points).tolist(), visibility(view, points, "thesis").tolist()
    ([1.0, 0.0], [1.0, 1.0])
    """
    if rule not in VISIBILITIES:
        raise UnknownNameError("visibility", rule, VISIBILITIES)
    x, y, z = (np.asarray(p_BT) - view.p_BoCo_B).T
    pitch = np.arctan2(z, np.hypot(x, y))
    if rule == THESIS:
        # For a tool to the side, y / 0 is infinite and its atan the right angle.
        with np.errstate(divide="ignore", invalid="ignore"):
            yaw = np.nan_to_num(np.arctan(y / x))
        return 0.5 * (_printed(yaw, YAW_GOAL, view.yaw) + _printed(pitch, PITCH_GOAL, view.pitch))
    yaw = np.arctan2(y, x)
    score = 0.5 * (_two_sided(yaw, YAW_GOAL, view.yaw) + _two_sided(pitch, PITCH_GOAL, view.pitch))
    visible = _within(yaw, view.yaw) & _within(pitch, view.pitch)
    return np.asarray(np.where(visible, score, 0.0))


def _printed(angle: FloatArray, goal: float, bounds: tuple[float, float]) -> FloatArray:
    score = 1.0 - np.abs((angle - goal) / (bounds[1] - goal))
    return np.where(_within(angle, bounds), score, 0.0)


def _two_sided(angle: FloatArray, goal: float, bounds: tuple[float, float]) -> FloatArray:
    width = np.where(angle < goal, goal - bounds[0], bounds[1] - goal)
    return np.asarray(1.0 - np.abs(angle - goal) / width)


def _within(angle: FloatArray, bounds: tuple[float, float]) -> BoolArray:
    return np.asarray((angle >= bounds[0]) & (angle <= bounds[1]))
