"""The problems that the kernel and its peers solve, pairs of configuration and goal, and the judge.

In all pairs base and gripper are free and the goal is within reach: only inverse kinematics and
collision checks of the arm are left. Whether a pair is reachable is decided by a dense scan of the
free joint, not by the search that is measured.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform

from tcs.kernel.arrays import FloatArray, IntArray
from tcs.kernel.problem import Problem, build_problem
from tcs.kernel.rows import rows_at
from tcs.kernel.sweep import gripper_contacts
from tcs.kernel.verification.dense import DENSE_SAMPLES
from tcs.kernel.verification.scans import dense_scan
from tcs.model.scene import LoweredScene, Scene, goal_poses
from tcs.placement.scoring import load_job, sweep
from tcs.placement.scoring.job import Job
from tcs.placement.tables import Reason, ScoreTable

TASK, ENVIRONMENT, ROBOT = "shaving", "wheelchair", "pr2"
IN_REACH = (Reason.REACHED, Reason.JOINT_LIMITS, Reason.ARM_BLOCKED)
"""Reasons of pairs whose base and gripper are free and whose goal is within reach."""
POSITION_BAR = 1e-3
"""Tolerance of the tool position [m]: a thousand times that of `tcs verify`, so that no iterative
peer fails because of its stopping tolerance."""
ROTATION_BAR = 1e-2
"""Tolerance of the tool orientation [rad], likewise."""
LIMIT_ROUNDING = 1e-6
"""How far a joint may be past its limit [rad]: TRAC-IK keeps limits in single precision."""
CONTACT_ROUNDING = 2e-6
"""How much closer than the margin a pair may be [m]: Drake's distance of boxes is that good."""


@dataclass(frozen=True, eq=False)
class Bench:
    """The scene, once live and once as arrays, and its scores."""

    job: Job
    scene: Scene
    lowered: LoweredScene
    problem: Problem
    grippers: IntArray
    scores: ScoreTable

    @classmethod
    def build(cls) -> Bench:
        """Return the bench that everything here is measured on."""
        job = load_job(TASK, ENVIRONMENT, ROBOT, paper=True)
        scene = job.scene()
        lowered = job.lowered(scene)
        problem = build_problem(lowered.arrays)
        scores = sweep(lowered, job.task.weights).tables[0]
        return cls(job, scene, lowered, problem, gripper_contacts(problem), scores)


@dataclass(frozen=True, eq=False)
class Pair:
    """One problem: from this place, can the tool be brought to that goal?"""

    configuration: int
    goal: int
    torso_level: int
    base: tuple[float, float, float]
    """x, y [m] and yaw [rad]."""
    torso: float
    X_WG: RigidTransform
    X_AG: FloatArray
    """The goal in the arm base A, shape (4, 4)."""
    reachable: bool


@dataclass(frozen=True, eq=False)
class Answer:
    """What a solver made of a pair."""

    seconds: float
    """Processor time, of all threads: others on the machine do not add to it."""
    postures: tuple[FloatArray, ...]
    """Joint angles [rad] it holds for solutions, shape (7,) each."""


class Peer(Protocol):
    """A solver under one label or several, such as with one try and with five."""

    labels: tuple[str, ...]

    def solve(self, pair: Pair, rng: np.random.Generator) -> tuple[Answer, ...]:
        """Return an answer for each label."""


@dataclass(frozen=True, eq=False)
class ProblemSet:
    """The pairs that were drawn."""

    pairs: tuple[Pair, ...]
    """Reachable and unreachable ones by turns."""
    drawn: int
    """How many pairs the dense scan looked at until there were enough of both."""
    unconfirmed: int
    """Solutions of the scan that Drake refuses; such pairs are left out."""

    def of(self, reachable: bool) -> tuple[Pair, ...]:
        """Return those that are reachable, or those that are not."""
        return tuple(pair for pair in self.pairs if pair.reachable == reachable)


def draw(bench: Bench, judge: Judge, count: int, seed: int) -> ProblemSet:
    """Return `count` random pairs within reach, half of them reachable.

    Args:
        bench: The scene and its scores, of which only the reasons above are used.
        judge: Has to confirm what the scan finds.
        count: How many pairs.
        seed: Seed of the random order in which they are looked at.
    """
    candidates = np.argwhere(np.isin(bench.scores.reason, IN_REACH))
    order = np.random.default_rng(seed).permutation(len(candidates))
    wanted = {True: (count + 1) // 2, False: count // 2}
    found: dict[bool, list[Pair]] = {True: [], False: []}
    drawn = unconfirmed = 0
    q = np.empty(7)
    for h, g in candidates[order]:
        if all(len(found[key]) == wanted[key] for key in found):
            break
        reachable = (
            dense_scan(bench.problem, rows_at(bench.lowered.grid, [h]), int(g), DENSE_SAMPLES, q)
            >= 0.0
        )
        drawn += 1
        pair = _pair(bench, int(h), int(g), reachable)
        if reachable and not judge.confirms(pair, q):
            unconfirmed += 1
        elif len(found[reachable]) < wanted[reachable]:
            found[reachable].append(pair)
    mixed = [pair for both in zip(found[True], found[False], strict=False) for pair in both]
    mixed += found[True][len(found[False]) :] + found[False][len(found[True]) :]
    return ProblemSet(tuple(mixed), drawn, unconfirmed)


def _pair(bench: Bench, h: int, g: int, reachable: bool) -> Pair:
    at = {name: float(v[0]) for name, v in bench.job.scored_grid.values(np.array([h])).items()}
    scene, base = bench.scene, (at["base_x"], at["base_y"], at["base_yaw"])
    scene.place_base(*base)
    scene.set_torso(at["torso"])
    X_WA = scene.built.arm_base_frame.CalcPoseInWorld(scene.plant_context)
    X_WG = goal_poses(scene, bench.job.task)[g]
    return Pair(
        configuration=h,
        goal=g,
        torso_level=h % bench.lowered.grid.torso_levels,
        base=base,
        torso=at["torso"],
        X_WG=X_WG,
        X_AG=(X_WA.inverse() @ X_WG).GetAsMatrix4(),
        reachable=reachable,
    )


@dataclass(frozen=True)
class Verdict:
    """What Drake says of an answer."""

    at_goal: bool
    """The tool is at its goal and every joint within its limits."""
    free: bool
    """And nothing is closer than the larger of contact margin and self margin."""


class Judge:
    """Drake's verdict on answers, with the whole robot in the whole environment.

    Peers know one distance that everything has to keep, the larger margin; the paddings of some
    of the person's shapes, which our kernel respects as well, are not required of them.
    """

    def __init__(self, bench: Bench) -> None:
        """Judge answers on the scene of `bench`."""
        self._scene = bench.scene
        spec = bench.job.spec
        self._margin = max(spec.environment.contact_margin, spec.robot.self_margin)
        self._lower, self._upper = bench.scene.arm_limits

    def check(self, pair: Pair, q: NDArray[np.float64]) -> Verdict:
        """Return the verdict on joint angles q [rad] for a pair."""
        q = self._turned(q)
        if not self._is_at_goal(pair, q):
            return Verdict(at_goal=False, free=False)
        clearances = self._scene.clearances(self._margin)
        free = all(distance >= self._margin - CONTACT_ROUNDING for _, _, distance in clearances)
        return Verdict(at_goal=True, free=free)

    def confirms(self, pair: Pair, q: NDArray[np.float64]) -> bool:
        """Return whether Drake confirms a solution by the full rule, paddings included."""
        if not self._is_at_goal(pair, q):
            return False
        return all(
            distance >= self._scene.required_clearance(first, second) - CONTACT_ROUNDING
            for first, second, distance in self._scene.violations()
        )

    def _is_at_goal(self, pair: Pair, q: NDArray[np.float64]) -> bool:
        if np.any(q < self._lower - LIMIT_ROUNDING) or np.any(q > self._upper + LIMIT_ROUNDING):
            return False
        self._scene.place_base(*pair.base)
        self._scene.set_torso(pair.torso)
        self._scene.set_arm(q)
        X_TG = self._scene.tool_pose().inverse() @ pair.X_WG
        off = float(np.linalg.norm(X_TG.translation()))
        return off <= POSITION_BAR and X_TG.rotation().ToAngleAxis().angle() <= ROTATION_BAR

    def _turned(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return q with every joint turned by full turns as near to its limits as it gets."""
        return turned(np.asarray(q, dtype=np.float64), self._lower, self._upper)


def turned(q: FloatArray, lower: FloatArray, upper: FloatArray) -> FloatArray:
    """Return joint angles turned by full turns to where their limits, if any, are nearest.

    Args:
        q: Joint angles [rad], shape (..., 7).
        lower: Lower limits [rad], -inf where there is none, shape (7,).
        upper: Upper limits [rad], shape (7,).

    >>> turned(np.array([6.0, 6.0]), np.array([-1.0, 5.0]), np.array([1.0, 7.0])).round(3)
    array([-0.283,  6.   ])
    """
    limited = np.isfinite(lower) & np.isfinite(upper)
    middle = np.where(limited, (np.where(limited, lower, 0) + np.where(limited, upper, 0)) / 2, 0)
    return q - 2.0 * np.pi * np.round((q - middle) / (2.0 * np.pi))


def tries_filled(answers: list[Answer], last: Answer, count: int) -> tuple[Answer, ...]:
    """Return `count` answers: those after the numbers of tries that were made, then the last one.

    Args:
        answers: After each number of tries that was looked at before the solver succeeded.
        last: After its last try.
        count: How many numbers of tries are looked at.
    """
    return (*answers, *([last] * (count - len(answers))))


def start_limits(lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return between what random starts are drawn [rad]: the limits, or one full turn."""
    return (
        np.where(np.isfinite(lower), lower, -np.pi),
        np.where(np.isfinite(upper), upper, np.pi),
    )
