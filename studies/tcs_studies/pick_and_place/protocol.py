"""The protocol of the experiment: familiarisation, and each base pose with training."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from joblib import Parallel, delayed

from tcs.capability import Reach
from tcs.capability.head import head_view, load_head
from tcs.errors import TcsError
from tcs.kernel.arrays import FloatArray
from tcs.model.robots import load_robot
from tcs.teleop.arm import Arm, load_arm
from tcs_studies.experiment.order import counterbalanced_orders
from tcs_studies.pick_and_place.master import Coupling
from tcs_studies.pick_and_place.operator import Experience
from tcs_studies.pick_and_place.phases import Traits
from tcs_studies.pick_and_place.repetition import (
    TIME_LIMIT,
    Measures,
    Outcome,
    Repetition,
    Setting,
    measure,
    perform,
)
from tcs_studies.pick_and_place.slave import Control
from tcs_studies.pick_and_place.task import (
    CONDITIONS,
    FAMILIARISATION,
    START,
    TORSO_HEIGHT,
    Condition,
)
from tcs_studies.pick_and_place.view import aimed_at

OPERATORS, REPETITIONS = 6, 7
"""Numbers of the thesis: participants, and successful repetitions in each part."""
ROBOT = "tiago"
"""Robot of the thesis. Its tool frame is that of the robot file: with it all base poses of the
thesis are in our own map of the task."""
_ATTEMPTS = 3
"""Attempts per requested repetition, after which an operator gives up a part."""
_PATH_POINTS = 200

OnProgress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """Size, seed and variations of the experiment.

    Attributes:
        operators: Number of operators.
        repetitions: Number of successful repetitions of each part, training included.
        training: Number of training repetitions from each base pose; None is `repetitions`.
        seed: Seed of operators and noise.
        conditions: The base poses.
        control: Control of the slave.
        coupling: Coupling of master and slave.
        usual: Medians of the operators' traits.
        time_limit: Time after which a repetition has failed [s].
    """

    operators: int = OPERATORS
    repetitions: int = REPETITIONS
    training: int | None = None
    seed: int = 0
    conditions: tuple[Condition, ...] = CONDITIONS
    control: Control = Control.POSITION_FIRST
    coupling: Coupling = field(default_factory=Coupling)
    usual: Traits = field(default_factory=Traits)
    time_limit: float = TIME_LIMIT

    def __post_init__(self) -> None:
        """Check the plan.

        Raises:
            TcsError: If there is no operator, repetition or condition, one condition twice, or the
                time limit is below 1 s.
        """
        if self.operators < 1 or self.repetitions < 1 or self.practice < 0:
            raise TcsError(
                f"pick and place with {self.operators} operators, {self.repetitions} repetitions "
                f"and {self.practice} training repetitions: at least 1 operator and 1 repetition "
                "are needed."
            )
        names = [condition.name for condition in self.conditions]
        if not names or len({*names}) != len(names):
            raise TcsError(f"pick and place: base poses {names} must be one or more, each once.")
        if not (math.isfinite(self.time_limit) and self.time_limit >= 1.0):
            raise TcsError(
                f"pick and place: time limit {self.time_limit:g} s; must be at least 1 s."
            )

    @property
    def practice(self) -> int:
        """Number of training repetitions from each base pose."""
        return self.repetitions if self.training is None else self.training

    def order(self, operator: int) -> tuple[Condition, ...]:
        """Return the order of the conditions for an operator, counted from 0."""
        orders = counterbalanced_orders(self.conditions)
        return orders[operator % len(orders)]


@dataclass(frozen=True, eq=False)
class Part:
    """Repetitions of one operator in one part of the protocol.

    Attributes:
        successes: Measures of the successful repetitions.
        failures: Outcomes of the failed ones.
        paths: Samples of each successful repetition: time [s] and position of the tool in the base
            [m], shapes (k, 4).
    """

    successes: tuple[Measures, ...]
    failures: tuple[Outcome, ...]
    paths: tuple[FloatArray, ...]


@dataclass(frozen=True, eq=False)
class OperatorResult:
    """One operator: familiarisation, and training and experiment by condition."""

    traits: Traits
    familiarisation: Part
    training: dict[str, Part]
    recorded: dict[str, Part]


@dataclass(frozen=True, eq=False)
class PickAndPlace:
    """Plan and results of an experiment.

    Attributes:
        plan: The plan.
        settings: Arm and view of each condition, by name.
        operators: The results, by operator.
    """

    plan: Plan
    settings: dict[str, Setting]
    operators: tuple[OperatorResult, ...]

    def sample(self, condition: str, name: str) -> FloatArray:
        """Return the mean of a measure over the repetitions of each operator, shape (n,).

        NaN for an operator without a successful repetition.
        """
        return np.array(
            [
                np.mean([getattr(one, name) for one in done]) if done else np.nan
                for done in (operator.recorded[condition].successes for operator in self.operators)
            ]
        )

    def failures(self, condition: str, *, training: bool = False) -> int:
        """Return the number of failed repetitions of all operators."""
        parts = (one.training if training else one.recorded for one in self.operators)
        return sum(len(part[condition].failures) for part in parts)


@dataclass(frozen=True, eq=False)
class Robot:
    """The robot of the experiment: arm, start posture and head."""

    reach: Reach
    arm: Arm
    joints: FloatArray

    def setting(self, condition: Condition, control: Control, coupling: Coupling) -> Setting:
        """Return what is the same in all repetitions from a base pose."""
        head = load_head(self.reach.robot)
        view = head_view(self.reach.scene, float(self.reach.torso_height))
        field_of_view = math.radians(head.horizontal_fov_deg), math.radians(head.vertical_fov_deg)
        camera = aimed_at(condition, view, field_of_view)
        return Setting(self.arm, self.joints, condition, camera, control, coupling)


def load_pick_and_place_robot() -> Robot:
    """Return TIAGo with the tool frame, torso height and start pose of the experiment.

    Raises:
        TcsError: If the arm does not reach the start pose.
    """
    robot = load_robot(ROBOT)
    reach = Reach(robot, torso_height=TORSO_HEIGHT)
    # The gripper is symmetric: of its two rolls, the start posture with more manipulability.
    rolls = np.stack([np.eye(3), np.diag([1.0, -1.0, -1.0])])
    solved = reach.solve(rolls, np.tile(START, (2, 1)))
    best = int(np.argmax(solved.manipulability))
    if not solved.reached[best]:
        raise TcsError(f"pick and place: '{ROBOT}' does not reach the start pose {START}.")
    # Joints in single precision may exceed a limit by rounding.
    joints = np.clip(np.asarray(solved.joints[best], dtype=np.float64), *reach.limits)
    arm = load_arm(robot, torso_height=TORSO_HEIGHT)
    frames = arm.frames.copy()
    frames[-1, :3, :3] = frames[-1, :3, :3] @ rolls[best]
    return Robot(reach, replace(arm, frames=frames), joints)


def run_pick_and_place(
    plan: Plan | None = None,
    robot: Robot | None = None,
    *,
    jobs: int = 1,
    on_progress: OnProgress | None = None,
) -> PickAndPlace:
    """Return the repetitions of all operators from all base poses.

    Args:
        plan: Size, seed and variations; None for those of the thesis.
        robot: The robot; None loads it.
        jobs: Number of processes; the results do not depend on it.
        on_progress: Called with the number of operators done and of all.

    Raises:
        TcsError: If the robot cannot be used.
    """
    plan, robot = plan or Plan(), robot or load_pick_and_place_robot()
    settings = {
        condition.name: robot.setting(condition, plan.control, plan.coupling)
        for condition in (FAMILIARISATION, *plan.conditions)
    }
    calls = (delayed(_operator)(plan, settings, number) for number in range(plan.operators))
    found: dict[int, OperatorResult] = {}
    for number, result in Parallel(jobs, return_as="generator_unordered")(calls):
        found[number] = result
        if on_progress is not None:
            on_progress(len(found), plan.operators)
    settings.pop(FAMILIARISATION.name)
    return PickAndPlace(plan, settings, tuple(found[i] for i in range(plan.operators)))


def _operator(plan: Plan, settings: dict[str, Setting], number: int) -> tuple[int, OperatorResult]:
    """Return the repetitions of one operator, from its first to its last condition."""
    traits = Traits.drawn(_rng(plan.seed, number), plan.usual)
    experience = Experience()

    def part(count: int, condition: Condition, *place: int) -> Part:
        rng = _rng(plan.seed, number, *place)
        return _part(settings[condition.name], count, traits, experience, rng, plan.time_limit)

    familiarisation = part(plan.repetitions, FAMILIARISATION, 0)
    training, recorded = {}, {}
    for condition in plan.order(number):
        place = plan.conditions.index(condition) + 1
        training[condition.name] = part(plan.practice, condition, place, 0)
        recorded[condition.name] = part(plan.repetitions, condition, place, 1)
    return number, OperatorResult(traits, familiarisation, training, recorded)


def _part(
    setting: Setting,
    count: int,
    traits: Traits,
    experience: Experience,
    rng: np.random.Generator,
    time_limit: float,
) -> Part:
    """Return repetitions until the requested number was successful, or the operator gives up."""
    successes: list[Measures] = []
    failures: list[Outcome] = []
    paths: list[FloatArray] = []
    while len(successes) < count and len(successes) + len(failures) < _ATTEMPTS * count:
        done = perform(setting, traits, experience, rng, time_limit=time_limit)
        if done.outcome is Outcome.DONE:
            successes.append(measure(done))
            paths.append(_path(done))
        else:
            failures.append(done.outcome)
    return Part(tuple(successes), tuple(failures), tuple(paths))


def _path(done: Repetition) -> FloatArray:
    """Return at most `_PATH_POINTS` samples of time [s] and tool position [m], shape (k, 4)."""
    count = len(done.time)
    rows = np.linspace(0, count - 1, min(_PATH_POINTS, count)).astype(int)
    return np.asarray(np.column_stack([done.time, done.tool])[rows])


def _rng(seed: int, *place: int) -> np.random.Generator:
    """Return the random generator of one operator or part, independent of the order of calls."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(len(place), *place)))


def failure_counts(outcomes: Sequence[Outcome]) -> dict[str, int]:
    """Return the number of failures of each type, without types that did not occur."""
    return {one.value: outcomes.count(one) for one in Outcome if one in outcomes}
