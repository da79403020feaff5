"""Scratch of one worker, and the placing of the arm's shapes in it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.arrays import BoolArray, FloatArray, IntArray
from tcs.kernel.cache import inner
from tcs.kernel.collide import move
from tcs.kernel.problem import Problem


class Workspace(NamedTuple):
    """Scratch of one worker, reused from pair to pair."""

    arm: FloatArray
    """Rows of `Problem.links.shapes` in A at the current posture; of groups that `is_placed` does
    not name only the shapes that were looked at."""
    is_placed: BoolArray
    """Whether the shapes of each group of the arm are up to date, shape (arm groups,)."""
    touching: IntArray
    """Rows of the two shapes found in contact last, shape (2,)."""
    environment_B: FloatArray
    """Environment shapes in B, packed."""
    environment_A: FloatArray
    """Environment shapes in A, packed; only those listed in `near` are up to date."""
    near: IntArray
    """Indices of the environment shapes within the arm's reach, shape (n_environment,)."""
    near_count: IntArray
    """Number of entries in `near`, shape (1,)."""
    link_R: FloatArray
    """Orientations of A, L1..L7 and the coupled links in A, shape (8 + coupled, 3, 3)."""
    link_p: FloatArray
    """Origins of A, L1..L7 and the coupled links in A [m], shape (8 + coupled, 3)."""
    last: IntArray
    """Last pair in contact: partner of the arm (-1 for none), arm shape, partner's shape; shape
    (3,)."""
    met_gripper: BoolArray
    """Set where a link of the arm touches the gripper: at another angle of the last joint it may
    not, shape (1,)."""
    R_BW: FloatArray
    """Orientation of the environment W in the current base B, shape (3, 3)."""
    p_BW: FloatArray
    """Origin of W in B [m], shape (3,)."""
    R_AG: FloatArray
    """Orientation of the current goal in the arm base A, shape (3, 3)."""
    p_AG: FloatArray
    """Position of the goal in A [m], shape (3,)."""


def new_workspace(problem: Problem) -> Workspace:
    """Return scratch memory for one worker."""
    return Workspace(
        np.empty_like(problem.links.shapes),
        np.zeros(len(problem.links.groups.first) - 1, np.bool_),
        np.zeros(2, np.int64),
        np.empty_like(problem.environment.shapes[0]),
        np.empty_like(problem.environment.shapes[0]),
        np.zeros(problem.environment.body.size, np.int64),
        np.zeros(1, np.int64),
        np.empty((8 + len(problem.chain.coupled), 3, 3)),
        np.empty((8 + len(problem.chain.coupled), 3)),
        np.full(3, -1, np.int64),
        np.zeros(1, np.bool_),
        np.eye(3),
        np.zeros(3),
        np.eye(3),
        np.zeros(3),
    )


@inner
def place_group(problem: Problem, work: Workspace, g: int) -> None:
    """Place the box around a group of the arm in A; its shapes have to follow."""
    place_link(problem, work, problem.links.groups.first[-1] + g)
    work.is_placed[g] = False


@inner
def place_shapes(problem: Problem, work: Workspace, g: int) -> None:
    """Place the shapes and clusters of a group of the arm in A unless they are up to date."""
    if work.is_placed[g]:
        return
    groups = problem.links.groups
    for i in range(groups.first[g], groups.first[g + 1]):
        place_link(problem, work, i)
    for c in range(groups.clusters[g], groups.clusters[g + 1]):
        place_link(problem, work, groups.cluster_box[c])
    work.is_placed[g] = True


@inner
def place_link(problem: Problem, work: Workspace, i: int) -> None:
    """Place arm shape i in A from the link poses in the workspace."""
    frame = problem.links.frame[i]
    move(work.link_R[frame], work.link_p[frame], problem.links.shapes, i, work.arm, i)
