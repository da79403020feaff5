"""Reachability and manipulability of tool poses for a robot on an empty floor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from tcs.errors import GridError, UnknownNameError
from tcs.files.memory import check_room
from tcs.files.paths import data_reference
from tcs.files.quantities import MAP_STEP
from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.kernel.postures import free_postures, measures, tool_poses
from tcs.kernel.problem import Problem, build_problem
from tcs.kernel.rows import Rows, single_row
from tcs.kernel.scores import REACHED
from tcs.kernel.sweep import score
from tcs.kernel.workspace import new_workspace
from tcs.model.grid import Axis, Grid
from tcs.model.robots import RobotFile, load_robot
from tcs.model.scene import EnvironmentFile, LoweredScene, Scene, SceneSpec, lower

MEASURE = "inverse-condition-limited-thesis"
"""The thesis's manipulability: sigma_min / sigma_max, eq. (20), times the penalty, eq. (21)."""

_SLICE = 2048
"""Poses per task of a thread: tens of milliseconds of work, so that threads end together."""
_SAME_HEIGHT = 1e-9
"""Torso heights closer than this are equal [m]."""

OnProgress = Callable[[int, int], None]


@dataclass(frozen=True, eq=False)
class Solved:
    """Best posture for each tool pose."""

    reached: BoolArray
    """Whether each pose is reached, shape (n,)."""
    manipulability: NDArray[np.float32]
    """The measure of the best posture, 0 where not reached, shape (n,)."""
    joints: NDArray[np.float32]
    """The best posture [rad], 0 where not reached, shape (n, 7)."""


class Reach:
    """Reachability of tool poses for a robot on an empty floor, at a range of torso heights.

    The base B is at the origin. Obstacles are the floor and the robot itself.
    """

    def __init__(
        self, robot: RobotFile, *, torso_height: float | None = None, step: float = 0.05,
        measure: str = MEASURE, robot_reference: str | None = None, head: str | None = None,
    ) -> None:  # fmt: skip
        """Lower the robot to arrays at `torso_height` and at all heights whole steps away from it.

        Args:
            robot: The robot.
            torso_height: Torso height of the maps [m]; None is the middle of the torso's range.
            step: Distance between torso heights [m].
            measure: Name of the dexterity measure, see `tcs.kernel.dexterity`.
            robot_reference: Name or path that maps store as a reference to the robot; None is its
                name.
            head: Name or path of the head file; None is the robot's name.

        Raises:
            RobotError: If the model of the robot cannot be used, or its arm does not have seven
                joints.
            GridError: If the torso height is out of range or not finite, or the step is not
                positive.
            UnknownNameError: If there is no measure of that name.
            MemoryError: If the address space is limited, and too little is left.
        """
        check_room()
        robot.require_seven_joints("a capability map")
        self.robot, self.measure = robot, measure
        self.head = head
        """Name or path of the head file; None is the robot's name."""
        self.robot_reference = robot.name if robot_reference is None else robot_reference
        """Name of the robot, or path of its file."""
        MAP_STEP.check(step, "the step of the torso heights", GridError)
        self.scene = Scene(SceneSpec(robot, _empty_floor()))
        low, high = self.scene.built.torso_limits
        self.torso_height = 0.5 * (low + high) if torso_height is None else torso_height
        if not low - _SAME_HEIGHT <= self.torso_height <= high + _SAME_HEIGHT:
            raise GridError(
                f"robot '{robot.name}': torso height {self.torso_height:g} m is out of range; must "
                f"be {low:g} to {high:g} m."
            )
        below = int(np.floor((self.torso_height - low) / step + _SAME_HEIGHT))
        above = int(np.floor((high - self.torso_height) / step + _SAME_HEIGHT))
        self.level = below
        """Index of `torso_height` among `torso_heights`."""
        self.torso_heights = self.torso_height + step * np.arange(-below, above + 1)
        """Torso heights [m], shape (levels,)."""
        axis = Axis("torso", "m", float(self.torso_heights[0]), step, len(self.torso_heights))
        fixed = (Axis(name, unit, 0.0, 0.0, 1) for name, unit in _FIXED_AXES)
        self.lowered: LoweredScene = lower(self.scene, None, Grid((*fixed, axis)))
        self._problem = build_problem(self.lowered.arrays, measure)
        self.R_BA = self.lowered.arrays.arm_base_R[below]
        """Orientation of the arm base A in B at `torso_height`, shape (3, 3)."""
        self.p_BA = self.lowered.arrays.arm_base_p[below]
        """Origin of A in B at `torso_height` [m], shape (3,)."""

    @classmethod
    def load(
        cls, robot: str | Path, *, tool: str | None = None, torso_height: float | None = None,
        step: float = 0.05, measure: str = MEASURE, head: str | None = None,
    ) -> Reach:  # fmt: skip
        """Return the reachability of a robot by its name or file.

        Args:
            robot: Name of a robot that ships with tcs, or path of a robot file.
            tool: Frame of the robot to use as the tool; None is that of the robot file.
            torso_height: As in the constructor.
            step: As in the constructor.
            measure: As in the constructor.
            head: As in the constructor.

        Raises:
            UnknownNameError: If there is no such robot, tool frame or measure.
            RobotError: If the robot cannot be used.
            GridError: If the torso height is out of range.
        """
        file = load_robot(robot)
        if tool is not None:
            known = {*file.model().links, *(one.name for one in (*file.frames, *file.bodies))}
            if tool not in known:
                raise UnknownNameError("tool frame", tool, known, where=f"robot '{file.name}'")
        return cls(
            file if tool is None else file.model_copy(update={"tool_frame": tool}),
            torso_height=torso_height, step=step, measure=measure,
            robot_reference=data_reference(robot, file.name), head=head,
        )  # fmt: skip

    @property
    def limits(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper joint limits [rad], shape (7,) each."""
        chain = self.lowered.arrays.chain
        return chain.lower, chain.upper

    @property
    def shoulder(self) -> FloatArray:
        """Origin of link frame L1 in B at `torso_height` [m], shape (3,)."""
        return np.asarray(self.p_BA + self.R_BA @ self.lowered.arrays.chain.p[0])

    @property
    def length(self) -> float:
        """Sum of the link lengths: an upper bound of the distance from shoulder to tool [m]."""
        return float(np.linalg.norm(self.lowered.arrays.chain.p[1:], axis=1).sum())

    def solve(
        self, R_BT: FloatArray, p_BT: FloatArray, *, level: int | None = None, jobs: int = 2,
        on_progress: OnProgress | None = None,
    ) -> Solved:  # fmt: skip
        """Return the best collision-free posture for each tool pose.

        Args:
            R_BT: Tool orientations in B, shape (n, 3, 3).
            p_BT: Tool positions in B [m], shape (n, 3).
            level: Index of the torso height; None is that of `torso_height`.
            jobs: Number of threads; the results do not depend on it.
            on_progress: Called with the number of poses done and of all.
        """
        at = single_row(torso=self.level if level is None else level)
        count = len(p_BT)
        solved = Solved(
            np.zeros(count, np.bool_), np.zeros(count, np.float32), np.zeros((count, 7), np.float32)
        )
        parts = [slice(i, min(i + _SLICE, count)) for i in range(0, count, _SLICE)]
        done = 0
        runs = (delayed(_solve_part)(self._problem, at, R_BT, p_BT, part, solved) for part in parts)
        # Threads suffice, as the kernel releases the interpreter lock.
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
        tool_poses(self._problem.chain.R, self._problem.chain.p, _writable(joints), R, p)
        return R, p

    def manipulability(self, joints: FloatArray) -> FloatArray:
        """Return the manipulability of postures, shape (n,).

        Args:
            joints: Arm joints [rad], shape (n, 7).
        """
        value = np.empty(len(joints))
        measures(self._problem, _writable(joints), value)
        return value

    def free(self, joints: FloatArray, level: int) -> BoolArray:
        """Return whether postures are free of contact with robot and floor, shape (n,).

        Args:
            joints: Arm joints [rad], shape (n, 7).
            level: Index of the torso height.
        """
        R_AT, p_AT = self.tool_poses(joints)
        R_BA, p_BA = self._problem.arm_base.R[level], self._problem.arm_base.p[level]
        problem = self._problem.at_poses((R_BA @ R_AT)[None], (p_AT @ R_BA.T + p_BA)[None])
        free = np.zeros(len(joints), np.bool_)
        free_postures(
            problem, new_workspace(problem), single_row(torso=level), _writable(joints), free
        )
        return free

    def free_torso_heights(self, joints: FloatArray, *, jobs: int = 1) -> NDArray[np.uint32]:
        """Return the torso heights free of contact, bit i for `torso_heights[i]`, shape (n,).

        Args:
            joints: Arm joints [rad], shape (n, 7).
            jobs: Number of threads; the results do not depend on it.
        """
        bits = np.zeros(len(joints), np.uint32)

        def fill(part: slice, level: int) -> tuple[slice, NDArray[np.uint32]]:
            return part, self.free(joints[part], level).astype(np.uint32) << np.uint32(level)

        parts = [slice(i, i + _SLICE) for i in range(0, len(joints), _SLICE)]
        runs = (
            delayed(fill)(part, level) for part in parts for level in range(len(self.torso_heights))
        )
        for part, of_level in Parallel(jobs, "threading", return_as="generator_unordered")(runs):
            bits[part] |= of_level
        return bits


def _solve_part(
    problem: Problem,
    at: Rows,
    R_BT: FloatArray,
    p_BT: FloatArray,
    part: slice,
    solved: Solved,
) -> int:
    """Solve a slice of the poses into its rows of `solved`; return their number."""
    scores = score(problem.at_poses(R_BT[None, part], p_BT[None, part]), at)
    count: int = part.stop - part.start
    solved.reached[part] = scores.reason[0] == REACHED
    solved.manipulability[part] = scores.dexterity[0]
    solved.joints[part] = scores.joints[0]
    return count


def _writable(array: NDArray[Any]) -> FloatArray:
    """Return a writable copy: numba compiles anew for read-only arrays, which are another type."""
    return np.array(array, dtype=np.float64, order="C")


_FIXED_AXES = (("base_x", "m"), ("base_y", "m"), ("base_yaw", "deg"))


def _empty_floor() -> EnvironmentFile:
    """Return an environment without furniture."""
    axes = {
        name: {"unit": unit, "start": 0.0, "step": 0.0, "count": 1}
        for name, unit in (*_FIXED_AXES, ("torso", "m"))
    }
    return EnvironmentFile(
        name="empty floor",
        title="Empty floor",
        origin="On the floor, under the robot",
        source="none",
        grid=axes,
    )
