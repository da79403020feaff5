"""How tests drive an arm."""

from __future__ import annotations

import numpy as np


def drive(session, command, seconds):
    """Return the steps of a while under one command."""
    return [session.step(command) for _ in range(round(seconds / session.settings.period))]


def off(steps, p):
    """Return how far the tool went from a place [m]."""
    return max(float(np.linalg.norm(step.p - p)) for step in steps)
