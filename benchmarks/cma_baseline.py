"""CMA-ES over the continuous space of a score file, as a baseline of the refinement.

The settings are those of the original program's later version, for two members: sigma 1 in quarters
of the ranges, cmean 0.25, from mid-range, 10 iterations with a population of 1600, with axes of the
environment 3600, cost 10 - 10 P_R - P_M. Where no goal is reached, the distance to the goals is
added. It starts anew, with the next seed, where it has converged before its time is over.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

import tcs
from tcs.kernel.arrays import FloatArray
from tcs.placement.refinement import PointScorer
from tcs.placement.refinement.local_search import Space
from tcs.placement.tables import tc_manipulability, tc_reachability

POPULATION, POPULATION_WITH_ENVIRONMENT = 1600, 3600
ITERATIONS, CMEAN = 10, 0.25
SLOW_STEP = 0.005
"""Torso heights and axes of the environment are rounded to this [m or rad]: each different value
costs a call of Drake."""
TOC_TOGETHER = 0.95
"""Factor of the manipulability of more than one configuration in TOC; as in hrl_base_selection in
gt-ros-pkg/hrl-assistive (BSD), last published state."""
UNREACHED = 10.0
"""Cost where no goal is reached, without the distance."""
FRACTIONS = (0.25, 0.5, 1.0)
"""Fractions of the time at which the best set so far is recorded."""


@dataclass(frozen=True)
class CmaRun:
    """The best sets that one run met."""

    at_end: float
    """P_R + P_M after the iterations."""
    spent: float
    """Processor time of the iterations [s]."""
    at_time: tuple[float, ...]
    """P_R + P_M at each of `FRACTIONS` of the time."""
    members: FloatArray
    """Values of the members of the set with the least cost, shape (2, axes)."""


def cma_run(file: tcs.ScoreFile, seconds: float, seed: int, *, toc: bool, whole: bool) -> CmaRun:
    """Search the space of a score file with CMA-ES, in one thread.

    Args:
        file: The score file.
        seconds: Processor time after which the run ends [s].
        seed: Seed of the run.
        toc: Whether P_M of two members counts 0.95, as in TOC.
        whole: Whether the run goes on to the end of its iterations.
    """
    scorer = PointScorer.of(file, file.nominal_index, 1)
    scorer.warm_up()
    space = Space.of(file.configurations, file.nominal.sets)
    low, high = np.tile(space.low, 2), np.tile(space.high, 2)
    free, start = high > low, (low + high) / 2.0
    strategy = _strategy(space, low, high, seed)
    goals = np.mean([np.reshape(at, (-1, 3))[0, :2] for at in file.body_frames.values()], axis=0)
    begun = time.process_time()
    best = [0.0] * len(FRACTIONS)
    least, members = np.inf, np.zeros((2, space.low.size))
    at_end, spent, iteration = (0.0, 0.0), 0.0, 0
    while spent < seconds or (whole and iteration < ITERATIONS):
        if strategy.stop():
            seed += 1000
            strategy = _strategy(space, low, high, seed)
        asked = strategy.ask()
        values = np.tile(start, (len(asked), 1))
        values[:, free] = asked
        costs, totals, sets = _evaluated(scorer, space, file, values, goals, toc)
        strategy.tell(asked, costs.tolist())
        spent = time.process_time() - begun
        iteration += 1
        if iteration <= ITERATIONS:
            at_end = max(at_end[0], float(totals.max())), spent
        for i, fraction in enumerate(FRACTIONS):
            # The population that is under way when the time is over still counts.
            if i == len(FRACTIONS) - 1 or spent <= fraction * seconds:
                best[i] = max(best[i], float(totals.max()))
        if costs.min() < least:
            least, members = float(costs.min()), sets[int(costs.argmin())]
    return CmaRun(*at_end, tuple(best), members)


def _strategy(space: Space, low: FloatArray, high: FloatArray, seed: int) -> object:
    """Return CMA-ES at the middle of the ranges."""
    import cma

    free = high > low
    return cma.CMAEvolutionStrategy(
        ((low + high) / 2.0)[free],
        1.0,
        {
            "popsize": POPULATION_WITH_ENVIRONMENT if space.environment_axes else POPULATION,
            "CMA_stds": ((high - low) / 4.0)[free],
            "bounds": [low[free], high[free]],
            "CMA_cmean": CMEAN,
            "seed": seed + 1,
            "verbose": -9,
        },
    )


def _evaluated(
    scorer: PointScorer,
    space: Space,
    file: tcs.ScoreFile,
    values: FloatArray,
    goals: FloatArray,
    toc: bool,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return cost, P_R + P_M and members of sets of two, shapes (n,), (n,), (n, 2, axes)."""
    members = space.inside(values.reshape(len(values), 2, -1))
    slow = np.r_[np.arange(space.environment_axes), members.shape[-1] - 1]
    rounded = np.round(members[..., slow] / SLOW_STEP) * SLOW_STEP
    members[..., slow] = np.clip(rounded, space.low[slow], space.high[slow])
    flat = members.reshape(-1, members.shape[-1])
    found = scorer.score(flat)
    shape = (*members.shape[:2], -1)
    weights = file.nominal.sets.weights
    reachability = tc_reachability(found.reached.reshape(shape).any(axis=1), weights)
    manipulability = tc_manipulability(found.dexterity.reshape(shape).max(axis=1), weights)
    distance = np.linalg.norm(members[..., -4:-2] - goals, axis=2).sum(axis=1)
    far = np.where(reachability > 0.0, 0.0, distance)
    factor = TOC_TOGETHER if toc else 1.0
    costs = UNREACHED - 10.0 * reachability - factor * manipulability + far
    return costs, reachability + manipulability, members
