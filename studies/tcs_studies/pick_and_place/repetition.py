"""One performance of the task, and its measures."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from tcs.kernel.arrays import FloatArray
from tcs.teleop.arm import Arm
from tcs.teleop.control.latency import DelayLine
from tcs_studies.experiment.metrics import (
    resampled,
    spectral_arc_length,
    steering_angle,
    steering_translation,
)
from tcs_studies.pick_and_place.cup import (
    FINGER_HALF_HEIGHT,
    LOST,
    PALM,
    PALM_HALF_HEIGHT,
    TIPS,
    Cup,
    CupState,
)
from tcs_studies.pick_and_place.master import PERIOD, Coupling, Master, drawn_tremor
from tcs_studies.pick_and_place.operator import Experience, Operator
from tcs_studies.pick_and_place.phases import Phase, Seen, Traits
from tcs_studies.pick_and_place.slave import PERIOD as SLAVE_PERIOD
from tcs_studies.pick_and_place.slave import Control, Slave, orientation
from tcs_studies.pick_and_place.task import FARTHEST, TABLE_HEIGHT, Condition
from tcs_studies.pick_and_place.view import HeadCamera

TIME_LIMIT = 180.0
"""Time after which a repetition has failed [s]; the thesis states none."""
_EVERY = round(SLAVE_PERIOD / PERIOD)


class Outcome(StrEnum):
    """How a repetition ended."""

    DONE = "done"
    TOPPLED = "toppled"
    """The cup was knocked over, or dropped."""
    FALLEN = "fallen"
    """The cup fell from the table."""
    TIMEOUT = "timeout"
    """The task was not finished within the time limit."""


@dataclass(frozen=True, eq=False)
class Setting:
    """What is the same in all repetitions from a base pose.

    Attributes:
        arm: The arm.
        joints: Its start posture [rad], shape (7,).
        condition: The base pose.
        camera: The view.
        control: Control of the slave.
        coupling: Coupling of master and slave.
    """

    arm: Arm
    joints: FloatArray
    condition: Condition
    camera: HeadCamera
    control: Control
    coupling: Coupling


@dataclass(frozen=True, eq=False)
class Repetition:
    """What was recorded in a repetition of n samples.

    Attributes:
        outcome: How it ended.
        time: Times since the coupling [s], shape (n,).
        hand: Position of the hand at the master [m], shape (n, 3).
        angles: Roll, pitch and yaw of the hand [rad], shape (n, 3).
        tool: Position of the tool in the base [m], shape (n, 3).
        place: Position of the place in the base [m], shape (3,).
        actions: Times at which the gripper was commanded [s]: closed, opened, and so on.
        corrections: Number of times that the cup stood partly outside the circle.
    """

    outcome: Outcome
    time: FloatArray
    hand: FloatArray
    angles: FloatArray
    tool: FloatArray
    place: FloatArray
    actions: tuple[float, ...]
    corrections: int


def perform(
    setting: Setting,
    traits: Traits,
    experience: Experience,
    rng: np.random.Generator,
    *,
    time_limit: float = TIME_LIMIT,
) -> Repetition:
    """Return one repetition of an operator, who learns from it.

    Args:
        setting: The base pose, the arm and its control.
        traits: Traits of the operator.
        experience: What the operator has learnt; updated in place.
        rng: Random generator.
        time_limit: Time after which the repetition has failed [s].
    """
    return _Performance(setting, traits, experience, rng).run(time_limit)


class _Performance:
    """State of arm, cup, hand and operator during a repetition."""

    def __init__(
        self, setting: Setting, traits: Traits, experience: Experience, rng: np.random.Generator
    ) -> None:
        self._setting = setting
        self._slave = Slave(setting.arm, setting.joints, setting.control)
        self._cup = Cup(setting.condition, PERIOD)
        tremor = drawn_tremor(rng, traits.tremor, traits.tremor_lever)
        self._master = Master(setting.coupling, tremor)
        self._operator = Operator(
            traits, experience, setting.condition, setting.camera, setting.arm.frames[0, :3, 3],
            control=setting.control, coupling=setting.coupling, rng=rng,
        )  # fmt: skip
        self._goals: list[tuple[FloatArray, FloatArray]] = []
        latency = setting.coupling.latency
        goal = self._master.p, self._master.angles
        self._commands = DelayLine(latency.command, PERIOD, goal)
        self._images = DelayLine(latency.picture, PERIOD, self._shown())
        self._group_time = 0.0

    def run(self, time_limit: float) -> Repetition:
        """Perform the task until it is done, has failed, or the time is over."""
        setting, operator, cup = self._setting, self._operator, self._cup
        place, outcome = setting.condition.place, Outcome.TIMEOUT
        tool = []
        for sample in range(round(time_limit / PERIOD)):
            self._advance(sample)
            p = self._slave.step.p
            tool.append(p)
            if cup.state in LOST:
                outcome = Outcome(cup.state.value)
                break
            off = p - place
            retreats = operator.phase in (Phase.BACK, Phase.RETREAT)
            if retreats and off @ off > FARTHEST**2:
                outcome = Outcome.DONE
                break
        goals, start = np.array([p for p, _ in self._goals]), self._goals[0][0]
        return Repetition(
            outcome=outcome,
            time=np.asarray(PERIOD * np.arange(1, len(tool) + 1), dtype=np.float64),
            hand=(goals - start) / setting.coupling.scale,
            angles=np.array([angles for _, angles in self._goals]),
            tool=np.array(tool),
            place=place,
            actions=tuple(operator.actions),
            corrections=operator.corrections,
        )

    def _advance(self, sample: int) -> None:
        """Advance hand, arm and cup by one sample of the master."""
        operator, cup = self._operator, self._cup
        seen = self._images.send(self._shown())
        if operator.group is None:
            operator.advance(sample * PERIOD, seen, self._master)
            self._group_time = sample * PERIOD
        self._goals.append(self._master.sample())
        p, angles = self._commands.send(self._goals[-1])
        depth = max(0.0, self._floor() - float(p[2]))
        self._master.feel(depth)
        if sample % _EVERY == 0:
            if operator.group is None:
                goal = p.copy()
                goal[2] += depth
                self._slave.follow(goal, orientation(*angles))
            else:
                self._turn_group(sample * PERIOD)
        step = self._slave.step
        cup.advance(step.R, step.p, close=operator.closing)

    def _shown(self) -> Seen:
        """Return what the image shows, and what the hand feels, before any latency."""
        step, cup = self._slave.step, self._cup
        return Seen(step.p, step.R, cup.p.copy(), cup.state, self._master.force)

    def _turn_group(self, now: float) -> None:
        """Move joint group 1 for one period; end its motion when its time is over."""
        group = self._operator.group
        assert group is not None
        begins = self._group_time + group.pause
        ends = begins + abs(group.turn) / self._slave.group_rate
        moves = begins <= now < ends
        self._slave.turn_group(int(np.sign(group.turn)) if moves else 0)
        if now >= ends + group.regrip:
            self._operator.group = None

    def _floor(self) -> float:
        """Return the least height of the tool origin: gripper and cup are on the table [m]."""
        condition, step = self._setting.condition, self._slave.step
        ahead = step.R[:2, 0]
        tips, palm = (step.p[:2] + x * ahead for x in (TIPS, PALM))
        floor = -np.inf
        if condition.over_table(*palm):
            floor = TABLE_HEIGHT + PALM_HALF_HEIGHT
        elif condition.over_table(*tips):
            floor = TABLE_HEIGHT + FINGER_HALF_HEIGHT
        if self._cup.state is CupState.HELD:
            below = self._cup.bottom_below_tool
            assert below is not None
            floor = max(floor, TABLE_HEIGHT + below)
        return float(floor)


@dataclass(frozen=True, slots=True, kw_only=True)
class Measures:
    """Measures of a successful repetition.

    Attributes:
        tct: Completion time: from the coupling until the gripper is 0.30 m from the place [s].
        csa: Cumulative steering angle [rad].
        cst: Cumulative steering translation, of the hand [m].
        sal: Spectral arc length of the speed of the hand.
        csa_rate: Steering angle per time [rad/s].
        cst_rate: Steering translation per time [m/s].
        approach: Time until the gripper is first closed [s].
        transfer: Time from then until it is first opened [s].
        retreat: Time from then to the end [s].
        actions: Number of times that the gripper was opened or closed.
        corrections: Number of times that the cup stood partly outside the circle.
    """

    tct: float
    csa: float
    cst: float
    sal: float
    csa_rate: float
    cst_rate: float
    approach: float
    transfer: float
    retreat: float
    actions: float
    corrections: float


MEASURES = tuple(Measures.__dataclass_fields__)


def measure(done: Repetition) -> Measures:
    """Return the measures of a successful repetition.

    Args:
        done: The repetition; the gripper closed and opened at least once.

    Source:
        ITCM thesis, III.C.4, Appendices F.1, F.3 and F.4. The master is sampled at 50 Hz, the rate
        to which the thesis resamples; so the filter has nothing left to remove.
    """
    _, hand = resampled(done.time, np.hstack([done.hand, np.unwrap(done.angles, axis=0)]))
    rate = (len(hand) - 1) / float(done.time[-1] - done.time[0])
    speed = rate * np.linalg.norm(np.diff(hand[:, :3], axis=0), axis=1)
    tct = float(done.time[-1])
    closed, opened = done.actions[:2]
    csa, cst = steering_angle(hand[:, 3:]), steering_translation(hand[:, :3])
    return Measures(
        tct=tct,
        csa=csa,
        cst=cst,
        sal=spectral_arc_length(speed, rate),
        csa_rate=csa / tct,
        cst_rate=cst / tct,
        approach=closed,
        transfer=opened - closed,
        retreat=tct - opened,
        actions=float(len(done.actions)),
        corrections=float(done.corrections),
    )
