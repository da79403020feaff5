"""Memory of the search for approachable postures."""

from __future__ import annotations

from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np

from tcs.kernel.analytic.scratch import Search
from tcs.kernel.approach.curve import CurveWorkspace, new_curve
from tcs.kernel.approach.grid import LineGrid, new_grid
from tcs.kernel.approach.scene import LineScene
from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.five_joints.score_turned import FiveJointSolver
from tcs.kernel.motion.scene import MotionScene, MotionWorkspace, new_motion_workspace
from tcs.kernel.numeric.search import NumericSolver
from tcs.kernel.problem import Problem
from tcs.kernel.six_joints.score_solutions import SixJointSolver
from tcs.kernel.solvers import new_solver
from tcs.kernel.workspace import Workspace, new_workspace

MOST_CURVES = 100
"""Greatest number of motions that are followed for a pair."""
ENOUGH = 1_000_000
"""In place of the number of motions: no other can be free."""


class Approach(NamedTuple):
    """Memory of one worker, for an arm of seven joints with a closed form."""

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


Solver = TypeVar("Solver", bound=NumericSolver | SixJointSolver | FiveJointSolver)


class ListedApproach(NamedTuple, Generic[Solver]):
    """Memory of one worker, for an arm whose postures at the goal are listed."""

    work: Workspace
    search: Solver
    """The solver of the arm."""
    scene: MotionScene
    moving: IntArray
    """As in `LineScene`."""
    moved: FloatArray
    """As in `LineScene`."""
    motion: MotionWorkspace
    curve: CurveWorkspace
    offset: FloatArray
    """As in `Approach`."""
    contact: IntArray
    """As in `Approach`."""
    q: FloatArray
    """Posture whose line is followed [rad], shape (7,)."""


AnyApproach = Approach | ListedApproach[Any]


def new_approach(problem: Problem, lines: LineScene) -> AnyApproach:
    """Return the memory of one worker, given the `approach_scene` of the problem."""
    pairs = lines.motion.pairs
    scene = lines.motion._replace(pairs=pairs._replace(centre=pairs.centre.copy()))
    solver = new_solver(problem)
    if not isinstance(solver, Search):
        return ListedApproach(
            new_workspace(problem),
            solver,
            scene,
            lines.moving,
            lines.moved,
            new_motion_workspace(scene),
            new_curve(),
            np.empty(3),
            np.zeros(1, np.int64),
            np.empty(7),
        )
    return Approach(
        new_workspace(problem),
        solver,
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
