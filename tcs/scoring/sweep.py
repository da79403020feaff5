"""Score a lowered scene: the kernel over slices of the grid, on several threads."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from tcs.kernel.cache import is_compiled
from tcs.kernel.problem import Problem, build_problem
from tcs.kernel.sweep import Scores, gripper_contacts, score_slice
from tcs.scene import LoweredScene
from tcs.tables import ScoreTable

SLICE = 1024
"""Configurations in a slice: some milliseconds of work, so that threads end together and a bar
moves, and scratch memory that stays in the processor's cache."""


@dataclass(frozen=True, eq=False)
class Sweep:
    """The scores of a grid, and what they cost."""

    scores: ScoreTable
    compile_seconds: float
    """Compiling the kernel, or loading its machine code."""
    scoring_seconds: float
    """Scoring alone, machine code at hand."""


def sweep(
    lowered: LoweredScene,
    weights: NDArray[np.float64],
    *,
    jobs: int = 2,
    on_progress: Callable[[int, int], None] | None = None,
    on_compile: Callable[[], None] | None = None,
) -> Sweep:
    """Score every configuration of the grid against every goal.

    Args:
        lowered: The scene.
        weights: Weights of the goals, sum 1, shape (goals,).
        jobs: Number of threads; the scores do not depend on it.
        on_progress: Called with configurations done and in all.
        on_compile: Called first, when no earlier run has left machine code on this machine.

    Returns:
        Scores, TCS eq. (1) to (4) per configuration, with a reason for every pair.

    Raises:
        ArmClassError: If the closed form cannot solve the arm.
    """
    problem = build_problem(lowered.arrays, lowered.grid)
    compile_seconds = warm_up(problem, on_compile)
    size, goals = _size(problem), problem.goal_p.shape[1]
    begun = time.perf_counter()
    grippers = gripper_contacts(problem)
    starts = range(0, size, SLICE)
    reason = np.empty((size, goals), np.uint8)
    contact = np.empty((size, goals), np.int32)
    isotropy = np.empty((size, goals), np.float32)
    joints = []
    done = 0
    for part in Parallel(n_jobs=jobs, prefer="threads", return_as="generator")(
        delayed(_slice)(problem, grippers, start, min(start + SLICE, size)) for start in starts
    ):
        rows = slice(done, done + len(part.reason))
        reason[rows], contact[rows], isotropy[rows] = part.reason, part.contact, part.isotropy
        # Only the joints of reached pairs are worth keeping: one pair in ten.
        joints.append(part.joints[part.reason == 0])
        done += len(part.reason)
        if on_progress is not None:
            on_progress(done, size)
    scoring_seconds = time.perf_counter() - begun
    pair, names = _named(contact, lowered, problem)
    scores = ScoreTable(
        isotropy=isotropy,
        reason=reason,
        pair=pair,
        pair_names=names,
        arm_joints=np.concatenate(joints) if joints else np.empty((0, 7), np.float32),
        weights=np.asarray(weights, dtype=np.float64),
    )
    return Sweep(scores, compile_seconds, scoring_seconds)


def warm_up(problem: Problem, on_compile: Callable[[], None] | None = None) -> float:
    """Have the kernel's machine code at hand; return the seconds it took."""
    if on_compile is not None and not is_compiled():
        on_compile()
    begun = time.perf_counter()
    _slice(problem, gripper_contacts(problem), 0, 0)
    return time.perf_counter() - begun


def _size(problem: Problem) -> int:
    """Return how many configurations the grid has."""
    places = problem.base_x.size * problem.base_y.size * problem.base_yaw.size
    return int(problem.environment_states * places * problem.torso_levels)


def _slice(problem: Problem, grippers: NDArray[np.int64], start: int, stop: int) -> Scores:
    """Return the scores of configurations start <= h < stop."""
    shape = (stop - start, problem.goal_p.shape[1])
    scores = Scores(
        reason=np.empty(shape, np.uint8),
        contact=np.empty(shape, np.int32),
        isotropy=np.zeros(shape, np.float32),
        joints=np.zeros((*shape, 7), np.float32),
    )
    score_slice(problem, grippers, start, stop, scores)
    return scores


def _named(
    contact: NDArray[np.int32], lowered: LoweredScene, problem: Problem
) -> tuple[NDArray[np.int32], tuple[tuple[str, str], ...]]:
    """Return contact codes as indices into a list of pairs of names, and the list."""
    codes, index = np.unique(contact, return_inverse=True)
    others = problem.room_bodies + problem.robot_bodies
    both = (*lowered.room_bodies, *lowered.robot_bodies)
    names = tuple(
        (lowered.robot_bodies[code // others], both[code % others]) for code in codes if code >= 0
    )
    # NO_CONTACT, -1, sorts first when it is there at all.
    first = int(np.any(codes < 0))
    return (index.reshape(contact.shape) - first).astype(np.int32), names
