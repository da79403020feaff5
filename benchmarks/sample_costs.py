"""Fraction of the time of the samples of the free joint that the measure takes."""

from __future__ import annotations

import time

import numba
import numpy as np
from peer_problems import Pair

from tcs.kernel.analytic.ik import wrist_goal
from tcs.kernel.analytic.samples import MAX_SAMPLES, ROWS, measure_samples, solve_samples
from tcs.kernel.analytic.solver import ArmSolver
from tcs.kernel.arrays import FloatArray

SAMPLES = 48
ROUNDS = 20
"""Passes over all goals in one timing, so that it takes milliseconds."""


def measure_fractions(arm: ArmSolver, pairs: tuple[Pair, ...], repeats: int) -> list[float]:
    """Return the fraction of the samples' time that the measure takes, once for each repeat."""
    goals = np.empty((len(pairs), 4, 3))
    for pair, goal in zip(pairs, goals, strict=True):
        wrist_goal(arm, pair.X_AG[:3, :3].copy(), pair.X_AG[:3, 3].copy(), goal)
    for measured in (False, True):
        _run(arm, goals, SAMPLES, 1, measured)
    shares = []
    for _ in range(repeats):
        used = []
        for measured in (False, True):
            begun = time.process_time()
            _run(arm, goals, SAMPLES, ROUNDS, measured)
            used.append(time.process_time() - begun)
        shares.append(1.0 - used[0] / used[1])
    return shares


@numba.njit(nogil=True)
def _run(arm: ArmSolver, goals: FloatArray, samples: int, rounds: int, measured: bool) -> None:
    """Solve samples spread over a full turn for every goal and branch."""
    cosines, sines = np.empty(samples), np.empty(samples)
    for i in range(samples):
        angle = 2.0 * np.pi * i / samples
        cosines[i], sines[i] = np.cos(angle), np.sin(angle)
    rows, slack, measure = np.empty(ROWS * MAX_SAMPLES), np.empty(samples), np.empty(samples)
    for _ in range(rounds):
        for k in range(len(goals)):
            for b in range(len(arm.branches)):
                solve_samples(arm, goals[k], arm.branches[b], cosines, sines, samples, rows, slack)
                if measured:
                    measure_samples(arm, rows, slack, samples, measure)
