"""Simulated recordings: a simulated hand at the master moves the teleoperated arm.

A capability map (ITCM) of the joint states can be made without an operator. The hand moves between
random poses in the box of a master device, and the arm follows in end-effector control. Before the
arm touches the robot or the floor it stops, and retreats along its path.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tcs.capability import Reach, Recording
from tcs.errors import DataFileError
from tcs.files.quantities import MASTER_SCALE, POSITION, RECORDING
from tcs.kernel.arrays import BoolArray, FloatArray
from tcs.teleop.arm import JOINTS, load_arm
from tcs.teleop.control.resolved_rate import pose_error
from tcs.teleop.control.session import Step, Teleoperation
from tcs.teleop.control.settings import Command, Mode, Settings

MASTER_BOX = (0.070, 0.160, 0.120)
"""Depth, width and height of the workspace of a Geomagic Touch [m]: forward, left, up."""
PERIOD = 0.02
"""Time between samples [s]: joint states are published at 50 Hz, ITCM thesis, Appendix C.1."""
_GAIN = 4.0
"""Commanded tool speed per distance to the hand [1/s]."""
_FASTEST = (1.5, 0.4)
"""Greatest commanded velocities, angular and linear [rad/s; m/s]."""
_LEAD = 0.10
"""Distance between hand and tool above which the hand waits [m]."""
_PATIENCE = 1.0
"""Longest time that the hand waits for the tool [s]."""
_RETREAT = 50
"""Number of samples by which the arm retreats after its first stop: one second."""
_STRETCH = 25
"""Number of samples that are checked for collision together: half a second."""
_SETTINGS = Settings(period=PERIOD, length=0.3)
"""Where joint limits leave the tool too few joints, `length` divides the error between position and
orientation; of 0.1 to 0.6 m, this gives recordings with the most cells."""
_RECOVERY = Mode.ASSISTED
"""Mode after a stop or a lost hand, which moves the joints away from their limits."""

OnProgress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class HandMotion:
    """Motion of the operator's hand, scaled to the arm.

    The defaults are those of the recording in the ITCM thesis where the thesis states them: fixed
    height, roll and pitch, and the duration of Appendix C.1 (section II.A rounds it to an hour). It
    does not state scale, centre, yaw and speed of the hand.

    Attributes:
        height: Height of the tool above the floor [m].
        seconds: Duration of the recording [s]: 53 min 17 s, as in Appendix C.1.
        scale: Metres at the arm per metre at the master: 0.16 m become the 1.2 m of the thesis.
        centre: Centre of the box, x and y in B [m].
        yaw: Lowest and highest yaw of the tool [rad].
        pitch: Pitch of the tool [rad]; pi / 2 for top grasps.
        speed: Speed of the hand, scaled to the arm [m/s].
        angular_speed: Angular speed of the hand [rad/s].
    """

    height: float = 0.41
    seconds: float = 3197.0
    scale: float = 7.5
    centre: tuple[float, float] = (0.65, 0.0)
    yaw: tuple[float, float] = (-math.pi / 2, math.pi / 2)
    pitch: float = 0.0
    speed: float = 0.15
    angular_speed: float = 0.5

    @property
    def middle(self) -> FloatArray:
        """Middle of the box and of the yaw range: x, y [m] and yaw [rad], shape (3,)."""
        return np.array([*self.centre, np.mean(self.yaw)])

    @property
    def extent(self) -> FloatArray:
        """Depth and width of the box [m] and the yaw range [rad], shape (3,)."""
        depth, width = (self.scale * side for side in MASTER_BOX[:2])
        return np.array([depth, width, self.yaw[1] - self.yaw[0]])

    def tool_poses(self, hand: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return commanded tool poses in B: rotations (n, 3, 3) and positions [m] (n, 3).

        Args:
            hand: x, y [m] and yaw [rad] of the hand, shape (n, 3).
        """
        cp, sp = math.cos(self.pitch), math.sin(self.pitch)
        c, s = np.cos(hand[:, 2]), np.sin(hand[:, 2])
        R = np.zeros((len(hand), 3, 3))
        R[:, 0, 0], R[:, 0, 1], R[:, 0, 2] = c * cp, -s, c * sp
        R[:, 1, 0], R[:, 1, 1], R[:, 1, 2] = s * cp, c, s * sp
        R[:, 2, 0], R[:, 2, 2] = -sp, cp
        return R, np.column_stack([hand[:, :2], np.full(len(hand), self.height)])


@dataclass(frozen=True, eq=False)
class SimulatedRecording:
    """Joint states of the teleoperated arm, and its tracking errors."""

    recording: Recording
    position_error: FloatArray
    """Distance from the commanded to the actual tool position [m], shape (n,)."""
    orientation_error: FloatArray
    """Angle from the commanded to the actual tool orientation [rad], shape (n,)."""
    stopped: BoolArray
    """Whether the arm retreated along its path after a stop, shape (n,)."""


def simulate_recording(
    reach: Reach,
    motion: HandMotion | None = None,
    *,
    seed: int = 0,
    on_progress: OnProgress | None = None,
) -> SimulatedRecording:
    """Return the joint states of an arm that follows a simulated hand.

    Args:
        reach: The robot, at the torso height of the recording.
        motion: Motion of the hand; None for the defaults.
        seed: Seed of the random poses of the hand.
        on_progress: Called with the number of samples done and of all.

    Raises:
        DataFileError: If a number is out of its physical range, or the arm reaches no pose in the
            box to start from.

    Source:
        The "complete simulation" that the ITCM thesis proposes as future work, Appendix C.4:
        scaling between master and slave, joint limits, self-collision. The controller of its slave
        is not published; here it is `Mode.END_EFFECTOR` of `tcs.teleop`.
    """
    motion = motion or HandMotion()
    count = _sample_count(motion)
    start = _start_posture(reach, motion)
    session = Teleoperation(
        load_arm(reach.robot, torso_height=float(reach.torso_height)), start, _SETTINGS
    )
    step = session.step(Command(mode=Mode.END_EFFECTOR))
    hand = _Hand(motion, np.random.default_rng(seed), step)
    joints, poses = np.empty((count, JOINTS)), np.empty((count, 3))
    stopped = np.zeros(count, np.bool_)
    done, path, back = 0, [start], _RETREAT
    while done < count:
        first, end = done, min(done + _STRETCH, count)
        for i in range(done, end):
            step = session.step(hand.command(step))
            joints[i], poses[i] = step.joints, hand.pose
        blocked = np.flatnonzero(~reach.free(joints[done:end], reach.level))
        done = done + int(blocked[0]) if blocked.size else end
        path.extend(joints[first:done].copy())
        if not blocked.size:
            back = max(_RETREAT, back - _STRETCH)
        else:
            # Retreat along the free path, farther at each stop, so that the arm does not get stuck.
            end = min(done + max(1, min(back, len(path) - 1)), count)
            for i in range(done, end):
                if len(path) > 1:
                    path.pop()
                joints[i] = path[-1]
            poses[done:end], stopped[done:end] = poses[done], True
            done, back = end, 2 * back
            session.place(path[-1])
            step = session.step(Command())
            hand.give_up(step)
        if on_progress is not None:
            on_progress(done, count)
    R_BC, p_BC = motion.tool_poses(poses)
    R_AT, p_AT = reach.tool_poses(joints)
    chord = np.linalg.norm(R_BC - reach.R_BA @ R_AT, axis=(1, 2)) / math.sqrt(8.0)
    return SimulatedRecording(
        Recording(joints, np.full(count, float(reach.torso_height))),
        np.linalg.norm(p_BC - (p_AT @ reach.R_BA.T + reach.p_BA), axis=1),
        2.0 * np.arcsin(np.minimum(chord, 1.0)),
        stopped,
    )


class _Hand:
    """Hand that moves between random poses in its box, and waits for a tool that lags behind."""

    def __init__(self, motion: HandMotion, rng: np.random.Generator, step: Step) -> None:
        """Start at the position of the tool, with the middle yaw."""
        self.pose = np.array([step.p[0], step.p[1], motion.middle[2]])
        """x, y [m] and yaw [rad] in B, shape (3,)."""
        self._motion, self._rng = motion, rng
        self._mode = Mode.END_EFFECTOR
        self._target = self._draw()
        self._waited = 0.0

    def command(self, step: Step) -> Command:
        """Return the command of the next period, after the arm's last step."""
        behind = math.hypot(self.pose[0] - step.p[0], self.pose[1] - step.p[1])
        self._waited = self._waited + PERIOD if behind > _LEAD else 0.0
        if self._waited > _PATIENCE:
            self.give_up(step)
        if self._waited == 0.0:
            self._move()
        R, p = self._motion.tool_poses(self.pose[None])
        twist = _GAIN * pose_error(R[0], p[0], step.R, step.p)
        for part, fastest in zip((twist[:3], twist[3:]), _FASTEST, strict=True):
            part *= min(1.0, fastest / max(math.sqrt(part @ part), 1e-12))
        return Command(angular=twist[:3], linear=twist[3:], mode=self._mode)

    def give_up(self, step: Step) -> None:
        """Return to the tool and move to another pose, with assistance until it is reached."""
        self.pose[:2] = step.p[:2]
        self._target, self._waited, self._mode = self._draw(), 0.0, _RECOVERY

    def _move(self) -> None:
        """Move towards the target for one period, at the hand's speed."""
        difference = self._target - self.pose
        motion = self._motion
        seconds = max(
            math.hypot(difference[0], difference[1]) / motion.speed,
            abs(difference[2]) / motion.angular_speed,
        )
        if seconds <= PERIOD:
            self.pose[:] = self._target
            self._target, self._mode = self._draw(), Mode.END_EFFECTOR
        else:
            self.pose += (PERIOD / seconds) * difference

    def _draw(self) -> FloatArray:
        motion = self._motion
        return motion.middle + motion.extent * self._rng.uniform(-0.5, 0.5, 3)


def _sample_count(motion: HandMotion) -> int:
    """Return the number of samples.

    Raises:
        DataFileError: If a number is out of its physical range.
    """
    where = "simulated recording: its"
    POSITION.check((motion.height, *motion.centre), f"{where} height or centre", DataFileError)
    MASTER_SCALE.check((motion.scale,), f"{where} scale", DataFileError)
    RECORDING.check((motion.seconds,), f"{where} length", DataFileError)
    return round(motion.seconds / PERIOD)


def _start_posture(reach: Reach, motion: HandMotion) -> FloatArray:
    """Return the best posture at the reachable pose of the box that is nearest to its middle.

    Raises:
        DataFileError: If no pose of the box is reached.
    """
    line = np.linspace(-0.5, 0.5, 9)
    grid = np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1).reshape(-1, 3)
    order = np.argsort((grid**2).sum(axis=1), kind="stable")
    solved = reach.solve(*motion.tool_poses(motion.middle + motion.extent * grid[order]))
    if not solved.reached.any():
        depth, width = motion.extent[:2]
        raise DataFileError(
            f"simulated recording: the arm cannot start, as it reaches no pose in the box of "
            f"{depth:.2f} x {width:.2f} m about x {motion.centre[0]:g}, y {motion.centre[1]:g} m "
            f"at a height of {motion.height:g} m with the torso at {reach.torso_height:g} m. Move "
            "the box."
        )
    # Joints in single precision may exceed a limit by rounding.
    joints = np.asarray(solved.joints[int(np.argmax(solved.reached))], dtype=np.float64)
    return np.asarray(np.clip(joints, *reach.limits))
