"""Re-check of a plan that was read from a file: contacts, limits, timing and goals, with Drake."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from tcs.errors import StoreFormatError
from tcs.kernel.arrays import FloatArray
from tcs.model.scene import goal_poses
from tcs.motion.motion_plan import MotionPlan, Segment, StopPlan
from tcs.motion.plans import value_of
from tcs.motion.recheck import StopCheck
from tcs.motion.stops import Stop
from tcs.motion.timing import Timed
from tcs.placement.scoring.job import Job
from tcs.placement.scoring.rebuild import rebuild_made_from

SAME_POSTURE = 1e-6
"""Greatest difference of the posture between two segments [rad]: files hold nine decimals."""
POSITION_BAR = 1e-6
"""Greatest distance of the tool from its goal at the end of an approach [m]."""
LIMIT_BAR = 1.001
"""Greatest fraction of a velocity or acceleration limit: times in files hold six decimals."""


@dataclass(frozen=True)
class PlanCheck:
    """Result of re-checking a plan."""

    edges: int
    """Number of pieces between two samples, each re-checked at postures between which no point of
    the arm moves by more than a millimetre."""
    false: int
    """Number of these that Drake finds in contact or beyond joint limits."""
    jumps: int
    """Number of segments that do not begin where the one before ended; the first begins at rest."""
    goals: int
    """Number of approaches."""
    max_position_error: float
    """Greatest distance of the tool from its goal at the end of an approach [m]."""
    velocity: float
    """Greatest velocity at a sample, as a fraction of its limit."""
    acceleration: float
    """Greatest mean acceleration between two samples, as a fraction of its limit."""
    jerk: float | None
    """Greatest mean jerk from one pair of samples to the next, rest before and after the motions of
    a stop included, as a fraction of its limit; None if the plan has no jerk limits."""

    @property
    def is_sound(self) -> bool:
        """Whether nothing was refuted."""
        return (
            self.false == 0
            and self.jumps == 0
            and self.max_position_error <= POSITION_BAR
            and max(self.velocity, self.acceleration, self.jerk or 0.0) <= LIMIT_BAR
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
    job, scene = rebuild_made_from(plan.made_from)
    check_names(plan, job)
    total, done = sum(len(stop.segments) for stop in plan.stops), 0
    check = None
    edges = false = jumps = goals = 0
    error = velocity = acceleration = jerk = 0.0
    for planned in plan.stops:
        stop = stop_of(plan, planned, job, scene)
        check = StopCheck(stop, check)
        jumps += _jumps(planned, stop)
        for segment in planned.segments:
            edges += segment.edges
            false += check.false_pieces(segment)
            if segment.type == "approach":
                goals += 1
                error = max(error, _position_error(segment, stop))
            timing = segment.timing
            rates = np.diff(timing.velocities, axis=0) / np.diff(timing.times)[:, None]
            velocity = max(velocity, float(np.max(np.abs(timing.velocities) / stop.velocity)))
            acceleration = max(acceleration, float(np.max(np.abs(rates) / stop.acceleration)))
            if plan.jerk_limits is not None:
                jerk = max(jerk, float(np.max(_greatest_jerk(timing) / plan.jerk_limits)))
            done += 1
            if on_progress is not None:
                on_progress(done, total)
    of_limits = None if plan.jerk_limits is None else jerk
    return PlanCheck(edges, false, jumps, goals, error, velocity, acceleration, of_limits)


def stop_of(plan: MotionPlan, planned: StopPlan, job: Job, scene: Any) -> Stop:
    """Return the stop of a plan, the live scene set to it."""
    values = [value_of(planned.at, axis.name) for axis in job.scored_grid.axes]
    return Stop.at_values(job, scene, values, plan.seed)


def check_names(plan: MotionPlan, job: Job) -> None:
    """Check that a plan names the joints, axes and goals of its scene.

    Raises:
        StoreFormatError: If it does not.
    """
    if plan.joints != tuple(job.spec.robot.arm_joints):
        raise StoreFormatError("The plan names other joints than the scored arm has. Plan again.")
    axes = {axis.name for axis in job.scored_grid.axes}
    for stop in plan.stops:
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
                if goal is not None and not 0 <= goal < len(job.task.goals):
                    raise StoreFormatError(f"The plan names goal {goal}, which does not exist.")
            if segment.type == "approach" and segment.end is None:
                raise StoreFormatError("The plan has an approach to rest. Plan again.")


def _jumps(planned: StopPlan, stop: Stop) -> int:
    """Return how many segments do not begin where the one before ended."""
    if not planned.segments:
        return 0
    begins = [segment.timing.positions[0] for segment in planned.segments]
    ends = [segment.timing.positions[-1] for segment in planned.segments]
    jumps = int(np.any(np.abs(begins[0] - stop.rest) > SAME_POSTURE))
    for end, (_, begin) in zip(ends[:-1], itertools.pairwise(begins), strict=True):
        jumps += int(np.any(np.abs(begin - end) > SAME_POSTURE))
    return jumps


def _greatest_jerk(timing: Timed) -> FloatArray:
    """Return the greatest mean jerk of each joint from one pair of samples to the next [rad/s^3].

    Args:
        timing: Samples of a motion; before and after it the joints rest.
    """
    steps = np.diff(timing.times)
    rates = np.diff(timing.velocities, axis=0) / steps[:, None]
    at_rest = np.zeros((1, 7))
    steps, rates = np.concatenate([[0.0], steps, [0.0]]), np.concatenate([at_rest, rates, at_rest])
    apart = 0.5 * (steps[1:] + steps[:-1])
    greatest: FloatArray = np.max(np.abs(np.diff(rates, axis=0)) / apart[:, None], axis=0)
    return greatest


def _position_error(segment: Segment, stop: Stop) -> float:
    """Return the distance of the tool from its goal at the end of an approach [m]."""
    scene = stop.scene
    scene.set_arm(segment.timing.positions[-1])
    X_WG = goal_poses(scene, stop.job.task)[segment.end or 0]
    return float(np.linalg.norm(scene.tool_pose().translation() - X_WG.translation()))
