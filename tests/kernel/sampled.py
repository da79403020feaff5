"""Samples of the free joint as tests want them: any number at once."""

from __future__ import annotations

import numpy as np

from tcs.kernel.analytic.samples import MAX_SAMPLES, ROW, ROWS, measure_samples, solve_samples


def slack_and_measure(arm, goal, branch, angles):
    """Return slack and measure at each angle of the free joint on one branch."""
    angles = np.atleast_1d(angles)
    slack, measure = np.full(len(angles), np.nan), np.full(len(angles), np.nan)
    rows = np.full(ROWS * ROW, np.nan)
    for first in range(0, len(angles), MAX_SAMPLES):
        part = slice(first, first + MAX_SAMPLES)
        cosine, sine = np.cos(angles[part]), np.sin(angles[part])
        solve_samples(arm, goal, branch, cosine, sine, len(cosine), rows, slack[part])
        measure_samples(arm, rows, slack[part], len(cosine), measure[part])
    return slack, measure
