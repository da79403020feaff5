"""Base poses that reach tool poses: a grid, screened, refined, and chosen by joint paths."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from tcs.errors import TcsError
from tcs.kernel.arrays import BoolArray, FloatArray, IntArray
from tcs.kernel.motion.edges import certified
from tcs.kernel.motion.goal_postures import postures_at
from tcs.kernel.motion.scene import goal_from_arm_base, motion_scene, new_motion_workspace
from tcs.kernel.problem import Goals, Problem, build_problem
from tcs.kernel.rows import Rows, single_row
from tcs.model.grid import Grid
from tcs.model.random_streams import named_generator
from tcs.model.robots import RobotFile
from tcs.model.scene import EMPTY_ENVIRONMENT, Scene, SceneSpec, lower
from tcs.placement.constraints import Obstacle
from tcs.placement.refinement.local_search import LocalSearch, ScoreObjective, Space
from tcs.placement.refinement.points import PointScores
from tcs.placement.scoring.job import with_obstacles
from tcs.placement.scoring.kernel_start import warm_up
from tcs.placement.scoring.scorer import Scorer
from tcs.placement.tables import Reason

SAMPLES = 48
"""Values of the free joint at each pose."""
MOST_POSTURES = 200
"""Postures at each pose that paths are searched among."""
LONGEST_STEP = 2.0
"""Greatest motion of a joint from one pose to the next [rad]; more is another branch."""
ATTEMPTS = 40
"""Paths that are tried, each without the postures and steps that blocked those before."""


def joint_path(problem: Problem, row: Rows, through: FloatArray | None = None) -> FloatArray | None:
    """Return a joint path through all goals of a problem in their order, None if none is found.

    Of all sequences of postures, one at each goal, the one with the least sum of squared steps is
    taken; each step, straight in joint space, is certified free of contact.

    Args:
        problem: The scene.
        row: The initial configuration.
        through: Further posture at each goal [rad], shape (G, 7), e.g. the best ones of scoring.

    Returns:
        Joint angles [rad], shape (G, 7); continuous joints are not wrapped.
    """
    layers = _layers(problem, row, through)
    if any(not len(layer) for layer in layers):
        return None
    motion = motion_scene(problem, row)
    work = new_motion_workspace(motion)
    periodic = motion.limits.period > 0.0
    costs = [_costs(a, b, periodic) for a, b in itertools.pairwise(layers)]
    for _ in range(ATTEMPTS):
        rows = _cheapest(costs)
        if rows is None:
            return None
        path = _unwrapped(np.array([q[i] for q, i in zip(layers, rows, strict=True)]), periodic)
        blocked = [
            k
            for k in range(max(len(path) - 1, 1))
            if certified(motion, work, _edge(path[k], path[min(k + 1, len(path) - 1)])) < 1.0
        ]
        if not blocked:
            return path
        if not costs:
            return None
        for k in blocked:
            costs[k][rows[k], rows[k + 1]] = np.inf
            for side in (k, k + 1):
                if certified(motion, work, _edge(path[side], path[side])) < 1.0:
                    _forbid(costs, side, rows[side])
    return None


def _layers(problem: Problem, row: Rows, through: FloatArray | None) -> list[FloatArray]:
    """Return postures at each goal, shapes (n, 7)."""
    layers = []
    for g in range(problem.goals.number):
        found = postures_at(problem, *goal_from_arm_base(problem, row, g), SAMPLES)
        found = found[:: max(1, -(-len(found) // MOST_POSTURES))]
        if through is not None:
            found = np.concatenate([found, through[g : g + 1]])
        layers.append(found)
    return layers


def _costs(a: FloatArray, b: FloatArray, periodic: BoolArray) -> FloatArray:
    """Return the squared steps between postures, infinite for steps that are too long."""
    step = b[None] - a[:, None]
    step = np.where(periodic, np.mod(step + np.pi, 2.0 * np.pi) - np.pi, step)
    cost = np.sum(step**2, axis=2)
    cost[np.abs(step).max(axis=2) > LONGEST_STEP] = np.inf
    return np.asarray(cost)


def _cheapest(costs: list[FloatArray]) -> list[int] | None:
    """Return the row in each layer of the cheapest path; None if all are blocked."""
    if not costs:
        return [0]
    total = np.zeros(len(costs[0]))
    before = []
    for cost in costs:
        sums = total[:, None] + cost
        before.append(np.argmin(sums, axis=0))
        total = np.min(sums, axis=0)
    if not np.isfinite(total.min()):
        return None
    rows = [int(np.argmin(total))]
    for back in reversed(before):
        rows.append(int(back[rows[-1]]))
    return rows[::-1]


def _forbid(costs: list[FloatArray], layer: int, row: int) -> None:
    """Block a posture that is in contact."""
    if layer > 0:
        costs[layer - 1][:, row] = np.inf
    if layer < len(costs):
        costs[layer][row] = np.inf


def _unwrapped(path: FloatArray, periodic: BoolArray) -> FloatArray:
    """Return a path whose continuous joints take the shorter way round at each step."""
    return np.where(periodic, np.unwrap(path, axis=0), path)


def _edge(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the control points of a straight step, shape (4, 7)."""
    return np.linspace(a, b, 4)


SINGLE = {"start": 0.0, "step": 0.0, "count": 1}


@dataclass(frozen=True, eq=False)
class PoseScorer:
    """Scores base poses of a robot among boxes for poses of its tool, at one torso height."""

    scorer: Scorer
    """The scene, with the tool poses as goals."""
    grid: Grid
    """The base poses that the search starts from."""
    jobs: int
    """Number of threads; the scores do not depend on it."""

    @classmethod
    def of(cls, scene: PoseScene, poses: FloatArray, grid: Grid, jobs: int) -> Self:
        """Return the scorer of tool poses in W, shape (G, 4, 4)."""
        problem = scene.problem.at_poses(poses[None, :, :3, :3], poses[None, :, :3, 3])
        return cls(Scorer.of(problem), grid, jobs)

    @property
    def goals(self) -> Goals:
        """The tool poses."""
        return self.scorer.problem.goals

    def of_goals(self, goals: Sequence[int] | IntArray) -> Self:
        """Return the scorer of some of the goals."""
        chosen = np.asarray(goals, dtype=np.int64)
        R, p = self.goals.R[:, chosen], self.goals.p[:, chosen]
        problem = self.scorer.problem.at_poses(R, p)
        grippers = np.ascontiguousarray(self.scorer.grippers[:, chosen])
        return type(self)(Scorer(problem, grippers), self.grid, self.jobs)

    def score(self, points: FloatArray) -> PointScores:
        """Return the scores of base poses."""
        x, y, yaw = points[:, :3].T
        one = np.zeros(len(points), np.int64)
        found = self.scorer.score(Rows(one, x, y, yaw, one), self.jobs)
        reached = found.reason == Reason.REACHED
        hand = np.zeros(reached.shape, np.uint8)
        return PointScores(reached, found.dexterity, found.joints, hand)


@dataclass(frozen=True, eq=False)
class PoseScene:
    """A robot among boxes, prepared for any tool poses; building it takes half a second."""

    problem: Problem
    """The scene without goals."""
    reach: float
    """Greatest distance of the tool from the arm's first joint [m]."""
    arm_base: FloatArray
    """Origin of the arm base A in B [m], shape (3,)."""

    @classmethod
    def of(
        cls, robot: RobotFile, obstacles: Sequence[Obstacle], torso: float, measure: str
    ) -> Self:
        """Return the scene of a robot at a torso height [m], the kernel compiled."""
        scene = Scene(SceneSpec(robot, with_obstacles(EMPTY_ENVIRONMENT, obstacles)))
        grid = Grid.from_spec(
            {
                "base_x": {"unit": "m", **SINGLE},
                "base_y": {"unit": "m", **SINGLE},
                "base_yaw": {"unit": "deg", **SINGLE},
                "torso": {"unit": "m", **SINGLE, "start": torso},
            }
        )
        lowered = lower(scene, None, grid)
        problem = build_problem(lowered.arrays, measure)
        warm_up(problem)
        reach = float(np.linalg.norm(problem.chain.p[1:], axis=1).sum())
        offset = float(np.linalg.norm(problem.chain.p[0]))
        return cls(problem, reach + offset, problem.arm_base.p[0])


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
    is_spread: bool = False
    """Whether these are far from each other, rather than the most dexterous ones."""


FIRST = Fineness(step=0.1, most_along=31, headings=8, screened=24)
SPREAD = FIRST._replace(screened=96, is_spread=True)
SECOND = Fineness(step=0.05, most_along=61, headings=24, screened=96)
SINGLE_STOP = (FIRST, SPREAD, SECOND)
"""Searches for a single base pose, each where those before found none with a joint path."""
FEW = 12
"""Most tool poses that base poses are screened at."""
SETTLED = 0.8
"""Fraction of base poses that reach a tool pose from which on it hardly tells them apart."""
KEPT = 4
"""Base poses that stay in the screening, as a multiple of those that are scored at all poses."""
STARTS = 6
"""Base poses that are refined if none of these reaches all tool poses."""
ROUNDS = 24
"""Rounds of the refinement."""


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


class ScoredBase(NamedTuple):
    """A base pose and what it reaches."""

    values: FloatArray
    """Values of the axes, shape (4,)."""
    reached: BoolArray
    """Whether it reaches a tool pose, shape (n,)."""
    dexterity: NDArray[np.float32]
    """Its dexterity there, shape (n,)."""
    joints: NDArray[np.float32]
    """Arm joints of the best solution [rad], shape (n, 7)."""


class Stop(NamedTuple):
    """A base pose of a grid, and the joint path through what it reaches."""

    grid: Grid
    base: ScoredBase
    path: FloatArray | None
    """Arm joints [rad], shape (reached, 7); None if none was found."""

    @property
    def rank(self) -> tuple[int, bool]:
        """What it reaches, then whether there is a joint path."""
        return int(self.base.reached.sum()), self.path is not None


def best_stop(
    scene: PoseScene,
    poses: FloatArray,
    region: FloorRange | None,
    torso: float,
    levels: Sequence[Fineness],
    jobs: int,
) -> Stop:
    """Return the best base pose for tool poses in W, shape (n, 4, 4).

    Args:
        scene: The robot among its obstacles.
        poses: The tool poses.
        region: Least and greatest x, and y, of the base [m]; None for where the arm may reach.
        torso: Torso height [m].
        levels: Searches in turn: the first that finds a joint path through all tool poses is the
            last. One among base poses far from each other follows only where all are reached.
        jobs: Number of threads.

    Raises:
        TcsError: If the region is empty.
    """
    stops: list[Stop] = []
    for fineness in levels:
        if fineness.is_spread and stops[-1].rank[0] < len(poses):
            continue
        grid = _grid(scene, poses, region, torso, fineness)
        scorer = PoseScorer.of(scene, poses, grid, jobs)
        bases = _best(scorer, scene, fineness)
        if not bases[0].reached.any():
            stops.append(Stop(grid, bases[0], None))
            break
        stops.append(Stop(grid, *_with_path(scorer, bases)))
        if stops[-1].rank == (len(poses), True):
            break
    return max(stops, key=lambda stop: stop.rank)


def _best(scorer: PoseScorer, scene: PoseScene, fineness: Fineness) -> list[ScoredBase]:
    """Return base poses that reach as many tool poses as any, the most dexterous first."""
    grid = scorer.grid
    values = np.stack([*grid.values(np.arange(grid.size)).values()], axis=1)
    few = _screened(scorer, scene, values, fineness)
    scores = scorer.score(values[few])
    counts = scores.reached.sum(axis=1)
    order = np.lexsort((-scores.dexterity.mean(axis=1), -counts))
    goals = scorer.goals.number
    if counts[order[0]] == goals:
        found = [ScoredBase(values[few[i]], *(array[i] for array in scores[:3])) for i in order]
    else:
        found = _refined(scorer, [(int(few[i]),) for i in order[:STARTS]])
    most = max(int(base.reached.sum()) for base in found)
    return [base for base in found if base.reached.sum() == most]


def _refined(scorer: PoseScorer, starts: Sequence[tuple[int, ...]]) -> list[ScoredBase]:
    """Return base poses refined between the grid points.

    The search sees a few tool poses; where others are missed from what it finds, it begins anew
    with more of them.
    """
    goals, chosen = scorer.goals.number, np.empty(0, dtype=np.int64)
    missed = np.arange(goals)
    while True:
        p, R = scorer.goals.p[0, missed], scorer.goals.R[0, missed]
        chosen = np.union1d(chosen, missed[_far_apart(p, R)])
        search = LocalSearch(
            scorer.of_goals(chosen),
            Space.of(scorer.grid),
            ScoreObjective(np.full(chosen.size, 1.0 / chosen.size)),
            named_generator(0, "place"),
        )
        walks, _ = search.run(starts, ROUNDS, lambda done, total: None)
        values = np.concatenate([walk.present.values for walk in walks])
        scores = scorer.score(values)
        best = int(np.argmax(scores.reached.sum(axis=1)))
        missed = np.setdiff1d(np.flatnonzero(~scores.reached[best]), chosen)
        if not missed.size:
            return [
                ScoredBase(values[i], *(array[i] for array in scores[:3]))
                for i in range(len(values))
            ]


def _with_path(scorer: PoseScorer, bases: list[ScoredBase]) -> tuple[ScoredBase, FloatArray | None]:
    """Return the first of the best base poses with a joint path, or else the best without one."""
    for base in bases:
        served = np.flatnonzero(base.reached)
        row = single_row(*base.values[:3])
        problem = scorer.of_goals(served).scorer.problem
        path = joint_path(problem, row, base.joints[served].astype(np.float64))
        if path is not None:
            return base, path
    return bases[0], None


def _screened(
    scorer: PoseScorer, scene: PoseScene, values: FloatArray, fineness: Fineness
) -> IntArray:
    """Return base poses that reach the most of a few tool poses far from each other.

    Where a tool pose hardly tells them apart, the less dexterous half of them is left out.
    """
    alive = np.flatnonzero(_within_reach(scorer, scene, values))
    if not alive.size:
        alive = np.arange(len(values))
    reached = np.zeros(len(values))
    dexterity_sum = np.zeros(len(values))
    for goal in _far_apart(scorer.goals.p[0], scorer.goals.R[0]):
        if alive.size <= fineness.screened:
            break
        found = scorer.of_goals([goal]).score(values[alive])
        reached[alive] += found.reached[:, 0]
        dexterity_sum[alive] += found.dexterity[:, 0]
        alive = alive[reached[alive] == reached[alive].max()]
        if found.reached.mean() >= SETTLED and not fineness.is_spread:
            order = np.argsort(-dexterity_sum[alive], kind="stable")
            alive = alive[order[: max(alive.size // 2, KEPT * fineness.screened)]]
    alive = alive[np.argsort(-dexterity_sum[alive], kind="stable")]
    if fineness.is_spread:
        alive = alive[_far_apart(*_frames(values[alive]), fineness.screened)]
    return alive[: fineness.screened]


def _frames(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the origins and rotations of base poses, shapes (n, 3) and (n, 3, 3)."""
    p, R = np.zeros((len(values), 3)), np.tile(np.eye(3), (len(values), 1, 1))
    p[:, :2] = values[:, :2]
    c, s = np.cos(values[:, 2]), np.sin(values[:, 2])
    R[:, 0, 0], R[:, 0, 1], R[:, 1, 0], R[:, 1, 1] = c, -s, s, c
    return p, R


def _within_reach(scorer: PoseScorer, scene: PoseScene, values: FloatArray) -> BoolArray:
    """Return the base poses whose arm base is near enough to every tool pose, shape (n,)."""
    c, s = np.cos(values[:, 2]), np.sin(values[:, 2])
    x, y, z = scene.arm_base
    shoulder = np.stack(
        [values[:, 0] + c * x - s * y, values[:, 1] + s * x + c * y, np.full(len(values), z)],
        axis=1,
    )
    distance = np.linalg.norm(shoulder[:, None] - scorer.goals.p[0], axis=2)
    return np.asarray(np.all(distance <= scene.reach, axis=1))


def _far_apart(p: FloatArray, R: FloatArray, most: int = FEW) -> list[int]:
    """Return which of many frames are far, in position and orientation, from those before."""
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
