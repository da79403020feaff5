"""One robot standing on an empty floor: which tool poses its arm reaches, and how well."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from tcs.errors import GridError
from tcs.kernel.analytic.pairs import REACHED
from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.kernel.contacts import new_workspace
from tcs.kernel.postures import free_postures, measures, tool_poses
from tcs.kernel.problem import Problem, build_problem
from tcs.kernel.sweep import Scores, gripper_contacts, score_slice
from tcs.model.grid import Axis, Grid
from tcs.model.robots import RobotFile
from tcs.model.scene import EnvironmentFile, LoweredScene, Scene, SceneSpec, lower

MEASURE = "inverse-condition-limited-thesis"
"""The thesis's manipulability: sigma_min / sigma_max, eq. (20), times the penalty, eq. (21)."""

_SLICE = 2048
"""Poses solved at once: tens of milliseconds of work, so that threads end together."""
_SAME_LIFT = 1e-9
"""Lifts closer than this are one [m]."""

OnProgress = Callable[[int, int], None]


@dataclass(frozen=True, eq=False)
class Solved:
    """What became of tool poses."""

    reached: BoolArray
    """Shape (n,)."""
    manipulability: NDArray[np.float32]
    """The measure of the best posture, 0 where not reached, shape (n,)."""
    joints: NDArray[np.float32]
    """That posture [rad], 0 where not reached, shape (n, 7)."""


class Reach:
    """A robot on an empty floor, lowered once for a range of lifts.

    The base B stands at the origin. Nothing but the floor and the robot itself is in the way.
    """

    def __init__(
        self, robot: RobotFile, *, lift: float | None = None, step: float = 0.05,
        measure: str = MEASURE, found_as: str | None = None, head: str | None = None,
    ) -> None:  # fmt: skip
        """Lower the robot at `lift` and at all lifts that are whole steps away from it.

        Args:
            robot: The robot.
            lift: The lift that maps are made at [m]; None is the middle of its range.
            step: Distance of the lifts looked at [m].
            measure: Name of the dexterity measure, see `tcs.kernel.dexterity`.
            found_as: Name or path by which maps remember the robot; None is its name.
            head: Name or path of the head that looks on; None is the robot's name.

        Raises:
            RobotError: If the robot's model cannot be used.
            ArmClassError: If the closed form cannot solve the arm.
            GridError: If the lift is out of range.
            UnknownNameError: If there is no measure of that name.
        """
        self.robot, self.measure = robot, measure
        self.head = head
        """Name or path of the head that looks on; None is the robot's name."""
        self.found_as = robot.name if found_as is None else found_as
        """How to find the robot again: its name, or the path of its file."""
        self.scene = Scene(SceneSpec(robot, _empty_floor()))
        low, high = self.scene.built.torso_limits
        self.lift = 0.5 * (low + high) if lift is None else lift
        if not low - _SAME_LIFT <= self.lift <= high + _SAME_LIFT:
            raise GridError(
                f"robot '{robot.name}': lift {self.lift:g} m is out of range; its torso goes from "
                f"{low:g} to {high:g} m."
            )
        below = int(np.floor((self.lift - low) / step + _SAME_LIFT))
        above = int(np.floor((high - self.lift) / step + _SAME_LIFT))
        self.level = below
        """Index of `lift` among `lifts`."""
        self.lifts = self.lift + step * np.arange(-below, above + 1)
        """Lifts that are looked at [m], shape (levels,)."""
        axis = Axis("torso", "m", float(self.lifts[0]), step, len(self.lifts))
        still = (Axis(name, unit, 0.0, 0.0, 1) for name, unit in _STILL)
        self.lowered: LoweredScene = lower(self.scene, None, Grid((*still, axis)))
        self._problem = build_problem(self.lowered.arrays, self.lowered.grid, measure)
        self.R_BA = self.lowered.arrays.arm_base_R[below]
        """Orientation of the arm base at `lift`, shape (3, 3)."""
        self.p_BA = self.lowered.arrays.arm_base_p[below]
        """Its origin [m], shape (3,)."""

    @property
    def limits(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper joint limits [rad], shape (7,) each."""
        chain = self.lowered.arrays.chain
        return chain.lower, chain.upper

    @property
    def shoulder(self) -> FloatArray:
        """Origin of the arm's first moving link in B at `lift` [m], shape (3,)."""
        return np.asarray(self.p_BA + self.R_BA @ self.lowered.arrays.chain.p[0])

    @property
    def length(self) -> float:
        """Farthest that the tool can be from the shoulder, the arm stretched out [m]."""
        return float(np.linalg.norm(self.lowered.arrays.chain.p[1:], axis=1).sum())

    def solve(
        self, R_BT: FloatArray, p_BT: FloatArray, *, level: int | None = None, jobs: int = 2,
        on_progress: OnProgress | None = None,
    ) -> Solved:  # fmt: skip
        """Return the best collision-free posture for each tool pose.

        Args:
            R_BT: Tool orientations in B, shape (n, 3, 3).
            p_BT: Tool positions in B [m], shape (n, 3).
            level: Index of the lift; None is `lift` itself.
            jobs: Number of threads; the answers do not depend on it.
            on_progress: Called with poses done and in all.
        """
        problem = self._at(self.level if level is None else level)
        count = len(p_BT)
        solved = Solved(
            np.zeros(count, np.bool_), np.zeros(count, np.float32), np.zeros((count, 7), np.float32)
        )
        parts = [slice(i, min(i + _SLICE, count)) for i in range(0, count, _SLICE)]
        done = 0
        runs = (delayed(_solve_part)(problem, R_BT, p_BT, part, solved) for part in parts)
        # Threads: the kernel lets go of the interpreter.
        for size in Parallel(jobs, "threading", return_as="generator_unordered")(runs):
            done += size
            if on_progress is not None:
                on_progress(done, count)
        return solved

    def tool_poses(self, joints: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return X_AT of postures: rotations (n, 3, 3) and positions [m] (n, 3).

        Args:
            joints: Arm joints [rad], shape (n, 7).
        """
        R, p = np.empty((len(joints), 3, 3)), np.empty((len(joints), 3))
        tool_poses(self._problem.chain_R, self._problem.chain_p, _own(joints), R, p)
        return R, p

    def manipulability(self, joints: FloatArray) -> FloatArray:
        """Return the measure of postures, shape (n,)."""
        value = np.empty(len(joints))
        measures(self._problem, _own(joints), value)
        return value

    def free(self, joints: FloatArray, level: int) -> BoolArray:
        """Return whether postures touch neither the robot nor the floor at a lift, shape (n,).

        Args:
            joints: Arm joints [rad], shape (n, 7).
            level: Index of the lift.
        """
        problem = self._at(level)
        R_AT, p_AT = self.tool_poses(joints)
        R_BA, p_BA = problem.base_R[0], problem.base_p[0]
        problem = _with_goals(problem, R_BA @ R_AT, p_AT @ R_BA.T + p_BA)
        free = np.zeros(len(joints), np.bool_)
        free_postures(problem, new_workspace(problem), 0, _own(joints), free)
        return free

    def free_lifts(self, joints: FloatArray) -> NDArray[np.uint32]:
        """Return for each posture the lifts at which it is free, bit i for `lifts[i]`."""
        bits = np.zeros(len(joints), np.uint32)
        for level in range(len(self.lifts)):
            bits |= self.free(joints, level).astype(np.uint32) << np.uint32(level)
        return bits

    def _at(self, level: int) -> Problem:
        """Return the problem with one torso level."""
        part = slice(level, level + 1)
        p = self._problem
        kept: Any = {
            name: getattr(p, name)[part].copy()
            for name in ("base_R", "base_p", "body", "body_A", "body_balls")
        }
        return p._replace(**kept, torso_levels=1)


def _solve_part(
    problem: Problem, R_BT: FloatArray, p_BT: FloatArray, part: slice, solved: Solved
) -> int:
    """Solve a slice of the poses, into its rows of `solved`; return how many they are."""
    problem = _with_goals(problem, R_BT[part], p_BT[part])
    count: int = part.stop - part.start
    scores = Scores(
        np.empty((1, count), np.uint8),
        np.empty((1, count), np.int32),
        np.zeros((1, count), np.float32),
        np.zeros((1, count, 7), np.float32),
    )
    score_slice(problem, gripper_contacts(problem), 0, 1, scores)
    solved.reached[part] = scores.reason[0] == REACHED
    solved.manipulability[part] = scores.isotropy[0]
    solved.joints[part] = scores.joints[0]
    return count


def _with_goals(problem: Problem, R_BT: FloatArray, p_BT: FloatArray) -> Problem:
    return problem._replace(goal_R=_own(R_BT)[None], goal_p=_own(p_BT)[None])


def _own(array: NDArray[Any]) -> FloatArray:
    """Return a writable copy: to numba, read-only arrays are another type to compile for."""
    return np.array(array, dtype=np.float64, order="C")


_STILL = (("base_x", "m"), ("base_y", "m"), ("base_yaw", "deg"))


def _empty_floor() -> EnvironmentFile:
    """Return an environment that holds nothing but a floor."""
    axes = {
        name: {"unit": unit, "start": 0.0, "step": 0.0, "count": 1}
        for name, unit in (*_STILL, ("torso", "m"))
    }
    return EnvironmentFile(
        name="empty floor",
        title="Nothing but a floor",
        origin="On the floor, under the robot",
        source="none",
        grid=axes,
    )
