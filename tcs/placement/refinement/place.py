"""Base poses for tool poses that are given as arrays: placement without files."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tcs.errors import TaskError, TcsError
from tcs.files.quantities import GOALS
from tcs.kernel.arrays import FloatArray
from tcs.kernel.dexterity import DEFAULT_MEASURE, dexterity
from tcs.model.grid import InitialConfiguration
from tcs.model.robots import RobotFile, load_robot
from tcs.placement.constraints import Obstacle
from tcs.placement.refinement.base_poses import FIRST, SINGLE_STOP, FloorRange, PoseScene, best_stop

MOST_STOPS = 8
"""Greatest number of base poses."""
RIGID = 1e-6
"""Greatest deviation of a rotation matrix from orthogonality."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Placement:
    """Base poses from which a robot reaches tool poses; arrays are read-only."""

    stops: tuple[InitialConfiguration, ...]
    """The base poses; () if no tool pose is reached from anywhere."""
    stop: NDArray[np.int64]
    """Number of the stop that serves each tool pose, -1 where none reaches it, shape (n,)."""
    reached: NDArray[np.bool_]
    """Whether a tool pose is reached, shape (n,)."""
    dexterity: NDArray[np.float32]
    """Dexterity at each tool pose, 0 where not reached, shape (n,)."""
    joints: NDArray[np.float64]
    """Arm joints at each tool pose [rad], shape (n, 7): along the path where `continuous`, else the
    most dexterous ones; 0 where not reached."""
    continuous: tuple[bool, ...]
    """For each stop, whether a joint path through its tool poses in their order was found, straight
    between them in joint space and free of contact. If not, they are only reached one by one."""
    seconds: float
    """Duration [s]."""

    @property
    def reachability(self) -> float:
        """Fraction of the tool poses that are reached."""
        return float(self.reached.mean())


def place(
    robot: str | Path | RobotFile,
    poses: ArrayLike,
    *,
    obstacles: Sequence[Obstacle] = (),
    region: FloorRange | None = None,
    stops: int = 1,
    torso: float = 0.0,
    measure: str = DEFAULT_MEASURE,
    jobs: int = 2,
) -> Placement:
    """Return where to stand for all of many tool poses, e.g. those of a trajectory.

    Base poses of a grid are tried at a few tool poses that are far from each other; those that
    reach the most are tried at all. If none reaches all, the best are refined between the grid
    points. A single stop is sought in a finer grid too, if it does not reach all or no joint path
    is found. The robots and obstacles of the last four calls stay prepared, so further calls are
    faster.

    Args:
        robot: Name of a robot, path of its file, or a robot.
        poses: Poses of the tool in W, homogeneous matrices of shape (n, 4, 4). The
            tool is the tool frame of the robot file, its x axis forward.
        obstacles: Boxes in W that nothing may touch.
        region: Least and greatest x, and y, of the base [m]; by default from where the arm may
            reach every pose.
        stops: Greatest number of base poses; each serves what those before it do not reach.
        torso: Torso height [m].
        measure: Dexterity measure to maximise among base poses that reach the same.
        jobs: Number of threads; the result does not depend on it.

    Raises:
        TaskError: If the poses are not rigid transforms.
        UnknownNameError: If there is no such robot or measure.
        DataFileError: If the robot file cannot be used.
        TcsError: If the region is empty, or a number is out of range.

    >>> import numpy as np
    >>> pose = np.eye(4)
    >>> pose[:3, 3] = 0.6, 0.0, 0.5
    >>> place("iiwa7", [pose]).reachability
    1.0
    """
    begun = time.perf_counter()
    X_WG = _checked(poses)
    if not 1 <= stops <= MOST_STOPS:
        raise TcsError(f"stops is {stops}; must be 1 to {MOST_STOPS}.")
    dexterity(measure)
    robot = robot if isinstance(robot, RobotFile) else load_robot(robot)
    scene = _scene(robot, tuple(obstacles), float(torso), measure)
    count = len(X_WG)
    serving = np.full(count, -1, dtype=np.int64)
    values, joints = np.zeros(count, dtype=np.float32), np.zeros((count, 7))
    found: list[InitialConfiguration] = []
    continuous: list[bool] = []
    levels = (FIRST,) if stops > 1 else SINGLE_STOP
    while len(found) < stops and np.any(serving < 0):
        left = np.flatnonzero(serving < 0)
        stop = best_stop(scene, X_WG[left], region, torso, levels, jobs)
        if not stop.base.reached.any():
            break
        base, path = stop.base, stop.path
        served = np.flatnonzero(base.reached)
        rows = left[served]
        serving[rows] = len(found)
        values[rows] = base.dexterity[served]
        joints[rows] = base.joints[served] if path is None else path
        found.append(stop.grid.between(base.values.tolist()))
        continuous.append(path is not None)
    reached = serving >= 0
    for array in (serving, values, joints, reached):
        array.flags.writeable = False
    return Placement(
        stops=tuple(found),
        stop=serving,
        reached=reached,
        dexterity=values,
        joints=joints,
        continuous=tuple(continuous),
        seconds=time.perf_counter() - begun,
    )


@lru_cache(maxsize=4)
def _scene(
    robot: RobotFile, obstacles: tuple[Obstacle, ...], torso: float, measure: str
) -> PoseScene:
    return PoseScene.of(robot, obstacles, torso, measure)


def _checked(poses: ArrayLike) -> FloatArray:
    """Return poses as an array; refuse what are not rigid transforms."""
    X = np.asarray(poses, dtype=np.float64)
    if X.ndim != 3 or X.shape[1:] != (4, 4) or not np.all(np.isfinite(X)):
        raise TaskError(
            f"poses have shape {X.shape}; must be finite homogeneous matrices, shape (n, 4, 4)."
        )
    GOALS.check(len(X), "poses: their number", TaskError)
    R = X[:, :3, :3]
    error = np.abs(R @ R.transpose(0, 2, 1) - np.eye(3)).max()
    is_rigid = error <= RIGID and np.all(np.linalg.det(R) > 0.0)
    if not is_rigid or not np.allclose(X[:, 3], [0.0, 0.0, 0.0, 1.0]):
        raise TaskError("poses: each must be a rotation and a translation, last row 0, 0, 0, 1.")
    return X
