"""Memory of the search for approachable postures."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tcs.kernel.analytic.scratch import Search, new_search
from tcs.kernel.approach.curve import CurveWorkspace, new_curve
from tcs.kernel.approach.grid import LineGrid, new_grid
from tcs.kernel.approach.scene import LineScene
from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.motion.scene import MotionScene, MotionWorkspace, new_motion_workspace
from tcs.kernel.problem import Problem
from tcs.kernel.workspace import Workspace, new_workspace

MOST_CURVES = 100
"""Greatest number of motions that are followed for a pair."""
ENOUGH = 1_000_000
"""In place of the number of motions: no other can be free."""


class Approach(NamedTuple):
    """Memory of one worker."""

    work: Workspace
    search: Search
    grid: LineGrid
    scene: MotionScene
    moving: IntArray
    """As in `LineScene`."""
    moved: FloatArray
    """As in `LineScene`."""
    motion: MotionWorkspace
    curve: CurveWorkspace
    offset: FloatArray
    """Motion of the tool from the goal to the begin of the approach, in A [m], shape (3,)."""
    columns: IntArray
    """Number of columns of the grid, and of those that the free joint moves from level to level;
    column and branch of the posture that scoring found; number of motions followed; 1 if lines are
    looked at first where others were blocked; level at which a line was blocked last; shape (7,).
    """
    known: FloatArray
    """Measure of the posture that scoring found, shape (1,)."""
    contact: IntArray
    """First contact that blocked a motion, as a code, shape (1,)."""


def new_approach(problem: Problem, lines: LineScene) -> Approach:
    """Return the memory of one worker, given the `approach_scene` of the problem."""
    scene = lines.motion._replace(centre=lines.motion.centre.copy())
    return Approach(
        new_workspace(problem),
        new_search(),
        new_grid(),
        scene,
        lines.moving,
        lines.moved,
        new_motion_workspace(scene),
        new_curve(),
        np.empty(3),
        np.zeros(7, np.int64),
        np.zeros(1),
        np.zeros(1, np.int64),
    )
