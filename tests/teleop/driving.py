"""Helpers of tests that teleoperate an arm."""

from __future__ import annotations

import numpy as np


def drive(session, command, seconds):
    """Return the steps of a period of time under one command."""
    return [session.step(command) for _ in range(round(seconds / session.settings.period))]


def off(steps, p):
    """Return the greatest distance of the tool from a position [m]."""
    return max(float(np.linalg.norm(step.p - p)) for step in steps)
