"""Re-check of a plan that was read from a file: contacts, limits, timing and goals, with Drake."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np

from tcs.errors import StoreFormatError
from tcs.kernel.arrays import FloatArray
from tcs.kernel.motion.straight import OFF_LINE
from tcs.model.scene import Scene, alternative_poses
from tcs.model.tasks import TOOL_SPEED
from tcs.motion.cubics import at_times, extremes
from tcs.motion.curves import CHAIN
from tcs.motion.motion_plan import MotionPlan, Segment, StopPlan
from tcs.motion.plans import value_of
from tcs.motion.recheck import StopCheck
from tcs.motion.stops import Stop
from tcs.motion.timing import Timed
from tcs.placement.scoring.drake_check import pose_errors
from tcs.placement.scoring.job import Job
from tcs.placement.scoring.rebuild import rebuild_scenes

ROUNDING = 1e-9
"""Greatest difference of the posture between two segments [rad], and greatest velocity at their
ends [rad/s]."""
POSITION_BAR = 1e-6
"""Greatest distance of the tool from its goal at the end of an approach [m]."""
LIMIT_BAR = 1.0 + 1e-6
"""Greatest fraction of a limit: sums of the cubics' coefficients round."""
TOOL_SECONDS = 0.004
"""Time between two postures at which the tool is measured on a straight motion [s]; it is measured
anew, TOOL_FINER as close, where it is fastest."""
TOOL_FINER = 20


@dataclass(frozen=True)
class PlanCheck:
    """Result of re-checking a plan."""

    edges: int
    """Number of pieces between two samples, each re-checked at postures between which no point of
    the arm moves by more than a millimetre."""
    false: int
    """Number of these that Drake finds in contact or beyond joint limits."""
    jumps: int
    """Number of segments that do not begin where the one before ended, or not at rest: the first of
    a stop begins in the rest posture, and the last ends there if the arm returns."""
    goals: int
    """Number of approaches."""
    max_position_error: float
    """Greatest distance of the tool from its goal at the end of an approach [m]."""
    velocity: float
    """Greatest velocity on the cubics, as a fraction of its limit."""
    acceleration: float
    """Greatest acceleration on the cubics, as a fraction of its limit."""
    jerk: float | None
    """Greatest jerk on the cubics, rest before and after each segment included, as a fraction of
    its limit; None if the plan has no jerk limits."""
    tool_speed: float
    """Greatest speed of the tool on straight segments [m/s]."""
    max_line_error: float
    """Greatest distance of the tool from the line, and angle from its orientation there, on
    straight segments [m and rad]."""

    @property
    def is_sound(self) -> bool:
        """Whether nothing was refuted."""
        return (
            self.false == 0
            and self.jumps == 0
            and self.max_position_error <= POSITION_BAR
            and max(self.velocity, self.acceleration, self.jerk or 0.0) <= LIMIT_BAR
            and self.tool_speed <= LIMIT_BAR * TOOL_SPEED
            and self.max_line_error <= LIMIT_BAR * OFF_LINE
        )

    def to_json(self) -> dict[str, Any]:
        """Return the findings as plain containers."""
        verdict = "the plan holds" if self.is_sound else "THE PLAN IS FALSE"
        return {**asdict(self), "verdict": verdict}


def check_plan(
    plan: MotionPlan, *, on_progress: Callable[[int, int], None] | None = None
) -> PlanCheck:
    """Re-check a plan with Drake in the scene that it was made for.

    Args:
        plan: The plan, e.g. from `load_plan`.
        on_progress: Called with the number of finished segments and their total.

    Raises:
        StoreMismatchError: If the models have changed since the plan was made.
        StoreFormatError: If it names goals, joints or axes that its scene does not have.
    """
    hands = hands_of(plan)
    total, done = sum(len(stop.segments) for stop in plan.stops), 0
    checks: dict[str, StopCheck] = {}
    edges = false = jumps = goals = 0
    error = velocity = acceleration = jerk = speed = off_line = 0.0
    for planned in plan.stops:
        hand = hands[planned.hand]
        stop = stop_of(plan, planned, hand.job, hand.scene)
        check = checks[planned.hand] = StopCheck(stop, checks.get(planned.hand))
        jumps += _jumps(planned, stop)
        for segment in planned.segments:
            edges += segment.edges
            false += check.false_pieces(segment)
            if segment.type == "approach":
                goals += 1
                error = max(error, _position_error(segment, stop, hand.goals))
            if segment.type != "move":
                measured = _tool(segment.timing, stop)
                speed, off_line = max(speed, measured[0]), max(off_line, measured[1])
            found = extremes(segment.timing)
            own = slice(CHAIN - stop.joints, None)
            velocity = max(velocity, float(np.max(found.velocity / stop.velocity[own])))
            acceleration = max(
                acceleration, float(np.max(found.acceleration / stop.acceleration[own]))
            )
            if plan.jerk_limits is not None:
                jerk = max(jerk, float(np.max(found.jerk / plan.jerk_limits)))
            done += 1
            if on_progress is not None:
                on_progress(done, total)
    of_limits = None if plan.jerk_limits is None else jerk
    return PlanCheck(
        edges, false, jumps, goals, error, velocity, acceleration, of_limits, speed, off_line
    )


class PlanHand(NamedTuple):
    """A hand of a plan, in the scene that it was made for."""

    job: Job
    scene: Scene
    goals: tuple[int, ...]
    """Numbers of the goals that it may serve."""


def hands_of(plan: MotionPlan, *, meshes: bool = False) -> dict[str, PlanHand]:
    """Return the hands of a plan, by the name in its stops.

    Args:
        plan: The plan.
        meshes: Whether to load the robot's visual meshes, for display; this takes seconds.

    Raises:
        StoreMismatchError: If the models have changed since the plan was made.
        StoreFormatError: If it names hands, goals, joints or axes that its scene does not have.
    """
    built = rebuild_scenes(plan.made_from, meshes=meshes)
    if len(built) == 1:
        job, scene, _ = built[0]
        found = {"": PlanHand(job, scene, tuple(range(len(job.task.goals))))}
    else:
        found = {job.hand.name: PlanHand(job, scene, job.goal_numbers) for job, scene, _ in built}
    _check_names(plan, found)
    return found


def stop_of(plan: MotionPlan, planned: StopPlan, job: Job, scene: Any) -> Stop:
    """Return the stop of a plan, the live scene set to it."""
    values = [value_of(planned.at, axis.name) for axis in job.scored_grid.axes]
    return Stop.at_values(job, scene, values, plan.seed)


def _check_names(plan: MotionPlan, hands: Mapping[str, PlanHand]) -> None:
    """Check that a plan names the hands, joints, axes and goals of its scene.

    Raises:
        StoreFormatError: If it does not.
    """
    first = next(iter(hands.values())).job
    axes = {axis.name for axis in first.scored_grid.axes}
    for stop in plan.stops:
        if stop.hand not in hands:
            raise StoreFormatError("The plan names hands that its task does not have. Plan again.")
        hand = hands[stop.hand]
        if (stop.joints or plan.joints) != tuple(hand.job.spec.robot.arm_joints):
            raise StoreFormatError(
                "The plan names other joints than the scored arm has. Plan again."
            )
        named = {
            "base_x",
            "base_y",
            "base_yaw",
            "torso",
            *(name for name, _ in stop.at.environment),
        }
        if named != axes:
            raise StoreFormatError(
                "The plan has other axes of the environment than its scene. Plan again."
            )
        for segment in stop.segments:
            for goal in (segment.start, segment.end):
                if goal is not None and goal not in hand.goals:
                    raise StoreFormatError(f"The plan names goal {goal}, which does not exist.")
            if segment.type == "approach" and segment.end is None:
                raise StoreFormatError("The plan has an approach to rest. Plan again.")


def _jumps(planned: StopPlan, stop: Stop) -> int:
    """Return how many segments do not begin where the one before ended, or not at rest."""
    where = rest = stop.rest[CHAIN - stop.joints :]
    jumps = 0
    for segment in planned.segments:
        timing = segment.timing
        moved = np.abs([timing.positions[0] - where, *timing.velocities[[0, -1]]])
        jumps += int(np.any(moved > ROUNDING))
        where = timing.positions[-1]
    if planned.segments and planned.returns:
        jumps += int(np.any(np.abs(where - rest) > ROUNDING))
    return jumps


def _tool(timing: Timed, stop: Stop) -> tuple[float, float]:
    """Return the tool's greatest speed [m/s], and how far it is off the line [m and rad].

    Args:
        timing: A straight motion.
        stop: Its stop.
    """
    scene = stop.scene
    scene.set_arm(timing.positions[-1])
    end = scene.tool_pose()
    scene.set_arm(timing.positions[0])
    begin = scene.tool_pose()
    axis = stop.problem.goals.turn
    line = end.translation() - begin.translation()
    line = line / max(float(np.linalg.norm(line)), POSITION_BAR)

    def speeds(times: FloatArray) -> list[float]:
        found = []
        for q, v in zip(*at_times(timing, times), strict=True):
            scene.set_arm(q)
            found.append(float(np.linalg.norm(scene.tool_jacobian()[3:] @ v)))
            pose = scene.tool_pose()
            away = pose.translation() - begin.translation()
            turned = begin.rotation().inverse().multiply(pose.rotation()).ToAngleAxis().angle()
            if np.any(axis):
                # An arm of five joints may rotate the tool about this axis.
                turned = np.linalg.norm(
                    (begin.rotation().matrix() - pose.rotation().matrix()) @ axis
                )
            off.extend([float(np.linalg.norm(away - (away @ line) * line)), float(turned)])
        return found

    off: list[float] = []
    count = max(int(np.ceil(timing.duration / TOOL_SECONDS)), 2)
    times = np.union1d(np.linspace(0.0, timing.duration, count + 1), timing.times)
    coarse = speeds(times)
    fastest = int(np.argmax(coarse))
    near = times[max(fastest - 1, 0)], times[min(fastest + 1, len(times) - 1)]
    fine = speeds(np.linspace(*near, 2 * TOOL_FINER + 1))
    return max(*coarse, *fine), max(off)


def _position_error(segment: Segment, stop: Stop, goals: Sequence[int]) -> float:
    """Return the distance of the tool from its goal at the end of an approach [m].

    Of a free goal, or one of several poses, it is the distance from the nearest pose that serves,
    or the angle [rad].
    """
    scene, task, goal = stop.scene, stop.job.task, goals.index(segment.end or 0)
    scene.set_arm(segment.timing.positions[-1])
    X_TW = scene.tool_pose().inverse()
    errors = [
        pose_errors(X_TW @ X_WG, pose.free)
        for pose, X_WG in zip(
            task.goals[goal].poses, alternative_poses(scene, task)[goal], strict=True
        )
    ]
    return min(map(max, errors)) if task.goals[goal].region else errors[0][0]
