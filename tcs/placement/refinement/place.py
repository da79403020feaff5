"""Base poses for tool poses that are given as arrays: placement without files."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tcs.errors import TaskError, TcsError
from tcs.files.quantities import GOALS
from tcs.kernel.arrays import BoolArray, FloatArray, IntArray
from tcs.kernel.dexterity import DEFAULT_MEASURE, dexterity
from tcs.model.grid import Grid, InitialConfiguration
from tcs.model.random_streams import named_generator
from tcs.model.robots import RobotFile, load_robot
from tcs.placement.constraints import Obstacle
from tcs.placement.refinement.joint_path import joint_path
from tcs.placement.refinement.objectives import ScoreObjective
from tcs.placement.refinement.poses import PoseScene, PoseScorer
from tcs.placement.refinement.search import LocalSearch
from tcs.placement.refinement.space import Space
from tcs.placement.tables import Points

FloorRange = tuple[tuple[float, float], tuple[float, float]]
"""Least and greatest x, and y, of the base [m]."""


class Fineness(NamedTuple):
    """How fine a grid of base poses is."""

    step: float
    """Distance of base positions [m], unless the region is large."""
    most_along: int
    """Most values along x, and along y."""
    headings: int
    screened: int
    """Base poses that are scored at all tool poses."""


FIRST = Fineness(step=0.1, most_along=31, headings=8, screened=24)
SECOND = Fineness(step=0.05, most_along=61, headings=24, screened=96)
"""Where a single base pose is requested and none of the first grid reaches all tool poses."""
STARTS = 6
"""Base poses that are refined if none of these reaches all tool poses."""
PATH_TRIES = 24
"""Most base poses at which a joint path is searched."""
ROUNDS = 24
"""Rounds of the refinement."""
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
    points, and for a single stop a finer grid is tried. The last call's robot and obstacles stay
    prepared, so further calls are faster.

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
    while len(found) < stops and np.any(serving < 0):
        left = np.flatnonzero(serving < 0)
        grid = _grid(scene, X_WG[left], region, torso, FIRST)
        scorer = PoseScorer.of(scene, X_WG[left], grid, jobs)
        bases = _best(scorer, scene, FIRST)
        most = int(bases[0].reached.sum())
        if stops == 1 and 0 < most < count:
            grid = _grid(scene, X_WG, region, torso, SECOND)
            finer = PoseScorer.of(scene, X_WG, grid, jobs)
            of_finer = _best(finer, scene, SECOND)
            if of_finer[0].reached.sum() > most:
                scorer, bases = finer, of_finer
        if not bases[0].reached.any():
            break
        base, path = _with_path(scorer, bases)
        served = np.flatnonzero(base.reached)
        rows = left[served]
        serving[rows] = len(found)
        values[rows] = base.dexterity[served]
        joints[rows] = base.joints[served] if path is None else path
        found.append(grid.between(base.values.tolist(), 0))
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


def _grid(
    scene: PoseScene,
    poses: FloatArray,
    region: FloorRange | None,
    torso: float,
    fineness: Fineness,
) -> Grid:
    """Return a grid of base poses."""
    if region is None:
        # The arm base is up to this far from the robot's base.
        far = scene.reach + float(np.hypot(*scene.arm_base[:2]))
        at = poses[:, :2, 3]
        low, high = at.max(axis=0) - far, at.min(axis=0) + far
        # Poses too far apart for one base pose: what lies between them.
        region = tuple((min(a, b), max(a, b)) for a, b in zip(low, high, strict=True))  # type: ignore[assignment]
    assert region is not None
    spec: dict[str, dict[str, Any]] = {}
    for name, (low_end, high_end) in zip(("base_x", "base_y"), region, strict=True):
        if not low_end <= high_end:
            raise TcsError(f"region: {name} from {low_end:g} to {high_end:g} m is empty.")
        count = min(fineness.most_along, int((high_end - low_end) / fineness.step) + 1)
        count = max(count, 2) if high_end > low_end else 1
        step = (high_end - low_end) / (count - 1) if count > 1 else 0.0
        spec[name] = {"unit": "m", "start": low_end, "step": step, "count": count}
    turn = 360.0 / fineness.headings
    spec["base_yaw"] = {"unit": "deg", "start": 0.0, "step": turn, "count": fineness.headings}
    spec["torso"] = {"unit": "m", "start": torso, "step": 0.0, "count": 1}
    return Grid.from_spec(spec, where="region")


class _Base(NamedTuple):
    """A base pose and what it reaches."""

    values: FloatArray
    """Values of the axes, shape (4,)."""
    reached: BoolArray
    """Whether it reaches a tool pose, shape (n,)."""
    dexterity: NDArray[np.float32]
    """Its dexterity there, shape (n,)."""
    joints: NDArray[np.float32]
    """Arm joints of the best solution [rad], shape (n, 7)."""


def _best(scorer: PoseScorer, scene: PoseScene, fineness: Fineness) -> list[_Base]:
    """Return base poses that reach as many tool poses as any, the most dexterous first."""
    grid = scorer.grid
    values = np.stack([*grid.values(np.arange(grid.size)).values()], axis=1)
    few = _screened(scorer, scene, values, fineness.screened)
    scores = scorer.score(_points(values[few]))
    counts = scores.reached.sum(axis=1)
    order = np.lexsort((-scores.dexterity.mean(axis=1), -counts))
    goals = scorer.problem.goal_p.shape[1]
    if counts[order[0]] == goals:
        found = [_Base(values[few[i]], *(array[i] for array in scores)) for i in order]
    else:
        search = LocalSearch(
            scorer,
            Space.of(grid),
            ScoreObjective(np.full(goals, 1.0 / goals)),
            named_generator(0, "place"),
        )
        starts = [(int(few[i]),) for i in order[:STARTS]]
        walks, _ = search.run(starts, ROUNDS, lambda done, total: None)
        found = [
            _Base(at.values[0], at.reached[0], at.dexterity[0], at.joints[0])
            for at in (walk.present for walk in walks)
        ]
    most = max(int(base.reached.sum()) for base in found)
    return [base for base in found if base.reached.sum() == most]


def _with_path(scorer: PoseScorer, bases: list[_Base]) -> tuple[_Base, FloatArray | None]:
    """Return the first of the best base poses with a joint path, or else the best without one."""
    for base in bases[:PATH_TRIES]:
        served = np.flatnonzero(base.reached)
        at = scorer.of_goals(served).at(base.values)
        path = joint_path(at, base.joints[served].astype(np.float64))
        if path is not None:
            return base, path
    return bases[0], None


def _screened(scorer: PoseScorer, scene: PoseScene, values: FloatArray, most: int) -> IntArray:
    """Return the base poses that reach the most of a few tool poses far from each other."""
    alive = np.flatnonzero(_within_reach(scorer, scene, values))
    if not alive.size:
        alive = np.arange(len(values))
    reached = np.zeros(len(values))
    dexterity_sum = np.zeros(len(values))
    for goal in _far_apart(scorer.problem.goal_p[0], scorer.problem.goal_R[0]):
        if alive.size <= most:
            break
        found = scorer.of_goals([goal]).score(_points(values[alive]))
        reached[alive] += found.reached[:, 0]
        dexterity_sum[alive] += found.dexterity[:, 0]
        alive = alive[reached[alive] == reached[alive].max()]
    order = np.argsort(-dexterity_sum[alive], kind="stable")
    return alive[order[:most]]


def _within_reach(scorer: PoseScorer, scene: PoseScene, values: FloatArray) -> BoolArray:
    """Return the base poses whose arm base is near enough to every tool pose, shape (n,)."""
    c, s = np.cos(values[:, 2]), np.sin(values[:, 2])
    x, y, z = scene.arm_base
    shoulder = np.stack(
        [values[:, 0] + c * x - s * y, values[:, 1] + s * x + c * y, np.full(len(values), z)],
        axis=1,
    )
    distance = np.linalg.norm(shoulder[:, None] - scorer.problem.goal_p[0], axis=2)
    return np.asarray(np.all(distance <= scene.reach, axis=1))


def _far_apart(p: FloatArray, R: FloatArray, most: int = 12) -> list[int]:
    """Return goals, each far in position and orientation from those before it."""
    centre = np.linalg.norm(p - p.mean(axis=0), axis=1)
    chosen = [int(np.argmax(centre))]
    nearest = np.full(len(p), np.inf)
    while len(chosen) < min(most, len(p)):
        last = chosen[-1]
        turned = np.linalg.norm(R - R[last], axis=(1, 2))
        nearest = np.minimum(nearest, np.linalg.norm(p - p[last], axis=1) + 0.2 * turned)
        nearest[last] = -1.0
        chosen.append(int(np.argmax(nearest)))
    return chosen


def _points(values: FloatArray) -> Points:
    return Points(values, np.zeros(len(values), dtype=np.int64))
