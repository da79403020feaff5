"""Curves whose fastest timing is known or easily judged."""

from __future__ import annotations

import numpy as np

from tcs.motion.curves import Curve


def straight(length):
    """Return a straight curve of joint 1."""
    direction = np.eye(7)[0]
    ends = np.array([0 * direction, length * direction])
    return Curve(np.array([0.0, length]), ends, np.array([direction, direction]))


def bent():
    """Return two straight pieces with a parabola between them."""
    a, b = np.eye(7)[0], np.eye(7)[1]
    q = np.array([0 * a, 0.8 * a, a + 0.2 * b, a + b])
    return Curve(np.array([0.0, 0.8, 1.2, 2.0]), q, np.array([a, a, b, b]))
