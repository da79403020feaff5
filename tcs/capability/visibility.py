"""The visibility score: how well the head camera sees the tool, for a person who steers by it."""

from __future__ import annotations

import math

import numpy as np

from tcs.capability.head import View
from tcs.errors import UnknownNameError
from tcs.kernel.arrays import BoolArray, FloatArray

YAW_GOAL = 0.0
"""Straight ahead: what a hand at the master device does is then what the picture shows."""
PITCH_GOAL = -math.pi / 4.0
"""Half way down: shadows and heights both tell how far away things are."""

CORRECTED, THESIS = "corrected", "thesis"
VISIBILITIES = (CORRECTED, THESIS)


def visibility(view: View, p_BT: FloatArray, rule: str = CORRECTED) -> FloatArray:
    """Return how well tools are seen.

    Args:
        view: The camera.
        p_BT: Tool positions in the base [m], shape (n, 3).
        rule: "corrected" or "thesis".

    Returns:
        Scores in [0, 1], shape (n,): 1 straight ahead and 45 deg down.

    Raises:
        UnknownNameError: If there is no such rule.

    Source:
        ITCM thesis eqs. (12) to (17). "thesis" is as printed: atan takes what lies behind for what
        lies ahead; an axis out of view leaves the other one's half of the score; and the distance
        from the goal is measured by that of the upper bound alone, so that a pitch 37.5 deg below
        the goal, at the lower bound, still scores 2/3. "corrected" uses atan2, gives nothing to
        what is out of view on either axis, and falls to 0 at the bound on either side.

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
        # Straight to the side, y / 0 is infinite and atan of it the right angle.
        with np.errstate(divide="ignore", invalid="ignore"):
            yaw = np.nan_to_num(np.arctan(y / x))
        return 0.5 * (_printed(yaw, YAW_GOAL, view.yaw) + _printed(pitch, PITCH_GOAL, view.pitch))
    yaw = np.arctan2(y, x)
    score = 0.5 * (_two_sided(yaw, YAW_GOAL, view.yaw) + _two_sided(pitch, PITCH_GOAL, view.pitch))
    seen = _within(yaw, view.yaw) & _within(pitch, view.pitch)
    return np.asarray(np.where(seen, score, 0.0))


def _printed(angle: FloatArray, goal: float, bounds: tuple[float, float]) -> FloatArray:
    score = 1.0 - np.abs((angle - goal) / (bounds[1] - goal))
    return np.where(_within(angle, bounds), score, 0.0)


def _two_sided(angle: FloatArray, goal: float, bounds: tuple[float, float]) -> FloatArray:
    room = np.where(angle < goal, goal - bounds[0], bounds[1] - goal)
    return np.asarray(1.0 - np.abs(angle - goal) / room)


def _within(angle: FloatArray, bounds: tuple[float, float]) -> BoolArray:
    return np.asarray((angle >= bounds[0]) & (angle <= bounds[1]))
